"""Both choices are predicted as the running controller drives them; which points count."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders.closed_loop import AVOIDANCE
from builders.problems import STALL_POSITION, case_a_proposal

from airground_drake.gatekeeper.problem import Horizon, predicted_problem
from airground_drake.gatekeeper.rollout import View, closed_loop
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.law import UgvLaw
from airground_drake.scenarios.load import load
from airground_drake.scenarios.world import make_world
from airground_drake.systems.components import make_presets
from airground_drake.systems.controllers import UgvController


@pytest.mark.parametrize("on_top", [True, False])
@pytest.mark.parametrize("selection", [np.eye(3), np.array([[0.0, 1.0, 0.0]])])
def test_prediction_is_the_running_controller(on_top: bool, selection: np.ndarray) -> None:
    """The rolled-out velocities are those of `UgvController`, step by step, under both choices."""
    scenario = load("case_a")[0]
    scene, law, proposal, _ = case_a_proposal()
    law = replace(law, intervention_on_top=on_top)
    proposal = replace(proposal, selection=selection)
    presets = make_presets(scenario)
    controller = UgvController(make_world(scenario), law)
    h = law.avoidance.period
    loop = closed_loop(scene, law, proposal, 60, 1)
    for accepted, predicted in zip((True, False), loop.constant_plans()[:2], strict=True):
        positions = np.array([STALL_POSITION, [-30.0, 0.0, 0.0], [-30.0, 0.0, 2.0]])
        for k in range(60):
            t = scene.t + k * h
            at = [presets[0].sample(np.array([t, t + h])), np.zeros((2, 3))]
            reference = np.array([rows[0] for rows in at])
            rate = np.array([(rows[1] - rows[0]) / h for rows in at])
            held = proposal.motion.sample(np.array([t, t + h]))
            step = Motion(np.array([t, t + h]), held)  # the rate that the sampled motion has over this step
            answer = [replace(proposal, motion=step) if accepted else None, None]
            velocity = controller.velocity(t, positions, reference, rate, answer)
            np.testing.assert_allclose(predicted[k], velocity[0], atol=1e-9)
            positions[0] += h * velocity[0]


@pytest.mark.parametrize(("max_speed", "kept"), [(3.0, 1), (0.9, 0)])
def test_points_are_kept_that_any_plan_might_reach(max_speed: float, kept: int) -> None:
    """A disc 1.5 m away, 1.5 s, and both constant plans at rest."""
    one, rest = np.ones(1), Motion(np.zeros(1), np.zeros((1, 3)))
    scene = View(0.0, np.zeros(3), rest, np.array([[3.5, 0.0, 0.0]]), np.zeros((1, 3)), 2 * one, one, max_speed)
    law = UgvLaw(AVOIDANCE, 2.0, 1.5, intervention_on_top=False)
    problem = predicted_problem(scene, law, Proposal("stay", 0.0, rest), Horizon(24, 1, 1.0, 200.0))
    assert len(problem.distances) == kept
