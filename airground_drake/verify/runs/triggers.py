"""The recorded triggers of a run, and the trigger (20) run again on its decision variable.

The decision variable x(t) = ||rho_rd(t) - rho(t)|| + n(t) is, between rows, the norm of a vector that is linear
in time plus a number that is linear in time, so its turning points and crossings are found exactly.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.scenario.schema import Decision
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.geometry import NormSignal, corner_times, interpolate, travelled
from airground_drake.verify.runs.pairs import preset_of

Transition = tuple[float, str]  # time in s, and a key of MODES or kind of event

Conflict = dict[str, Any]  # a disagreement: `t_s`, `what`, and the values on both sides

# Noise at a row may differ by this, m, from the row before and the sample of its period: rows closer than 1e-9 s are
# one, and noise moves by less in that time.
NOISE_TOLERANCE_M = 1e-8
LARGEST_SAMPLE = 9.0  # standard deviations: one normal sample in 1e19 is larger


def recorded_events(trace: Trace, ugv: str) -> list[Transition]:
    own = (event for event in trace.events if event["robot"] == ugv and event["kind"] in ("trigger", "release"))
    return sorted((float(event["t_s"]), str(event["kind"])) for event in own)


def column_conflict(trace: Trace, ugv: str, events: list[Transition]) -> Conflict | None:
    """First row at which the columns on triggers and releases contradict the earlier events."""
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


def decision_variable(trace: Trace, ugv: str) -> NormSignal:
    """x(t) of (15), recomputed from the trace's positions and noise and the scenario's preset."""
    return _signal(trace, ugv, trace.column(f"{ugv}.noise_m"))


def task_error(trace: Trace, ugv: str) -> NormSignal:
    """The task error e(t) = ||rho_rd(t) - rho(t)||: the decision variable without noise."""
    return _signal(trace, ugv, np.zeros(len(trace.t)))


def _signal(trace: Trace, ugv: str, noise: Array) -> NormSignal:
    """||rho_rd(t) - rho(t)|| + n(t) with this n at the rows, (T,), m."""
    rows, (waypoints, speed) = trace.t, preset_of(trace, ugv)
    corners = corner_times(waypoints, speed)
    t = np.union1d(rows, corners[(corners > rows[0]) & (corners < rows[-1])])
    parts = interpolate(rows, np.column_stack([trace.position(ugv), noise]), t)
    parts[:, :3] = travelled(waypoints, speed, t) - parts[:, :3]
    return NormSignal.of(t, parts)


def recorded_variable(trace: Trace, ugv: str) -> NormSignal:
    """The recorded x(t), the signal that the trigger had, taken to be linear in time between rows."""
    x = trace.column(f"{ugv}.decision_variable_m")
    return NormSignal.of(trace.t, np.column_stack([np.zeros((len(x), 3)), x]))


def transitions(x: NormSignal, zeta: float, release: float, dwell: float) -> Iterator[Transition]:
    """Run the trigger automaton on x: levels zeta >= release, m, and dwell, s (release = zeta, dwell = 0: bare)."""
    released, resume = -np.inf, float(x.t[0])
    while resume <= x.t[-1]:
        waited = resume > released  # at the start or the end of a refractory time x may be above already
        if waited and np.isfinite(released):
            yield resume, "resume"
        trigger = resume if waited and x.at(resume) >= zeta else x.reaches(zeta, resume, above=True)
        if trigger is None:
            return
        yield trigger, "trigger"
        fallen = x.reaches(release, trigger, above=False)
        if fallen is None:
            return
        released, resume = fallen, max(fallen, trigger + dwell)
        yield released, "refractory" if resume > released else "release"


def noise_conflict(trace: Trace, ugv: str) -> Conflict | None:
    """First row at which the noise of a UGV is not that of dn = -leak n dt + s dW, by Euler's method over rows."""
    t, n = trace.t, trace.column(f"{ugv}.noise_m")
    if abs(n[0]) > NOISE_TOLERANCE_M:
        return {"t_s": float(t[0]), "what": "noise: does not start at 0", "noise_m": float(n[0])}
    off = noise_off(t, n[:, None], trace.scenario.decision)[:, 0]
    if not (off > NOISE_TOLERANCE_M).any():
        return None
    k = int(np.argmax(off > NOISE_TOLERANCE_M))
    what = "noise: not one sample held over its period, or too large a one"
    return {"t_s": float(t[k + 1]), "what": what, "noise_m": float(n[k + 1]), "off_m": float(off[k])}


def noise_off(t: Array, noise: Array, given: Decision) -> Array:
    """Differences of n noises, (T, n), m, from their expected values at each row but the first, (T - 1, n), m."""
    # It starts at 0. In each of its periods h one sample w, of standard normal size, is held: between rows n moves at
    # the rate s w / sqrt(h) - leak n.
    dt, h = np.diff(t), given.noise_period_s
    lasting = dt[:, None]
    moved = np.diff(noise, axis=0) + given.leak_1_s * noise[:-1] * lasting
    _, period = np.unique(np.floor(0.5 * (t[1:] + t[:-1]) / h), return_inverse=True)
    order = np.lexsort((dt, period))
    longest = order[np.append(np.diff(period[order]) > 0, True)]  # the longest step in each period
    due = lasting * (moved[longest] / dt[longest, None])[period]
    most = LARGEST_SAMPLE * given.noise_m_sqrt_s / np.sqrt(h) * lasting
    return np.asarray(np.maximum(np.abs(moved - due), np.abs(moved) - most))
