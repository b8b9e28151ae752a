"""What tamperings share: a registry, what must refuse each, and editors of copies of a report of case B.

Files of a copy are hard links to those of the report, so an editor never writes into a file: it puts another one in its
place. Editors mend the SHA-256 that a report has of a file, as somebody would who wants the change to pass.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from airground_drake.check import command as checker
from airground_drake.check.report import AGREES, Line
from airground_drake.report import rebuild
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify import Verdict, judge, verify_all
from airground_drake.verify.claim import Claim

RUN, UGV = "d", "ugv1"
"""The run and the UGV that are tampered with."""


@dataclass(frozen=True)
class Tampering:
    """A way to tamper with a report.

    Attributes:
        edit: edits a copy of a report's folder in place.
        mended: whether the list of files is made right afterwards.
        no_report: what standard error says if the folder is refused as a whole, with exit code 2.
    """

    edit: Callable[[Path], None]
    mended: bool = True
    no_report: str = ""


TAMPERINGS: dict[str, Tampering] = {}
Edit = Callable[[Path], None]


def tampering(*, mended: bool = True, no_report: str = "") -> Callable[[Edit], Edit]:
    """Register a tampering that must be refused."""

    def register(edit: Edit) -> Edit:
        assert edit.__name__ not in TAMPERINGS
        TAMPERINGS[edit.__name__] = Tampering(edit, mended and not no_report, no_report)
        return edit

    return register


def refused_as_a_whole(why: str) -> Callable[[Edit], Edit]:
    """Register a tampering after which the folder is no report."""
    return tampering(no_report=why)


def named(name: str, edit: Edit) -> Edit:
    """An edit that is made by another function, under a name of its own."""

    def renamed(folder: Path) -> None:
        edit(folder)

    renamed.__name__ = name
    return renamed


# ------------------------------------------------------------------------------------- files


def write(path: Path, content: bytes) -> None:
    """Put a file in the place of another."""
    path.unlink(missing_ok=True)
    path.write_bytes(content)


def read_json(path: Path) -> Any:
    """The value of a JSON file."""
    return json.loads(path.read_text(encoding="utf-8"))


@contextlib.contextmanager
def edited_json(path: Path) -> Iterator[Any]:
    """The value of a JSON file, to be changed in place."""
    value = read_json(path)
    yield value
    write(path, json.dumps(value, ensure_ascii=False).encode())


@contextlib.contextmanager
def edited_report(folder: Path) -> Iterator[Any]:
    """report.json."""
    with edited_json(folder / "report.json") as report:
        yield report


@contextlib.contextmanager
def edited_claim(folder: Path, claim: str, run: str = RUN) -> Iterator[Any]:
    """A claim's entry in report.json."""
    with edited_report(folder) as report:
        yield claim_of(report, claim, run)


@contextlib.contextmanager
def edited_entries(folder: Path, run: str = RUN) -> Iterator[list[Any]]:
    """What is said of a run in both places: its entry in report.json, and its meta.json."""
    with edited_report(folder) as report, edited_json(trace(folder, run) / "meta.json") as meta:
        yield [report["runs"][run], meta]


@contextlib.contextmanager
def edited_scenarios(folder: Path) -> Iterator[list[Any]]:
    """The resolved scenario in all places."""
    with contextlib.ExitStack() as stack:
        report = stack.enter_context(edited_report(folder))
        metas = [stack.enter_context(edited_json(path)) for path in sorted(folder.glob("trace/*/meta.json"))]
        yield [report["scenario"]["resolved"], *(meta["scenario"] for meta in metas)]


def set_everywhere(*path: str, value: Any) -> Edit:
    """Put a value into the resolved scenario, in all places."""

    def edit(folder: Path) -> None:
        with edited_scenarios(folder) as scenarios:
            for part in scenarios:
                for key in path[:-1]:
                    part = part[key]
                part[path[-1]] = value

    return edit


@contextlib.contextmanager
def edited_timings(folder: Path, run: str = RUN) -> Iterator[Any]:
    """timings.json of a run."""
    with edited_json(trace(folder, run) / "timings.json") as timings:
        yield timings


def trace(folder: Path, run: str = RUN) -> Path:
    """The folder of a trace."""
    return folder / "trace" / run


def claim_of(report: Any, claim: str, run: str = RUN) -> Any:
    """A claim's entry in report.json."""
    return next(entry for entry in report["claims"] if (entry["id"], entry["run"]) == (claim, run))


# ------------------------------------------------------------------------------------- tables


def read_table(folder: Path, table: str = "signals", run: str = RUN) -> pd.DataFrame:
    """A table of a trace."""
    return pd.read_parquet(trace(folder, run) / f"{table}.parquet")


def write_table(folder: Path, frame: pd.DataFrame, table: str = "signals", run: str = RUN) -> None:
    """Put a table in the place of another."""
    buffer = io.BytesIO()
    frame.to_parquet(buffer, index=False)
    write(trace(folder, run) / f"{table}.parquet", buffer.getvalue())
    seal(folder, run)


@contextlib.contextmanager
def edited_table(folder: Path, table: str = "signals", run: str = RUN) -> Iterator[pd.DataFrame]:
    """A table, to be changed in place."""
    frame = read_table(folder, table, run)
    yield frame
    write_table(folder, frame, table, run)


def seal(folder: Path, run: str = RUN) -> None:
    """Make the digests in a meta.json right."""
    with edited_json(trace(folder, run) / "meta.json") as meta:
        for name in meta["files"]:
            meta["files"][name] = hashlib.sha256((trace(folder, run) / name).read_bytes()).hexdigest()


def middle(frame: pd.DataFrame) -> int:
    """A row while the UGV intervened on is under way."""
    return int(np.flatnonzero(frame[f"{UGV}.accepted"] == 1.0)[10])


# ------------------------------------------------------------------------------------- trying


@dataclass(frozen=True)
class Outcome:
    """What the checker says of a tampered copy: its exit code, the checks that are no agreement, and standard error."""

    code: int
    refused: list[dict[str, Any]]
    error: str

    def is_of(self, tampering: Tampering) -> bool:
        """Whether the tampering is refused as it must be."""
        return self.code == 2 and tampering.no_report in self.error if tampering.no_report else self.code == 1


@cache
def _contents(report: Path) -> tuple[set[str], dict[str, int]]:
    """Folders of a report, and the inode of each of its files, by relative path."""
    folders, files = set(), {}
    for place, _, names in os.walk(report):
        folders.add(os.path.relpath(place, report))
        for name in names:
            path = os.path.join(place, name)
            files[os.path.relpath(path, report)] = os.stat(path).st_ino
    return folders, files


def copy(report: Path, folder: Path) -> Path:
    """A copy of a report, to be tampered with; what is there of a copy that was is mended."""
    folders, files = _contents(report)
    for place, inside, names in os.walk(folder, topdown=False):
        for name in (*names, *(each for each in inside if os.path.islink(os.path.join(place, each)))):
            path = os.path.join(place, name)
            if files.get(os.path.relpath(path, folder)) != os.lstat(path).st_ino:
                os.unlink(path)
        if os.path.relpath(place, folder) not in folders:
            os.rmdir(place)
    for name in folders:
        (folder / name).mkdir(parents=True, exist_ok=True)
    for name in files:
        if not os.path.exists(folder / name):
            os.link(report / name, folder / name)
    return folder


@cache
def _digest(path: str, _inode: int, _written_ns: int) -> str:
    """SHA-256 of a file; one that was put in its place is another."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def mend(folder: Path) -> None:
    """Make the list of files right, if there is a report to put it into."""
    try:
        with edited_report(folder) as report:
            names = [os.path.join(place, name) for place, _, names in os.walk(folder) for name in names]
            files = {os.path.relpath(path, folder): path for path in names if os.path.isfile(path)}
            report["files"] = {
                name: _digest(path, os.stat(path).st_ino, os.stat(path).st_mtime_ns)
                for name, path in files.items()
                if name != "report.json" and not name.startswith("proofs/")  # those are added later
            }
    except (OSError, ValueError, TypeError, RecursionError):
        return


def attempt(report: Path, edit: Edit, *, mended: bool = True) -> Outcome:
    """Tamper with a copy of a report, beside it, and check it; `mended`: with the list of files made right."""
    folder = copy(report, report.with_name(f"tampered_{os.getpid()}"))
    edit(folder)
    if mended:
        mend(folder)
    try:
        found = checker.checked(folder, checker.LIMIT_S)
    except checker.UsageError as error:
        return Outcome(2, [], str(error))
    if all(line.outcome == AGREES for line in found):
        found = [Line(**line, by="judged again") for line in rebuild.lines(folder, judge=judged)]
    refused = [asdict(line) for line in found if line.outcome != AGREES]
    return Outcome(int(bool(refused)), refused, "")


def judged(scenario: Scenario, traces: Sequence[Trace]) -> list[Verdict]:
    """As `verify_all`, but what was judged before is not judged again: most tamperings leave most runs as they are."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(judge, "run_parallel", lambda pieces, **_: [_once(_Content(each, _key(each))) for each in pieces])
        return verify_all(scenario, traces)


@dataclass(frozen=True)
class _Content:
    """A piece of work that is known by what it depends on."""

    work: Any = field(compare=False)
    key: str


def _key(piece: partial[Any]) -> str:
    """Text of the traces, or of the claim and its inputs, that a piece of work of `verify_all` is about."""
    texts = [piece.func.__name__]
    for given in piece.args:
        if isinstance(given, Trace):
            tables = (given.signals, given.decisions, given.problems, given.proposals)
            texts += [json.dumps(given.meta), json.dumps(given.timings), *(table.to_json() for table in tables)]
        elif isinstance(given, Claim):
            texts.append(given.id)
        elif isinstance(given, dict):
            texts.append(json.dumps(given))
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()


@lru_cache(maxsize=64)
def _once(content: _Content) -> Any:
    return content.work()
