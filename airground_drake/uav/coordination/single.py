"""Plan one robot's way among robots with fixed motions: a safe-interval search to its preset, then along it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Self

import numpy as np

from airground_drake.base.arrays import Array, Flags
from airground_drake.uav.coordination import intervals
from airground_drake.uav.coordination.intervals import Indices
from airground_drake.uav.coordination.roadmap import Roadmap, RobotNodes, RobotTask, Space
from airground_drake.uav.coordination.timed import distance, free_pieces, timed, without_repeats

ROUNDING_M = 1e-9  # distances between robots may fall short by this, m
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
    # What other robots block, by the identity of a motion and a radius, and the motion, which keeps it alive.
    blocked: dict[tuple[int, float], tuple[Indices, Array, Array]] = field(default_factory=dict)

    @classmethod
    def on(cls, roadmap: Roadmap, space: Space, task: RobotTask, speed: float, own: RobotNodes) -> Self:
        """Put a robot with a speed, m/s, on a roadmap."""
        places = roadmap.nodes[own.preset]
        clear = own.usable[:-1] & own.usable[1:] & space.segments_are_free(places[:-1], places[1:])
        to_go = roadmap.distances_to(own.preset[own.usable]) / speed
        edges = intervals.Edges(roadmap.first_edge, roadmap.heads, roadmap.lengths / speed)
        return cls(task, speed, own, roadmap, space, to_go, clear, edges)


def find(
    mover: Mover, fixed: Sequence[OtherRobot], follow: float, budget: int, brief: Sequence[OtherRobot] = ()
) -> tuple[Way | None, int]:
    """Find the way on which a robot is back on its preset as early as possible."""
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
    blocked = [_blocked_times(mover, other) for other in [*fixed, *brief]]
    while len(mover.blocked) > max(MOST_KNOWN, len(blocked)):
        del mover.blocked[next(iter(mover.blocked))]  # the one not used for longest
    nodes = np.concatenate([np.zeros(0, np.int64), *(nodes for nodes, _ in blocked)])
    times = np.concatenate([np.zeros((0, 2)), *(times for _, times in blocked)])
    free = intervals.safe_intervals(len(roadmap.nodes), nodes, times)
    joins = _joins(mover, fixed, follow)
    route, arrivals, joined, spent = intervals.search(mover.edges, free, own.start, joins, mover.to_go, budget)
    return (_way(roadmap, mover, route, arrivals, joined) if len(route) else None), int(spent)


def _blocked_times(mover: Mover, other: OtherRobot) -> tuple[Indices, Array]:
    """Nodes (B,) that another robot blocks, and when, (B, 2), s. Start and target have smaller radii, see `find`."""
    key = id(other.motion), other.radius
    known = mover.blocked.pop(key, None) or (*_all_blocked_times(mover, other), other.motion)
    mover.blocked[key] = known
    return known[0], np.minimum(known[1], other.until)


def _all_blocked_times(mover: Mover, other: OtherRobot) -> tuple[Indices, Array]:
    roadmap, space = mover.roadmap, mover.space
    start, target = roadmap.nodes[mover.own.start], roadmap.nodes[mover.own.target]
    at_first = float(np.hypot(*(start - other.motion[0, 1:])))
    at_last = float(np.hypot(*(target - other.motion[-1, 1:])))
    near = np.minimum([at_first, at_last], space.apart + other.radius) - ROUNDING_M
    radii = np.full(len(roadmap.nodes), space.wide(roadmap.longest, other.radius))
    np.minimum.at(radii, [mover.own.start, mover.own.target], near)
    return intervals.blocked_times(other.motion, roadmap.grid, radii)


def _joins(mover: Mover, fixed: Sequence[OtherRobot], follow: float) -> Array:
    """First and last time at which the preset can be joined at each node, (N, 2), s; see `intervals.join_time`."""
    own, roadmap, space = mover.own, mover.roadmap, mover.space
    times, places = own.preset_times, roadmap.nodes[own.preset]
    preset, clear = timed(times, places), mover.clear.copy()
    for other in fixed:
        clear &= free_pieces(preset, other.motion, _wished(space, other) - ROUNDING_M)
    stays = preset[-1:]
    in_the_end = np.array([np.hypot(*(places[-1] - other.motion[-1, 1:])) for other in fixed])
    held = all(
        distance(stays, other.motion, float(times[-1])) >= min(_wished(space, other), end) - ROUNDING_M
        for other, end in zip(fixed, in_the_end.tolist(), strict=True)
    )
    # the next time at which the preset is blocked, for each of its nodes
    blocked = np.append(np.where(clear, np.inf, times[:-1]), np.inf if held else times[-1])
    blocked = np.minimum.accumulate(blocked[::-1])[::-1]
    joins = np.tile([np.inf, -np.inf], (len(roadmap.nodes), 1))
    usable = own.usable & (blocked >= np.minimum(times + follow, times[-1]))
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
