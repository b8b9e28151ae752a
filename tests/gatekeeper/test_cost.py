"""Cost (25) with (26d), exact and along half-planes, against the formulas."""

from __future__ import annotations

import numpy as np
import pytest
from builders.problems import random_problem
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airground_drake.gatekeeper.half_planes import normals_along


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
