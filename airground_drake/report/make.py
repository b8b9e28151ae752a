"""Making a report: simulate every run of a scenario, judge it, and write everything to a folder."""

import time
from datetime import UTC, datetime
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from airground_drake.base import files
from airground_drake.base.progress import SILENT, Progress
from airground_drake.report import folder
from airground_drake.scenario.estimate import DEFAULT_LIMITS, Limits, within
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.runs import simulate_all

# Slow to import, and needed after the simulation: it is imported while the runs are simulated.
_NEXT = "airground_drake.report.after_runs"


class Wanted(NamedTuple):
    """The requested parts of a report, and limits of its cost."""

    formats: tuple[str, ...] = tuple(folder.PAGES)  # of html, json and junit; traces and diagram are always written
    command: str = ""  # how to make this report again
    kept: Path | None = None  # folder of kept findings about the model, see `judge_model`; None: everything anew
    audited: bool = False  # whether all findings about the paper are made; each must then be demonstrated
    limits: Limits = DEFAULT_LIMITS  # what the scenario may ask for
    seeds: int = 0  # with how many seeds, from 1 on, distances and arrivals are counted; 0: none


def write_report(
    scenario: Scenario, output: Path | str, wanted: Wanted | None = None, progress: Progress = SILENT
) -> dict[str, Any]:
    """Simulate every run, judge it, and write everything to a folder.

    Args:
        scenario: validated scenario.
        output: folder, created if need be; an earlier report in it is removed.
        wanted: what the report should have; default: all pages, with every claim judged anew.
        progress: is told what is done.

    Returns:
        The document, as in report.json.

    Raises:
        LimitError: if the scenario asks for more than the limits.
        FolderError: before the work, if the folder holds anything but a report, is in use, or cannot be written.
        PluginError: if the scenario names a policy, route, task or plant that cannot be made.
        OSError: if something cannot be written, after all.
    """
    wanted, output = Wanted() if wanted is None else wanted, Path(output)
    within(scenario, wanted.limits, 1 + wanted.seeds)
    started, clock = datetime.now(UTC), time.perf_counter()
    if scenario.claims:  # a claim that cannot be made is refused before the work
        from airground_drake.verify.registry import model_claims, run_claims

        model_claims(added=scenario.claims)
        run_claims(added=scenario.claims)
    with folder.held(output):
        if wanted.kept is not None and wanted.kept.is_dir():
            files.sweep(wanted.kept)
        traces = simulate_all(scenario, progress=progress, meanwhile=partial(import_module, _NEXT))
        from airground_drake.report import after_runs

        def provenance() -> dict[str, Any]:
            origin = after_runs.provenance(scenario, started, wanted.command)
            return origin | {"wall_s": time.perf_counter() - clock}

        return after_runs.finish(
            scenario, traces, output, progress, wanted.formats, provenance,
            kept=wanted.kept, seeds=wanted.seeds, audited=wanted.audited,
        )  # fmt: skip
