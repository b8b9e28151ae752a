"""Both choices are predicted as the running controller drives them; which points count; how much is bent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders.closed_loop import AVOIDANCE, H, Instance
from builders.problems import STALL_POSITION, case_a_proposal
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.components import make_presets, make_team
from airground_drake.gatekeeper.prediction import Horizon, Scene, closed_loop, predicted_problem
from airground_drake.gatekeeper.problem import Problem
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.law import UgvLaw
from airground_drake.nsbc.motion import Motion
from airground_drake.scenarios.load import load
from airground_drake.systems.controllers import UgvController


@pytest.mark.parametrize("on_top", [True, False])
@pytest.mark.parametrize("selection", [np.eye(3), np.array([[0.0, 1.0, 0.0]])])
def test_prediction_is_the_running_controller(on_top: bool, selection: np.ndarray) -> None:
    """The rolled-out velocities are those of `UgvController`, step by step, under both choices."""
    scenario = load("case_a")[0]
    scene, law, proposal, _ = case_a_proposal()
    law = replace(law, intervention_on_top=on_top)
    proposal = replace(proposal, selection=selection)
    team, presets = make_team(scenario), make_presets(scenario)
    controller = UgvController(team, law)
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
    scene = Scene(0.0, np.zeros(3), rest, np.array([[3.5, 0.0, 0.0]]), np.zeros((1, 3)), 2 * one, one, max_speed)
    law = UgvLaw(AVOIDANCE, 2.0, 1.5, intervention_on_top=False)
    problem = predicted_problem(scene, law, Proposal("stay", 0.0, rest), Horizon(24, 1, 1.0, 200.0))
    assert len(problem.distances) == kept


def bend(case: Instance, problem: Problem) -> float:
    """`Problem.bend` from its formula, by the running controller's law with and without the inequalities."""
    loop = problem.loop
    assert loop is not None
    positions = np.vstack([loop.start, loop.positions(np.ones(problem.stages))])
    bent = wanted = 0.0
    for k in range(problem.stages):
        (at, rate), (way, pace) = case.preset.at(k * H), case.proposal.motion.at(k * H)
        own = (rate + 2.0 * (at - positions[k])) * [1, 1, 0]
        own *= min(1.0, 3.0 / max(np.linalg.norm(own), 1e-300))
        asked = (pace + 1.5 * (way - positions[k])) * [1, 1, 0]
        below = own + case.proposal.chosen @ (asked - own)
        below *= min(1.0, 3.0 / max(np.linalg.norm(below), 1e-300))
        bent += np.linalg.norm((positions[k + 1] - positions[k]) / H - below)
        wanted += np.linalg.norm(below)
    return float(bent / wanted)


@examples(60)
@given(st.integers(0, 10**6))
def test_bend_follows_its_formula(seed: int) -> None:
    case = Instance(seed)
    problem = case.problem(20)
    assert np.isfinite(problem.bend)
    assert problem.bend >= 0.0
    assert problem.bend == pytest.approx(bend(case, problem), rel=1e-6, abs=1e-9)


@given(st.integers(0, 10**6))
def test_nothing_bends_without_points_or_with_the_intervention_on_top(seed: int) -> None:
    free, on_top = Instance(seed), Instance(seed, on_top=True)
    nothing = free.scene.restrict(np.zeros(len(free.scene.distances), dtype=bool))
    assert predicted_problem(nothing, free.law, free.proposal, Horizon(20, 1, 1.0, 200.0)).bend == 0.0
    assert on_top.problem(20).bend == 0.0


def towards_a_disc(gap: float, target: float = 3.0, speed: float = 2.0) -> Problem:
    """A proposal straight along x, a disc of radius 2 m around (2 + gap, 0), the UGV at rest at the origin."""
    motion = Motion.at_speed(np.array([np.zeros(3), [target, 0.0, 0.0]]), speed)
    rest = Motion(np.zeros(1), np.zeros((1, 3)))
    one = np.ones(1)
    scene = Scene(0.0, np.zeros(3), rest, np.array([[2.0 + gap, 0.0, 0.0]]), np.zeros((1, 3)), 2 * one, one, 3.0)
    law = UgvLaw(AVOIDANCE, 2.0, 1.5, intervention_on_top=False)
    return predicted_problem(scene, law, Proposal("in", 0.0, motion), Horizon(48, 1, 1.0, 200.0))


def test_a_proposal_straight_into_a_disc_is_bent_as_far_as_it_is_blocked() -> None:
    assert towards_a_disc(0.0).bend == pytest.approx(1.0, abs=1e-9)  # no motion at all
    near, half_way, beyond = (towards_a_disc(gap).bend for gap in (0.3, 1.5, 3.1))
    assert 0.9 < near < 1.0
    assert 0.3 < half_way < near
    assert beyond < 1e-9
    assert towards_a_disc(-0.5).bend > 1.0  # inside the safe distance: it retreats against what is wanted


def test_nothing_wanted_is_not_bent() -> None:
    one, rest = np.ones(1), Motion(np.zeros(1), np.zeros((1, 3)))
    scene = Scene(0.0, np.zeros(3), rest, np.array([[2.5, 0.0, 0.0]]), np.zeros((1, 3)), 2 * one, one, 3.0)
    law = UgvLaw(AVOIDANCE, 2.0, 1.5, intervention_on_top=False)
    assert predicted_problem(scene, law, Proposal("stay", 0.0, rest), Horizon(8, 1, 1.0, 200.0)).bend == 0.0
