"""`airground index DIR`: write a page that lists the reports in a folder."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from airground_drake.base import files
from airground_drake.base.errors import FolderError, ReportError, TraceError, one_line
from airground_drake.report import folder
from airground_drake.report.sentences import Line
from airground_drake.scenario.options import Parser, parser_of

if TYPE_CHECKING:
    from airground_drake.report.model import Report

PAGE = "index.html"
MARK = "airground_drake index"  # text in every page that this command has written


def parser() -> Parser:
    says = f"Write DIR/{PAGE}, a page that links to the reports in DIR."
    return parser_of("index", says, {"folder": "folder that contains folders of reports"})


def main(arguments: Sequence[str] | None = None) -> int:
    print(one_line(str(_write(parser().parse_args(arguments).folder))))
    return 0


def _write(place: Path) -> Path:
    """Write the page of a folder; FolderError without reports, or with an index.html of other origin."""
    from airground_drake.report.html import render_beside

    page = place / PAGE
    if page.exists() and MARK.encode() not in files.read_bytes(page):
        raise FolderError(f"{page} is not a list of reports that `airground index` has made; it is left alone")
    below = sorted({path.parent for path in place.glob("**/*/report.json")})
    entries: list[dict[str, Any]] = []
    problems = []
    for report in below:
        try:
            if report.is_symlink():
                raise FolderError(f"{report} is a link; wanted: a folder")
            entries.append(_entry(report, place, f"run-{len(entries)}"))
        except (ReportError, FolderError) as error:
            problems.append(str(error))
    if not entries:
        why = f": {problems[0]}" if problems else ""
        raise FolderError(f"there are no reports in the folders below {place}{why}")
    entries.sort(key=lambda entry: (entry["scenario"].name, str(entry["provenance"].get("started")), entry["place"]))
    name = place.resolve().name
    files.write_text(page, render_beside("index.html.j2", entries=entries, problems=problems, name=name, mark=MARK))
    return page


def _entry(report: Path, place: Path, prefix: str) -> dict[str, Any]:
    from airground_drake.report import model

    content = model.read(report)
    files.refuse_links(report)
    leads_to = report / (folder.PAGES["html"] if (report / folder.PAGES["html"]).is_file() else folder.PAGES["json"])
    where = report.relative_to(place).as_posix()
    link = quote(os.fsencode(leads_to.relative_to(place)))
    return {
        "scenario": content.scenario, "overall": content.overall, "provenance": content.provenance, "place": where,
        "link": link, "headline": _headline(content), "thumbnail": _thumbnail(report, content, prefix),
    }  # fmt: skip


def _headline(report: Report) -> list[Line]:
    """The report in one or two lines; empty if its evidence is incomplete."""
    from airground_drake.report import screen

    try:
        return screen.first_screen(report).headline
    except (LookupError, TypeError, ValueError, AttributeError):
        return []


def _thumbnail(folder: Path, report: Report, prefix: str) -> str:
    """A picture of the last run; '' without a usable trace."""
    from airground_drake.report.view.plane import thumbnail_of
    from airground_drake.sim import trace

    runs = [run for run in report.runs if run.isidentifier()]
    try:
        return thumbnail_of(trace.load(folder / "trace" / runs[-1]), prefix)
    except (TraceError, OSError, LookupError, ValueError):
        return ""
