"""What is not the paper's is declared under `choices`, and an override takes its reason away."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import pytest

from airground_drake.scenario.load import load
from airground_drake.scenario.schema import Scenario

CASES = ("case_a", "case_b", "case_a_table1")
TABLE_1: dict[str, Any] = {
    "ugvs.ugv1.start_m": [1.0, 0.5, 0.0],
    "ugvs.ugv2.start_m": [-1.0, 0.5, 0.0],
    "uav.start_m": [0.2, 1.0, 2.0],
    "ugvs.ugv1.target_m": [3.3, 13.0, 0.0],
    "ugvs.ugv2.target_m": [-1.0, 13.0, 0.0],
    "uav.target_m": [1.1, 13.0, 2.0],
    "uav.altitude_m": 2.0,
    "uav.task": "formation",
    "obstacles.obstacle_1.position_m": [1.7, 4.0, 0.0],
    "obstacles.obstacle_2.position_m": [4.0, 7.0, 0.0],
    "obstacles.obstacle_3.position_m": [-0.5, 5.0, 0.0],
    "obstacles.sudden.position_m": [5.5, 5.8, 0.0],  # section 5.2
    "ugvs.ugv1.preset.waypoints_m": [[3.3, 0.0, 0.0], [3.3, 13.0, 0.0]],
    "ugvs.ugv2.preset.waypoints_m": [[1.3, 0.0, 0.0], [1.3, 13.0, 0.0], [-1.0, 13.0, 0.0]],
    **{f"ugvs.ugv{k}.preset.speed_m_s": 1.0 for k in (1, 2)},
    **{f"obstacles.{name}.known_to_uav": True for name in ("obstacle_1", "obstacle_2", "obstacle_3", "sudden")},
    "safe_distance.obstacle_m": 2.0,
    "safe_distance.ugv_m": 2.0,
    "control.law": "shared",
    "control.avoidance_gain_1_s": 3.0,
    "control.motion_gain_1_s": 2.0,
    "control.formation_gain_1_s": 5.0,
    "control.intervention_gain_1_s": 1.5,
    "decision.threshold.rule": "fixed",
    "decision.threshold.zeta_m": 3.0,
    "decision.threshold.c1_1_s": 0.5,
    "decision.threshold.c2": 1.0,
    "gatekeeper.period_s": 0.05,
    "gatekeeper.horizon_s": 3.0,
    "gatekeeper.stages": 60,
}
"""What the paper gives, as we read its Table 1: points that drive at first order, without bodies, lags or motion."""
STUDY = {
    "name", "title", "description", "seed", "duration_s", "arrival_tolerance_m", "stall_tolerance_m", "runs", "claims",
    "expected", "reproduction", "choices", "uav.name",
}  # fmt: skip
"""What is simulated for how long, and how it is judged and named."""
EFFORT = {"solver", "budget", "budget_iterations", "budget_share", "budget_s"}
"""Limits of a computation's effort, and who computes."""


def leaves(value: Any, above: str = "") -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict) and value:
        for name, inner in value.items():
            yield from leaves(inner, f"{above}{name}.")
    else:
        yield above[:-1], value


def not_the_papers(scenario: Scenario) -> set[str]:
    """Keys whose values are not the paper's. A value such as 0 or [] says that something is not there."""
    given = leaves({key: value for key, value in asdict(scenario).items() if key not in STUDY})
    found = {key for key, value in given if value != TABLE_1.get(key) and (value or key in TABLE_1)}
    found = {key for key in found - STUDY if key.rpartition(".")[2] not in EFFORT}
    return found | {f"runs.{name}.composition" for name, run in scenario.runs.items() if run.composition == "augmented"}


@pytest.mark.parametrize("name", CASES)
def test_every_value_that_is_not_the_papers_is_declared_and_no_other(name: str) -> None:
    scenario = load(name)
    declared, different = {choice.key for choice in scenario.choices}, not_the_papers(scenario)
    undeclared = different - declared
    if any(key.startswith("runs.") for key in declared & different):  # the same for all runs
        undeclared = {key for key in undeclared if not key.startswith("runs.")}
    assert not undeclared
    assert declared - different <= {"runs.c_literal.set.gatekeeper.route"}


def test_an_override_takes_the_place_of_the_reason_for_a_value() -> None:
    speed, same = "ugvs.ugv1.preset.speed_m_s", "ugvs.ugv2.preset.speed_m_s"
    scenario = load("case_a", [f"{speed}=1.0", f"{same}=0.5606"])
    found = {choice.key: (choice.source, choice.reason) for choice in scenario.choices}
    assert found[speed] == ("set", "set by an override; the file has 0.5606")
    assert found[same][0] == "calibrated"
    own = {choice.key: choice for choice in load("case_a", [f"{speed}=1.0", "choices.0.reason=mine"]).choices}
    assert own["runs.a.composition"].reason == "mine"
    policies = {
        choice.key: choice for choice in load("case_a", ["intervention.policies.0.parameters.speed_m_s=2"]).choices
    }
    assert policies["intervention.policies"].source == "set"
    assert load("case_a", {"choices": []}).choices == []


def test_a_choice_about_what_an_override_removes_is_dropped() -> None:
    for name in CASES:
        scenario = load(name, ["runs={d: {method: d}}", "reproduction=[]"])
        kept = {choice.key for choice in scenario.choices}
        assert kept == {choice.key for choice in load(name).choices if not choice.key.startswith("runs.")}
