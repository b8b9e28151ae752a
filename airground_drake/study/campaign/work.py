"""One draw of a campaign: simulate its scenario, judge its runs, turn the verdicts into rows."""

import gc
import hashlib
import json
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache, lru_cache
from typing import Any, NamedTuple

import numpy as np

from airground_drake.base import files
from airground_drake.base.errors import AirgroundError, ScenarioError, described
from airground_drake.base.statuses import PASSING
from airground_drake.scenario import plugins
from airground_drake.scenario.estimate import Limits, within
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.batch.run import Batch, Going, LeftToDrakeError
from airground_drake.sim.events import arrival_row
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
    SCREENED,
    STOPPED,
    Row,
    blank,
)
from airground_drake.study.campaign.spec import Spec
from airground_drake.uav.guest.time_limit import OutOfTime, time_limit
from airground_drake.verify import Verdict, array_judges, judge
from airground_drake.verify.array_judges import SAME, ArrayJudges, NoScreenError, triggers
from airground_drake.verify.registry import run_claims

SHARE = 0.005  # share of the loop's faultless runs that Drake repeats, chosen by hash


class DrawOutOfTime(BaseException):
    """A draw took too long. It is a BaseException, because an Exception could count as a policy's fault."""


class DifferenceError(AirgroundError):
    """Both engines, or both judges, differ about one run; ends a campaign."""


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
    common = _of_draw(index, values)
    try:
        scenario = spec.scenario_of(values, index)
    except ScenarioError as error:
        return [common | {"ended": INVALID, "what": str(error)}]
    return rows_of_scenario(spec, scenario, limits, common, engine)


def died(index: int, values: Mapping[str, Any]) -> list[Row]:
    """The row of a draw whose process died each time, with its values by dotted key."""
    return [_of_draw(index, values) | {"ended": DIED, "what": "the process that simulated it died"}]


def _of_draw(index: int, values: Mapping[str, Any]) -> Row:
    return blank() | {"index": index, "drawn": json.dumps(files.strict(values, str), allow_nan=False)}


def rows_of_scenario(
    spec: Spec, scenario: Scenario, limits: Limits, common: Row | None = None, engine: Engine = "batch"
) -> list[Row]:
    """Simulate a scenario and judge it by the claims of a campaign; every row begins with `common`."""
    common, rows = blank() if common is None else common, list[Row]()
    try:
        with _within(spec, scenario, limits):
            rows = [row for run in scenario.runs for row in _rows_of_run(scenario, run, spec.claims, common, engine)]
            return rows
    except DifferenceError:
        raise
    except AirgroundError as error:
        return [common | {"ended": INVALID, "what": str(error)}]
    except DrawOutOfTime as error:
        return [common | {"ended": STOPPED, "what": str(error)}]
    finally:
        _keep_what_is_loaded()
        # Python does not see the size of a diagram, and would wait for hundreds.
        if any(row["engine"] not in (BATCH, SCREENED) for row in rows or [common]):
            gc.collect()


@contextmanager
def _within(spec: Spec, scenario: Scenario, limits: Limits) -> Iterator[None]:
    """Allow or refuse third-party code, and limit the time of the body."""
    within(scenario, limits)
    if not limits.plugins:
        plugins.refuse(scenario, spec.scenario)
    allow = limits.plugins and bool(spec.source)  # without a source, the scenario is no file either
    with (
        plugins.beside(spec.scenario, allow=allow),
        plugins.beside(spec.source, allow=allow),
        time_limit(limits.time, DrawOutOfTime),
    ):
        yield


def _rows_of_run(scenario: Scenario, run: str, claims: Collection[str], common: Row, engine: Engine) -> list[Row]:
    common = common | {"run": run, "method": scenario.runs[run].method, "duration_s": scenario.duration_s}
    started = time.perf_counter()
    try:
        judged = _judged(scenario, run, claims, common["index"], engine)
    except DifferenceError:
        raise
    except (Exception, SystemExit) as error:
        return [common | {"ended": STOPPED, "what": described(error)}]
    common |= {"ended": JUDGED, "engine": judged.engine, "wall_s": time.perf_counter() - started, **judged.happened}
    # A claim that is declared not to be judged here, such as one about the package's law, is not about this run.
    about = [verdict for verdict in judged.verdicts if not (verdict.status == "not_run" and verdict.as_expected)]
    rows = [common | _of_claim(verdict) for verdict in about]
    return rows or [common | {"what": "no claim is about this run"}]


class _Judged(NamedTuple):
    """A run that was made and judged."""

    verdicts: Sequence[Verdict]
    happened: Row
    engine: str  # see `rows.COLUMNS`


def _judged(scenario: Scenario, run: str, claims: Collection[str], index: int, engine: Engine) -> _Judged:
    """A run by the loop if possible, otherwise by Drake; screened without a trace if that suffices."""
    try:
        if engine != BATCH:
            raise LeftToDrakeError
        loop = Batch(scenario, run)
        made = loop.made()
    except LeftToDrakeError:
        trace = simulate(scenario, run)
        return _Judged(judge(trace, claims=claims or None), happened_in(trace), DRAKE)
    # A policy's limit is wall-clock time, so Drake's run may exceed it at another plan.
    clock = any(OutOfTime.__name__ in asking.what for asking in made.memory.asked)
    screens = screened(loop, made, claims)
    by_hash = int.from_bytes(hashlib.sha256(f"{index} {run}".encode()).digest()[:8])
    chosen = by_hash < SHARE * 2**64
    if screens and not chosen and not any(_is_failure(verdict) for verdict in screens):
        return _Judged(screens, happened(loop, made), CLOCK if clock else SCREENED)
    trace = made.trace()
    verdicts = judge(trace, claims=claims or None)
    _agree(screens, verdicts, trace)
    compares = chosen or any(_is_failure(verdict) for verdict in verdicts)
    made_by = CLOCK if clock else _compared(trace, simulate(scenario, run)) if compares else BATCH
    return _Judged(verdicts, happened_in(trace), made_by)


def _is_failure(verdict: Verdict) -> bool:
    """Whether Drake repeats a run because of an undeclared failure."""
    # A narrow margin is no reason: what array judges cannot decide, the judge of traces decides, on traces that equal
    # Drake's bit by bit.
    return verdict.status not in (*PASSING, "not_run") and verdict.as_expected is False


def _agree(screens: Sequence[Verdict], verdicts: Sequence[Verdict], trace: Trace) -> None:
    """Raise a DifferenceError if an array judge and the trace judge disagree."""
    for ours, theirs in zip(screens, verdicts, strict=True) if screens else ():
        numbers = [float("nan") if verdict.margin is None else verdict.margin for verdict in (ours, theirs)]
        same = (ours.status, ours.exercised) == (theirs.status, theirs.exercised)
        if not same or not np.isclose(numbers[0], numbers[1], rtol=0.0, atol=SAME, equal_nan=True):
            words = [
                f"{verdict.status}, margin {verdict.margin}, {verdict.exercised} times" for verdict in (ours, theirs)
            ]
            where = f"run {trace.run} of {trace.meta['scenario']['name']}, seed {trace.meta['seed']}"
            difference = f"{where}: {ours.claim.id} is {words[1]} by the trace and {words[0]} by the array judge"
            raise DifferenceError(f"{difference}; --engine drake does without")


def _compared(trace: Trace, by_drake: Trace) -> str:
    """The engine of a run, after a comparison bit by bit; raises DifferenceError."""
    from airground_drake.report.difference import first_difference  # slow to import, and rarely needed

    if any(OutOfTime.__name__ in fault["what"] for fault in by_drake.meta["faults"]):
        return CLOCK
    if (difference := first_difference(by_drake, trace)) is not None:
        about, drakes, ours = difference
        quantity = f"run {trace.run} of {trace.meta['scenario']['name']}, seed {trace.meta['seed']}: {about} is"
        raise DifferenceError(f"{quantity} {drakes!r} by Drake and {ours!r} by the loop; --engine drake does without")
    return BOTH


def _of_claim(verdict: Verdict) -> Row:
    against = verdict.counterexample or {}
    who = " and ".join(str(against[key]) for key in ("robot", "first", "second", "other") if key in against)
    broken = f"{against['hypothesis']}, {who or 'all'} at {against['t_s']:.2f} s" if "hypothesis" in against else ""
    margin = verdict.margin if verdict.claim.margin_decides else None
    return {
        "claim": verdict.claim.id,
        "what": broken,
        "status": verdict.status,
        "as_expected": verdict.as_expected is not False,
        "margin": float("nan") if margin is None else float(margin),
        "unit": verdict.unit,
        "exercised": float("nan") if verdict.exercised is None else float(verdict.exercised),
    }


def screened(loop: Batch, made: Going, claims: Collection[str]) -> list[Verdict]:
    """The verdicts of array judges on a run; empty if a claim needs the trace judge."""
    if not claims or not {*claims} <= {*array_judges.SCREENED}:
        return []
    try:
        findings = _judges(loop).findings(made.log, claims)
    except NoScreenError:
        return []
    if len(findings) < len({*claims}):
        return []
    expected = loop.given.runs[loop.name].expected
    return [
        Verdict.of(claim, loop.name, findings[claim.id], expected.get(claim.id, claim.expected))
        for claim in run_claims(claims)
    ]


@lru_cache(maxsize=1)
def _judges(loop: Batch) -> ArrayJudges:
    """The array judges of a scenario's runs, which do not depend on the seed."""
    return ArrayJudges(loop)


def happened(loop: Batch, made: Going) -> Row:
    """Triggers, arrivals of UGVs, and decisions of a run, from its arrays; nothing has collided."""
    log, world, given = made.log, loop.world, loop.given
    times = [time for of_ugv in triggers(log) for time in of_ugv.tolist()]
    arrivals = []
    for i, ugv in enumerate(world.names("ugv")):
        row = arrival_row(log.bodies[:, 3 * i : 3 * i + 3], given.ugvs[ugv].target_m, given.arrival_tolerance_m)
        arrivals += [] if row is None else [float(log.t[row])]
    # Each row has the state of the interval before it.
    intervened_s = np.diff(log.t) @ (log.executing[1:] >= 0.0)
    return _times_of(times, arrivals, intervened_s.tolist()) | {
        "ugvs": len(world.names("ugv")),
        "decisions": len(made.decided),
        "accepted": sum(decision.accepted for decision in made.decided),
        "faults": sum(bool(asking.what) for asking in made.memory.asked),
    }


def happened_in(trace: Trace) -> Row:
    triggered = [event["t_s"] for event in trace.events if event["kind"] == "trigger"]
    arrivals = [event["t_s"] for event in trace.events if event["kind"] == "arrival" and event["robot"] in trace.ugvs]
    intervened_s = [float(np.diff(trace.t) @ (trace.executing(ugv)[1:] >= 0)) for ugv in trace.ugvs]
    return _times_of(triggered, arrivals, intervened_s) | {
        "ugvs": len(trace.ugvs),
        "decisions": len(trace.decisions),
        "accepted": int((trace.decisions["decision"] == "accept").sum()),
        "faults": len(trace.meta["faults"]),
    }


def _times_of(triggers: Sequence[float], arrivals: Sequence[float], intervened_s: Sequence[float]) -> Row:
    return {
        "triggers": len(triggers),
        "first_trigger_s": min(triggers, default=float("nan")),
        "arrived": len(arrivals),
        "arrival_s": max(arrivals, default=float("nan")),
        "intervened_s": max(intervened_s, default=0.0),
    }
