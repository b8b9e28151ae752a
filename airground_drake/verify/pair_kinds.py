"""Who must keep which distance from whom, read from the scenario alone.

SAFE-HYP compares the built controllers with the scenario.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import combinations, product
from typing import Any, NamedTuple

from airground_drake.base.exact import decimal
from airground_drake.model.plants.budget import AT_REST, Bounds, law_distance
from airground_drake.scenario.plants import bounds_of, plant_of
from airground_drake.scenario.schema import Control, Scenario, Uav, Ugv

# By kind of pair, the parts of an inequality that its two bodies take; an obstacle stands still and takes none.
KINDS = {"air_ground": "uav_ugv", "ugv": "ugv_ugv", "uav": "uav_uav"}  # by `Scenario.pair_of`, of two robots
SHARES = {"obstacle": (Fraction(1), Fraction(0)), **dict.fromkeys(KINDS.values(), (Fraction(1, 2),) * 2)}
MOVING = "moving"  # the kind of a robot beside an obstacle that may move: no theorem keeps its distance
# The kind of a pair with a body that is not where the law steers it: these theorems are about the steered points.
STEERED = "steered"


def kind_of(scenario: Scenario, first: str, second: str) -> str:
    """The kind of a pair of bodies, named in either order."""
    for name in (first, second):
        if name in scenario.barriers and scenario.barriers[name].expected_speed_m_s > 0.0:
            return MOVING
    robots = [scenario.robots[name] for name in (first, second) if name in scenario.robots]
    if any(plant_of(robot, scenario.control.period_s).signals for robot in robots):
        return STEERED
    if len(robots) < 2:
        return "obstacle"
    return KINDS[scenario.pair_of(first, second)]


class Apart(NamedTuple):
    """A robot, and a barrier or another robot that it must keep apart from, by name."""

    first: str  # the robot
    second: str
    kind: str  # one in `SHARES`, or `MOVING`
    required_m: float  # gap to keep between the surfaces
    radii_m: tuple[float, float]  # of the two bodies


def apart(scenario: Scenario) -> Iterator[Apart]:
    """Who must keep apart: robot by robot each barrier, and then each two robots."""
    safe = scenario.safe_distance
    robots = scenario.robots
    for (name, robot), (other, barrier) in product(robots.items(), scenario.barriers.items()):
        moves = barrier.expected_speed_m_s > 0.0
        required = barrier.distance_m or (moves and safe.moving_m) or safe.obstacle_m
        yield Apart(name, other, MOVING if moves else "obstacle", required, (robot.radius_m, barrier.radius_m))
    for name, other in combinations(robots, 2):
        pair = scenario.pair_of(name, other)
        radii = robots[name].radius_m, robots[other].radius_m
        yield Apart(name, other, KINDS[pair], getattr(safe, f"{pair}_m"), radii)


class PairKind(NamedTuple):
    """Pairs of one kind with the same distance in the law, m, and closing speed, m/s."""

    # That is the safe distance of a centre from the other's core, and more if a body is not where the law steers it.

    kind: str
    safe_m: Fraction
    closing_m_s: Fraction


def constants(scenario: Scenario) -> dict[str, Any]:
    """Constants of a scenario that the claims about avoidance are about, strict JSON."""
    control = scenario.control
    return {
        "avoidance_gain_1_s": control.avoidance_gain_1_s,
        "period_s": control.period_s,
        "sensing_range_m": control.sensing_range_m,
        "pairs": [
            {"kind": pair.kind, "distance_m": float(pair.safe_m), "closing_m_s": float(pair.closing_m_s)}
            for pair in _kinds(scenario)
        ],
    }


def kinds_of(inputs: dict[str, Any]) -> list[PairKind]:
    """The pairs among a claim's inputs, as the decimals that their numbers print as."""
    return [
        PairKind(pair["kind"], decimal(pair["distance_m"]), decimal(pair["closing_m_s"])) for pair in inputs["pairs"]
    ]


def _kinds(scenario: Scenario) -> Iterator[PairKind]:
    """The extreme pairs of each kind in `SHARES`: the hypotheses hold for all pairs if they hold for these."""
    # Kept are pairs that no other pair exceeds in both distance and speed, and the nearest pair.
    robots = {name: _Robot.of(robot, scenario.control, scenario.seen(name)) for name, robot in scenario.robots.items()}
    asked = {(pair.kind, robots[pair.first], robots.get(pair.second), *pair[3:]) for pair in apart(scenario)}
    pairs: dict[str, set[tuple[Fraction, Fraction]]] = {kind: set() for kind in SHARES}
    for kind, own, other, required, (_, radius) in asked:
        if kind in pairs:
            pairs[kind].add(own.beside(other, decimal(required) + (own.radius_m + decimal(radius))))
    for kind, both in pairs.items():
        kept: list[tuple[Fraction, Fraction]] = []
        for pair in sorted(both, reverse=True):
            if not kept or pair[1] > kept[-1][1]:
                kept.append(pair)
        if both:
            nearest = min(both, key=lambda pair: (pair[0], -pair[1]))
            kept += [nearest] if nearest not in kept else []
        yield from (PairKind(kind, *pair) for pair in kept)


class _Robot(NamedTuple):
    """Its radius, its speed limit, what its plant takes, and the gain of the law."""

    radius_m: Fraction
    speed_m_s: Fraction
    bounds: Bounds
    gain_1_s: float

    @classmethod
    def of(cls, robot: Ugv | Uav, control: Control, seen: dict[str, Any]) -> _Robot:
        bounds = bounds_of(robot, control.period_s, seen)
        return cls(decimal(robot.radius_m), decimal(robot.max_speed_m_s), bounds, control.avoidance_gain_1_s)

    def beside(self, other: _Robot | None, safe_m: Fraction) -> tuple[Fraction, Fraction]:
        """Distance in the law, m, and closing speed, m/s, beside another robot, or None, a set at rest."""
        if other is None:
            return self._in_the_law(safe_m, AT_REST), self.speed_m_s
        return self._in_the_law(safe_m, other.bounds), self.speed_m_s + other.speed_m_s

    def _in_the_law(self, safe_m: Fraction, other: Bounds) -> Fraction:
        """The safe distance and what the plants take, rounded to a float; exact if they take nothing."""
        if self.bounds.exact and other.exact:
            return safe_m
        return decimal(float(law_distance(float(safe_m), self.bounds, other, gain=self.gain_1_s)))
