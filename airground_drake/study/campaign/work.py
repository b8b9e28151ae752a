"""One draw of a campaign: simulate its scenario, judge its runs, turn the verdicts into rows."""

from __future__ import annotations

import gc
import hashlib
import json
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from typing import Any

import numpy as np

from airground_drake.base import files
from airground_drake.base.errors import AirgroundError, ScenarioError, described, one_line
from airground_drake.base.statuses import PASSING
from airground_drake.scenario import plugins
from airground_drake.scenario.estimate import Limits, within
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.batch.run import Batch, LeftToDrakeError
from airground_drake.sim.simulation import Engine, simulate
from airground_drake.sim.trace import Trace
from airground_drake.study.campaign.rows import (
    BATCH,
    BOTH,
    CLOCK,
    DIED,
    DRAKE,
    INVALID,
    JUDGED,
    STOPPED,
    Row,
    blank,
)
from airground_drake.study.campaign.spec import Spec
from airground_drake.uav.guest.time_limit import OutOfTime, time_limit
from airground_drake.verify import Verdict, judge

SHARE = 0.005  # of the runs that the loop made and nothing is wrong with, which Drake makes again


class DrawOutOfTime(BaseException):
    """A draw took too long. An Exception or an OutOfTime would count as a fault of a policy, so it is neither."""


class EnginesDifferError(AirgroundError):
    """Drake and the compiled loop made different runs of one draw; it ends a campaign."""


def rows_of(spec: Spec, index: int, limits: Limits, engine: Engine = "batch") -> list[Row]:
    """Simulate and judge one draw. Returns a row for each run and claim, with the columns of `rows.COLUMNS`."""
    return rows_at(spec, spec.values(index), index, limits, engine)


@cache
def _keep_what_is_loaded() -> None:
    """Exempt loaded libraries and compiled code from garbage collection."""
    gc.collect()
    gc.freeze()


def rows_at(spec: Spec, values: Mapping[str, Any], index: int, limits: Limits, engine: Engine = "batch") -> list[Row]:
    """Simulate and judge any values by dotted key, on the course of a draw."""
    common = blank() | {"index": index, "drawn": json.dumps(files.strict(values, str), allow_nan=False)}
    try:
        scenario = spec.scenario_of(values, index)
    except ScenarioError as error:
        return [common | {"ended": INVALID, "what": one_line(str(error))}]
    return rows_of_scenario(spec, scenario, limits, common, engine)


def rows_of_scenario(
    spec: Spec, scenario: Scenario, limits: Limits, common: Row | None = None, engine: Engine = "batch"
) -> list[Row]:
    """Simulate a scenario and judge it by the claims of a campaign; every row begins with `common`."""
    common, rows = blank() if common is None else common, list[Row]()
    try:
        with _within(spec, scenario, limits):
            rows = [row for run in scenario.runs for row in _rows_of_run(scenario, run, spec.claims, common, engine)]
            return rows
    except EnginesDifferError:
        raise
    except AirgroundError as error:
        return [common | {"ended": INVALID, "what": one_line(str(error))}]
    except DrawOutOfTime as error:
        return [common | {"ended": STOPPED, "what": str(error)}]
    finally:
        _keep_what_is_loaded()
        # Python does not see the size of a diagram, and would wait for hundreds.
        if any(row["engine"] != BATCH for row in rows or [common]):
            gc.collect()


@contextmanager
def _within(spec: Spec, scenario: Scenario, limits: Limits) -> Iterator[None]:
    """Find or refuse third-party code; limit the time of the body."""
    within(scenario, limits)
    with (
        plugins.admitted(scenario, spec.scenario, allow=limits.plugins),
        plugins.beside(spec.source, allow=limits.plugins),
        time_limit(limits.time, DrawOutOfTime),
    ):
        yield


def _rows_of_run(scenario: Scenario, run: str, claims: Collection[str], common: Row, engine: Engine) -> list[Row]:
    common = common | {"run": run, "method": scenario.runs[run].method, "duration_s": scenario.duration_s}
    started = time.perf_counter()
    try:
        trace, made_by = _made(scenario, run, engine)
        verdicts = judge(trace, claims=claims or None)
        if made_by == BATCH and _is_for_drake(common["index"], run, verdicts):
            made_by = _compared(trace, simulate(scenario, run))
    except EnginesDifferError:
        raise
    except (Exception, SystemExit) as error:
        return [common | {"ended": STOPPED, "what": described(error)}]
    common |= {"ended": JUDGED, "engine": made_by, "wall_s": time.perf_counter() - started, **_happened(trace)}
    return [common | _of_claim(verdict) for verdict in verdicts] or [common | {"what": "no claim is about this run"}]


def _made(scenario: Scenario, run: str, engine: Engine) -> tuple[Trace, str]:
    """The trace of a run, and who made it: the loop, if it can and may."""
    if engine == BATCH:
        with suppress(LeftToDrakeError):
            return Batch(scenario, run).simulate(), BATCH
    return simulate(scenario, run), DRAKE


def _is_for_drake(index: int, run: str, verdicts: Sequence[Verdict]) -> bool:
    """Whether Drake makes a run of the loop again: what fails undeclared, and a share of all, chosen by hash."""
    # A narrow margin is no reason: every verdict is that of the full judge, about a trace that is Drake's to the bit.
    told = hashlib.sha256(f"{index} {run}".encode()).digest()
    return int.from_bytes(told[:8]) < SHARE * 2**64 or any(
        verdict.status not in (*PASSING, "not_run") and verdict.as_expected is not True for verdict in verdicts
    )


def _compared(trace: Trace, by_drake: Trace) -> str:
    """Who made a run, after a comparison bit by bit; raises EnginesDifferError."""
    from airground_drake.report.difference import first_difference  # slow to import, and rarely needed

    both = trace.meta["faults"] + by_drake.meta["faults"]
    if any(OutOfTime.__name__ in fault["what"] for fault in both):
        return CLOCK  # a policy's limit is in time by the clock, and need not fall at the same plan
    if (difference := first_difference(by_drake, trace)) is not None:
        about, drakes, ours = difference
        told = f"run {trace.run} of {trace.meta['scenario']['name']}, seed {trace.meta['seed']}: {about} is"
        raise EnginesDifferError(
            one_line(f"{told} {drakes!r} by Drake and {ours!r} by the loop; --engine drake does without")
        )
    return BOTH


def died(index: int) -> list[Row]:
    """The row of a draw whose process died each time."""
    return [blank() | {"index": index, "ended": DIED, "what": "the process that simulated it died", "drawn": "{}"}]


def _of_claim(verdict: Verdict) -> Row:
    finding = verdict
    return {
        "claim": verdict.claim.id,
        "status": finding.status,
        "as_expected": verdict.as_expected is not False,
        "margin": float("nan") if finding.margin is None else float(finding.margin),
        "unit": finding.unit,
        "exercised": float("nan") if finding.exercised is None else float(finding.exercised),
    }


def _happened(trace: Trace) -> Row:
    """Triggers, arrivals of UGVs, and decisions of a run."""
    triggers = [event["t_s"] for event in trace.events if event["kind"] == "trigger"]
    arrivals = [event["t_s"] for event in trace.events if event["kind"] == "arrival" and event["robot"] in trace.ugvs]
    # Each row has the state of the interval before it.
    intervened_s = [float(np.diff(trace.t) @ (trace.executing(ugv)[1:] >= 0)) for ugv in trace.ugvs]
    return {
        "ugvs": len(trace.ugvs),
        "triggers": len(triggers),
        "first_trigger_s": min(triggers, default=float("nan")),
        "arrived": len(arrivals),
        "arrival_s": max(arrivals, default=float("nan")),
        "decisions": len(trace.decisions),
        "accepted": int((trace.decisions["decision"] == "accept").sum()),
        "faults": len(trace.meta["faults"]),
        "intervened_s": max(intervened_s, default=0.0),
    }
