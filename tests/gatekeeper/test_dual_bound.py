"""Weak duality: bounds for any multipliers, tight at the optimum."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders.problems import PLANS, random_problem, rolled_out
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.gatekeeper.relaxation import dual_bound, normals_along
from gatekeeper.contract import used
from gatekeeper.formulas import half_plane_cost


@given(st.integers(0, 10**6), PLANS, PLANS)
def test_the_dual_bound_holds_for_any_multipliers(seed: int, at: np.ndarray, omega: np.ndarray) -> None:
    """The bound linearised at one plan is below the cost, in half-planes, of another, from any stage on."""
    problem, rng = random_problem(seed), np.random.default_rng(seed)
    normals = normals_along(problem, problem.positions(rng.random(problem.stages)))
    multipliers = rng.exponential(3.0, normals.shape[:2]) * (rng.random(normals.shape[:2]) < 0.3)
    positions = problem.positions(omega)
    for k in range(problem.stages):
        rest = replace(
            problem, initial=positions[k - 1] if k else problem.initial, accept=problem.accept[k:],
            refuse=problem.refuse[k:], reference=problem.reference[k:], centres=problem.centres[k:],
        )  # fmt: skip
        bound = dual_bound(rest, normals[k:], at[k:], multipliers[k:])
        assert bound <= half_plane_cost(rest, omega[k:], normals[k:]) + 1e-9 * (1.0 + abs(bound))


def test_the_bound_of_the_relaxation_is_tight() -> None:
    """The relaxed plan costs, along the half-planes, no more than the bound: so it is the optimum."""
    for problem in [*(random_problem(s, 24, 1 + s % 3) for s in range(8)), *(rolled_out(s) for s in range(8))]:
        solution = used("relaxed").solve(problem)
        assert solution.relaxed is not None
        reached = half_plane_cost(problem, solution.relaxed, solution.normals)
        assert solution.route_bound == pytest.approx(reached, rel=1e-7, abs=1e-9)
