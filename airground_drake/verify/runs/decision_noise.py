"""The noise of (15) as a run has recorded it: one sample for each of its periods, integrated with the leak."""

from __future__ import annotations

import numpy as np

from airground_drake.arrays import Array
from airground_drake.trace import Trace
from airground_drake.verify.runs.trigger_record import Conflict

NOISE_TOLERANCE_M = 1e-8
"""Noise at a row may differ from what its period's sample makes of the row before by this, m: rows closer than 1e-9 s
are one, and noise moves by less in that time."""
LARGEST_SAMPLE = 9.0
"""In standard deviations: of normal samples one in 1e19 is larger."""


def noise_conflict(trace: Trace, ugv: str) -> Conflict | None:
    """First row at which the noise of a UGV is not that of dn = -leak n dt + s dW, by Euler's method over rows.

    It starts at 0. In each of its periods h one sample w, of standard normal size, is held: between rows n moves at the
    rate s w / sqrt(h) - leak n.
    """
    given, t, n = trace.scenario["decision"], trace.t, trace.column(f"{ugv}.noise_m")
    if abs(n[0]) > NOISE_TOLERANCE_M:
        return {"t_s": float(t[0]), "what": "noise: does not start at 0", "noise_m": float(n[0])}
    dt, h = np.diff(t), given["noise_period_s"]
    moved = np.diff(n) + given["leak_1_s"] * n[:-1] * dt
    due = dt * _rates(moved, dt, np.floor(0.5 * (t[1:] + t[:-1]) / h))
    most = LARGEST_SAMPLE * given["noise_m_sqrt_s"] / np.sqrt(h) * dt
    off = np.maximum(np.abs(moved - due), np.abs(moved) - most)
    if not (off > NOISE_TOLERANCE_M).any():
        return None
    k = int(np.argmax(off > NOISE_TOLERANCE_M))
    what = "noise: not one sample held over its period, or too large a one"
    return {"t_s": float(t[k + 1]), "what": what, "noise_m": float(n[k + 1]), "off_m": float(off[k])}


def _rates(moved: Array, dt: Array, period: Array) -> Array:
    """Of each step, moved / dt of the longest step in the same period, (S,)."""
    _, of = np.unique(period, return_inverse=True)
    order = np.lexsort((dt, of))
    longest = order[np.append(np.diff(of[order]) > 0, True)]
    rates: Array = (moved[longest] / dt[longest])[of]
    return rates
