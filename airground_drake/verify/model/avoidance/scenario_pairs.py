"""Who must keep which distance from whom, from the scenario alone, and the inequalities that follow, in plain numpy.

Nothing here is taken from the code that is judged: neither `nsbc` nor the factories nor the diagram. `wiring.py`
compares the controllers of the built diagram with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import combinations, product
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial.distance import cdist

from airground_drake.arrays import Array
from airground_drake.scenarios.schema import Scenario

Inputs = dict[str, Any]

WHOLE, HALF = 1.0, 0.5
"""Share of an inequality: beside an obstacle, which stands still; of each robot of a pair."""


@dataclass(frozen=True)
class Kind:
    """A kind of pair: safe distance m, largest closing speed m/s, share of the inequality that each robot takes.

    Distances are those of centres, radii included.
    """

    name: str
    safe: float
    closing: float
    share: float


def team_of(scenario: Scenario) -> Inputs:
    """Names, obstacles m, safe distances m, speed limits m/s and radii m of a scenario, strict JSON."""
    safe, uav = scenario.safe_distance, scenario.uav
    return {
        "ugvs": list(scenario.ugvs),
        "uav": uav.name,
        "obstacles": [list(obstacle.position_m) for obstacle in scenario.obstacles.values()],
        "obstacle_distance": safe.obstacle_m,
        "ugv_distance": safe.ugv_m,
        "air_ground_distance": safe.air_ground_m,
        "max_speed": [*(ugv.max_speed_m_s for ugv in scenario.ugvs.values()), uav.max_speed_m_s],
        "radius": [*(ugv.radius_m for ugv in scenario.ugvs.values()), uav.radius_m],
        "obstacle_radius": [obstacle.radius_m for obstacle in scenario.obstacles.values()],
    }


def kinds_of(team: Inputs) -> list[Kind]:
    """The kinds of pairs in a team (`team_of`).

    With radii there are many distances of a kind. What matters are pairs than which no other one is as far apart and as
    fast, from the farthest on, and the nearest; they are numbered if that makes several.
    """
    found = []
    for name, values in _distances_and_speeds(team).items():
        kept: list[tuple[float, float]] = []
        for safe, closing in sorted(values, reverse=True):
            if not kept or closing > kept[-1][1]:
                kept.append((safe, closing))
        nearest = min(values, key=lambda each: (each[0], -each[1]))
        kept += [nearest] if nearest not in kept else []
        numbered = [f"{name}_{k}" for k in range(1, len(kept) + 1)] if len(kept) > 1 else [name]
        share = WHOLE if name == "obstacle" else HALF
        found += [Kind(each, *pair, share) for each, pair in zip(numbered, kept, strict=True)]
    return found


def as_points(team: Inputs) -> Inputs:
    """The team without bodies or obstacles, as far apart as the nearest pairs of each kind are."""
    least = {name: min(values)[0] for name, values in _distances_and_speeds(team).items()}
    keys = {"obstacle": "obstacle_distance", "uav_ugv": "air_ground_distance", "ugv_ugv": "ugv_distance"}
    bare = {"obstacles": [], "obstacle_radius": [], "radius": [0.0] * len(team["radius"])}
    return team | bare | {keys[name]: safe for name, safe in least.items()}


def _distances_and_speeds(team: Inputs) -> dict[str, set[tuple[float, float]]]:
    """Of each kind of pairs that there is, safe distances of centres, m, and closing speeds, m/s."""
    *ugvs, uav = zip(team["radius"], team["max_speed"], strict=True)
    obstacles = [(radius, 0.0) for radius in set(team["obstacle_radius"])]
    pairs = {
        "obstacle": (team["obstacle_distance"], product({*ugvs, uav}, obstacles)),
        "uav_ugv": (team["air_ground_distance"], product([uav], ugvs)),
        "ugv_ugv": (team["ugv_distance"], combinations(ugvs, 2)),
    }
    found = {name: {(d + (r + s), _sum(v, w)) for (r, v), (s, w) in both} for name, (d, both) in pairs.items()}
    return {name: values for name, values in found.items() if values}


def _sum(one: float, other: float) -> float:
    """Of two decimals: 1.1 + 2.2 is 3.3 here, and not a little more."""
    return float(Fraction(repr(float(one))) + Fraction(repr(float(other))))


class Inequalities(NamedTuple):
    """What each of n + 1 robots must obey, n.v >= b, of K views each: all that it senses, and some that it does not.

    Attributes:
        view: which view, (n + 1, K).
        distance: of centres, (n + 1, K), m.
        safe: the safe one, ditto.
        share: part of the inequality that the robot takes, (n + 1, K).
        normal: n, (n + 1, K, 3); z is 0 for a UGV.
        bound: b, (n + 1, K), m/s; -inf for what is not sensed.
    """

    view: npt.NDArray[np.intp]
    distance: Array
    safe: Array
    share: Array
    normal: Array
    bound: Array


@dataclass(frozen=True, eq=False)
class Views:
    """n UGVs and the UAV, the last: what each must keep away from, the m obstacles first, then the other robots.

    Attributes:
        ugvs: names.
        uav: name.
        obstacles: (m, 3), m.
        obstacle_distance: safe distance of every robot to every obstacle, surface to surface, m.
        ugv_distance: safe distance between UGVs, ditto.
        air_ground_distance: safe distance between the UAV and each UGV, ditto.
        max_speed: (n + 1,), m/s.
        radius: of the robots, (n + 1,), m.
        obstacle_radius: (m,), m.
    """

    ugvs: tuple[str, ...]
    uav: str
    obstacles: Array
    obstacle_distance: float
    ugv_distance: float
    air_ground_distance: float
    max_speed: Array
    radius: Array
    obstacle_radius: Array

    @classmethod
    def of(cls, team: Inputs, ugvs: int | None = None) -> Views:
        """Of a team (`team_of`), or of its first so many UGVs and the UAV."""
        count = len(team["ugvs"]) if ugvs is None else min(ugvs, len(team["ugvs"]))
        of_robots = {
            key: np.array([*team[key][:count], team[key][-1]], dtype=np.float64) for key in ("max_speed", "radius")
        }
        of_obstacles = {
            "obstacles": np.array(team["obstacles"], dtype=np.float64).reshape(-1, 3),
            "obstacle_radius": np.array(team["obstacle_radius"], dtype=np.float64),
        }
        return cls(**(team | of_robots | of_obstacles | {"ugvs": tuple(team["ugvs"][:count])}))

    @property
    def robots(self) -> tuple[str, ...]:
        """Names of all robots."""
        return (*self.ugvs, self.uav)

    @cached_property
    def mobility(self) -> Array:
        """(n + 1, 3): 1 where a robot can move; UGVs stay in their plane."""
        return np.array([[1.0, 1.0, 0.0]] * len(self.ugvs) + [[1.0, 1.0, 1.0]])

    @cached_property
    def others(self) -> npt.NDArray[np.intp]:
        """Indices of the robots other than each, (n + 1, n)."""
        robots = range(len(self.robots))
        return np.array([[j for j in robots if j != i] for i in robots], dtype=np.intp)

    @cached_property
    def points(self) -> npt.NDArray[np.intp]:
        """What each view is of: indices into the m obstacles and n + 1 robots, (n + 1, m + n)."""
        m = len(self.obstacles)
        return np.hstack([np.tile(np.arange(m), (len(self.robots), 1)), m + self.others])

    @cached_property
    def safe(self) -> Array:
        """Safe distances of centres, (n + 1, m + n), m."""
        n, own = len(self.ugvs), self.radius[:, None]
        with_uav = (self.others == n) | (np.arange(n + 1)[:, None] == n)
        of_kind = np.where(with_uav, self.air_ground_distance, self.ugv_distance)
        beside_obstacles = self.obstacle_distance + (own + self.obstacle_radius)
        return np.hstack([beside_obstacles, of_kind + (own + self.radius[self.others])])

    def apart(self, robot: int, other: int) -> float:
        """Safe distance of the centres of a robot and another one, or obstacle -1 - other, m."""
        view = -1 - other if other < 0 else len(self.obstacles) + other - (other > robot)
        return float(self.safe[robot, view])

    @cached_property
    def share(self) -> Array:
        """Part of each inequality that the robot takes, (n + 1, m + n)."""
        return np.where(np.arange(self.safe.shape[1]) < len(self.obstacles), WHOLE, HALF) * np.ones_like(self.safe)

    def centres(self, positions: Array) -> Array:
        """Where what each robot avoids is when the robots are at positions (n + 1, 3): (n + 1, m + n, 3), m."""
        return np.vstack([self.obstacles, positions])[self.points]

    def distances(self, positions: Array) -> Array:
        """Distances of centres when the robots are at positions (n + 1, 3): (n + 1, m + n), m."""
        return np.take_along_axis(cdist(positions, np.vstack([self.obstacles, positions])), self.points, axis=1)

    def inequalities(self, positions: Array, gain: float, period: float, reach: float) -> Inequalities:
        """What every velocity must satisfy when the robots are at positions (n + 1, 3), m, and sense to `reach`, m."""
        beyond = self.distances(positions) > reach * (1.0 + 1e-9)
        most = max(1, int((~beyond).sum(axis=1).max()))
        view = np.argsort(beyond, axis=1, kind="stable")[:, :most]
        safe, share = (np.take_along_axis(each, view, axis=1) for each in (self.safe, self.share))
        points = np.take_along_axis(self.points, view, axis=1)
        offset = positions[:, None] - np.vstack([self.obstacles, positions])[points]
        distance = np.sqrt((offset**2).sum(axis=-1))
        normal = offset / np.where(distance > 0.0, distance, 1.0)[..., None] * self.mobility[:, None]
        rate = np.where(distance <= safe, gain, 1.0 / period)
        bound = np.where(distance <= reach, share * rate * (safe - distance), -np.inf)
        return Inequalities(view, distance, safe, share, normal, bound)

    def name_of(self, robot: int, view: int) -> str:
        """What a robot avoids: a robot's name, or `obstacle` and its number in the scenario's order."""
        m = len(self.obstacles)
        return f"obstacle {view}" if view < m else self.robots[self.others[robot, view - m]]

    @cached_property
    def kinds(self) -> npt.NDArray[np.str_]:
        """Name of each view's kind of pair, without the number that `kinds_of` may give it: (n + 1, m + n)."""
        m, n = len(self.obstacles), len(self.ugvs)
        with_uav = (self.points == m + n) | (np.arange(n + 1)[:, None] == n)
        return np.where(self.points < m, "obstacle", np.where(with_uav, "uav_ugv", "ugv_ugv"))
