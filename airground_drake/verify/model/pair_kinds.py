"""Who must keep which distance from whom, read from the scenario alone.

SAFE-HYP compares the built controllers with the scenario.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import combinations
from typing import Any, NamedTuple

from airground_drake.base.exact import decimal
from airground_drake.scenario.schema import Control, Scenario, Uav, Ugv
from airground_drake.verify.engines.bodies import Room, law_m, room_of

# By kind of pair, the parts of an inequality that its two bodies take; an obstacle stands still and takes none.
SHARES = {"obstacle": (Fraction(1), Fraction(0)), "uav_ugv": (Fraction(1, 2),) * 2, "ugv_ugv": (Fraction(1, 2),) * 2}
MOVING = "moving"  # the kind of a robot beside an obstacle that may move: no theorem keeps its distance
# The kind of a pair with a body that is not where the law steers it: these theorems are about the steered points.
STEERED = "steered"


def kind_of(scenario: Scenario, first: str, second: str) -> str:
    """The kind of a pair of bodies, named in either order."""
    for name in (first, second):
        if name in scenario.barriers and scenario.barriers[name].expected_speed_m_s > 0.0:
            return MOVING
    robots = [scenario.robots[name] for name in (first, second) if name in scenario.robots]
    if any(plant.kind != "first_order" for robot in robots for plant in robot.plant):
        return STEERED
    if len(robots) < 2:
        return "obstacle"
    return "uav_ugv" if scenario.uav.name in (first, second) else "ugv_ugv"


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
            {"kind": each.kind, "distance_m": float(each.safe_m), "closing_m_s": float(each.closing_m_s)}
            for each in _kinds(scenario)
        ],
    }


def kinds_of(inputs: dict[str, Any]) -> list[PairKind]:
    """The pairs among a claim's inputs, as the decimals that their numbers print as."""
    return [
        PairKind(each["kind"], decimal(each["distance_m"]), decimal(each["closing_m_s"])) for each in inputs["pairs"]
    ]


def _kinds(scenario: Scenario) -> Iterator[PairKind]:
    """The extreme pairs of each kind in `SHARES`: the hypotheses hold for all pairs if they hold for these."""
    # Kept are pairs that no other pair exceeds in both distance and speed, and the nearest pair.
    safe, control = scenario.safe_distance, scenario.control
    ugvs = [_Robot.of(ugv, control) for ugv in scenario.ugvs.values()]
    uav = _Robot.of(scenario.uav, control)
    barriers = {(decimal(each.distance_m or safe.obstacle_m), decimal(each.radius_m)) for each in
                scenario.barriers.values() if not each.expected_speed_m_s}  # fmt: skip
    pairs: dict[str, set[tuple[Fraction, Fraction]]] = {
        "obstacle": {own.beside_a_set(d + (own.radius_m + r)) for own in {*ugvs, uav} for d, r in barriers},
        "uav_ugv": {uav.beside(ugv, safe.air_ground_m) for ugv in ugvs},
        "ugv_ugv": {one.beside(other, safe.ugv_m) for one, other in combinations(ugvs, 2)},
    }
    for kind, both in pairs.items():
        kept: list[tuple[Fraction, Fraction]] = []
        for each in sorted(both, reverse=True):
            if not kept or each[1] > kept[-1][1]:
                kept.append(each)
        if both:
            nearest = min(both, key=lambda each: (each[0], -each[1]))
            kept += [nearest] if nearest not in kept else []
        yield from (PairKind(kind, *each) for each in kept)


class _Robot(NamedTuple):
    """Its radius, its speed limit, and what its plant takes."""

    radius_m: Fraction
    speed_m_s: Fraction
    room: Room

    @classmethod
    def of(cls, robot: Ugv | Uav, control: Control) -> _Robot:
        return cls(decimal(robot.radius_m), decimal(robot.max_speed_m_s), room_of(robot, control))

    def beside(self, other: _Robot, apart_m: float) -> tuple[Fraction, Fraction]:
        """Distance in the law, m, and closing speed, m/s; `apart_m` is the safe one between surfaces."""
        safe = decimal(apart_m) + self.radius_m + other.radius_m
        return self._in_the_law(safe, other.room), self.speed_m_s + other.speed_m_s

    def beside_a_set(self, safe_m: Fraction) -> tuple[Fraction, Fraction]:
        """Distance in the law, m, and closing speed, m/s, beside an obstacle at rest; `safe_m` is from its core."""
        return self._in_the_law(safe_m, None), self.speed_m_s

    def _in_the_law(self, safe_m: Fraction, other: Room | None) -> Fraction:
        """The safe distance and what the plants take, rounded to a float; exact if they take nothing."""
        if self.room.is_nothing and (other is None or other.is_nothing):
            return safe_m
        return decimal(law_m(float(safe_m), self.room, other, passive=False))
