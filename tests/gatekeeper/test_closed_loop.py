"""The closed loop under switching answers is the running controller's; which points count."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders.closed_loop import AVOIDANCE, FAR, H, Instance, run_controller
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, Integrator, Multiplexer, TrajectorySource

from airground_drake.gatekeeper.problem import Horizon, predicted_problem
from airground_drake.gatekeeper.rollout import View
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.messages import ACCEPT, REFUSE
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.law import UgvLaw
from airground_drake.systems import components


@pytest.mark.parametrize("on_top", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_switching_plans_are_those_of_the_running_controller_in_a_diagram(seed: int, on_top: bool) -> None:
    """UgvController and the plants under Drake's Simulator, the answers changed from stage to stage."""
    case = Instance(seed, on_top=on_top, obstacles=3, moving=False)
    builder = DiagramBuilder()
    controller = builder.AddNamedSystem("controller", case.controller)
    plant = builder.AddNamedSystem("plant", Integrator(6))
    others = builder.AddNamedSystem("uav", ConstantVectorSource(FAR))
    position = builder.AddNamedSystem("bodies", Multiplexer([6, 3]))
    builder.Connect(controller.GetOutputPort("command"), plant.get_input_port())
    builder.Connect(plant.get_output_port(), position.get_input_port(0))
    builder.Connect(others.get_output_port(), position.get_input_port(1))
    builder.Connect(position.get_output_port(), controller.GetInputPort("bodies"))
    reference = builder.AddNamedSystem(
        "reference",
        TrajectorySource(
            components.stack_presets([case.preset, Motion(np.zeros(1), case.other[None])]), output_derivative_order=1
        ),
    )
    builder.Connect(reference.get_output_port(), controller.GetInputPort("reference"))
    for name in ("proposals", "answers"):
        builder.ExportInput(controller.GetInputPort(name), name)
    built = builder.Build()
    simulator = Simulator(built)
    loop = case.loop(30)
    rng = np.random.default_rng(seed)
    for omega in (rng.integers(0, 2, 30), np.repeat(rng.integers(0, 2, 6), 5)):
        context = simulator.get_mutable_context()
        context.SetTime(0.0)
        plant.set_integral_value(plant.GetMyMutableContextFromRoot(context), np.concatenate([np.zeros(3), case.other]))
        proposals: Value[object] = Value(object())
        proposals.set_value((case.proposal, None))
        built.GetInputPort("proposals").FixValue(context, proposals)
        simulator.Initialize()
        driven = []
        for k, accepted in enumerate(omega):
            answer = [ACCEPT if accepted else REFUSE, case.proposal.number, REFUSE, -1.0]
            built.GetInputPort("answers").FixValue(context, answer)
            simulator.AdvanceTo((k + 1) * H)  # the update that is due at its end waits for the next answer
            driven.append(plant.get_output_port().Eval(plant.GetMyContextFromRoot(context))[:3])
        np.testing.assert_allclose(loop.positions(omega), driven, atol=1e-9)


@examples(40)
@given(st.integers(0, 10**6), st.booleans(), st.integers(1, 3))
def test_switching_plans_among_moving_robots_and_with_long_stages(seed: int, on_top: bool, substeps: int) -> None:
    case = Instance(seed, on_top=on_top)
    omega = np.random.default_rng(seed).integers(0, 2, 12)
    every = np.ones(len(case.scene.distances), dtype=bool)
    expected = run_controller(case, every, omega, substeps)
    np.testing.assert_allclose(case.loop(12, substeps).positions(omega), expected, atol=1e-9)


@examples(40)
@given(st.integers(0, 10**6), st.booleans(), st.integers(1, 3))
def test_the_constant_plans_are_those_of_the_mode_velocities(seed: int, on_top: bool, substeps: int) -> None:
    problem = Instance(seed, on_top=on_top).problem(12, substeps)
    assert problem.loop is not None
    for omega in (np.zeros(12), np.ones(12)):
        np.testing.assert_allclose(problem.loop.positions(omega), problem.positions(omega), atol=1e-12)
        by_velocities, rolled_out = problem.evaluate(omega), problem.evaluate_closed_loop(omega)
        assert rolled_out.objective == pytest.approx(by_velocities.objective, rel=1e-9, abs=1e-12)
        assert rolled_out.clearance == pytest.approx(by_velocities.clearance, abs=1e-9)


@pytest.mark.parametrize("omega", [np.ones(11), np.ones((12, 1)), np.full(12, 0.5), np.full(12, np.nan)])
def test_what_is_no_plan_is_an_error(omega: np.ndarray) -> None:
    problem = Instance(0).problem(12)
    with pytest.raises(ValueError, match="12 answers that are 0 or 1"):
        problem.evaluate_closed_loop(omega)
    with pytest.raises(ValueError, match="no closed loop"):
        replace(problem, loop=None).evaluate_closed_loop(np.ones(12))


@pytest.mark.parametrize(("max_speed", "kept"), [(3.0, 1), (0.9, 0)])
def test_points_are_kept_that_any_plan_might_reach(max_speed: float, kept: int) -> None:
    """A disc 1.5 m away, 1.5 s, and both constant plans at rest."""
    one, rest = np.ones(1), Motion(np.zeros(1), np.zeros((1, 3)))
    scene = View(0.0, np.zeros(3), rest, np.array([[3.5, 0.0, 0.0]]), np.zeros((1, 3)), 2 * one, one, max_speed)
    law = UgvLaw(AVOIDANCE, 2.0, 1.5, intervention_on_top=False)
    problem = predicted_problem(scene, law, Proposal("stay", 0.0, rest), Horizon(24, 1, 1.0, 200.0))
    assert len(problem.distances) == kept
