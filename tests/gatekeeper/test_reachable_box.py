"""What no plan can avoid."""

from __future__ import annotations

import numpy as np
from builders.problems import PLANS, random_problem
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.gatekeeper.relaxation import normals_along, remaining_cost, within_reach


@given(st.integers(0, 10**6), PLANS)
def test_no_plan_costs_less_than_what_remains(seed: int, omega: np.ndarray) -> None:
    problem = random_problem(seed)
    positions = problem.positions(omega)
    stage = problem.dt * np.square(problem.reference - positions).sum(axis=1)  # no slack is cheapest
    stage[-1] *= 1.0 + problem.terminal_weight / problem.dt
    to_come = np.append(np.cumsum(stage[::-1])[::-1], 0.0)
    assert (remaining_cost(problem) <= to_come + 1e-9).all()


@given(st.integers(0, 10**6), PLANS, PLANS)
def test_where_nothing_can_come_near_no_half_plane_is_in_the_way(seed: int, guide: np.ndarray, w: np.ndarray) -> None:
    problem = random_problem(seed)
    normals = normals_along(problem, problem.positions(guide))
    away = problem.positions(w)[:, None] - problem.centres
    idle = ~within_reach(problem)
    assert (np.linalg.norm(away, axis=2) >= problem.distances - 1e-9)[idle].all()
    assert (np.einsum("kmi,kmi->km", away, normals) >= problem.distances - 1e-9)[idle].all()
