"""SAFE-BUDGET: what the law keeps beyond the safe distance is what the theorems ask for, and no less."""

from typing import Any

import pytest

from airground_drake.scenario.load import load
from airground_drake.verify import judge_model
from airground_drake.verify.claims.safe_budget import SafeBudget

SCENARIOS = ("case_a_unicycle", "lagging", "turtlebots")


def inputs(scenario: str) -> dict[str, Any]:
    return SafeBudget().inputs(load(scenario))


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_shipped_scenario_meets_all_hypotheses(scenario: str) -> None:
    finding = SafeBudget().judge(inputs(scenario))
    assert finding.status == "proved"
    assert all(each.holds for each in finding.evidence["hypotheses"])
    assert len(finding.evidence["hypotheses"]) > len(load(scenario).ugvs)


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_a_law_that_keeps_a_micrometre_less_is_not_proved(scenario: str) -> None:
    for k in range(len(inputs(scenario)["pairs"])):
        given = inputs(scenario)
        given["pairs"][k]["law_m"] -= 1e-6
        finding = SafeBudget().judge(given)
        assert finding.status == "inconclusive"
        assert sum(not each.holds for each in finding.evidence["hypotheses"]) == 1


def test_a_unicycle_that_could_swing_round_in_a_period_is_not_proved() -> None:
    given = inputs("case_a_unicycle")
    given["robots"]["ugv1"]["plant"][0] |= {"hand_point_m": 0.07, "max_turn_rad_s": 0.0}
    assert "turn in a period" in [each.hypothesis for each in SafeBudget().hypotheses(given) if not each.holds]


def test_only_robots_that_turn_or_lag_have_a_budget() -> None:
    assert judge_model(load("case_a"), claims=["SAFE-BUDGET"]) == []
    assert len(judge_model(load("lagging"), claims=["SAFE-BUDGET"])) == 1
