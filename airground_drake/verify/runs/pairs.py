"""The pairs of a run that are to be kept apart, and where they are."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from airground_drake.arrays import Array
from airground_drake.trace import Trace
from airground_drake.verify.engines.segments import MERGE_S, interpolate


class Pair(NamedTuple):
    """Two things to keep apart: a robot, and an obstacle or robot; `share` is the part that each robot takes.

    `safe_m` is the safe distance between centres: that of the kind of pair and both radii.
    """

    first: str
    second: str
    safe_m: float
    share: float


def pairs_of(trace: Trace) -> Iterator[Pair]:
    """All robot/obstacle and robot/robot pairs of a run, with the safe distances of its scenario.

    Those of one robot come in the order in which its controller lists them: obstacles, then robots in array order.
    """
    safe, uav, radius = trace.scenario["safe_distance"], trace.scenario["uav"]["name"], radii_of(trace)
    for robot in trace.robots:
        for obstacle in trace.scenario["obstacles"]:
            yield Pair(robot, obstacle, safe["obstacle_m"] + (radius[robot] + radius[obstacle]), 1.0)
    for robot, other in combinations(trace.robots, 2):
        kind = "air_ground_m" if uav in (robot, other) else "ugv_m"
        yield Pair(robot, other, safe[kind] + (radius[robot] + radius[other]), 0.5)


def radii_of(trace: Trace) -> dict[str, float]:
    """Radius of each robot and obstacle, m."""
    robots = {**trace.scenario["ugvs"], trace.scenario["uav"]["name"]: trace.scenario["uav"]}
    return {name: float(body["radius_m"]) for name, body in {**robots, **trace.scenario["obstacles"]}.items()}


def speed_limits(trace: Trace) -> dict[str, float]:
    """Maximum speed of each robot, m/s."""
    robots = {**trace.scenario["ugvs"], trace.scenario["uav"]["name"]: trace.scenario["uav"]}
    return {name: float(robot["max_speed_m_s"]) for name, robot in robots.items()}


def reach_m(trace: Trace, pair: Pair) -> float:
    """By how much a pair can come closer to each other in one control period, m."""
    limits = speed_limits(trace)
    closing = limits[pair.first] + limits.get(pair.second, 0.0)
    return closing * float(trace.scenario["control"]["period_s"])


def places_of(trace: Trace) -> dict[str, Array]:
    """Positions by name, m: (T, 3) of a robot, (3,) of an obstacle, whether the UAV knows it or not."""
    obstacles = trace.scenario["obstacles"]
    at_rest = {name: np.asarray(o["position_m"], dtype=np.float64) for name, o in obstacles.items()}
    return at_rest | {robot: trace.position(robot) for robot in trace.robots}


def snapshot(trace: Trace, names: Iterable[str], t_s: float) -> dict[str, Any]:
    """Positions at a time, and velocities of the robots just after it, of those of `names` that are things."""
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


def slack_of(offset: Array, velocity: Array, pair: Pair, control: dict[str, Any], *, planar: bool) -> Array:
    """n.v minus its bound for one pair at S samples, (S,), m/s; +inf out of sensing range.

    Args:
        offset: from the other to the robot, (S, 3), m; n is its direction.
        velocity: of the robot, (S, 3), m/s.
        pair: safe distance and share.
        control: gain A, period h and sensing range of the scenario.
        planar: whether the robot cannot use the z component of n.
    """
    distance = np.sqrt((offset**2).sum(axis=1))
    normal = np.divide(offset, distance[:, None], out=np.zeros_like(offset), where=distance[:, None] > 0.0)
    if planar:
        normal[:, 2] = 0.0
    excess = distance - pair.safe_m
    bound = -pair.share * np.where(excess <= 0.0, control["avoidance_gain_1_s"], 1.0 / control["period_s"]) * excess
    slack = (normal * velocity).sum(axis=1) - bound
    return np.where(distance <= control["sensing_range_m"], slack, np.inf)
