"""What a UGV senses in a run: parts of barriers and robots within range, and parts that it had not sensed before."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.geometry import interpolate
from airground_drake.verify.engines.outlines import Cores, away_from, within
from airground_drake.verify.runs.pairs import Pair, Parts, carried, lifetimes, pairs_beside, parts_of
from airground_drake.verify.runs.proposals import row_at

SAME_M = 1e-9
"""Cores whose corners and heights differ by no more than this are one, m."""
Indices = npt.NDArray[np.intp]


def still_parts(trace: Trace) -> Parts:
    """The convex parts of the barriers at rest: records number them in their order."""

    def found() -> Parts:
        parts, still = parts_of(trace), carried(trace)[0][0]
        owner = parts.owner[still]
        return Parts(parts.cores.take(still), owner, np.unique(owner, return_index=True)[1], parts.names)

    return trace.derived("still parts", found)


def are_there(trace: Trace, t: float | Array) -> npt.NDArray[np.bool_]:
    still, times = carried(trace)[0][0], np.append(trace.t, np.inf)
    first, last = (times[rows[still]] for rows in lifetimes(trace))
    return np.asarray((first <= t + TIME_TOLERANCE_S) & (t < last - TIME_TOLERANCE_S))


def place_of(trace: Trace, robot: str, t: float | Array) -> Array:
    """Where all take a robot to be at times, s: (3,) or (K, 3), m; with errors, as it was published last."""
    if not trace.scenario.sensing:
        return interpolate(trace.t, trace.position(robot), t)
    last = np.searchsorted(trace.t[trace.sample_rows], np.asarray(t) + TIME_TOLERANCE_S, side="right") - 1
    return trace.as_seen(robot, robot)[last]


class Sensed(NamedTuple):
    """What a UGV senses when it decides: parts of barriers, by number, and robots, each with its pair.

    `places` are those of each robot, (S, 3), m, if it moves on as it does.
    """

    parts: Indices
    robots: list[Pair]
    places: list[Array]


def sensed(trace: Trace, robot: str, t: float, after: Array) -> Sensed:
    """What is within sensing range of a UGV at a time, s, with the places of robots at times `after` that."""
    here, reach = place_of(trace, robot, t), trace.scenario.control.sensing_range_m
    pairs, places = list[Pair](), list[Array]()
    for other in trace.robots:
        place, velocity = moves(trace, other, t)
        if other != robot and np.linalg.norm(place - here) <= reach:
            pairs.append(pairs_beside(trace, robot)[other])
            places.append(place + after[:, None] * velocity)
    return Sensed(np.flatnonzero(are_there(trace, t) & (beyond_range(trace, robot, t) <= 0.0)), pairs, places)


def beyond_range(trace: Trace, ugv: str, t: float) -> Array:
    """How far each part is beyond the sensing range of a UGV at a time, s, (m,), m."""
    here = place_of(trace, ugv, t)
    return away_from(still_parts(trace).cores, here, planar=True).distance - trace.scenario.control.sensing_range_m


def moves(trace: Trace, robot: str, t: float) -> tuple[Array, Array]:
    return place_of(trace, robot, t), trace.command(robot)[row_at(trace, t)]


def news(trace: Trace, ugv: str, mapped: Array, begin_s: float, end_s: float) -> Indices:
    """Parts that a UGV senses for the first time within (begin_s, end_s], and that are not on a proposal's map."""
    first = trace.derived(("first sensed", ugv), lambda: first_sensed(trace, ugv))
    new = (first > begin_s + TIME_TOLERANCE_S) & (first <= end_s + TIME_TOLERANCE_S)
    shown = are_same(still_parts(trace).cores, Cores.of(mapped)).any(axis=1)
    return np.flatnonzero(new & ~shown)


def are_same(one: Cores, other: Cores) -> npt.NDArray[np.bool_]:
    both = Cores.joined([one, other])
    numbers = np.column_stack([both.corners.reshape(len(both.base), 2 * both.corners.shape[1]), both.base, both.top])
    m = len(one.base)
    return np.asarray((np.abs(numbers[:m, None] - numbers[m:]) <= SAME_M).all(axis=2))


def first_sensed(trace: Trace, ugv: str) -> Array:
    """When a UGV senses each part for the first time, at the gatekeeper's samples, (m,), s; inf if never."""
    times, cores, there = _near(trace, ugv)
    found = np.full(len(still_parts(trace).owner), np.inf)
    np.minimum.at(found, cores[there], times[there])
    return found


def seen_gone(trace: Trace, ugv: str) -> Array:
    """When a UGV first has each part that it has sensed within range, and it is gone, (m,), s; inf if never."""
    times, cores, there = _near(trace, ugv)
    first = first_sensed(trace, ugv)
    gone = ~there & (times > first[cores])
    found = np.full(len(first), np.inf)
    np.minimum.at(found, cores[gone], times[gone])
    return found


def _near(trace: Trace, ugv: str) -> tuple[Array, Indices, npt.NDArray[np.bool_]]:
    """Times of the gatekeeper's samples, s, at which a part is within sensing range; the part; whether it is there."""
    period_s = trace.scenario.gatekeeper.period_s
    samples = period_s * np.arange(np.floor(trace.t[-1] / period_s + 1e-9) + 1.0)
    was = place_of(trace, ugv, np.minimum(samples, trace.t[-1]))
    parts = still_parts(trace)
    near = within(parts.cores, was, trace.scenario.control.sensing_range_m, planar=True)
    then = np.array([are_there(trace, t) for t in samples]).reshape(len(samples), len(parts.owner))
    return samples[near.place], near.core, then[near.place, near.core]
