"""The paper's route: relaxation (27) as a convex quadratic program, sum-up rounding (28)-(29)."""

from __future__ import annotations

import math

import numpy as np
from pydrake.solvers import ClarabelSolver, SolverOptions

from airground_drake.base.arrays import Array
from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.convex_program import Shape, TeamProgram, empty_program
from airground_drake.gatekeeper.dual_bound import dual_bound, multipliers_at
from airground_drake.gatekeeper.half_planes import normals_along
from airground_drake.gatekeeper.problem import Problem
from airground_drake.gatekeeper.rounding import sum_up_rounding
from airground_drake.gatekeeper.routes.guard import guarded, how_it_ended, unavoidable_cost, without_optimum
from airground_drake.gatekeeper.solution import ConstantPlans, Solution, Status, cheapest

_TOLERANCE = 1e-6

_OPTIONS = {
    "tol_gap_abs": 1e-9,
    "tol_gap_rel": _TOLERANCE,
    "tol_feas": _TOLERANCE,
    "iterative_refinement_enable": 0,
    "equilibrate_enable": 0,
    "presolve_enable": 0,
}
"""Of Clarabel: optima to 1e-6 in two thirds of the time that its defaults take."""


class RelaxedRoute:
    """Relax, solve, round; every solution carries its optimality gap.

    The obstacle constraint (26d) is replaced by supporting half-planes n_k.(p_k - o) >= d - u_k with unit n_k.
    As ||p_k - o|| >= n_k.(p_k - o), they imply (26d) for any n_k: conservative, never optimistic. The n_k are
    taken along the better of the two constant plans. Taking them along the best plan found and solving again
    was tried: it costs half as much again and brought the plans no nearer to the best known.

    The rounded plan, the same with the other first stage, and both constant plans are evaluated with the exact
    distances; the cheapest is returned. (A search for better plans, which came within 0.1 % of the best known, was
    tried and taken out: it changed no answer of any shipped case, and plans that switch are predicted to no better
    than 0.3 m.)

    `route_bound` is computed from the multipliers by weak duality (`dual_bound`), so that it is a bound whatever
    the solver's tolerances, and also when its iterations ran out.

    Budget: iterations and the time left go to the solver; there is no tree to search. If the solver fails, the omega
    where it ended is rounded all the same: plans are evaluated exactly, whatever they come from.

    The program is built once for a number of stages and the weights, then only its coefficients change.
    """

    def __init__(self) -> None:
        """Start without any program."""
        self._programs: dict[Shape, TeamProgram] = {}
        self._solver = ClarabelSolver()

    def solve(self, problem: Problem, budget: Budget = Budget()) -> Solution:  # noqa: B008 (immutable)
        """See `Route`."""
        return guarded(problem, budget, self._solve)

    def _solve(self, problem: Problem, constants: ConstantPlans, budget: Budget) -> Solution:
        normals = normals_along(problem, constants.better.positions)
        relaxed, bound, status = self._relax(problem, normals, constants.better.objective, budget)
        if relaxed is None:
            return without_optimum(problem, constants, budget, normals)
        rounded = sum_up_rounding(relaxed)
        other = np.append(1.0 - rounded[0], rounded[1:])
        return cheapest(
            problem,
            (constants.accept, constants.refuse, problem.evaluate(rounded), problem.evaluate(other)),
            status=status,
            route_bound=max(bound, unavoidable_cost(problem)),
            normals=normals,
            relaxed=relaxed,
            rounded=rounded,
        )

    def _relax(
        self, problem: Problem, normals: Array, cost: float, budget: Budget
    ) -> tuple[Array | None, float, Status]:
        """Omega (N,) where the solver ended, None if that is no number; the bound that follows; how it ended."""
        scale = _scale(cost)
        shape = Shape.of(problem, scale=scale)
        if shape not in self._programs:
            self._programs[shape] = empty_program([shape])
        team = self._programs[shape]
        (ugv,) = team.ugvs
        rows = ugv.update(problem, normals)
        result = self._solver.Solve(team.program, None, _options(budget))
        omega = np.clip(result.GetSolution(ugv.omega), 0.0, 1.0)
        status = how_it_ended(result, budget)
        usable = np.isfinite(omega).all()
        if not usable or status == "solver_failed":
            del self._programs[shape]  # a fresh workspace after a failure
        if not usable:
            return None, -math.inf, status
        bound = dual_bound(problem, normals, omega, multipliers_at(problem, normals, problem.positions(omega)))
        if status == "solver_failed":  # its multipliers and its cost are not to be relied on
            return omega, bound, status
        if bound < (1.0 - 2.0 * _TOLERANCE) * scale * result.get_optimal_cost() and rows.any():
            multipliers = np.zeros(rows.shape)
            multipliers[rows] = scale * result.GetDualSolution(ugv.avoidance)
            bound = max(bound, dual_bound(problem, normals, omega, multipliers))
        return omega, bound, status


def _scale(cost: float) -> float:
    """Cost that is 1 in the program: `cost` to a power of ten, so that few programs are kept.

    Clarabel's relative gap is absolute below 1: unscaled, it would mean nothing where there is little to pay.
    """
    return float(10.0 ** min(12, max(-12, math.floor(math.log10(max(cost, 1e-300))))))


def _options(budget: Budget) -> SolverOptions:
    options = SolverOptions()
    solver = ClarabelSolver.id()
    for name, value in _OPTIONS.items():
        options.SetOption(solver, name, value)
    options.SetOption(solver, "max_iter", min(budget.iterations, 10_000))
    if budget.left_s() < math.inf:
        options.SetOption(solver, "time_limit", max(budget.left_s(), 1e-6))
    return options
