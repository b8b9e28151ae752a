"""Plan one robot's way among robots with fixed motions: a safe-interval search to its preset, then along it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Self

import numpy as np

from airground_drake.base.arrays import Array, Flags
from airground_drake.uav.coordination import intervals
from airground_drake.uav.coordination.intervals import Indices
from airground_drake.uav.coordination.roadmap import ROUNDING_M, Roadmap, RobotNodes, RobotTask, Space
from airground_drake.uav.coordination.timed import distance, free_pieces, timed, without_repeats

# A mover stores what so many motions block, to limit memory; more if there are more other robots, since every search
# goes through the motions of all of them.
MOST_KNOWN = 16


class OtherRobot(NamedTuple):
    """Another robot."""

    motion: Array  # timed, (M, 3)
    radius: float = 0.0  # of its body, m
    until: float = math.inf  # the robot counts as an obstacle up to this time, s


@dataclass(frozen=True, eq=False)
class Way:
    """The plan for one robot."""

    motion: Array  # timed, (M, 3), from t = 0 to the end of its preset
    joined: float  # time at which it is back on its preset, s
    rows: int  # number of rows of the motion up to that time


def sum_of_times(ways: Sequence[Way | None]) -> float:
    """Sum of the times at which robots are back on their presets, s: the objective of plans."""
    return math.fsum(way.joined for way in ways if way is not None)


@dataclass(frozen=True, eq=False)
class Mover:
    """One robot on a roadmap."""

    task: RobotTask  # where it is, and where it must go
    speed: float  # m/s
    own: RobotNodes  # its nodes
    roadmap: Roadmap  # the part that it can use
    space: Space  # discs and distances that it has to keep
    to_go: Array  # lower bound of the time from every node to its preset, (N,), s
    clear: Flags  # which pieces of its preset between neighbouring nodes are free of discs, (K - 1,)
    edges: intervals.Edges
    blocked: dict[tuple[int, float], "Blocked"] = field(default_factory=dict)  # by others' `id(motion)`s and radii
    found: dict[object, "Found"] = field(default_factory=dict)  # earlier results of `find`

    @classmethod
    def on(cls, roadmap: Roadmap, space: Space, task: RobotTask, speed: float, own: RobotNodes) -> Self:
        """Put a robot with a speed, m/s, on a roadmap."""
        places = roadmap.nodes[own.preset]
        clear = own.usable[:-1] & own.usable[1:] & space.segments_are_free(places[:-1], places[1:])
        to_go = roadmap.distances_to(own.preset[own.usable]) / speed
        edges = intervals.Edges(roadmap.first_edge, roadmap.heads, roadmap.lengths / speed)
        return cls(task, speed, own, roadmap, space, to_go, clear, edges)


class Blocked(NamedTuple):
    """What the motion of another robot blocks for a mover."""

    nodes: Indices  # (B,)
    times: Array  # when they are blocked, (B, 2), s
    clear: Flags  # which pieces of the preset it leaves free, (K - 1,)
    at_end: bool  # whether the mover can stay at the end of its preset
    motion: Array  # kept alive, for it is known by its identity


class Found(NamedTuple):
    """A result of `find`."""

    way: Way | None
    spent: int  # number of expanded intervals
    latest: float  # up to when the robot had to be back, s
    others: tuple[OtherRobot, ...]  # which keeps their motions alive: they are known by their identity


def find(
    mover: Mover,
    fixed: Sequence[OtherRobot],
    follow: float,
    budget: int,
    brief: Sequence[OtherRobot] = (),
    latest: float = math.inf,
) -> tuple[Way | None, int]:
    """Find the way on which a robot is back on its preset as early as possible, before the time `latest`, s."""
    # A robot is planned for among the same others several times: then the earlier result is returned, with its effort.
    others = (*fixed, *brief)
    key = frozenset((id(other.motion), other.radius, other.until) for other in others), follow
    known = mover.found.get(key)
    if known is None or known.spent > budget or (known.way is None and known.latest < latest):
        way, spent = _found(mover, fixed, follow, budget, others, latest)
        known = Found(way, spent, latest, others)
        if known.spent < budget:
            mover.found[key] = known
    return known.way, known.spent


def _found(
    mover: Mover,
    fixed: Sequence[OtherRobot],
    follow: float,
    budget: int,
    others: Sequence[OtherRobot],
    latest: float,
) -> tuple[Way | None, int]:
    # The robot is back when it has joined its preset and nothing blocks it for the time `follow`, or to its end.
    #
    # Why robots keep their distance d + spacing also along an edge: let R^2 = (d + spacing)^2 + L^2/4, where L is the
    # length of the longest edge. Another robot blocks a node while its distance from the node is below R. The squared
    # distance to a point of the edge is a weighted mean of the squared distances to the ends, less s (1 - s) L^2. So it
    # is at least R^2 - L^2/4. Only at start and target may the other robot be nearer: at d, or at the distance that it
    # has there in the beginning or in the end. Edges at these nodes are shorter than sqrt(R^2 - d^2), so the distance
    # grows along them from the first.
    # follow: how long the preset must be free, s.
    # Returns the way, or None if no way is found within the budget; and the number of expanded intervals.
    own, roadmap = mover.own, mover.roadmap
    blocked = [_blocked(mover, other) for other in others]
    while len(mover.blocked) > max(MOST_KNOWN, len(blocked)):
        del mover.blocked[next(iter(mover.blocked))]  # the one not used for longest
    nodes = np.concatenate([np.zeros(0, np.int64), *(by.nodes for by in blocked)])
    until = [np.minimum(by.times, other.until) for by, other in zip(blocked, others, strict=True)]
    free = intervals.safe_intervals(len(roadmap.nodes), nodes, np.concatenate([np.zeros((0, 2)), *until]))
    joins = _joins(mover, blocked[: len(fixed)], follow)
    route, arrivals, joined, spent = intervals.search(mover.edges, free, own.start, joins, mover.to_go, budget, latest)
    return (_way(roadmap, mover, route, arrivals, joined) if len(route) else None), int(spent)


def _blocked(mover: Mover, other: OtherRobot) -> Blocked:
    """What another robot blocks, as if it always counted as an obstacle."""
    key = id(other.motion), other.radius
    known = mover.blocked.pop(key, None) or _blocked_by(mover, other)
    mover.blocked[key] = known
    return known


def _blocked_by(mover: Mover, other: OtherRobot) -> Blocked:
    own, roadmap, space = mover.own, mover.roadmap, mover.space
    start, target = roadmap.nodes[own.start], roadmap.nodes[own.target]
    at_first = float(np.hypot(*(start - other.motion[0, 1:])))
    at_last = float(np.hypot(*(target - other.motion[-1, 1:])))
    near = np.minimum([at_first, at_last], space.apart + other.radius) - ROUNDING_M
    radii = np.full(len(roadmap.nodes), space.wide(roadmap.longest, other.radius))
    np.minimum.at(radii, [own.start, own.target], near)
    preset = timed(own.preset_times, roadmap.nodes[own.preset])
    wished = _wished(space, other)
    clear = free_pieces(preset, other.motion, wished - ROUNDING_M)
    at_end = distance(preset[-1:], other.motion, float(preset[-1, 0])) >= min(wished, at_last) - ROUNDING_M
    nodes, times = intervals.blocked_times(other.motion, roadmap.grid, radii)
    return Blocked(nodes, times, clear, at_end, other.motion)


def _joins(mover: Mover, blocked: Sequence[Blocked], follow: float) -> Array:
    """First and last time at which the preset can be joined at each node, (N, 2), s; see `intervals.join_time`."""
    own, roadmap, times = mover.own, mover.roadmap, mover.own.preset_times
    clear = np.logical_and.reduce([mover.clear, *(by.clear for by in blocked)])
    held = all(by.at_end for by in blocked)
    # the next time at which the preset is blocked, for each of its nodes
    until = np.append(np.where(clear, np.inf, times[:-1]), np.inf if held else times[-1])
    until = np.minimum.accumulate(until[::-1])[::-1]
    joins = np.tile([np.inf, -np.inf], (len(roadmap.nodes), 1))
    usable = own.usable & (until >= np.minimum(times + follow, times[-1]))
    joins[own.preset[usable]] = times[usable, None]
    joins[own.target] = times[-1], np.inf
    return joins


def _wished(space: Space, other: OtherRobot) -> float:
    """Distance that a robot keeps from another one where possible, m."""
    return space.apart + other.radius + space.spacing


def _way(roadmap: Roadmap, mover: Mover, route: Indices, arrivals: Array, joined: float) -> Way:
    """The motion along a route with its waits, then along the preset from the time `joined`, s, on."""
    places = roadmap.nodes[route]
    lengths = np.hypot(*np.diff(places, axis=0).T)
    leaves = np.append(arrivals[1:] - np.maximum(lengths, ROUNDING_M) / mover.speed, joined)
    times = np.column_stack([arrivals, leaves]).ravel()
    before = without_repeats(timed(times, np.repeat(places, 2, axis=0)))
    preset = mover.task.preset
    after = preset[preset[:, 0] > joined + 1e-9]
    return Way(np.concatenate([before, after]), joined, len(before))
