"""Branch and bound: its bound, its failures, licensed solvers."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from builders.problems import random_problem
from gatekeeper.contract import check_contract
from gatekeeper.formulas import blocked
from pydrake.solvers import ClarabelSolver, MixedIntegerBranchAndBound, SolutionResult, SolverOptions

from airground_drake.gatekeeper.half_planes import normals_along
from airground_drake.gatekeeper.routes import branch_and_bound
from airground_drake.gatekeeper.routes.branch_and_bound import BranchAndBoundRoute
from airground_drake.gatekeeper.solution import ConstantPlans


def test_branch_and_bound_bounds_the_convexified_problem() -> None:
    for seed in range(12):
        problem = random_problem(seed, 24, 1 + seed % 3)
        normals = normals_along(problem, ConstantPlans.of(problem).better.positions)
        best = min(problem.evaluate_half_planes(problem.positions(w), normals) for w in blocked(24, 8))
        solution = BranchAndBoundRoute(8).solve(problem)
        assert 0.975 * best <= solution.route_bound <= best * (1.0 + 1e-6)
        assert solution.gap <= 0.0105


@pytest.mark.parametrize("how", ["RuntimeError", "infeasible"])
def test_a_failing_branch_and_bound_leaves_the_better_constant_plan(how: str, monkeypatch: pytest.MonkeyPatch) -> None:
    class Search:
        Options = MixedIntegerBranchAndBound.Options

        def __init__(self, *arguments: object) -> None:
            """Take whatever the route gives."""

        def Solve(self) -> SolutionResult:
            if how == "RuntimeError":
                raise RuntimeError("Unknown result")
            return SolutionResult.kInfeasibleConstraints

    monkeypatch.setattr(branch_and_bound, "MixedIntegerBranchAndBound", Search)
    for seed in range(3):
        solution = check_contract(BranchAndBoundRoute(), random_problem(seed))
        assert solution.status == "solver_failed"
        assert solution.objective == ConstantPlans.of(random_problem(seed)).better.objective


def test_a_licensed_solver_gets_one_binary_per_stage(monkeypatch: pytest.MonkeyPatch) -> None:
    class Licensed:
        """Stands in for Gurobi or Mosek: Drake's own search behind a solver's interface."""

        def Solve(self, program: Any, guess: None, options: SolverOptions) -> Any:
            search = MixedIntegerBranchAndBound(program, ClarabelSolver.id())
            found = search.Solve() == SolutionResult.kSolutionFound
            return SimpleNamespace(
                is_success=lambda: found, get_optimal_cost=search.GetOptimalCost, GetSolution=search.GetSolution
            )

    problem = random_problem(3, 12, 1)
    blocks = BranchAndBoundRoute(4).solve(problem)
    monkeypatch.setattr(branch_and_bound, "licensed_solver", Licensed)
    stages = check_contract(BranchAndBoundRoute(4), problem)
    assert stages.objective < blocks.objective
