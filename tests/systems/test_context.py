"""The state of a run is in its Context: copies of it and other simulators continue identically."""

from __future__ import annotations

from typing import Any

import pytest
from pydrake.common import RandomGenerator
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import Context, Diagram

from airground_drake.run.simulation import EVENT_ACCURACY
from airground_drake.scenarios.load import load
from airground_drake.systems.diagram import RECORDED, Model, build_model

HALF_S, END_S = 15.0, 18.0
"""Case A triggers at 14.48 s: at half time a proposal is being executed and watched."""


def begun(diagram: Diagram, seed: int) -> Context:
    context = diagram.CreateDefaultContext()
    diagram.SetRandomContext(context, RandomGenerator(seed))
    context.SetAccuracy(EVENT_ACCURACY)
    return context


def advanced(diagram: Diagram, context: Context, until: float) -> Simulator:
    simulator = Simulator(diagram, context)
    euler = SimulatorConfig(integration_scheme="explicit_euler", max_step_size=0.05, use_error_control=False)
    euler.start_time = context.get_time()  # else the Context is set to 0 s
    ApplySimulatorConfig(euler, simulator)
    simulator.Initialize()
    simulator.AdvanceTo(until)
    return simulator


def ends(model: Model, context: Context) -> list[Any]:
    """All recorded signals and all decisions."""
    signals = [model.diagram.GetOutputPort(name).Eval(context).tolist() for name in RECORDED]
    gatekeeper = model.gatekeeper
    assert gatekeeper is not None
    decided = gatekeeper.decisions(gatekeeper.GetMyContextFromRoot(context))
    return [*signals, [(d.t, d.robot, d.accepted, d.reason, d.proposal.number) for d in decided]]


@pytest.mark.parametrize("method", ["c", "d"])
def test_a_cloned_context_goes_on_identically(method: str) -> None:
    scenario = load("case_a")
    model = build_model(scenario, method)
    simulator = advanced(model.diagram, begun(model.diagram, scenario.seed), HALF_S)
    clone = simulator.get_context().Clone()
    simulator.AdvanceTo(END_S)
    first = ends(model, simulator.get_context())
    assert len(first[-1]) > 10
    second = advanced(model.diagram, clone, END_S)
    assert ends(model, second.get_context()) == first


def test_two_simulators_of_one_diagram_do_not_disturb_each_other() -> None:
    scenario = load("case_a")
    model = build_model(scenario, "d")
    simulators = [advanced(model.diagram, begun(model.diagram, seed), HALF_S) for seed in (scenario.seed, 7)]
    for until in (16.0, 17.0, END_S):
        for simulator in simulators:
            simulator.AdvanceTo(until)
    for simulator, seed in zip(simulators, (scenario.seed, 7), strict=True):
        alone = build_model(scenario, "d")
        expected = ends(alone, advanced(alone.diagram, begun(alone.diagram, seed), END_S).get_context())
        assert ends(model, simulator.get_context()) == expected
