"""Verdicts of array judges on a run of the loop, and what happened in it, from arrays or from a trace."""

from collections.abc import Collection
from functools import lru_cache

import numpy as np

from airground_drake.sim.batch.run import Batch, Going
from airground_drake.sim.events import arrival_row
from airground_drake.sim.trace import Trace
from airground_drake.study.campaign.rows import Row
from airground_drake.verify import Verdict
from airground_drake.verify.array_judges import SCREENED, ArrayJudges, NoScreenError, triggers
from airground_drake.verify.registry import run_claims


def screened(loop: Batch, made: Going, claims: Collection[str]) -> list[Verdict]:
    """The verdicts of array judges on a run; none if a claim needs the judge of traces."""
    if not claims or not {*claims} <= {*SCREENED}:
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
    """The judges of a scenario's runs: other seeds have the same."""
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
    return {
        "ugvs": len(world.names("ugv")),
        "triggers": len(times),
        "first_trigger_s": min(times, default=float("nan")),
        "arrived": len(arrivals),
        "arrival_s": max(arrivals, default=float("nan")),
        "decisions": len(made.decided),
        "accepted": sum(decision.accepted for decision in made.decided),
        "faults": sum(bool(asking.what) for asking in made.memory.asked),
        "intervened_s": float(intervened_s.max(initial=0.0)),
    }


def happened_in(trace: Trace) -> Row:
    """The same from a trace."""
    triggered = [event["t_s"] for event in trace.events if event["kind"] == "trigger"]
    arrivals = [event["t_s"] for event in trace.events if event["kind"] == "arrival" and event["robot"] in trace.ugvs]
    intervened_s = [float(np.diff(trace.t) @ (trace.executing(ugv)[1:] >= 0)) for ugv in trace.ugvs]
    return {
        "ugvs": len(trace.ugvs),
        "triggers": len(triggered),
        "first_trigger_s": min(triggered, default=float("nan")),
        "arrived": len(arrivals),
        "arrival_s": max(arrivals, default=float("nan")),
        "decisions": len(trace.decisions),
        "accepted": int((trace.decisions["decision"] == "accept").sum()),
        "faults": len(trace.meta["faults"]),
        "intervened_s": max(intervened_s, default=0.0),
    }
