"""The content of a resolved scenario: pairs and safe distances, presets, the trigger and its threshold."""

from __future__ import annotations

import math
from copy import deepcopy
from dataclasses import dataclass
from fractions import Fraction
from itertools import combinations, pairwise
from typing import Any, NamedTuple

import numpy as np

from .files import Json
from .plants import Taken, law_m, taken
from .rules import Array
from .shapes import POINT, Shape, shape_of

ENDLESS_M = 1e6  # height of the walls of an arena, m
PERIODS = 1e-9  # share of a time in control periods that counts as rounding


class Pair(NamedTuple):
    """A robot, and an obstacle or another robot."""

    robot: str  # name
    other: str  # name
    gap_m: float  # distance of the surfaces to be kept: d of the kind of pair
    radii_m: float  # sum of both radii
    closing_m_s: float  # largest speed at which they are expected to approach each other
    share: float  # part of the inequality that each robot takes: 1 beside an obstacle, 1/2 beside a robot
    shape: Shape = POINT  # of the other; for a UGV walls are endless in height
    # V, the speed at which an obstacle is expected to move at most; above 0 the passive law is in force.
    moves_m_s: float = 0.0
    more_m: float = 0.0  # distance that the law keeps beyond the safe one, between the points that it steers
    cover_m: float = 0.0  # sum of both bodies' distances from these points after a period
    drift_m: float = 0.0  # the part of `more_m` that makes up for missed commands
    slip_m: float = 0.0  # how much of its command the robot may miss in a period
    error_m: float = 0.0  # error bound of the measured relative position, on which the law acts
    asynchronous: bool = False  # whether each of two UGVs acts on an old position of the other
    halved: bool = False  # whether one of two robots may stand, so that the pair meets the law with half the gain
    # Time from the start during which the bodies themselves must be clear, because they follow earlier commands; None
    # if the steered points suffice.
    start_s: float | None = None

    @property
    def safe_m(self) -> float:
        """Distance to keep between the robot's centre and the other's shape, m."""
        return self.gap_m + self.radii_m

    @property
    def in_the_law(self) -> Pair:
        """This pair with the law's distance in place of d."""
        return self._replace(gap_m=self.gap_m + self.more_m) if self.more_m else self

    def passive(self, period_s: float) -> Pair:
        """This pair with d + V h in place of d; in the law errors of measured positions are left out."""
        return self._replace(gap_m=self.gap_m - self.error_m + self.moves_m_s * period_s)


class Levels(NamedTuple):
    """The trigger: it triggers at `zeta_m`, releases below `release_m`, and rests until `dwell_s` after a trigger."""

    zeta_m: float
    release_m: float
    dwell_s: float


@dataclass(frozen=True)
class Preset:
    """Preset trajectory: a polyline travelled at constant speed from t = 0, then held."""

    corners_m: Array
    length_m: Array  # of the way to each corner, (m,)
    speed_m_s: float  # constant

    @property
    def corner_s(self) -> Array:
        """Times at which the corners and the end are reached, (m - 1,); empty at standstill."""
        return self.length_m[1:] / self.speed_m_s if self.speed_m_s > 0.0 else np.empty(0)

    def position_m(self, t_s: Array) -> Array:
        """At times (K,): (K, 3)."""
        travelled = self.speed_m_s * np.asarray(t_s)
        return np.stack([np.interp(travelled, self.length_m, axis) for axis in self.corners_m.T], axis=-1)


def as_run(scenario: Json, name: str) -> Json:
    """The scenario with the values that a run sets by dotted key."""
    changed: Json = deepcopy(scenario)
    for key, value in scenario["runs"][name]["set"].items():
        *above, last = key.split(".")
        place: Any = changed
        for part in above:
            place = place[int(part) if isinstance(place, list) else part]
        place[last] = value
    return changed


def uavs_of(scenario: Json) -> dict[str, Json]:
    return scenario.get("uavs") or {scenario["uav"]["name"]: scenario["uav"]}


def robots_of(scenario: Json) -> dict[str, Json]:
    """Each robot's part of the scenario by name, the UGVs first."""
    return scenario["ugvs"] | uavs_of(scenario)


def barriers_of(scenario: Json) -> dict[str, Json]:
    """The obstacles, and the map and the walls of the arena as entries like theirs, by name."""
    barriers: dict[str, Json] = dict(scenario["obstacles"])
    keys = ("heading_rad", "radius_m", "distance_m", "appears_s", "disappears_s", "max_speed_m_s")
    numbers = dict.fromkeys(keys, 0.0) | {"moves": None}
    if scenario["map"] and scenario["map"]["cells"]["rectangles"]:
        barriers["map"] = numbers | scenario["map"]
    if not scenario["arena_m"]:
        return barriers
    (west, east), (south, north) = (sorted(axis) for axis in zip(*scenario["arena_m"], strict=True))
    around = [[west, south], [east, south], [east, north], [west, north], [west, south]]
    walls = zip(("south", "east", "north", "west"), pairwise(around), strict=True)
    wall = numbers | {"height_m": ENDLESS_M, "position_m": []}
    return barriers | {f"arena_{side}": wall | {"segment_m": [*corners]} for side, corners in walls}


def moving_of(scenario: Json) -> list[str]:
    return [name for name, body in scenario["obstacles"].items() if body["moves"]]


def places_of(scenario: Json, t_s: Array) -> dict[str, Array]:
    """Origins of the shapes of barriers at times (K,), (K, 3), m, by name; 0 for static ones."""
    period_s = float(scenario["control"]["period_s"])
    return {
        name: way_m(body["moves"], period_s, t_s) if body["moves"] else np.zeros((len(t_s), 3))
        for name, body in barriers_of(scenario).items()
    }


def way_m(moves: Json, period_s: float, t_s: Array) -> Array:
    """Positions of a moving obstacle, (K, 3), m; every leg takes a whole number of control periods."""
    there = np.array(moves["waypoints_m"], dtype=np.float64)
    back = {"stop": there[:0], "reverse": there[-2::-1], "loop": there[:1]}[moves["at_end"]]
    corners = np.concatenate([there, back])
    legs_s = np.linalg.norm(np.diff(corners, axis=0), axis=1) / moves["speed_m_s"]
    reached = np.append(0.0, np.cumsum(np.maximum(_whole(legs_s / period_s), 1.0)))
    since = np.maximum(t_s / period_s - _whole(moves["start_s"] / period_s), 0.0)
    since = since % reached[-1] if len(back) else since
    return np.stack([np.interp(since, reached, axis) for axis in corners.T], axis=-1)


def _whole(periods: Any) -> Any:
    return np.ceil(periods * (1.0 - PERIODS))


def expected_m_s(body: Json) -> float:
    """The largest expected speed of an obstacle, m/s."""
    return float(body["max_speed_m_s"] or (body["moves"]["speed_m_s"] if body["moves"] else 0.0))


def pairs_of(scenario: Json) -> list[Pair]:
    """Every robot with every obstacle, and every two robots once."""
    uavs, robots = uavs_of(scenario), robots_of(scenario)
    limit = {name: float(robot["max_speed_m_s"]) for name, robot in robots.items()}
    safe = {kind: float(distance) for kind, distance in scenario["safe_distance"].items()}
    beside_obstacles = []
    for name, body in barriers_of(scenario).items():
        speed = expected_m_s(body)
        gap_m = float(body["distance_m"] or (speed and safe["moving_m"]) or safe["obstacle_m"])
        for of, endless in ((scenario["ugvs"], True), (uavs, False)):
            shape = shape_of(body, endless=endless)
            beside_obstacles += [
                Pair(robot, name, gap_m, radii_m(robots[robot], body), limit[robot] + speed, 1.0, shape, speed)
                for robot in of
            ]
    beside_robots = []
    for first, second in combinations(robots, 2):
        kinds = {"uav" if name in uavs else "ugv" for name in (first, second)}
        gap_m = safe["air_ground_m" if len(kinds) == 2 else f"{kinds.pop()}_m"]
        radii = radii_m(robots[first], robots[second])
        beside_robots.append(Pair(first, second, gap_m, radii, limit[first] + limit[second], 0.5))
    room = {name: taken(robot, scenario["control"]) for name, robot in robots.items()}
    with_plants = [_with_plants(pair, room) for pair in beside_obstacles + beside_robots]
    error_m = float((scenario.get("sensing") or {}).get("position_error_m", 0.0))
    old, lossy = is_asynchronous(scenario), links_of(scenario)["loss"] > 0.0
    seen = [pair._replace(halved=pair.share < 1.0 and (error_m > 0.0 or (lossy and pair.robot in scenario["ugvs"])))
            for pair in with_plants]  # fmt: skip
    seen = [pair._replace(asynchronous=old and {pair.robot, pair.other} <= {*scenario["ugvs"]}) for pair in seen]
    gain = float(scenario["control"]["avoidance_gain_1_s"]) if has_own_views(scenario) else math.inf
    return [_as_seen(pair, error_m, max(limit[pair.robot], limit.get(pair.other, 0.0)) / gain)
            if error_m or pair.halved else pair for pair in seen]  # fmt: skip


def has_own_views(scenario: Json) -> bool:
    """Whether each robot measures the other robots, instead of all acting on published positions."""
    sensing = scenario.get("sensing") or {}
    return not sensing.get("shared", True) and float(sensing["position_error_m"]) > 0.0


def is_asynchronous(scenario: Json) -> bool:
    """Whether UGVs act on old positions of each other."""
    return bool(scenario["control"].get("law", "shared") == "asynchronous")


def links_of(scenario: Json) -> dict[str, float]:
    """Delay, s, and loss of positions between UGVs that share inequalities."""
    given = {} if is_asynchronous(scenario) else (scenario.get("channel") or {}).get("ugvs") or {}
    return {key: float(given.get(key, 0.0)) for key in ("delay_s", "loss")}


def _as_seen(pair: Pair, error_m: float, fastest: float) -> Pair:
    """A pair under position errors: the distance e + sqrt(m^2 + e^2), plus drift over the pair's gain."""
    # Of two robots one may stand: the pair then meets the law with half the gain, and a drift costs twice as much. If
    # each measures the other, their directions n and n' differ: |n - n'| <= 2 e / (sqrt(m^2 + e^2) - e).
    # fastest: the faster robot's speed limit over the gain, m; 0 with the same positions for both
    robots = 2 if pair.halved else 1
    error_m, drift_m = robots * error_m, robots * pair.drift_m
    kept = math.hypot(pair.safe_m + pair.more_m - pair.drift_m, error_m)
    drift_m += robots * fastest * 2.0 * error_m / (kept - error_m) if robots == 2 and fastest else 0.0
    law_m = error_m + kept + drift_m
    return pair._replace(more_m=law_m - pair.safe_m, drift_m=drift_m, error_m=error_m)


def _with_plants(pair: Pair, room: dict[str, Taken]) -> Pair:
    """A pair with the cost of its robots' plants."""
    own, other = room[pair.robot], room.get(pair.other)
    both = [plant for plant in (own, other) if plant]
    cover, drift = sum(plant.cover_m + plant.slip_m for plant in both), sum(plant.drift_m for plant in both)
    if not cover:
        return pair
    more = law_m(pair.safe_m, own, other, passive=pair.moves_m_s > 0.0) - pair.safe_m
    late = any(plant.lag_s or plant.delay_s for plant in both) or (own.drawn_m and not other)
    start_s = max(plant.delay_s for plant in both) if late and not pair.moves_m_s else None
    return pair._replace(more_m=more, cover_m=cover, drift_m=drift, slip_m=own.slip_m, start_s=start_s)


def radii_m(own: Json, other: Json) -> float:
    return float(own["radius_m"]) + float(other["radius_m"])


def preset_of(scenario: Json, ugv: str) -> Preset:
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
    """The threshold in force: the fixed one, the Bayes-optimal one, or the root of (19) as printed."""
    rule = scenario["decision"]["threshold"]
    if rule["rule"] == "fixed":
        return float(rule["zeta_m"])
    ratio_s = rule["c1_1_s"] / rule["c2"] if rule["rule"] == "printed" else rule["c2"] / rule["c1_1_s"]
    return root_m(rule["drift_m_s"], rule["noise_m_sqrt_s"], ratio_s)


def root_m(drift_m_s: float, noise_m_sqrt_s: float, ratio_s: float) -> float:
    """Root of noise^2/drift^2 (sinh u + u) = ratio, with u = 2 zeta drift / noise^2, by bisection: (19)."""
    level = ratio_s * (drift_m_s / noise_m_sqrt_s) ** 2
    low, high = 0.0, 1.0 + level
    for _ in range(200):
        middle = (low + high) / 2.0
        above = middle > 700.0 or math.sinh(middle) + middle > level
        low, high = (low, middle) if above else (middle, high)
    return high * noise_m_sqrt_s**2 / (2.0 * drift_m_s)


def written(value: float) -> Fraction:
    """A float as the decimal that it prints as, exactly: 0.1 is 1/10."""
    return Fraction(repr(float(value)))
