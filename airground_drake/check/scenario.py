"""What a resolved scenario declares: pairs to keep apart, presets, the trigger and its threshold."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import numpy as np

from .files import Json
from .rules import Array


class Pair(NamedTuple):
    """A robot, and an obstacle or another robot.

    Attributes:
        robot: name.
        other: name.
        safe_m: safe distance of the centres: d of the kind of pair, and both radii.
        closing_m_s: largest speed at which they can approach each other.
        share: part of the inequality that each robot takes: 1 beside an obstacle, 1/2 beside a robot.
    """

    robot: str
    other: str
    safe_m: float
    closing_m_s: float
    share: float

    def turned(self) -> Pair:
        """The same pair, seen from the other robot."""
        return self._replace(robot=self.other, other=self.robot)


class Levels(NamedTuple):
    """The trigger: it triggers at `zeta_m`, releases below `release_m`, and rests until `dwell_s` after a trigger."""

    zeta_m: float
    release_m: float
    dwell_s: float


@dataclass(frozen=True)
class Preset:
    """Preset trajectory: a polyline travelled at constant speed from t = 0, then held.

    Attributes:
        corners_m: (m, 3).
        length_m: of the way to each corner, (m,).
        speed_m_s: constant.
    """

    corners_m: Array
    length_m: Array
    speed_m_s: float

    @property
    def corner_s(self) -> Array:
        """When corners are passed and the end is reached, (m - 1,); at standstill none is."""
        return self.length_m[1:] / self.speed_m_s if self.speed_m_s > 0.0 else np.empty(0)

    def position_m(self, t_s: Array) -> Array:
        """At times (K,): (K, 3)."""
        travelled = self.speed_m_s * np.asarray(t_s)
        return np.stack([np.interp(travelled, self.length_m, axis) for axis in self.corners_m.T], axis=-1)

    def rate_m_s(self, t_s: Array) -> Array:
        """Velocity at times (K,), none at a corner: (K, 3)."""
        legs, lengths = np.diff(self.corners_m, axis=0), np.diff(self.length_m)[:, None]
        along = np.divide(self.speed_m_s * legs, lengths, out=np.zeros_like(legs), where=lengths > 0.0)
        leg = np.searchsorted(self.corner_s, t_s) if len(self.corner_s) else np.full(len(t_s), len(legs))
        return np.asarray(np.append(along, np.zeros((1, 3)), axis=0)[leg])


def robots_of(scenario: Json) -> dict[str, Json]:
    """Each robot's part of the scenario by name, the UGVs first, the UAV last."""
    return {**scenario["ugvs"], scenario["uav"]["name"]: scenario["uav"]}


def pairs_of(scenario: Json) -> list[Pair]:
    """Every robot with every obstacle, and every two robots once."""
    uav, robots = scenario["uav"]["name"], robots_of(scenario)
    limit = {name: float(robot["max_speed_m_s"]) for name, robot in robots.items()}
    beside_obstacles = [
        Pair(robot, obstacle, apart_m(scenario, "obstacle_m", robots[robot], body), limit[robot], 1.0)
        for robot in robots
        for obstacle, body in scenario["obstacles"].items()
    ]
    beside_robots = []
    for one, other in combinations(robots, 2):
        safe = apart_m(scenario, "air_ground_m" if other == uav else "ugv_m", robots[one], robots[other])
        beside_robots.append(Pair(one, other, safe, _sum(limit[one], limit[other]), 0.5))
    return beside_obstacles + beside_robots


@lru_cache(maxsize=10_000)
def _sum(one: float, other: float) -> float:
    """Of two decimals as they are written: 1.1 and 2.2 make 3.3."""
    return float(Fraction(repr(one)) + Fraction(repr(other)))


def apart_m(scenario: Json, kind: str, one: Json, other: Json) -> float:
    """A distance of surfaces, of a kind of pair, as one of centres: with both radii."""
    return float(scenario["safe_distance"][kind]) + (float(one["radius_m"]) + float(other["radius_m"]))


def views_of(scenario: Json) -> dict[str, list[Pair]]:
    """The pairs as each robot sees them: obstacles, then the other robots, UGVs first, as recursion (5) lists them."""
    found: dict[str, list[Pair]] = {robot: [] for robot in robots_of(scenario)}
    for pair in pairs_of(scenario):
        found[pair.robot].append(pair)
        if pair.other in found:
            found[pair.other].append(pair.turned())
    return found


def preset_of(scenario: Json, ugv: str) -> Preset:
    """The preset trajectory of a UGV."""
    given = scenario["ugvs"][ugv]["preset"]
    corners = np.array(given["waypoints_m"], dtype=np.float64)
    legs = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    return Preset(corners, np.append(0.0, np.cumsum(legs)), given["speed_m_s"])


def levels_of(scenario: Json) -> Levels:
    """The trigger of a scenario; the paper's bare one releases at the threshold and never rests."""
    decision = scenario["decision"]
    zeta = threshold_m(scenario)
    if decision["trigger"] == "bare":
        return Levels(zeta, zeta, 0.0)
    return Levels(zeta, decision["release_m"], decision["min_inter_event_s"])


def threshold_m(scenario: Json) -> float:
    """The threshold in force: the fixed one, or the Bayes-optimal one."""
    rule = scenario["decision"]["threshold"]
    if rule["rule"] == "fixed":
        return float(rule["zeta_m"])
    return bayes_threshold_m(rule["drift_m_s"], rule["noise_m_sqrt_s"], rule["c2"] / rule["c1_1_s"])


def bayes_threshold_m(drift_m_s: float, noise_m_sqrt_s: float, ratio_s: float) -> float:
    """Root of noise^2/drift^2 (sinh u + u) = ratio, with u = 2 zeta drift / noise^2, by bisection: (19) with c2/c1."""
    level = ratio_s * (drift_m_s / noise_m_sqrt_s) ** 2
    low, high = 0.0, 1.0 + level
    for _ in range(200):
        middle = (low + high) / 2.0
        above = middle > 700.0 or math.sinh(middle) + middle > level
        low, high = (low, middle) if above else (middle, high)
    return high * noise_m_sqrt_s**2 / (2.0 * drift_m_s)


class Kind(NamedTuple):
    """A kind of pairs, of which the scenario has at least one, and the names of obligations."""

    name: str
    safe_m: float
    closing_m_s: float
    share: float


def rational(value: float) -> Fraction:
    """The decimal that a number prints as."""
    return Fraction(repr(float(value)))


def kinds_of(scenario: Json) -> list[Kind]:
    """The kinds of pairs of a scenario, in the order of the report.

    Of each those that no other pair has at as large a distance and as fast, from the largest distance on, and one at
    the least distance; numbered if that makes several.
    """
    pairs, uav, found = pairs_of(scenario), scenario["uav"]["name"], []
    for name in ("obstacle", "uav_ugv", "ugv_ugv"):
        share = 1.0 if name == "obstacle" else 0.5
        of_kind = {
            (pair.safe_m, pair.closing_m_s)
            for pair in pairs
            if pair.share == share and (share == 1.0 or (pair.other == uav) == (name == "uav_ugv"))
        }
        kept: list[tuple[float, float]] = []
        for safe, closing in sorted(of_kind, reverse=True):
            if not kept or closing > max(fast for _, fast in kept):
                kept.append((safe, closing))
        if kept and (nearest := min(of_kind, key=lambda each: (each[0], -each[1]))) not in kept:
            kept.append(nearest)
        names = [name] if len(kept) == 1 else [f"{name}_{k}" for k in range(1, len(kept) + 1)]
        found += [Kind(each, *values, share) for each, values in zip(names, kept, strict=True)]
    return found


def disturbance_m_s(scenario: Json) -> float:
    """The disturbance that SAFE-DIST is about: 10 % of the largest speed limit, at most A/4 of the least distance."""
    tenth = 0.1 * max(float(robot["max_speed_m_s"]) for robot in robots_of(scenario).values())
    least = min(kind.safe_m for kind in kinds_of(scenario))
    return min(tenth, scenario["control"]["avoidance_gain_1_s"] * least / 4.0)
