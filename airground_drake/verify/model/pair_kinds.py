"""Who must keep which distance from whom, read from the scenario alone.

SAFE-HYP compares the built controllers with the scenario.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import combinations
from typing import Any, NamedTuple

from airground_drake.base.exact import decimal
from airground_drake.scenarios.schema import Scenario

SHARES = {"obstacle": (Fraction(1), Fraction(0)), "uav_ugv": (Fraction(1, 2),) * 2, "ugv_ugv": (Fraction(1, 2),) * 2}
"""By kind of pair, the parts of an inequality that its two bodies take; an obstacle stands still and takes none."""
THEOREMS = {
    "obstacle": ("Safety.safe_always", "Safety.obstacle"),
    "uav_ugv": ("Safety.safe_always",),
    "ugv_ugv": ("Safety.safe_always",),
}
"""By kind of pair, the theorems that prove its distance. A kind that is not here is never called proved."""
MOVING = "moving"
"""The kind of a robot beside an obstacle that may move: no theorem keeps its distance."""


def kind_of(scenario: Scenario, first: str, second: str) -> str:
    """The kind of a pair of bodies, named in either order."""
    for name in (first, second):
        if name in scenario.barriers:
            return MOVING if scenario.barriers[name].expected_speed_m_s > 0.0 else "obstacle"
    return "uav_ugv" if scenario.uav.name in (first, second) else "ugv_ugv"


class PairKind(NamedTuple):
    """Pairs of one kind with the same safe distance, m, of a centre from the other's core, and closing speed, m/s."""

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
    """The extreme pairs of each kind in `THEOREMS`: the hypotheses hold for all pairs if they hold for these.

    Kept are pairs that no other pair exceeds in both distance and speed, and the nearest pair.
    """
    safe = scenario.safe_distance
    ugvs = [_Robot(decimal(ugv.radius_m), decimal(ugv.max_speed_m_s)) for ugv in scenario.ugvs.values()]
    uav = _Robot(decimal(scenario.uav.radius_m), decimal(scenario.uav.max_speed_m_s))
    barriers = {(decimal(each.distance_m or safe.obstacle_m), decimal(each.radius_m)) for each in
                scenario.barriers.values() if not each.expected_speed_m_s}  # fmt: skip
    pairs: dict[str, set[tuple[Fraction, Fraction]]] = {
        "obstacle": {(d + (own.radius_m + r), own.speed_m_s) for own in {*ugvs, uav} for d, r in barriers},
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
    """Its radius and speed limit."""

    radius_m: Fraction
    speed_m_s: Fraction

    def beside(self, other: _Robot, apart_m: float) -> tuple[Fraction, Fraction]:
        """Safe distance of the centres, m, and closing speed, m/s; `apart_m` is the one between surfaces."""
        return decimal(apart_m) + self.radius_m + other.radius_m, self.speed_m_s + other.speed_m_s
