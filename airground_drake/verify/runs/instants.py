"""When things happened in a run: the control samples, and the intervals in which UGVs were intervened on."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.run.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.geometry import MERGE_S
from airground_drake.verify.finding import Finding

GATED_METHODS = ("c", "d")
"""Methods with an optimising gatekeeper."""


def samples_of(trace: Trace) -> npt.NDArray[np.intp]:
    """Rows of the control samples, (S,)."""
    return trace.sample_rows


def row_at(trace: Trace, t_s: float) -> int:
    """The row at a time, s, or the next one; for times after the run the last one."""
    return min(int(np.searchsorted(trace.t, t_s - TIME_TOLERANCE_S)), len(trace.t) - 1)


def chosen_at(trace: Trace, samples: npt.NDArray[np.intp]) -> npt.NDArray[np.intp]:
    """Rows whose commands were chosen at the samples: the command of a row led to it, so it is the row after."""
    return np.searchsorted(trace.t, trace.t[samples] + MERGE_S)


def executing(trace: Trace, ugv: str) -> npt.NDArray[np.int64]:
    """Number of the proposal that a UGV executes from each control sample on, (S,); -1: none, -2: not known which."""
    samples = samples_of(trace)
    table = (
        trace.decisions if trace.meta["method"] in GATED_METHODS else trace.proposals.assign(t_s=lambda p: p.issued_s)
    )
    mine = table[table["robot"] == ugv].sort_values("t_s", kind="stable")
    times, numbers = mine["t_s"].to_numpy(dtype=np.float64), np.append(mine["number"].to_numpy(dtype=np.int64), -2)
    last = np.searchsorted(times, trace.t[samples] + TIME_TOLERANCE_S) - 1
    return np.where(trace.column(f"{ugv}.accepted")[chosen_at(trace, samples)] != 0.0, numbers[last], -1)


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
    """UGVs that were intervened on long enough, but got no proposal: the UAV found no way, or its policies failed."""
    asked = {event["robot"] for event in trace.events if event["kind"] == "proposal"}
    return [ugv for ugv in trace.ugvs if ugv not in asked and talk_is_due(trace, ugv)]


def silent(trace: Trace, ugvs: Iterable[str], kind: str) -> Finding:
    """Not run: UGVs were intervened on, but no message of a kind was recorded."""
    reason = f"{', '.join(ugvs)} were in mode 'intervening', but the trace has no {kind}"
    return Finding("not_run", evidence={"reason": reason, "faults": trace.meta["faults"]})
