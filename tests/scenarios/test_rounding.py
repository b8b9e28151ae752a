"""Scenarios in which rounding could take more from a safe distance than SAFE-TRACE tolerates are refused."""

from __future__ import annotations

import re

import pytest

from airground_drake.base.errors import ScenarioError
from airground_drake.scenarios.load import load, validated
from airground_drake.scenarios.rounding import TOLERANCE_M, Rounding
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.runs.pairs import DISTANCE_TOLERANCE_M


def test_one_tolerance() -> None:
    """Claims about a run share no code with the scenario's side."""
    assert TOLERANCE_M == DISTANCE_TOLERANCE_M


def moved(scenario: Scenario, by: float) -> Scenario:
    for ugv in scenario.ugvs.values():
        for point in (ugv.start_m, ugv.target_m, *ugv.preset.waypoints_m):
            point[0] += by
    for place in (scenario.uav.start_m, scenario.uav.target_m, *(o.position_m for o in scenario.obstacles.values())):
        place[0] += by
    for run in scenario.runs.values():
        for stall in run.stalls_m.values():
            stall[0] += by
    return scenario


def rejected(scenario: Scenario) -> ScenarioError:
    with pytest.raises(ScenarioError) as caught:
        validated(scenario)
    return caught.value


def test_coordinates_far_away_are_refused_and_the_message_says_what_is_allowed(case_a: Scenario) -> None:
    text = str(rejected(moved(case_a, 1.6e7)))
    assert re.search(r"(start_m|target_m|position_m|waypoints_m\.\d+): \[", text)
    assert "1e-09 m" in text
    allowed = float(text.split("coordinates of at most ")[1].split(" m")[0])
    assert 1e3 < allowed < 1e4
    validated(moved(load("case_a")[0], allowed - 13.0))
    rejected(moved(load("case_a")[0], 1.001 * allowed))


@pytest.mark.parametrize(
    ("change", "key"),
    [({"duration_s": 1e5}, "duration_s"), ({"control.avoidance_gain_1_s": 1e-6}, "control.avoidance_gain_1_s")],
)
def test_what_is_to_blame_is_named_and_what_the_message_allows_is_allowed(change: dict[str, float], key: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        load("case_a", change)
    text = str(caught.value)
    assert f"{key}:" in text
    bound = float(re.findall(r"at (?:most|least) ([\d.e+-]+) ", text)[0])
    load("case_a", {key: bound})


def test_without_a_gain_no_extent_is_too_large() -> None:
    validated(moved(load("case_a", {"control.avoidance_gain_1_s": 0.0, "duration_s": 1e4})[0], 1e7))


def test_the_bound_on_rounding_grows_with_what_it_is_made_of() -> None:
    bound = Rounding(reach=5.0, closing=10.0, period=0.05, gain=3.0)
    assert bound.of_a_step(20.0, 60.0) > 1.5 * bound.of_a_step(20.0, 30.0)
    assert bound.of_a_step(40.0, 30.0) > bound.of_a_step(20.0, 30.0)
    assert bound._replace(gain=1.5).largest_extent(1.0) < bound.largest_extent(1.0)
    extent = bound.largest_extent(30.0)
    assert bound.of_a_step(extent, 30.0) / (3.0 * 0.05) == pytest.approx(TOLERANCE_M)
