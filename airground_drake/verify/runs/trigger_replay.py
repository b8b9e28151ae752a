"""The trigger (20) run again on a run: its decision variable, and the automaton's transitions.

The decision variable x(t) = ||rho_rd(t) - rho(t)|| + n(t) is, between rows, the norm of a vector that is linear
in time plus a number that is linear in time, so its turning points and crossings are found exactly.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from airground_drake.trace import Trace
from airground_drake.verify.engines.segments import NormSignal, corner_times, interpolate, travelled
from airground_drake.verify.runs.trigger_record import Transition


def decision_variable(trace: Trace, ugv: str) -> NormSignal:
    """x(t) of (15) from positions and noise of the trace and the preset of its scenario, not the recorded one."""
    rows, preset = trace.t, trace.scenario["ugvs"][ugv]["preset"]
    waypoints = np.asarray(preset["waypoints_m"], dtype=np.float64)
    speed = preset["speed_m_s"]
    corners = corner_times(waypoints, speed)
    t = np.union1d(rows, corners[(corners > rows[0]) & (corners < rows[-1])])
    parts = interpolate(rows, np.column_stack([trace.position(ugv), trace.column(f"{ugv}.noise_m")]), t)
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
        found = x.reaches(release, trigger, above=False)
        if found is None:
            return
        released, resume = found, max(found, trigger + dwell)
        yield released, "refractory" if resume > released else "release"
