"""What rounding takes from a safe distance: accepted scenarios are proved, and others are told what is allowed."""

from __future__ import annotations

import math
import re

import pytest

from airground_drake.check.scenario import kinds_of, rounding_m
from airground_drake.errors import ScenarioError
from airground_drake.scenarios.load import load, resolved, shipped, validated
from airground_drake.scenarios.rounding import TOLERANCE_M
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.model.avoidance.conformance import rounding_leaves, rounding_margins
from airground_drake.verify.model.avoidance.constants import constants
from airground_drake.verify.model.avoidance.safe_inv import SafeInv
from airground_drake.verify.runs.pairs import DISTANCE_TOLERANCE_M


def test_one_tolerance() -> None:
    """Claims about a run share no code with the scenario's side."""
    assert TOLERANCE_M == DISTANCE_TOLERANCE_M


@pytest.mark.parametrize("name", shipped())
def test_the_independent_checker_has_the_same_bound(name: str) -> None:
    scenario = load(name)[0]
    ours = rounding_margins(constants(scenario))
    data = resolved(scenario)
    theirs = {kind.name: rounding_m(data, kind) for kind in kinds_of(data)}
    assert theirs == pytest.approx({key: each["margin_with_restoring_m"] for key, each in ours.items()}, rel=1e-12)


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


def test_what_is_accepted_is_proved_up_to_the_limit(case_a: Scenario) -> None:
    """The same formula on both sides: just inside a scenario is accepted and proved, just outside neither."""
    low, high = 0.0, 1e5
    for _ in range(40):
        middle = 0.5 * (low + high)
        try:
            validated(moved(load("case_a")[0], middle))
            low = middle
        except ScenarioError:
            high = middle
    inside, outside = moved(load("case_a")[0], low), moved(case_a, high * (1.0 + 1e-9))
    assert SafeInv().judge(SafeInv().inputs(inside)).status == "proved"
    _, left = rounding_leaves(rounding_margins(constants(outside)))
    assert left is not None
    assert -1e-15 < left < 0.0


def test_beyond_the_limit_nothing_is_proved(case_a: Scenario) -> None:
    """Were it accepted: the constants of a scenario far away, the diagram of the one at hand."""
    given = SafeInv().inputs(case_a) | {"extent_m": 1.6e7}
    finding = SafeInv().judge(given)
    assert finding.status == "inconclusive"
    assert finding.margin is not None
    assert finding.margin < 0.0
    assert "SAFE-TRACE" in finding.evidence["reason"]


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


def test_without_a_gain_no_extent_is_too_large_and_none_is_proved() -> None:
    scenario = load("case_a", {"control.avoidance_gain_1_s": 0.0, "duration_s": 1e4})[0]
    found = rounding_margins(constants(scenario))
    assert all(each["margin_with_restoring_m"] is None for each in found.values())
    assert all(math.isfinite(each["margin_of_a_step_m"]) for each in found.values())
    assert rounding_leaves(found)[1] is None


def test_the_bound_on_rounding_grows_with_what_it_is_made_of() -> None:
    def lost(**change: float) -> float:
        scenario = load("case_a", {key.replace("__", "."): value for key, value in change.items()})[0]
        return max(float(each["margin_with_restoring_m"]) for each in rounding_margins(constants(scenario)).values())

    assert lost(duration_s=60.0) > 1.5 * lost()
    assert lost(control__avoidance_gain_1_s=1.5) == pytest.approx(2.0 * lost())
    assert lost(uav__max_speed_m_s=20.0) > 1.5 * lost()
