"""Stalls: places at which UGVs stood short of their targets, and the bodies that held them."""

from typing import Any

import numpy as np
import pandas as pd
from scipy.optimize import nnls

from airground_drake.base.arrays import Array, Indices
from airground_drake.base.errors import TraceError
from airground_drake.sim.trace import Trace
from airground_drake.verify.claims.live_goal import AT_REST_M, AT_REST_S
from airground_drake.verify.engines.geometry import interpolate
from airground_drake.verify.runs.control_law import Inequalities, avoided, inequalities_of
from airground_drake.verify.runs.proposals import proposal_of

PUSH = 1e-3  # a body holds a UGV if it blocks more than this share of its desired velocity
UNEXPLAINED = 0.1  # no body holds a UGV if more than this share of its desired velocity is not blocked
# An inequality binds a standing UGV with less to spare, m/s: a retreat at this speed still counts as standing.
HELD_M_S = AT_REST_M / AT_REST_S


def stalls(trace: Trace) -> list[dict[str, Any]]:
    """Stalls of `AT_REST_S` or longer, by time, before a UGV's first collision."""
    # No body holds a UGV that waits as its proposal demands.
    waits = list[dict[str, Any]]()
    for ugv in trace.ugvs:
        if standing := _standing(trace, ugv):
            given = inequalities_of(trace, ugv)
            waits += [_stall(trace, ugv, first, last, given) for first, last in standing]
    return sorted(waits, key=lambda stall: float(stall["from_s"]))


def _standing(trace: Trace, ugv: str) -> list[tuple[int, int]]:
    """First and last control sample of each stall of a UGV."""
    rows = trace.sample_rows[trace.sample_rows < trace.counting_rows(ugv)]
    place = trace.position(ugv)[rows]
    window = round(AT_REST_S / trace.scenario.control.period_s)
    if len(rows) <= window:
        return []
    seen = pd.DataFrame(place).rolling(window + 1)
    ends = np.flatnonzero((seen.max() - seen.min()).max(axis=1, skipna=False) <= AT_REST_M)
    still = np.zeros(len(rows) + 1, dtype=np.int8)
    for end in ends.tolist():
        still[end - window : end + 1] = 1
    edges = np.flatnonzero(np.diff(still, prepend=0)).reshape(-1, 2) - [0, 1]
    target = trace.scenario.ugvs[ugv].target_m
    tolerance = trace.scenario.arrival_tolerance_m
    return [(first, last) for first, last in edges.tolist() if np.linalg.norm(place[last] - target) > tolerance]


def _stall(trace: Trace, ugv: str, first: int, last: int, given: Inequalities) -> dict[str, Any]:
    times = trace.sampled("t_s")
    to_the_end = last == len(trace.sample_rows) - 1
    return {
        "robot": ugv,
        "from_s": float(times[first]),
        "until_s": float(trace.t[-1]) if to_the_end else float(times[last]),
        "position_m": trace.position(ugv)[trace.sample_rows[last]].tolist(),
        "held_by": _held_by(trace, ugv, last if to_the_end else (first + last) // 2, given),
    }


def _held_by(trace: Trace, ugv: str, sample: int, given: Inequalities) -> list[str]:
    """The bodies whose avoidance inequalities block a UGV's desired velocity at a sample."""
    binding = (given.sample == sample) & (given.slack(trace.chosen(ugv)) <= HELD_M_S)
    wish = _wish(trace, ugv, sample)
    speed = float(np.linalg.norm(wish))
    if not binding.any() or speed <= HELD_M_S:
        return []
    # Least squares: -wish = sum of shares times normals, shares >= 0. A wall that is only alongside gets none.
    shares, left = nnls(given.normal[binding].T, -wish / speed)
    if left > UNEXPLAINED:
        return []
    columns: Indices = given.column[binding][shares > PUSH]
    bodies = avoided(trace)
    return list(dict.fromkeys(bodies[column] for column in columns.tolist()))


def _wish(trace: Trace, ugv: str, sample: int) -> Array:
    """The desired velocity of a UGV without avoidance, (3,), m/s: of its executed proposal, or of its own task."""
    place = trace.position(ugv)[trace.sample_rows[sample]]
    number = int(trace.sampled(f"{ugv}.executing")[sample])
    gain = trace.scenario.control.motion_gain_1_s
    t_s = float(trace.sampled("t_s")[sample])
    if number >= 0:
        try:
            sent = proposal_of(trace, number)
        except TraceError:  # which claims report
            return np.zeros(3)
        return np.asarray(gain * (interpolate(sent.times_s, sent.positions_m, t_s) - place))
    return np.asarray(trace.reference_rate(ugv)[sample] + gain * (trace.reference(ugv)[sample] - place))
