"""Puts what `airground prove DIR` found into the page of that report: a line beside the distances of each run.

The page is written before anything is proved, with an empty place for each line; `write` fills these places.
"""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from markupsafe import Markup

from airground_drake.base import files
from airground_drake.base.errors import ReportError
from airground_drake.report.folder import PAGES
from airground_drake.report.model import Claim
from airground_drake.report.rules import DISTANCES
from airground_drake.report.sentences import distance

_PLACE = "<!--Coq on {run}-->{line}<!--end-->"
_PLACES = re.compile(r"<!--Coq on (\w+)-->.*?<!--end-->", re.DOTALL)


def place(claim: Claim) -> Markup:
    return _place(claim.run) if claim.id == DISTANCES else Markup("")


def _place(run: str, line: str = "") -> Markup:
    return Markup(_PLACE).format(run=run, line=line)


def write(folder: Path) -> bool:
    """Bring the page of a report up to date with proofs/proofs.json, and report.json with the page."""
    # Returns whether there is a page; without report.json or without report.html nothing is done.
    # ReportError if the page or a proved trace differs from the one that report.json names; nothing is changed.
    page, record = folder / PAGES["html"], folder / PAGES["json"]
    if not (page.exists() and record.exists()):
        return False
    proofs = json.loads(files.read_text(folder / "proofs" / "proofs.json"))
    report = json.loads(files.read_text(record))
    text = files.read_text(page)
    there = {f"trace/{run}/meta.json": entry["meta_sha256"] for run, entry in proofs["runs"].items()}
    there[page.name] = files.sha256(text.encode())
    for name, digest in there.items():
        if report.get("files", {}).get(name) != digest:
            raise ReportError(f"{folder / name} is not the file that report.json names: the page stays as it is")
    text = filled(text, proofs)
    report["files"][page.name] = files.sha256(text.encode())
    files.write_text(page, text)
    files.write_json(record, report)
    return True


def filled(page: str, proofs: Mapping[str, Any]) -> str:
    """A page with its places filled from proofs.json; places of other runs are emptied."""
    runs = {run: _line(entry, proofs["coq"]) for run, entry in proofs["runs"].items()}
    return _PLACES.sub(lambda at: _place(at[1], runs.get(at[1], Markup())), page)


def _line(entry: Mapping[str, Any], coq: str) -> Markup:
    answer = entry["distances"]
    near = answer.get("too_near", ())
    if answer["proved"]:
        says = f"machine-checked for this run (Coq {coq})"
    elif near:
        pairs = (
            f"pair {pair['first']}, {pair['second']}: {distance(pair['least_m'], pair['safe_distance_m'])} at "
            f"{pair['t_s']:.6g} s, {pair['safe_distance_m']:g} m required"
            for pair in near
        )
        says = f"Coq refused this run: {'; '.join(pairs)}"
    else:
        says = f"Coq did not prove this run: {answer['why']}"
    return Markup('<br><small><a href="proofs/{}">{}</a></small>').format(answer["file"], says)
