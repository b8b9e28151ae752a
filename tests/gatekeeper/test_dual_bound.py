"""Weak duality: bounds for any multipliers, tight at the optimum."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders.problems import PLANS, random_problem, rolled_out
from hypothesis import given
from hypothesis import strategies as st
from pydrake.solvers import ClarabelSolver, SolverOptions

from airground_drake.gatekeeper.convex_program import team_program
from airground_drake.gatekeeper.dual_bound import dual_bound
from airground_drake.gatekeeper.half_planes import normals_along
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
    """The optimum of the same program, solved to a tenth of the route's tolerance, is not above the bound."""
    options = SolverOptions()
    for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
        options.SetOption(ClarabelSolver.id(), name, 1e-9)
    for problem in [*(random_problem(s, 24, 1 + s % 3) for s in range(8)), *(rolled_out(s) for s in range(8))]:
        solution = used("relaxed").solve(problem)
        program = team_program([problem], [solution.normals]).program
        optimum = ClarabelSolver().Solve(program, None, options).get_optimal_cost()
        assert solution.route_bound == pytest.approx(optimum, rel=2e-5, abs=1e-8)
        assert solution.route_bound <= optimum * (1.0 + 1e-7) + 1e-9
