"""When things happened in a run: rows at times, and the intervals in which UGVs were intervened on."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.run.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.finding import Finding

GATED_METHODS = ("c", "d")
"""Methods with an optimising gatekeeper."""


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


def reasons(trace: Trace) -> dict[str, str]:
    """Why UGVs got no proposal, as the last policy that was asked said; UGVs without a reason are left out."""
    said = trace.plans[trace.plans["reason"] != ""].groupby("ugv", sort=False)["reason"].last()
    return {ugv: str(said[ugv]) for ugv in without_proposals(trace) if ugv in said.index}


def silent(trace: Trace, ugvs: Iterable[str], kind: str) -> Finding:
    """Not run: UGVs were intervened on, but no message of a kind was recorded."""
    reason = f"{', '.join(ugvs)} were in mode 'intervening', but the trace has no {kind}"
    return Finding("not_run", evidence={"reason": reason, "faults": trace.meta["faults"]})
