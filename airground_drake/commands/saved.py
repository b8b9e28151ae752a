"""Code shared by `replay`, `export` and `figures`: a report, its runs, and an output outside of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from airground_drake.base import files
from airground_drake.base.errors import FolderError, UnknownNameError
from airground_drake.report.folder import is_report

if TYPE_CHECKING:
    from airground_drake.scenario.schema import Scenario
    from airground_drake.sim.trace import Trace


def runs_of(folder: Path, run: str | None = None) -> Sequence[str]:
    if not is_report(folder):
        raise FolderError(f"{folder} is not a report; allowed: a folder that `airground report` has written")
    files.refuse_links(folder)
    runs = sorted(path.parent.name for path in folder.glob("trace/*/meta.json"))
    if not runs:
        raise FolderError(f"{folder} has no runs to replay; allowed: a report with trace/RUN/meta.json")
    if run not in (None, *runs):
        raise UnknownNameError("run", run, runs)
    return runs if run is None else [run]


def outside_reports(folder: Path, what: str) -> None:
    """Create a folder for `what`, outside of reports, in which the checker refuses foreign files."""
    for above in (folder.resolve(), *folder.resolve().parents):
        if is_report(above):
            raise FolderError(f"{folder} is in the report {above}, which is complete; name another, with -o")
    files.make_folder(folder, what)


def trace_of(folder: Path, run: str) -> tuple[Trace, Scenario]:
    from airground_drake.scenario.load import from_data
    from airground_drake.sim import trace

    saved = trace.load(folder / "trace" / run, run)
    return saved, from_data(saved.meta["scenario"], str(folder / "trace" / run))
