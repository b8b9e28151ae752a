"""The convexified problem with binaries, by branch and bound: Drake's own, or a licensed solver's."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.solvers import (
    ClarabelSolver,
    GurobiSolver,
    MixedIntegerBranchAndBound,
    MosekSolver,
    SolutionResult,
    SolverOptions,
)

from airground_drake.arrays import Array
from airground_drake.gatekeeper.blocks import check_blocks
from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.convex_program import TeamProgram, team_program
from airground_drake.gatekeeper.half_planes import normals_along
from airground_drake.gatekeeper.problem import Problem
from airground_drake.gatekeeper.routes.guard import guarded, how_it_ended, unavoidable_cost, without_optimum
from airground_drake.gatekeeper.solution import ConstantPlans, Solution, cheapest, cut_short

_SCALE = 10.0
"""Cost of the cheaper constant plan in the program: Drake's absolute tolerance is then 0.1 % of it.

At 1000 Clarabel fails twice as often."""

_NODE_S = 1e-3
"""Time that a node is taken to need, s."""

_NAMES = {
    GurobiSolver: ("NodeLimit", "TimeLimit"),
    MosekSolver: ("MSK_IPAR_MIO_MAX_NUM_BRANCHES", "MSK_DPAR_MIO_MAX_TIME"),
}
"""Options of the licensed solvers that limit nodes and time, s."""

_GAP = 0.01 + 1e-5
"""Drake's branch and bound stops at this gap, relative or absolute; both are fixed there. And Clarabel's own."""


class BranchAndBoundRoute:
    """Mixed-integer quadratic program with the half-planes of `RelaxedRoute`, no rounding: see `team_program`.

    With Gurobi or Mosek licensed for Drake, one binary per stage (their default gap 1e-4; not tested here,
    for want of a licence). Else `MixedIntegerBranchAndBound` with one binary per block of N / `blocks` stages
    and Clarabel for the relaxations. Drake's bound is not exposed in Python, but it stops within 1 % of the
    optimum, or 0.1 % of the cheaper constant plan's cost: `route_bound` is the optimum found less that, for
    the same half-planes and dwell. Its "binaries" are binary to a tolerance only, so that the plan is rounded
    and evaluated exactly, and the cheapest of it and the constant plans is returned.

    Anything but a proven optimum is a failure, which leaves the better constant plan. Of roll-outs among random discs
    some end so, because Clarabel reports insufficient progress in a node; Drake hands no options on to it.

    Budget: nodes go to Drake's search, which explores at most 2^(blocks + 1) anyway. It can be neither
    interrupted nor given a time, and its relaxations no number of iterations; so with a deadline it gets
    no more nodes than last for the time left at `_NODE_S` each, an estimate and no guarantee. A licensed solver
    gets both limits under its own names.
    """

    def __init__(self, blocks: int = 10) -> None:
        """Look for a licensed solver.

        Raises:
            ValueError: if `blocks` is not from 1 to 20.
        """
        self._blocks = check_blocks(blocks)
        self._licensed = licensed_solver()

    def solve(self, problem: Problem, budget: Budget = Budget()) -> Solution:  # noqa: B008 (immutable)
        """See `Route`."""
        return guarded(problem, budget, self._solve)

    def _solve(self, problem: Problem, constants: ConstantPlans, budget: Budget) -> Solution:
        normals = normals_along(problem, constants.better.positions)
        scale = max(problem.evaluate_half_planes(constants.better.positions, normals), 1e-9) / _SCALE
        blocks = self._blocks if self._licensed is None else None
        team = team_program([problem], [normals], relaxed=False, blocks=blocks, scale=scale)
        try:
            found = _branch(team, budget) if self._licensed is None else _delegate(self._licensed, team, budget)
        except (RuntimeError, ValueError):  # Drake: "Unknown result", or a failing sub-solver
            found = None
        if found is _SPENT:
            return cut_short(problem, constants.both, unavoidable_cost(problem))
        if found is None or not (np.isfinite(found.binaries).all() and np.isfinite(found.bound)):
            return without_optimum(problem, constants, budget, normals)
        plan = problem.evaluate((team.ugvs[0].plan(found.binaries) > 0.5).astype(float))
        return cheapest(problem, (plan, *constants.both), route_bound=max(0.0, scale * found.bound), normals=normals)


def licensed_solver() -> Any:
    """Gurobi or Mosek if Drake has it and a licence is there, else None."""
    for solver in (GurobiSolver(), MosekSolver()):
        if solver.available() and solver.enabled():
            return solver
    return None


@dataclass(frozen=True, eq=False)
class Found:
    """What a search gave: binaries (B,) and a lower bound in the program's unit."""

    binaries: Array
    bound: float


_SPENT = Found(np.zeros(0), -1.0)
"""What a search gave whose nodes were spent."""


def _branch(team: TeamProgram, budget: Budget) -> Found | None:
    """Drake's branch and bound; None without a proven optimum, unless the nodes were spent."""
    options = MixedIntegerBranchAndBound.Options()
    options.max_explored_nodes = min(budget.nodes, 2**31 - 1)
    if budget.left_s() < math.inf:
        options.max_explored_nodes = max(1, min(budget.nodes, int(budget.left_s() / _NODE_S)))
    search = MixedIntegerBranchAndBound(team.program, ClarabelSolver.id(), options)
    status = search.Solve()
    if status == SolutionResult.kIterationLimit:
        return _SPENT
    if status != SolutionResult.kSolutionFound:
        return None
    optimum = float(search.GetOptimalCost())
    binaries = np.asarray(search.GetSolution(team.ugvs[0].omega), dtype=float)
    return Found(binaries, optimum - _GAP * max(1.0, abs(optimum)))


def _delegate(solver: Any, team: TeamProgram, budget: Budget) -> Found | None:
    """The same by a solver of mixed-integer programs, at its default relative gap of 1e-4."""
    result = solver.Solve(team.program, None, _limits(solver, budget))
    if not result.is_success():
        return _SPENT if how_it_ended(result, budget) == "budget_spent" else None
    optimum = float(result.get_optimal_cost())
    return Found(np.asarray(result.GetSolution(team.ugvs[0].omega), dtype=float), optimum - 1e-4 * abs(optimum))


def _limits(solver: Any, budget: Budget) -> SolverOptions:
    """Nodes and time left, as Gurobi and Mosek call them."""
    options = SolverOptions()
    nodes, seconds = _NAMES.get(type(solver), ("", ""))
    if nodes:
        options.SetOption(solver.solver_id(), nodes, min(budget.nodes, 2**31 - 1))
        if budget.left_s() < math.inf:
            options.SetOption(solver.solver_id(), seconds, budget.left_s())
    return options
