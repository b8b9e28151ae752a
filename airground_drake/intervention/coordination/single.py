"""The way of one robot among motions that are fixed: safe-interval search, then along the preset."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.arrays import Array
from airground_drake.intervention.coordination import kernels
from airground_drake.intervention.coordination.roadmap import Errand, Indices, Roadmap, Space, Woven
from airground_drake.intervention.coordination.timed import distance, timed, without_repeats

ROUNDING_M = 1e-9
"""Robots may be nearer to each other than asked for by this, m."""


class Body(NamedTuple):
    """Another robot: its motion, (M, 3), how long that counts, s, and its radius, m."""

    motion: Array
    radius: float = 0.0
    until: float = math.inf


@dataclass(frozen=True, eq=False)
class Way:
    """What a robot is to do.

    Attributes:
        motion: timed, (M, 3), from t = 0 to the end of its preset.
        joined: when it is back on its preset, s.
        rows: of the motion up to then.
    """

    motion: Array
    joined: float
    rows: int


@dataclass(frozen=True, eq=False)
class Mover:
    """One robot on a roadmap.

    Attributes:
        errand: where it is and where it is to go.
        speed: m/s.
        woven: its nodes.
        roadmap: what it can use of it.
        space: what it has to keep away from.
        to_go: lower bound of the time from every node to its preset, (N,), s.
        clear: which pieces of its preset between neighbouring nodes no disc blocks, (K - 1,).
    """

    errand: Errand
    speed: float
    woven: Woven
    roadmap: Roadmap
    space: Space
    to_go: Array
    clear: npt.NDArray[np.bool_]

    @classmethod
    def on(cls, roadmap: Roadmap, space: Space, errand: Errand, speed: float, woven: Woven) -> Mover:
        """A robot with a speed, m/s, on a roadmap."""
        places = roadmap.nodes[woven.preset]
        clear = woven.usable[:-1] & woven.usable[1:] & space.segments_are_free(places[:-1], places[1:])
        to_go = roadmap.distances_to(woven.preset[woven.usable]) / speed
        return cls(errand, speed, woven, roadmap, space, to_go, clear)


def find(
    mover: Mover, fixed: Sequence[Body], follow: float, budget: int, brief: Sequence[Body] = ()
) -> tuple[Way | None, int]:
    """The way on which a robot is back on its preset as early as possible.

    Back means that it can follow it for a while: nothing blocks it for so long, or to its end. With
    R^2 = (d + spacing)^2 + L^2/4, no robot ever comes nearer than d + spacing to another one on an edge of length L
    whose both ends are farther from it than R all the while: the squared distance of a point of the edge is at least
    R^2 - L^2/4, for it is a mean of those of the ends less s (1 - s) L^2. Start and target may be nearer, to d, or to
    what the distance to the other robot is in the beginning or in the end: edges from there are shorter than
    sqrt(R^2 - d^2), so that the distance grows on them from the first.

    Args:
        mover: the robot.
        fixed: the other robots.
        follow: how long the preset must be free, s.
        budget: of expanded intervals.
        brief: places that others need for a time.

    Returns:
        The way, None if there is none or the budget is spent; and what was spent.
    """
    own, roadmap, space = mover.woven, mover.roadmap, mover.space
    start, target = roadmap.nodes[own.start], roadmap.nodes[own.target]
    nodes, times = [np.zeros(0, np.int64)], [np.zeros((0, 2))]
    ends = np.array([own.start, own.target])
    for other in [*fixed, *brief]:
        first = float(np.hypot(*(start - other.motion[0, 1:])))
        last = float(np.hypot(*(target - other.motion[-1, 1:])))
        near = np.minimum([first, last], space.apart + other.radius) - ROUNDING_M
        found = kernels.blocked_times(
            other.motion, roadmap.nodes, roadmap.cells, roadmap.members, roadmap.corner, roadmap.size, roadmap.shape,
            space.wide(roadmap.longest, other.radius), ends, near,
        )  # fmt: skip
        nodes.append(found[0])
        times.append(np.minimum(found[1], other.until))
    blocked, spans = np.concatenate(nodes), np.concatenate(times)
    order = np.lexsort((spans[:, 0], blocked))
    first_interval, intervals = kernels.safe_intervals(len(roadmap.nodes), blocked[order], spans[order])
    joins = _joins(mover, fixed, follow)
    route, arrivals, joined, spent = kernels.search(
        roadmap.first_edge, roadmap.heads, roadmap.lengths / mover.speed, first_interval, intervals, own.start,
        joins, mover.to_go, budget,
    )  # fmt: skip
    if not len(route):
        return None, int(spent)
    return _way(roadmap, mover, route, arrivals, joined), int(spent)


def _joins(mover: Mover, fixed: Sequence[Body], follow: float) -> Array:
    """First and last time at which the preset can be joined at each node, (N, 2), s; see `kernels.search`."""
    own, roadmap, space = mover.woven, mover.roadmap, mover.space
    times, places = own.preset_times, roadmap.nodes[own.preset]
    clear = mover.clear.copy()
    for other in fixed:
        clear &= _apart(space, timed(times, places), other)
    stays = timed(times[-1:], places[-1:])
    in_the_end = np.array([np.hypot(*(places[-1] - other.motion[-1, 1:])) for other in fixed])
    held = all(
        distance(stays, other.motion, float(times[-1])) >= min(_wished(space, other), end) - ROUNDING_M
        for other, end in zip(fixed, in_the_end.tolist(), strict=True)
    )
    # when the preset is next blocked, seen from each of its nodes
    blocked = np.append(np.where(clear, np.inf, times[:-1]), np.inf if held else times[-1])
    blocked = np.minimum.accumulate(blocked[::-1])[::-1]
    joins = np.tile([np.inf, -np.inf], (len(roadmap.nodes), 1))
    usable = own.usable & (blocked >= np.minimum(times + follow, times[-1]))
    joins[own.preset[usable]] = times[usable, None]
    joins[own.target] = times[-1], np.inf
    return joins


def _wished(space: Space, other: Body) -> float:
    """Distance that a robot wishes to keep from another one, m."""
    return space.apart + other.radius + space.spacing


def _apart(space: Space, preset: Array, other: Body) -> npt.NDArray[np.bool_]:
    """Which pieces of a preset (K, 3) another robot leaves free, (K - 1,)."""
    wished = _wished(space, other)
    found = np.ones(len(preset) - 1, dtype=bool)
    for k in range(len(found)):
        begin, end = float(preset[k, 0]), float(preset[k + 1, 0])
        found[k] = distance(preset[k : k + 2], other.motion, begin, end) >= wished - ROUNDING_M
    return found


def _way(roadmap: Roadmap, mover: Mover, route: Indices, arrivals: Array, joined: float) -> Way:
    """The motion along a route, with its waits, and along the preset from when it is joined."""
    places = roadmap.nodes[route]
    lengths = np.hypot(*np.diff(places, axis=0).T)
    leaves = arrivals[1:] - np.maximum(lengths, ROUNDING_M) / mover.speed
    rows = [np.array([[arrivals[0], *places[0]]])]
    for k, leave in enumerate(leaves.tolist()):
        rows.append(np.array([[leave, *places[k]], [arrivals[k + 1], *places[k + 1]]]))
    rows.append(np.array([[joined, *places[-1]]]))
    before = without_repeats(np.concatenate(rows))
    preset = mover.errand.preset
    after = preset[preset[:, 0] > joined + 1e-9]
    return Way(np.concatenate([before, after]), joined, len(before))
