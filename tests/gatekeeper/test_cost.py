"""Cost (25) with (26d), exact and along half-planes, against the formulas."""

from __future__ import annotations

import numpy as np
import pytest
from builders.problems import LAW, random_problem
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airground_drake.gatekeeper.problem import Horizon, predicted_problem
from airground_drake.gatekeeper.relaxation import normals_along
from airground_drake.gatekeeper.rollout import View
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.policy import Proposal


@given(st.integers(0, 10**6), arrays(np.float64, 20, elements=st.floats(0.0, 1.0)))
def test_costs_follow_25(seed: int, omega: np.ndarray) -> None:
    problem = random_problem(seed, 20)
    positions = problem.initial + problem.dt * np.cumsum(
        omega[:, None] * problem.accept + (1 - omega[:, None]) * problem.refuse, axis=0
    )
    distance = np.linalg.norm(positions[:, None] - problem.centres, axis=2) - problem.distances
    slack = np.maximum(0.0, -distance.min(axis=1))
    error = ((problem.reference - positions) ** 2).sum(axis=1)
    cost = problem.dt * (error.sum() + 200.0 * (slack**2).sum()) + problem.terminal_weight * error[-1]
    ours = problem.evaluate(omega)
    assert ours.objective == pytest.approx(cost)
    assert ours.clearance == pytest.approx(distance.min())


@given(st.integers(0, 10**6), arrays(np.float64, 20, elements=st.floats(0.0, 1.0)))
def test_half_planes_are_conservative(seed: int, omega: np.ndarray) -> None:
    """||p - o|| >= n.(p - o) for the unit n: slack to the half-planes covers the slack to the discs."""
    problem = random_problem(seed, 20)
    positions = problem.positions(omega)
    normals = normals_along(problem, problem.positions(np.ones(20)))
    np.testing.assert_allclose(np.linalg.norm(normals, axis=2), 1.0, atol=1e-12)
    offset = positions[:, None] - problem.centres
    to_planes = np.einsum("kmi,kmi->km", normals, offset) - problem.distances
    assert (np.linalg.norm(offset, axis=2) - problem.distances >= to_planes - 1e-12).all()
    assert problem.evaluate(omega).objective <= problem.evaluate_half_planes(positions, normals) + 1e-9


SPEED, LIMIT = 0.8, 3.0
"""Of the preset trajectory, and of the UGV, m/s."""


def tail_over_square(error: float, angle: float) -> float:
    """The task error's part of (25) that is still to come, over the squared error now, s: by the running law."""
    preset = Motion.at_speed(np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0]]), SPEED, start=0.0)
    start = preset.at(1.0)[0] + error * np.array([np.cos(angle), np.sin(angle), 0.0])
    none = np.empty((0, 3))
    scene = View(1.0, start, preset, none, none, np.empty(0), np.empty(0), LIMIT)
    problem = predicted_problem(scene, LAW, Proposal("none", 1.0, preset), Horizon(400, 1, 1.0, 1.0))
    return problem.evaluate(np.zeros(400)).objective / error**2


@given(st.floats(0.01, 20.0), st.floats(-np.pi, np.pi))
def test_the_terminal_cost_bounds_the_tail_of_25_under_the_own_task(error: float, angle: float) -> None:
    """1 / (2 B) up to the error at which the speed limit binds; beyond it more (docs/theory.md)."""
    gain, closing = LAW.motion_gain, LIMIT - SPEED
    weight = 1.0 / (2.0 * gain)
    if gain * error > closing:
        weight = error / (3.0 * closing) + closing**2 / (6.0 * gain**3 * error**2)
    assert tail_over_square(error, angle) <= weight * (1.0 + 1e-9)


def test_the_terminal_cost_is_what_is_to_come_where_no_limit_binds_and_too_little_where_it_does() -> None:
    gain, period = LAW.motion_gain, LAW.avoidance.period
    decay = (1.0 - gain * period) ** 2
    assert tail_over_square(0.5, 1.0) == pytest.approx(period * decay / (1.0 - decay), rel=1e-9)
    assert tail_over_square(0.5, 1.0) == pytest.approx(1.0 / (2.0 * gain), rel=1.6 * gain * period)
    assert tail_over_square(5.0, 0.0) > 1.0 / (2.0 * gain)
