"""The pairs of bodies that must keep apart, by the scenario, and where they are during a run.

A distance that users see is the gap of a pair, beside the gap required: between surfaces, below 0 if the bodies
overlap. `least_gap` and `gap_over_time` are its only sources. The law keeps distances of centres, `Pair.safe_m`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.run.trace import Trace
from airground_drake.scenarios.plants import plant_of
from airground_drake.verify.engines.geometry import MERGE_S, apart_at_least, boxes_of, closest_approach, interpolate


class Pair(NamedTuple):
    """A robot, and an obstacle or another robot that it must keep away from.

    Attributes:
        first: the robot.
        second: the obstacle or other robot.
        required_m: gap to keep: the scenario's safe distance of the kind of pair.
        radii_m: sum of both radii.
        share: part of the avoidance inequality that each robot takes: all beside an obstacle, half beside a robot.
        reach_m: how far they can approach each other in one control period.
        row: from which on both are there.
    """

    first: str
    second: str
    required_m: float
    radii_m: float
    share: float
    reach_m: float
    row: int = 0

    @property
    def safe_m(self) -> float:
        """Distance of the centres that the law keeps, m."""
        return self.required_m + self.radii_m


class Gap(NamedTuple):
    """Where the gap of a pair was smallest.

    Attributes:
        pair: the two bodies.
        gap_m: distance of their surfaces; below 0 they overlap.
        margin_m: how much more that is than the gap required.
        t_s: when, the earliest time.
        row: row of the trace that ends the segment on which it was.
    """

    pair: Pair
    gap_m: float
    margin_m: float
    t_s: float
    row: int

    def at_appearance(self, t: Array) -> bool:
        """Whether it was smallest when the obstacle appeared; t: times of the rows, (T,), s."""
        return self.pair.row > 0 and self.t_s <= t[self.pair.row]


def pairs_of(trace: Trace) -> tuple[Pair, ...]:
    """All robot/obstacle and robot/robot pairs of a run, with the safe distances of its scenario.

    Obstacles that do not appear before the end are in none.

    Those of one robot come in the order in which its controller lists them: obstacles, then robots in array order.
    """
    return trace.derived("pairs", lambda: tuple(pair for pair in declared_pairs(trace) if pair.row < len(trace.t)))


def declared_pairs(trace: Trace) -> Iterator[Pair]:
    """The same with obstacles that do not appear before the end."""
    safe, uav, period = trace.scenario.safe_distance, trace.scenario.uav.name, trace.scenario.control.period_s
    radius = {name: body.radius_m for name, body in trace.scenario.bodies.items()}
    limit = {name: robot.max_speed_m_s for name, robot in trace.scenario.robots.items()}
    there = {name: trace.there_from(name) for name in trace.scenario.obstacles}
    for robot in trace.robots:
        for obstacle, row in there.items():
            radii = radius[robot] + radius[obstacle]
            yield Pair(robot, obstacle, safe.obstacle_m, radii, 1.0, limit[robot] * period, row)
    for robot, other in combinations(trace.robots, 2):
        apart = safe.air_ground_m if uav in (robot, other) else safe.ugv_m
        yield Pair(robot, other, apart, radius[robot] + radius[other], 0.5, (limit[robot] + limit[other]) * period)


def pair_of(trace: Trace, one: str, other: str) -> Pair:
    """The pair of two bodies, named in either order."""
    return pairs_of(trace)[numbers_of(trace)[frozenset((one, other))]]


def numbers_of(trace: Trace) -> dict[frozenset[str], int]:
    """The place of each pair in `pairs_of`, by the names of its bodies."""

    def numbered() -> dict[frozenset[str], int]:
        return {frozenset((pair.first, pair.second)): k for k, pair in enumerate(pairs_of(trace))}

    return trace.derived("numbers", numbered)


def least_gap(trace: Trace, pair: Pair) -> Gap:
    """The smallest gap of a pair over continuous time, exact if both move on straight lines, else a lower bound."""

    def found() -> Gap:
        places, off_m = places_of(trace), off_m_of(trace, pair.first) + off_m_of(trace, pair.second)
        both = places[pair.first], places[pair.second]
        first, second = (place[pair.row :] if place.ndim == 2 else place for place in both)
        nearest = closest_approach(trace.t[pair.row :], first, second, off_m)
        gap, margin = nearest.distance_m - pair.radii_m, nearest.distance_m - pair.safe_m
        return Gap(pair, gap, margin, nearest.t_s, nearest.row + pair.row)

    return trace.derived(("least gap", pair.first, pair.second), found)


def gap_over_time(trace: Trace, pair: Pair) -> Array:
    """The gap of a pair at the rows of a trace, (T,), m; NaN before an obstacle appears."""
    places = places_of(trace)
    apart: Array = np.linalg.norm(places[pair.first] - places[pair.second], axis=1)
    apart[: pair.row] = np.nan
    return apart - pair.radii_m


def apart_of(trace: Trace) -> Array:
    """A lower bound of the distance of the centres of each pair over the run, (P,), m, in the order of `pairs_of`.

    Obstacles count as there from the start on.
    """
    return trace.derived("apart", lambda: _apart_of(trace))


def _apart_of(trace: Trace) -> Array:
    places, pairs = places_of(trace), pairs_of(trace)
    number = {name: k for k, name in enumerate(places)}
    boxes = boxes_of(np.stack([np.broadcast_to(place, (len(trace.t), 3)) for place in places.values()]))
    first, second = np.array([[number[pair.first], number[pair.second]] for pair in pairs], dtype=np.intp).T
    off = np.array([off_m_of(trace, name) for name in places])
    return apart_at_least(boxes, first, second) - (off[first] + off[second])


def off_m_of(trace: Trace, name: str) -> float:
    """How far a body may be from the straight line between its positions at two rows, m."""
    if name not in trace.robots:
        return 0.0
    position = trace.position(name)
    return plant_of(trace.scenario.robots[name]).motion(position[:-1], position[1:], np.diff(trace.t)).off_m


def least_of(bounds: Array, most: int, value: Callable[[int], float]) -> list[int]:
    """Indices of the smallest of K values, in increasing order; few values have to be computed.

    Args:
        bounds: lower bounds of the values, (K,).
        most: how many indices are wanted.
        value: computes the k-th value. No wanted value is above the largest of any `most` values, so values with larger
            bounds are not computed.
    """
    if len(bounds) <= most:
        return list(range(len(bounds)))
    enough = max(value(int(k)) for k in np.argsort(bounds, kind="stable")[:most])
    return sorted(sorted(np.flatnonzero(bounds <= enough).tolist(), key=value)[:most])


def near_pairs(trace: Trace) -> tuple[Pair, ...]:
    """The pairs, in their order, that may come within sensing range: other pairs have no inequality."""

    def chosen() -> tuple[Pair, ...]:
        near = apart_of(trace) <= trace.scenario.control.sensing_range_m
        return tuple(pair for pair, is_near in zip(pairs_of(trace), near.tolist(), strict=True) if is_near)

    return trace.derived("near", chosen)


def around(trace: Trace, robot: str) -> list[tuple[str, Pair]]:
    """Bodies that may come within sensing range of a robot, by name, each with their pair."""

    def by_robot() -> dict[str, list[tuple[str, Pair]]]:
        found = {name: list[tuple[str, Pair]]() for name in trace.robots}
        for pair in near_pairs(trace):
            found[pair.first].append((pair.second, pair))
            if pair.second in found:
                found[pair.second].append((pair.first, pair))
        return found

    return trace.derived("around", by_robot)[robot]


def preset_of(trace: Trace, ugv: str) -> tuple[Array, float]:
    """Corners of a UGV's preset trajectory, (m, 3), m, and its speed along them, m/s."""
    preset = trace.scenario.ugvs[ugv].preset
    return np.asarray(preset.waypoints_m, dtype=np.float64), preset.speed_m_s


def places_of(trace: Trace) -> dict[str, Array]:
    """Positions by name, m: (T, 3) of a robot, (3,) of an obstacle, whether the UAV knows it or not."""

    def found() -> dict[str, Array]:
        obstacles = trace.scenario.obstacles
        at_rest = {name: np.asarray(o.position_m, dtype=np.float64) for name, o in obstacles.items()}
        return at_rest | {robot: trace.position(robot) for robot in trace.robots}

    return trace.derived("places", found)


def centres_of(trace: Trace) -> Array:
    """Centres of the obstacles, (m, 3), m."""
    return np.array([o.position_m for o in trace.scenario.obstacles.values()], dtype=np.float64).reshape(-1, 3)


def appears_of(trace: Trace) -> Array:
    """When each obstacle appears, (m,), s; inf: not before the end."""
    rows = [trace.there_from(name) for name in trace.scenario.obstacles]
    return np.array([trace.t[row] if row < len(trace.t) else np.inf for row in rows], dtype=np.float64)


def snapshot(trace: Trace, names: Iterable[str], t_s: float) -> dict[str, Any]:
    """Positions of the bodies among `names` at a time, and velocities of the robots among them just after it."""
    t = trace.t
    places = places_of(trace)
    wanted = set(names)
    row = min(int(np.searchsorted(t, t_s + MERGE_S)), len(t) - 1)
    fixed = {name: place.tolist() for name, place in places.items() if name in wanted and place.ndim == 1}
    moving = wanted.intersection(trace.robots)
    return {
        "positions_m": fixed | {name: interpolate(t, places[name], t_s).tolist() for name in sorted(moving)},
        "velocities_m_s": {name: trace.command(name)[row].tolist() for name in sorted(moving)},
    }


DISTANCE_TOLERANCE_M = 1e-9
"""A distance may be this much below the safe one, m: the controller steers *onto* the safe distance, and sums of
some thousand rounded steps err by 1e-12 m. The reported margin does not contain it."""
