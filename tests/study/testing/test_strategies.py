"""Every draw is a valid scenario, of every kind; failures shrink to the simplest scenario."""

from collections import Counter

import pytest
from hypothesis import find, given, settings
from hypothesis import strategies as st
from properties import examples

from airground_drake.base.registry import METHODS, POLICIES
from airground_drake.scenario.load import from_data, resolved
from airground_drake.scenario.schema import Control, Decision, Gatekeeper, Scenario
from airground_drake.scenario.shapes import convex_parts
from airground_drake.sim.simulation import simulate
from airground_drake.study.testing import assert_holds
from airground_drake.study.testing.strategies import PARAMETERS, policies, scenarios
from airground_drake.verify import judge

OF_OBSTACLES = (
    "polygon_m", "segment_m", "size_m", "radius_m", "height_m", "heading_rad", "distance_m", "appears_s",
)  # fmt: skip


@examples(15)
@given(
    scenarios(
        ugvs=st.integers(5, 12),
        obstacles=st.just(30),
        triggers=st.just("bare"),
        routes=st.just("nonlinear"),
        compositions=st.just("recursion_nearest"),
        policies=policies(["mine:Mine"]),
        shapes=st.sampled_from(["wall", "box"]),
    )
)
def test_given_strategies_are_used(scenario: Scenario) -> None:
    assert 5 <= len(scenario.ugvs) <= 12
    assert len(scenario.obstacles) == 30
    assert all(each.segment_m or each.size_m for each in scenario.obstacles.values())
    assert (scenario.decision.trigger, scenario.gatekeeper.route) == ("bare", "nonlinear")
    assert {run.composition for run in scenario.runs.values()} == {"recursion_nearest"}
    assert [policy.parameters for policy in scenario.intervention.policies] in ([], [{}])
    assert from_data(resolved(scenario), "drawn") == scenario


@examples(12)
@given(
    scenarios(
        ugvs=st.integers(1, 3), methods=st.sampled_from("da"), durations=st.just(4.0), moving=st.booleans(),
        obstacles=st.integers(1, 4),
    )
)  # fmt: skip
def test_robots_bring_themselves_too_near_to_nothing_that_moves(scenario: Scenario) -> None:
    assert from_data(resolved(scenario), "drawn") == scenario
    (run,) = scenario.runs
    if any(each.moves for each in scenario.obstacles.values()):
        assert [verdict.status for verdict in judge(simulate(scenario, run), ["SAFE-OWN"])] == ["holds"]


@pytest.mark.slow
def test_draws_are_valid_and_of_many_kinds() -> None:
    seen: Counter[str] = Counter()

    @examples(150)
    @given(scenarios(moving=st.booleans()))
    def draw(scenario: Scenario) -> None:
        assert from_data(resolved(scenario), "drawn") == scenario
        seen.update([f"method {next(iter(scenario.runs))}", f"threshold {scenario.decision.threshold.rule}"])
        seen.update(f"policy {policy.name}" for policy in scenario.intervention.policies)
        seen.update(f"known {obstacle.known_to_uav}" for obstacle in scenario.obstacles.values())
        seen.update(f"composition {run.composition}" for run in scenario.runs.values())
        seen.update(f"radius {ugv.radius_m}" for ugv in scenario.ugvs.values())
        seen.update(f"waypoints {len(ugv.preset.waypoints_m)}" for ugv in scenario.ugvs.values())
        seen.update(["arena"] if scenario.arena_m else [])
        for each in scenario.obstacles.values():
            seen.update(["post"] if each.height_m and not (each.polygon_m or each.segment_m or each.size_m) else [])
            seen.update(key for key in OF_OBSTACLES if getattr(each, key))
            seen.update([each.moves.at_end, "known motion" if each.known_motion else ""] if each.moves else [])
            seen.update(["broken promise"] if each.moves and each.expected_speed_m_s < each.moves.speed_m_s else [])
            seen.update(["concave"] if each.polygon_m and len(convex_parts(each) or ()) > 1 else [])

    draw()
    assert {f"method {name}" for name in METHODS} <= set(seen)
    assert {f"policy {name}" for name in PARAMETERS} <= set(seen)
    assert {name for name in seen if name.startswith("composition")} == {"composition augmented"}
    assert {"arena", "concave", "post", *OF_OBSTACLES} <= set(seen)
    assert {"stop", "reverse", "loop", "known motion", "broken promise"} <= set(seen)
    assert {"threshold fixed", "threshold bayes", "known True", "known False", "waypoints 4", "radius 0.5"} <= set(seen)


def test_every_policy_of_the_package_can_be_drawn() -> None:
    assert {*PARAMETERS, "agent"} == set(POLICIES.own)  # which proposes nothing without an environment


@pytest.mark.slow
def test_a_failure_shrinks_to_the_simplest_scenario() -> None:
    two = settings(database=None, max_examples=60)
    drawn = scenarios(ugvs=st.integers(1, 3), obstacles=st.integers(0, 1))
    least = find(drawn, lambda scenario: len(scenario.ugvs) >= 2, settings=two)
    assert list(least.runs) == ["d"]
    assert least.duration_s == 1.0
    assert (least.obstacles, least.arena_m) == ({}, [])
    assert least.intervention.policies == []
    assert len(least.ugvs) == 2
    assert [least.ugvs["ugv1"].start_m, least.ugvs["ugv1"].target_m] == [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]]
    assert (least.control, least.decision, least.gatekeeper) == (Control(), Decision(), Gatekeeper())


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::airground_drake.study.testing.NotExercisedWarning")
@settings(max_examples=3)
@given(scenarios(ugvs=st.integers(1, 2), methods=st.just("d"), policies=policies(("hostile",)), durations=st.just(3.0)))
def test_certified_runs_are_safe(scenario: Scenario) -> None:
    assert_holds(simulate(scenario, "d"), "SAFE-TRACE", "SAFE-HYP")
