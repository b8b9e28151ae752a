"""Gains and threshold are parameters of the Context: a change there acts, and the trace tells it."""

from dataclasses import replace

import pytest
from pydrake.systems.framework import Context
from sim.blocks.contexts import advanced, begun

from airground_drake.scenario.load import load
from airground_drake.sim.diagram import Model, build_model
from airground_drake.sim.simulation import read_back, simulate
from airground_drake.verify.judging import judge

SCENARIO = load("case_a", ["duration_s=1.0"])


def prepared() -> tuple[Model, Context]:
    model = build_model(SCENARIO, "d")
    return model, begun(model.diagram, SCENARIO.seed)


@pytest.mark.parametrize(("which", "gain"), [(0, "motion_gain_1_s"), (1, "formation_gain_1_s")])
def test_a_gain_that_is_changed_in_a_context_acts_there(which: int, gain: str) -> None:
    model, changed = prepared()
    controller = model.controllers[which]
    unchanged = changed.Clone()
    gains = controller.mutable_gains(controller.GetMyMutableContextFromRoot(changed))
    setattr(gains, gain, 0.5 * getattr(gains, gain))
    place = model.diagram.GetOutputPort("bodies")
    ends = [place.Eval(advanced(model.diagram, each, 2.0).get_context()) for each in (changed, unchanged)]
    assert (ends[0] != ends[1]).any()


@pytest.mark.parametrize(("which", "gain"), [(0, "intervention_gain_1_s"), (1, "avoidance_gain_1_s")])
@pytest.mark.parametrize("value", [-0.1, 20.5, float("nan")])
def test_a_gain_that_is_negative_or_too_high_is_refused_by_name(which: int, gain: str, value: float) -> None:
    model, context = prepared()
    controller = model.controllers[which]
    setattr(controller.mutable_gains(controller.GetMyMutableContextFromRoot(context)), gain, value)
    with pytest.raises(ValueError, match=rf"{gain} = {value} in the Context of .*; allowed: 0 to 20 1/s"):
        advanced(model.diagram, context, 0.1)


def test_what_the_controllers_ran_with_is_read_from_the_context_and_refutes_safe_hyp() -> None:
    model, context = prepared()
    trace = simulate(SCENARIO, "d")
    honest = read_back(model, context)
    assert {name: trace.meta[name] for name in honest} == honest
    assert [v.status for v in judge(trace, ["SAFE-HYP"])] == ["holds"]
    uav = model.controllers[1]
    uav.mutable_gains(uav.GetMyMutableContextFromRoot(context)).avoidance_gain_1_s = 2.9
    told = replace(trace, meta={**trace.meta, **read_back(model, context)})
    (verdict,) = judge(told, ["SAFE-HYP"])
    assert verdict.status == "refuted"
    assert [each["parameter"] for each in verdict.evidence["different_parameters"]] == ["gain_1_s"]


def test_the_threshold_in_a_context_is_the_one_that_triggers() -> None:
    scenario = load("case_a")
    model = build_model(scenario, "b")
    context = begun(model.diagram, scenario.seed)
    levels = model.trigger.mutable_levels(model.trigger.GetMyMutableContextFromRoot(context))
    levels.zeta_m, levels.release_m = 2.0, 1.0
    simulator = advanced(model.diagram, context, 15.0)
    status = model.diagram.GetOutputPort("status").Eval(simulator.get_context()).reshape(-1, 4)
    lower = load("case_a", ["decision.threshold.zeta_m=2.0", "decision.release_m=1.0"])
    triggers = [e["t_s"] for e in simulate(lower, "b").events if e["kind"] == "trigger"]
    assert status[:, 2].max() == triggers[-1] > triggers[0] == 0.0
    assert read_back(model, simulator.get_context())["zeta_m"] == 2.0


def test_a_threshold_that_no_trigger_can_have_is_refused() -> None:
    model, context = prepared()
    model.trigger.mutable_levels(model.trigger.GetMyMutableContextFromRoot(context)).zeta_m = -1.0
    with pytest.raises(ValueError, match="zeta > 0"):
        advanced(model.diagram, context, 1.0)
