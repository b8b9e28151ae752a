"""(26) with its binary variables, solved to a proven optimum along half-planes, again and again: the default route."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.gatekeeper.binary_program import BinaryProgram
from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.drake_solvers import Search, relax
from airground_drake.gatekeeper.plan_search import cheap_plan, improve
from airground_drake.gatekeeper.problem import Problem
from airground_drake.gatekeeper.relaxation import dual_bound, normals_along, sum_up_rounding, unavoidable_cost
from airground_drake.gatekeeper.routes.guard import guarded
from airground_drake.gatekeeper.solution import ConstantPlans, Solution, Status, cheapest

_AGREE = 1e-6
"""Costs that differ by less than this, relative, are equal: the solver's tolerances and ours."""


@dataclass(frozen=True, eq=False)
class _Solved:
    """The outcome of linearising again and again.

    Attributes:
        plans: all plans found, (N,) each.
        status: whether the last optimum was proved.
        bound: lower bound along the last half-planes.
        normals: of these, (N, m, 3).
    """

    plans: list[Array]
    status: Status
    bound: float
    normals: Array


class MixedIntegerRoute:
    """Mixed-integer quadratic programs with one binary per stage, or per block of stages, and a proof of optimality.

    With half-planes for the exact distances, (26) is a convex program but for its binary variables. Half-planes at
    another plan allow other plans, so that the optimum of one program need not be that of (26). So the route begins
    with the cheapest plan by (26) itself that `plan_search` finds: by a beam, and by changes of one and two choices of
    sum-up rounding, the constant plans and the rest of the previous plan. Then it repeats:

    - It puts half-planes at the plan. Along these the plan costs what it costs by (26).
    - A solver looks for the optimum, starting from the plan. It costs no more by (26) than along the half-planes.
    - If that is cheaper, it is improved by changes of one and two choices, and is the next plan. Else the plan is the
      optimum along its own half-planes, and the route ends.

    Each plan is cheaper than the one before it. Nearly always the first is the last. The plan returned is the cheapest
    by (26) of all these and of the same with the other first choice. `route_bound` is the optimum along the last
    half-planes, and the gap is 0.

    Budget: only the clock can stop DAQP during a search, but it says how many iterations it took. If all searches
    together take more than `search_iterations`, or the time `search_s` is up, or the solver fails, the best plan so far
    decides. It does not depend on the clock; its bound is that of the relaxation along half-planes at it.
    """

    def __init__(self, blocks: int | None = None, solver: str = "daqp") -> None:
        """Start without any program.

        Args:
            blocks: binaries, each for a block of stages; they need not divide the stages. None: one per stage.
            solver: of the search; one of `drake_solvers.SOLVERS`. Relaxations are DAQP's.

        Raises:
            ValueError: if there is less than one block, or the solver cannot be used here.
        """
        if blocks is not None and blocks < 1:
            raise ValueError(f"blocks: {blocks}, allowed: 1 or more")
        self._blocks = blocks
        self._search = Search(solver)
        self._programs: dict[tuple[int, int], BinaryProgram] = {}

    def solve(self, problem: Problem, budget: Budget = Budget()) -> Solution:  # noqa: B008 (immutable)
        """See `Route`."""
        return guarded(problem, budget, self._solve)

    def _solve(self, problem: Problem, constants: ConstantPlans, budget: Budget) -> Solution:
        binary = self._program(problem)
        known = _known(binary, problem, constants)
        start = cheap_plan(problem.terms, binary.block, known)
        solved = self._solve_again_and_again(binary, problem, start, budget)
        plans = [*solved.plans, *known]
        turned = [np.where(binary.block == 0, 1.0 - plan[0], plan) for plan in plans]
        evaluated = [problem.evaluate(plan) for plan in (*plans, *turned)]
        return cheapest(
            problem,
            (constants.accept, constants.refuse, *evaluated),
            status=solved.status,
            route_bound=max(solved.bound, unavoidable_cost(problem)),
            normals=solved.normals,
        )

    def _solve_again_and_again(self, binary: BinaryProgram, problem: Problem, plan: Array, budget: Budget) -> _Solved:
        """Optima along half-planes at a plan (N,), then at the optimum, while that becomes cheaper."""
        plans, iterations, until = [plan], budget.search_iterations, time.monotonic() + budget.search_s
        while True:
            positions = problem.positions(plan)
            normals = normals_along(problem, positions)
            binary.update(problem, normals)
            seconds = min(until - time.monotonic(), budget.left_s())
            if seconds <= 0.0:
                return _Solved(plans, "budget_spent", _relaxed_bound(binary, problem, normals), normals)
            found = self._search.minimise(binary, binary.guess(problem, plan, normals), seconds)
            iterations -= found.iterations
            status: Status = found.ended if iterations >= 0 else "budget_spent"
            if found.omega is None or status != "optimal":
                return _Solved(plans, status, _relaxed_bound(binary, problem, normals), normals)
            optimum = binary.plan(found.omega.round())
            before = problem.evaluate_half_planes(positions, normals)
            cost = problem.evaluate_half_planes(problem.positions(optimum), normals)
            if cost > before * (1.0 + _AGREE):
                return _Solved(plans, "solver_failed", _relaxed_bound(binary, problem, normals), normals)
            plans.append(optimum)
            if cost >= before * (1.0 - _AGREE):
                return _Solved(plans, "optimal", min(cost, before), normals)
            plan, _ = improve(problem.terms, binary.block, optimum, pairs=True)
            plans.append(plan)

    def _program(self, problem: Problem) -> BinaryProgram:
        """Built once for a number of stages and blocks; then only its coefficients change."""
        stages = problem.stages
        size = stages, min(self._blocks or stages, stages)
        if size not in self._programs:
            self._programs[size] = BinaryProgram(*size)
        return self._programs[size]


def _known(binary: BinaryProgram, problem: Problem, constants: ConstantPlans) -> list[Array]:
    """Plans (N,) that need no search: constant ones, the rest of the previous one, and sum-up rounding."""
    count = len(binary.omega)
    known = [np.ones(count), np.zeros(count)]
    if problem.previous is not None:
        known.append(binary.blocked(problem.previous))
    binary.update(problem, normals_along(problem, constants.better.positions))
    shares = relax(binary).omega
    if shares is not None:
        known.append(sum_up_rounding(shares.clip(0.0, 1.0)))
    return [binary.plan(values) for values in known]


def _relaxed_bound(binary: BinaryProgram, problem: Problem, normals: Array) -> float:
    """Lower bound along half-planes, which are those of the program, by its relaxation; -inf if that fails."""
    shares = relax(binary).omega
    return -math.inf if shares is None else dual_bound(problem, normals, binary.plan(shares.clip(0.0, 1.0)))
