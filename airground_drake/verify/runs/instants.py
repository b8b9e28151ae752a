"""When things happened in a run: rows at times, and the intervals in which UGVs were intervened on."""

from collections.abc import Iterable

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.finding import Finding

GATED_METHODS = ("c", "d")  # methods with an optimising gatekeeper


def row_at(trace: Trace, t_s: float) -> int:
    """The row at a time, s, or the next one; for times after the run the last one."""
    return min(int(np.searchsorted(trace.t, t_s - TIME_TOLERANCE_S)), len(trace.t) - 1)


def intervening(trace: Trace, ugv: str) -> Array:
    """Intervals of mode 1, (K, 2), s; the mode of a row is in force since the row before."""
    inside = np.concatenate([[False], trace.column(f"{ugv}.mode")[1:] == 1.0, [False]])
    edges = np.flatnonzero(np.diff(inside.astype(np.int8)))
    return trace.t[edges].reshape(-1, 2)


def talk_is_due(trace: Trace, ugv: str) -> bool:
    """Whether a UGV is intervened on for longer than a proposal and a decision on it take."""
    periods = trace.scenario.intervention.period_s + trace.scenario.gatekeeper.period_s
    return bool((np.diff(intervening(trace, ugv)) > periods).any())


def without_proposals(trace: Trace) -> list[str]:
    """UGVs for which policies were asked, but that got no proposal: the UAV found no way, or its policies failed."""
    asked, got = {*trace.plans["ugv"]}, {*trace.proposals["robot"]}
    return [ugv for ugv in trace.ugvs if ugv in asked - got]


def lost_at_the_end(trace: Trace) -> list[str]:
    """UGVs that are still intervened on at the end, and for which the UAV found no way when it last looked for one."""
    return [ugv for ugv in trace.ugvs if _is_lost(trace, ugv)]


def _is_lost(trace: Trace, ugv: str) -> bool:
    switched = [
        event["kind"] for event in trace.events if event["robot"] == ugv and event["kind"] in ("trigger", "release")
    ]
    asked = trace.plans[trace.plans["ugv"] == ugv]
    last = asked[asked["t_s"] == asked["t_s"].max()]
    proposed = bool(last["outcome"].isin(["proposed", "passed over"]).any())
    return switched[-1:] == ["trigger"] and bool((last["reason"] != "").any()) and not proposed


def reasons(trace: Trace) -> dict[str, str]:
    """Why UGVs got no proposal, as the last policy that was asked said; UGVs without a reason are left out."""
    said = trace.plans[trace.plans["reason"] != ""].groupby("ugv", sort=False)["reason"].last()
    lost = [*without_proposals(trace), *lost_at_the_end(trace)]
    return {ugv: str(said[ugv]) for ugv in dict.fromkeys(lost) if ugv in said.index}


def silent(trace: Trace, ugvs: Iterable[str], kind: str) -> Finding:
    """Not run: UGVs were intervened on, but no message of a kind was recorded."""
    reason = f"{', '.join(ugvs)}: in mode 'intervening', but the trace has no {kind}"
    return Finding("not_run", evidence={"reason": reason, "faults": trace.meta["faults"]})
