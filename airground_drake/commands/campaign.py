"""`airground campaign SPEC -n 1000`: many draws of a scenario, and what can be concluded from them."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import yaml

from airground_drake import files
from airground_drake.campaign import pool
from airground_drake.campaign.evidence import evidence, strict
from airground_drake.campaign.page import page
from airground_drake.campaign.rows import Row
from airground_drake.campaign.spec import Spec, load_spec
from airground_drake.campaign.stopping import Stopping
from airground_drake.campaign.store import Store
from airground_drake.campaign.work import died, rows_of
from airground_drake.errors import AirgroundError, FolderError, ScenarioError, UnknownNameError, one_line
from airground_drake.scenarios.estimate import DEFAULT_LIMITS, Limits
from airground_drake.scenarios.load import resolved
from airground_drake.scenarios.plugins import OPTION

EXIT_REFUTED, EXIT_USAGE, EXIT_UNDECIDED, EXIT_TOOL = 1, 2, 3, 4
EVIDENCE, PAGE = "evidence.json", "campaign.html"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Returns:
        Exit code: 0 every claim as expected in every draw, 1 one differs, 2 usage, bad spec or folder, 3 something
        was undecided or a draw could not be judged, 4 tool error.
    """
    options = _parser().parse_args(arguments)
    try:
        spec = load_spec(options.spec)
        if options.only is not None:
            return _only(spec, options)
        stopping = Stopping.parse(options.stop_when) if options.stop_when else None
        return _run(spec, options, stopping)
    except (ScenarioError, FolderError, UnknownNameError, ValueError) as error:
        print(f"error: {one_line(str(error))}", file=sys.stderr)
        return EXIT_USAGE
    except (AirgroundError, OSError) as error:
        print(f"error: {one_line(str(error))}", file=sys.stderr)
        return EXIT_TOOL


def _run(spec: Spec, options: argparse.Namespace, stopping: Stopping | None) -> int:
    """Draw, simulate, judge, keep; then write the evidence and its page."""
    folder = options.output or Path("campaigns") / spec.name
    store = Store(folder, _manifest(spec), resume=options.resume)
    work = partial(rows_of, spec, limits=_limits(options), allow_plugins=options.allow_plugins)
    wanted = range(options.number if options.number is not None else spec.combinations)
    met = False
    if stopping is not None:
        for rows in _known(store):
            met = stopping.met(rows)
    left = [] if met else [index for index in wanted if index not in store.finished]
    try:
        _all(work, left, options, store, stopping)
    finally:
        store.close()
    found = strict(evidence(store.table(), spec.marks)) | {
        "name": spec.name,
        "title": spec.title,
        "spec": str(options.spec),
    }
    files.write_json(folder / EVIDENCE, found)
    files.write_text(folder / PAGE, page(found, store.table()))
    print(f"{_summary(found)}\n{one_line(str(folder))}")
    return _code(found)


def _all(work: Any, left: Sequence[int], options: argparse.Namespace, store: Store, stopping: Stopping | None) -> None:
    jobs = options.jobs or len(os.sched_getaffinity(0))
    progress = _Progress(len(left))
    with pool.cluster(options.scheduler) if options.scheduler else pool.local(jobs) as processes:
        for index, judged in processes(work, left):
            rows = died(index) if judged is None else judged
            store.add(rows)
            progress.show(rows)
            if stopping is not None and stopping.met(rows):
                break
    progress.end()


def _known(store: Store) -> Iterable[list[Row]]:
    """What an earlier call has finished, draw by draw."""
    for _, rows in store.table().groupby("index"):
        yield [{str(name): value for name, value in row.items()} for row in rows.to_dict("records")]


def _only(spec: Spec, options: argparse.Namespace) -> int:
    """One draw alone: its verdicts, and its scenario as a file that `report` and `replay` take."""
    scenario = spec.draw(options.only)
    text = yaml.safe_dump(resolved(scenario), sort_keys=False, allow_unicode=True)
    path = options.output or Path(f"{scenario.name}.yaml")
    files.write_text(path, text)
    rows = rows_of(spec, options.only, _limits(options), allow_plugins=options.allow_plugins)
    for row in rows:
        margin = "" if row["margin"] != row["margin"] else f" {row['margin']:.6g} {row['unit']}"
        print(f"{row['run']:12} {row['claim'] or row['ended']:12} {row['status'] or row['what']}{margin}")
    print(f"{one_line(str(path))}: airground report {one_line(str(path))}")
    return 0 if all(row["as_expected"] for row in rows) else EXIT_REFUTED


def _manifest(spec: Spec) -> dict[str, Any]:
    return {
        "name": spec.name,
        "spec_sha256": spec.digest,
        "scenario_sha256": spec.base_digest(),
        "package": version("airground_drake"),
        "drake": version("drake"),
    }


def _limits(options: argparse.Namespace) -> Limits:
    return Limits(options.limit_steps, DEFAULT_LIMITS.memory)


def _code(found: dict[str, Any]) -> int:
    claims = found["claims"]
    if any(claim["not_as_expected"] and claim["refuted"] for claim in claims):
        return EXIT_REFUTED
    open_ = any(claim["undecided"] for claim in claims) or found["ended"].keys() - {"judged", "invalid"}
    return EXIT_UNDECIDED if open_ or not claims else 0


def _summary(found: dict[str, Any]) -> str:
    ended = ", ".join(f"{count} {name}" for name, count in found["ended"].items())
    lines = [f"{found['name']}: {found['draws']} draws ({ended}), {found['simulated_s']:.0f} s simulated"]
    for claim in found["claims"]:
        low, high = claim["fixed"]
        bounds = f"probability of a violation {low:.2g} to {high:.2g}" if claim["tested"] else "never put to the test"
        lines.append(
            f"  {claim['run']:10} {claim['claim']:12} {claim['refuted']} of {claim['tested']} refuted, {bounds}"
        )
    return "\n".join(lines)


class _Progress:
    """A line on a terminal: how many, how fast, how long, and what was refuted so far."""

    def __init__(self, total: int) -> None:
        self.total, self.done, self.refuted = total, 0, Counter[str]()
        self.started = time.monotonic()
        self.shown = sys.stderr.isatty()

    def show(self, rows: Sequence[Row]) -> None:
        self.done += 1
        self.refuted.update(row["claim"] for row in rows if row["status"] == "refuted")
        if not self.shown:
            return
        rate = self.done / max(time.monotonic() - self.started, 1e-9)
        refuted = ", ".join(f"{claim} {count}" for claim, count in self.refuted.most_common(3)) or "nothing"
        left = f"{rate:.2f}/s, {(self.total - self.done) / rate:.0f} s left"
        line = f"\r\033[K{self.done}/{self.total} draws, {left}; refuted: {refuted}"
        print(line, end="", file=sys.stderr, flush=True)

    def end(self) -> None:
        if self.shown:
            print("\r\033[K", end="", file=sys.stderr, flush=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="airground campaign",
        description="Simulate and judge many draws of a scenario, and bound how likely a violation is.",
        epilog="exit codes: 0 every claim as expected in every draw, 1 one differs, 2 usage or bad spec, 3 undecided, "
        "4 tool error, 130 interrupted, 143 terminated; what is finished is kept: --resume goes on with it",
    )
    parser.add_argument("spec", type=Path, help="YAML file: a scenario, and distributions over its keys")
    parser.add_argument("-n", "--number", type=_count, metavar="N", help="draws (default: all combinations of grids)")
    parser.add_argument("-o", "--output", type=Path, metavar="DIR", help="default: campaigns/<name>; new, or --resume")
    parser.add_argument("--resume", action="store_true", help="go on with what the folder has")
    parser.add_argument("--only", type=int, metavar="INDEX", help="this draw alone; its scenario is written as YAML")
    parser.add_argument("--jobs", type=_count, metavar="N", help="processes (default: one for each processor)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster, such as tcp://host:8786")
    parser.add_argument("--stop-when", metavar="RULE", help="such as 'SAFE-TRACE < 1e-3': the anytime-valid bound")
    parser.add_argument(OPTION, action="store_true", help="import and run what is named as module:Class")
    parser.add_argument("--limit-steps", type=float, default=DEFAULT_LIMITS.work, metavar="N", help="of one draw")
    return parser


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not allowed; wanted: a whole number from 1 on")
    return value
