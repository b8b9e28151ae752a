"""A run with values of its own, `set`: simulated, judged and reported with them."""

from typing import Any

import pytest
from scenario.cases import SMALL_DATA, edit

from airground_drake.base.errors import ScenarioError
from airground_drake.report import document
from airground_drake.scenario.load import from_data
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.simulation import simulate
from airground_drake.verify import judge, judge_model


def with_run(settings: dict[str, float], expected: dict[str, str]) -> Scenario:
    run = {"method": "a", "set": settings, "expected": expected}
    return from_data(edit(edit(SMALL_DATA, "duration_s", 1), "runs.other", run), "small")


def test_a_run_is_simulated_judged_and_shown_with_what_it_sets() -> None:
    settings = {"decision.threshold.zeta_m": 2, "decision.noise_m_sqrt_s": 0.01}
    scenario = with_run(settings, {})
    trace = simulate(scenario, "other")
    assert trace.meta["zeta_m"] == trace.scenario.decision.threshold.zeta_m == 2.0
    assert trace.column("one.noise_m").any()
    assert not simulate(scenario, "d").column("one.noise_m").any()
    assert trace.meta["scenario"]["decision"]["threshold"]["zeta_m"] == 3.0
    (verdict,) = judge(trace, ["THR-TRIG"])
    assert verdict.status == "holds"
    shown: dict[str, Any] = document.build(scenario, {"other": trace}, [verdict], {})["runs"]["other"]
    assert shown["set"] == settings
    trace.meta["scenario"]["runs"]["other"]["set"]["decision.threshold.zeta_m"] = 2.5
    assert judge(trace, ["THR-TRIG"])[0].status == "error"  # another threshold


def test_only_the_runs_that_are_asked_for_are_checked() -> None:
    data = edit(SMALL_DATA, "runs.other", {"method": "a", "set": {"decision.threshold.zeta_m": -1}})
    with pytest.raises(ScenarioError, match="as run other sets it"):
        from_data(data, "small")
    assert [*from_data(data, "small", runs=["d"]).runs] == ["d"]
    with pytest.raises(ScenarioError, match="as run other sets it"):
        from_data(data, "small", runs=["d", "unknown"])


def test_claims_about_the_model_are_judged_for_a_run_that_changes_their_constants() -> None:
    scenario = with_run({"decision.threshold.zeta_m": 2}, {"THR-CHOICE": "exercised"})
    _, choice, other = judge_model(scenario, claims=["SAFE-INV", "THR-CHOICE"])
    assert [each.evidence["threshold_in_force_m"] for each in (choice, other)] == [3.0, 2.0]
    assert [(each.run, each.expected) for each in (choice, other)] == [("", "holds"), ("other", "exercised")]
    assert not other.as_expected  # it is declared
