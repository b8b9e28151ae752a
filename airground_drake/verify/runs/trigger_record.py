"""Triggers and releases as a run has recorded them: events, and the columns that must agree with them."""

from __future__ import annotations

from typing import Any

import numpy as np

from airground_drake.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S

Transition = tuple[float, str]
"""Time in s, and a key of MODES or kind of event."""

Conflict = dict[str, Any]
"""What disagrees: `t_s`, `what`, and the values on both sides."""


def recorded_events(trace: Trace, ugv: str) -> list[Transition]:
    """Trigger and release events of a UGV by time."""
    found = [(float(e["t_s"]), str(e["kind"])) for e in trace.events if e["robot"] == ugv]
    return sorted(event for event in found if event[1] in ("trigger", "release"))


def column_conflict(trace: Trace, ugv: str, events: list[Transition]) -> Conflict | None:
    """First row at which the columns on triggers and releases do not agree with the events before it."""
    t = trace.t
    for kind, name in (("trigger", "triggered_at_s"), ("release", "released_at_s")):
        times = np.array([-1.0, *(time for time, what in events if what == kind)])
        counts = [np.searchsorted(times[1:], t + shift) for shift in (-TIME_TOLERANCE_S, TIME_TOLERANCE_S)]
        value = trace.column(f"{ugv}.{name}")
        wrong = np.all([np.abs(value - times[n]) > TIME_TOLERANCE_S for n in counts], axis=0)
        if kind == "trigger":
            wrong |= np.all([trace.column(f"{ugv}.triggers") != n for n in counts], axis=0)
        if wrong.any():
            k = int(np.argmax(wrong))
            return {"robot": ugv, "t_s": float(t[k]), "what": f"column {name} or count disagrees with the events"}
    return None
