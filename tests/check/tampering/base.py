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
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from airground_drake import check

RUN, UGV = "d", "ugv1"
"""The run and the UGV that are tampered with."""
NO_REPORT = "no report"
"""In place of a claim: the folder is refused as a whole, exit code 2."""


@dataclass(frozen=True)
class Tampering:
    """A way to tamper with a report.

    Attributes:
        edit: edits a copy of a report's folder in place.
        claim: identifier in the line that must refuse it.
        rule: name of the rule that must be broken, or its beginning.
        run: on which run.
    """

    edit: Callable[[Path], None]
    claim: str
    rule: str
    run: str

    @property
    def mended(self) -> bool:
        """Whether the list of files is made right afterwards: unless it is what is tampered with."""
        return self.claim not in ("files", NO_REPORT)


TAMPERINGS: dict[str, Tampering] = {}
IGNORED: dict[str, tuple[Callable[[Path], None], str]] = {}
"""Edits that the checker does not notice, each with the reason."""

Edit = Callable[[Path], None]


def refused_by(claim: str, rule: str, run: str = RUN) -> Callable[[Edit], Edit]:
    """Register a tampering with the claim, the run and the rule that must refuse it."""

    def register(edit: Edit) -> Edit:
        assert edit.__name__ not in TAMPERINGS
        TAMPERINGS[edit.__name__] = Tampering(edit, claim, rule, run)
        return edit

    return register


def ignored(why: str) -> Callable[[Edit], Edit]:
    """Register an edit that the checker does not notice."""

    def register(edit: Edit) -> Edit:
        assert edit.__name__ not in IGNORED
        IGNORED[edit.__name__] = (edit, why)
        return edit

    return register


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

    def is_by(self, tampering: Tampering) -> bool:
        """Whether the refusal is the one that is expected."""
        if tampering.claim == NO_REPORT:
            return self.code == 2 and tampering.rule in self.error
        return self.code == 1 and any(
            (entry["claim"], entry["run"]) == (tampering.claim, tampering.run)
            and entry["rule"].startswith(tampering.rule)
            for entry in self.refused
        )


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
    said, complained = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(complained):
        code = check.main(["--json", str(folder)])
    checks = json.loads(said.getvalue())["checks"] if said.getvalue() else []
    return Outcome(code, [entry for entry in checks if entry["outcome"] != "agrees"], complained.getvalue())
