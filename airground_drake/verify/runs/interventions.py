"""When the UGVs of a run were intervened on, by its mode columns."""

from __future__ import annotations

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.run.trace import Trace

GATED_METHODS = ("c", "d")
"""Methods with an optimising gatekeeper."""


def intervening(trace: Trace, ugv: str) -> Array:
    """Intervals of mode 1, (K, 2), s; the mode of a row is in force since the row before."""
    inside = np.concatenate([[False], trace.column(f"{ugv}.mode")[1:] == 1.0, [False]])
    edges = np.flatnonzero(np.diff(inside.astype(np.int8)))
    return trace.t[edges].reshape(-1, 2)


def talk_is_due(trace: Trace, ugv: str) -> bool:
    """Whether a UGV is intervened on for longer than a proposal and a decision on it take."""
    periods = trace.scenario.intervention.period_s + trace.scenario.gatekeeper.period_s
    return bool((np.diff(intervening(trace, ugv)) > periods).any())
