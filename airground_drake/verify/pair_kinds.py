"""The pairs that must keep apart, and their distances, read from the scenario alone.

SAFE-HYP compares the built controllers with the scenario.
"""

from collections.abc import Iterator
from fractions import Fraction
from itertools import combinations, product
from typing import Any, NamedTuple

from airground_drake.base.exact import decimal
from airground_drake.model.plants.budget import AT_REST, law_distance
from airground_drake.scenario.plants import bounds_of, plant_of
from airground_drake.scenario.schema import Scenario

# By kind of pair, the parts of an inequality that its two bodies take; an obstacle stands still and takes none.
KINDS = {"air_ground": "uav_ugv", "ugv": "ugv_ugv", "uav": "uav_uav"}  # by `Scenario.pair_of`, of two robots
SHARES = {"obstacle": (Fraction(1), Fraction(0)), **dict.fromkeys(KINDS.values(), (Fraction(1, 2),) * 2)}
MOVING = "moving"  # the kind of a robot beside an obstacle that may move: no theorem keeps its distance
ASYNCHRONOUS = "asynchronous"  # the kind of two UGVs of which each acts on an old position of the other one
# The kind of a pair with a body that is not at its steered point: these theorems are about the steered points.
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
    return _of_robots(scenario, first, second)


def _of_robots(scenario: Scenario, first: str, second: str) -> str:
    pair = scenario.pair_of(first, second)
    return ASYNCHRONOUS if pair == "ugv" and scenario.asynchronous else KINDS[pair]


class Apart(NamedTuple):
    """A robot, and a barrier or another robot that it must avoid, by name."""

    first: str  # the robot
    second: str
    kind: str  # one in `SHARES`, `MOVING` or `ASYNCHRONOUS`
    required_m: float  # gap to keep between the surfaces
    radii_m: tuple[float, float]  # of the two bodies


def apart(scenario: Scenario) -> Iterator[Apart]:
    """All pairs: each robot with each barrier, then each two robots."""
    safe = scenario.safe_distance
    robots = scenario.robots
    for (name, robot), (other, barrier) in product(robots.items(), scenario.barriers.items()):
        moves = barrier.expected_speed_m_s > 0.0
        required = barrier.distance_m or (moves and safe.moving_m) or safe.obstacle_m
        yield Apart(name, other, MOVING if moves else "obstacle", required, (robot.radius_m, barrier.radius_m))
    for name, other in combinations(robots, 2):
        pair = scenario.pair_of(name, other)
        radii = robots[name].radius_m, robots[other].radius_m
        yield Apart(name, other, _of_robots(scenario, name, other), getattr(safe, f"{pair}_m"), radii)


class PairKind(NamedTuple):
    """Pairs of one kind with the same distance in the law, m, and closing speed, m/s."""

    # That is the safe distance of a centre from the other's core, and more if a body is not at its steered point.

    kind: str
    safe_m: Fraction
    closing_m_s: Fraction


def constants(scenario: Scenario) -> dict[str, Any]:
    """The scenario's constants for claims about avoidance, strict JSON."""
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
    """The pairs in a claim's inputs, with numbers as exact decimals."""
    return [
        PairKind(pair["kind"], decimal(pair["distance_m"]), decimal(pair["closing_m_s"])) for pair in inputs["pairs"]
    ]


def _kinds(scenario: Scenario) -> Iterator[PairKind]:
    """The extreme pairs of each kind in `SHARES`: the hypotheses hold for all pairs if they hold for these."""
    # Kept are pairs that no other pair exceeds in both distance and speed, and the nearest pair.
    control, robots = scenario.control, scenario.robots
    bounds = {name: bounds_of(robot, control.period_s, scenario.seen(name)) for name, robot in robots.items()}
    pairs: dict[str, set[tuple[Fraction, Fraction]]] = {kind: set() for kind in SHARES}
    asked = {(pair.kind, bounds[pair.first], bounds.get(pair.second, AT_REST), *pair[3:]) for pair in apart(scenario)}
    for kind, own, other, required, radii in asked:
        if kind in pairs:
            distance = decimal(required) + sum(map(decimal, radii), Fraction(0))
            if not (own.exact and other.exact):  # rounded to a float, with what the plants take
                law = law_distance(float(distance), own, other, gain=control.avoidance_gain_1_s)
                distance = decimal(float(law))
            pairs[kind].add((distance, decimal(own.speed_m_s) + decimal(other.speed_m_s)))
    for kind, both in pairs.items():
        kept: list[tuple[Fraction, Fraction]] = []
        for pair in sorted(both, reverse=True):
            if not kept or pair[1] > kept[-1][1]:
                kept.append(pair)
        if both:
            nearest = min(both, key=lambda pair: (pair[0], -pair[1]))
            kept += [nearest] if nearest not in kept else []
        yield from (PairKind(kind, *pair) for pair in kept)
