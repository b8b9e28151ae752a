"""Runs with bodies: radii are part of every distance that is kept, predicted or judged."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.misbuilt import neighbours

from airground_drake.base.arrays import Array
from airground_drake.gatekeeper.outcome_gatekeeper import OutcomeGatekeepers
from airground_drake.run.simulation import simulate
from airground_drake.run.trace import Trace
from airground_drake.scenarios.load import load, validated
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify import verify

ROCK, OWN, FLIER = 0.5, 0.25, 0.25
"""Radii, m, whose sums are exact."""


def scenario(*, points: bool = False) -> Scenario:
    """The minimal scenario with bodies, or with points that keep as much more."""
    found = load("minimal", ["duration_s=11"])[0]
    safe = found.safe_distance
    safe.obstacle_m, safe.air_ground_m, safe.ugv_m = 1.25, 0.75, 1.75
    found.ugvs["ugv1"].radius_m, found.uav.radius_m, found.obstacles["rock"].radius_m = OWN, FLIER, ROCK
    if points:
        safe.obstacle_m, safe.air_ground_m, safe.ugv_m = 1.25 + OWN + ROCK, 0.75 + OWN + FLIER, 1.75 + OWN
        found.ugvs["ugv1"].radius_m = found.uav.radius_m = found.obstacles["rock"].radius_m = 0.0
    return validated(found)


def statuses(trace: Trace) -> dict[str, str]:
    return {verdict.claim.id: verdict.finding.status for verdict in verify(trace)}


@pytest.fixture(scope="module")
def bodies() -> Trace:
    return simulate(scenario(), "d")


def test_bodies_move_as_points_that_keep_as_much_more(bodies: Trace) -> None:
    points = simulate(scenario(points=True), "d")
    assert bodies.signals.equals(points.signals)
    assert bodies.decisions.equals(points.decisions)
    assert bodies.events == points.events
    assert "accept" in set(bodies.decisions["decision"])
    for one, other in zip(verify(bodies), verify(points), strict=True):
        assert (one.finding.status, one.finding.margin) == (other.finding.status, other.finding.margin)
        assert one.finding.status in ("holds", "refuted" if one.claim.id == "LIVE-GOAL" else "holds")


@pytest.mark.parametrize(("kind", "name"), [("ugvs", "ugv1"), ("obstacles", "rock")])
def test_larger_bodies_were_too_near(bodies: Trace, kind: str, name: str) -> None:
    meta = deepcopy(bodies.meta)
    meta["scenario"][kind][name]["radius_m"] += 0.01
    found = statuses(replace(bodies, meta=meta))
    for claim in ("SAFE-TRACE", "SAFE-HYP", "EXEC", "GATE-MODEL"):
        assert found[claim] == "refuted", claim


def points_in_mind(self: OutcomeGatekeepers, *args: Any) -> tuple[Array, Array]:
    discs, distances = KNOWN(self, *args)
    return discs, np.full_like(distances, self._world.apart("ugv", "obstacle"))


KNOWN = OutcomeGatekeepers._known

FORGETFUL: dict[str, tuple[Callable[[pytest.MonkeyPatch], None], set[str]]] = {
    "an obstacle's radius": (
        neighbours(lambda near: near._replace(distance=near.distance - ROCK * (near.share == 1.0))),
        {"SAFE-TRACE", "SAFE-HYP", "EXEC", "GATE-MODEL"},
    ),
    "the other robot's radius": (
        neighbours(lambda near: near._replace(distance=near.distance - FLIER * (near.share == 0.5))),
        {"SAFE-TRACE", "SAFE-HYP", "EXEC"},
    ),
    "radii in the gatekeeper only": (
        lambda patch: patch.setattr(OutcomeGatekeepers, "_known", points_in_mind),
        {"GATE-MODEL"},
    ),
}


@pytest.mark.parametrize("name", FORGETFUL)
def test_running_code_that_forgets_radii_is_refuted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    edit, refuting = FORGETFUL[name]
    given = scenario()
    if name == "the other robot's radius":
        given.uav.start_m, given.uav.altitude_m, given.duration_s = [1.3, 0.0, 0.1], 1.3, 2.0  # the UGV is in its way
    if name == "radii in the gatekeeper only":  # a gap that is wide enough for points
        given.obstacles = {
            f"rock_{k}": replace(given.obstacles["rock"], position_m=[5.0, k - 1.5, 0.0]) for k in (0, 3)
        }
    edit(monkeypatch)
    found = {claim for claim, status in statuses(simulate(given, "d")).items() if status == "refuted"} - {"LIVE-GOAL"}
    assert refuting <= found
    if name == "radii in the gatekeeper only":
        assert not found & {"SAFE-TRACE", "SAFE-HYP", "EXEC"}
