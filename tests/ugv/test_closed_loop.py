"""Roll-outs of the closed loop: the running controller's law, the plant's step, the points that count."""

from dataclasses import replace

import numpy as np
import pytest
from builders.problems import LAW, view
from builders.worlds import world
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.model.geometry.motion import Motion
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.sim.blocks.controllers import UgvController
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.problem import Horizon, predicted_problem
from airground_drake.ugv.rollout import closed_loop, follow

H = 0.0625
"""Control period, s: a binary fraction, so that vertices of motions can lie exactly on control samples."""
FAR = np.array([-30.0, 0.0, 2.0])


@examples(60)
@given(st.integers(0, 10**6), st.booleans(), st.integers(1, 3))
def test_plans_are_those_of_the_running_controller(seed: int, on_top: bool, substeps: int) -> None:
    """A UGV among discs, with another one passing: its controller and its plant step by step, answers changing.

    The constant plans are those of the problem's mode velocities.
    """
    rng = np.random.default_rng(seed)
    law = UgvLaw(Avoidance(3.0, H, 4.0), 2.0, 1.5, on_top)
    angle = rng.uniform(-np.pi, np.pi, int(rng.integers(0, 5)))
    discs = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]) * rng.uniform(2.1, 3.5, (len(angle), 1))
    other, drift = (np.array([*rng.uniform(*range_m, 2), 0.0]) for range_m in ((2.0, 3.0), (-2.0, 0.5)))

    def travel(vertices: int, speed: float) -> Motion:
        times = np.concatenate([[-1.0], np.sort(rng.choice(np.arange(1, 64), vertices - 1, replace=False)) * H])
        steps = rng.normal(size=(vertices, 3)) * [1, 1, 0]
        steps *= speed * np.diff(times, prepend=-1.0)[:, None] / np.linalg.norm(steps, axis=1)[:, None]
        return Motion(times, np.cumsum(steps, axis=0))

    preset = travel(2, 0.8)
    selection = np.eye(3) if rng.random() < 0.7 else np.array([[rng.normal(), rng.normal(), 0.0]])
    proposal = Proposal("way", 0.0, travel(4, 2.8), selection)
    team = world(("ugv1", "ugv2"), discs, 2.0, 1.0, 1.0, max_speed=[3.0, 3.0, 9.0])
    near, controller = team.around(slice(0, 1)), UgvController(team, law)
    places, moving = np.vstack([other, FAR]), np.vstack([drift, np.zeros(3)])
    seen = view(np.zeros(3), preset, discs, 2.0, 3.0, places=places, velocities=moving)
    seen = replace(seen, distances=near.distance[0], shares=near.share[0])
    answers = rng.integers(0, 2, 12)
    position, ends = np.zeros(3), []
    for k in range(12 * substeps):
        at, rate = preset.at(k * H)
        passing = other + k * H * drift
        command = controller.velocity(
            k * H, np.array([position, passing, FAR]), np.array([at, passing]), np.array([rate, np.zeros(3)]),
            [proposal if answers[k // substeps] else None, None],
        )  # fmt: skip
        position = position + H * command[0]
        if (k + 1) % substeps == 0:
            ends.append(position)
    after = H * np.arange(0.0, 12 * substeps + 1.0)
    loop = closed_loop(seen, law, proposal, after, places + after[:, None, None] * moving, substeps)
    np.testing.assert_allclose(follow(loop, answers)[0], ends, atol=1e-9)
    problem = predicted_problem(seen, law, proposal, Horizon(12, substeps, 1.0, 200.0))
    for mode in (0, 1):
        constant, _ = follow(loop, np.full(12, mode))
        np.testing.assert_allclose(constant, problem.positions(np.full(12, float(mode))), atol=1e-12)


@pytest.mark.parametrize(("max_speed", "kept"), [(3.0, 1), (0.9, 0)])
def test_points_are_kept_that_any_plan_might_reach(max_speed: float, kept: int) -> None:
    """A disc 1.5 m away, 1.5 s, and both constant plans at rest."""
    rest, centres, nobody = Motion(np.zeros(1), np.zeros((1, 3))), np.array([[3.5, 0.0, 0.0]]), np.empty((0, 3))
    for velocity in (0.0, np.nan):  # NaN is kept, so that the problem is refused
        moving = {"places": centres, "velocities": np.full((1, 3), velocity), "share": 1.0}
        scene = view(np.zeros(3), rest, nobody, 2.0, max_speed, **moving)
        problem = predicted_problem(scene, LAW, Proposal("stay", 0.0, rest), Horizon(30, 1, 1.0, 200.0))
        assert len(problem.distances) == (kept if velocity == 0.0 else 1)
        assert problem.is_finite() == (velocity == 0.0)


SPEED, LIMIT = 0.8, 3.0
"""Of the preset trajectory, and of the UGV, m/s."""


@given(st.floats(0.01, 20.0), st.floats(-np.pi, np.pi))
def test_the_terminal_cost_bounds_the_tail_of_25_under_the_own_task(error: float, angle: float) -> None:
    """1 / (2 B) up to the error at which the speed limit binds; beyond it more (docs/theory.md)."""
    preset = Motion.at_speed(np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0]]), SPEED, start=0.0)
    start = preset.at(1.0)[0] + error * np.array([np.cos(angle), np.sin(angle), 0.0])
    scene = view(start, preset, np.empty((0, 3)), 2.0, LIMIT, t=1.0)
    problem = predicted_problem(scene, LAW, Proposal("none", 1.0, preset), Horizon(400, 1, 1.0, 1.0))
    gain, closing = LAW.motion_gain, LIMIT - SPEED
    weight = 1.0 / (2.0 * gain)
    if gain * error > closing:
        weight = error / (3.0 * closing) + closing**2 / (6.0 * gain**3 * error**2)
    assert problem.evaluate(np.zeros(400)).objective <= weight * error**2 * (1.0 + 1e-9)
