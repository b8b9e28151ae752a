"""(26) with its binary variables, solved to a proven optimum: the default route."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from numba import njit

from airground_drake.base.arrays import Array
from airground_drake.gatekeeper.binary_program import BinaryProgram
from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.cost import Terms, half_plane_cost
from airground_drake.gatekeeper.daqp_solver import Found, minimise
from airground_drake.gatekeeper.drake_solvers import DrakeSearch
from airground_drake.gatekeeper.problem import Problem
from airground_drake.gatekeeper.relaxation import dual_bound, normals_along, sum_up_rounding, unavoidable_cost
from airground_drake.gatekeeper.routes.guard import guarded
from airground_drake.gatekeeper.solution import ConstantPlans, Solution, Status, cheapest

_AGREE = 1e-6
"""A plan cheaper than a proven optimum by more than this, relative, shows that the solver is wrong."""


class MixedIntegerRoute:
    """Mixed-integer quadratic program with one binary per stage, or per block of stages, and a proof of optimality.

    First the relaxation is solved, as by `RelaxedRoute`. The best of sum-up rounding, the constant plans and the rest
    of the previous plan is improved by changing one choice at a time. Its cost, that of the incumbent, cuts the search
    by branch and bound: DAQP's, or that of Gurobi or Mosek where Drake has them.

    The plan returned is the cheapest by exact distances of the optimum, the incumbent, the plans that it was chosen
    from, and each of these with the other first choice. `route_bound` is the optimum along the half-planes; the gap
    is 0.

    Budget: only the clock can stop DAQP during a search, but it says how many iterations it took. If they are more than
    `search_iterations`, or the time `search_s` was up, or the solver fails, the incumbent decides. It does not depend
    on the clock; its bound is that of the relaxation.
    """

    def __init__(self, blocks: int | None = None, solver: str = "daqp") -> None:
        """Start without any program.

        Args:
            blocks: binaries, each for a block of stages; they need not divide the stages. None: one per stage.
            solver: of the search; 'daqp' or one of `drake_solvers.SOLVERS`. Relaxations are DAQP's.

        Raises:
            ValueError: if there is less than one block, or the solver cannot be used here.
        """
        if blocks is not None and blocks < 1:
            raise ValueError(f"blocks: {blocks}, allowed: 1 or more")
        self._blocks = blocks
        self._search: Callable[..., Found] = minimise if solver == "daqp" else DrakeSearch(solver).minimise
        self._programs: dict[tuple[int, int], BinaryProgram] = {}

    def solve(self, problem: Problem, budget: Budget = Budget()) -> Solution:  # noqa: B008 (immutable)
        """See `Route`."""
        return guarded(problem, budget, self._solve)

    def _solve(self, problem: Problem, constants: ConstantPlans, budget: Budget) -> Solution:
        normals = normals_along(problem, constants.better.positions)
        binary = self._program(problem)
        binary.update(problem, normals)
        bound, known_plans = _known(binary, problem, normals)
        costs = [problem.evaluate_half_planes(problem.positions(plan), normals) for plan in known_plans]
        start = known_plans[int(np.argmin(costs))]
        incumbent = _improved(problem.terms, normals, binary.block, start)
        known = problem.evaluate_half_planes(problem.positions(incumbent), normals)
        found = self._search(binary, known=known, seconds=min(budget.search_s, budget.left_s()))
        status: Status = found.ended if found.iterations <= budget.search_iterations else "budget_spent"
        plans = [incumbent, *known_plans]
        if found.omega is not None and status == "optimal":
            optimum = binary.plan(found.omega)
            cost = problem.evaluate_half_planes(problem.positions(optimum), normals)
            if abs(cost - known) <= _AGREE * known or cost < known:
                plans, bound = [optimum, *plans], min(cost, known)
            else:
                status = "solver_failed"
        turned = [np.where(binary.block == 0, 1.0 - plan[0], plan) for plan in plans]
        evaluated = [problem.evaluate(plan) for plan in (*plans, *turned)]
        return cheapest(
            problem,
            (constants.accept, constants.refuse, *evaluated),
            status=status,
            route_bound=max(bound, unavoidable_cost(problem)),
            normals=normals,
        )

    def _program(self, problem: Problem) -> BinaryProgram:
        """Built once for a number of stages and blocks; then only its coefficients change."""
        stages = problem.stages
        size = stages, min(self._blocks or stages, stages)
        if size not in self._programs:
            self._programs[size] = BinaryProgram(*size)
        return self._programs[size]


def _known(binary: BinaryProgram, problem: Problem, normals: Array) -> tuple[float, list[Array]]:
    """A lower bound by the relaxation, and plans (N,) that need no search."""
    count = len(binary.omega)
    known = [np.ones(count), np.zeros(count)]
    if problem.previous is not None:
        known.append(binary.blocked(problem.previous))
    bound, relaxed = -math.inf, minimise(binary, relaxed=True).omega
    if relaxed is not None:
        known.append(sum_up_rounding(relaxed))
        bound = dual_bound(problem, normals, binary.plan(relaxed))
    return bound, [binary.plan(values) for values in known]


@njit(cache=True)
def _improved(terms: Terms, normals: Array, block: npt.NDArray[np.int64], start: Array) -> Array:
    """A plan (N,) that no change of a single block makes cheaper, with distances along the half-planes.

    Args:
        terms: of the problem.
        normals: (N, m, 3).
        block: that each stage belongs to, (N,).
        start: where to begin, (N,), constant on each block.
    """
    plan, best, changed = start.copy(), _cost_turned(terms, normals, block, start, -1), True
    while changed:
        changed = False
        for turned in range(block[-1] + 1):
            cost = _cost_turned(terms, normals, block, plan, turned)
            if cost < best * (1.0 - 1e-12):
                plan, best, changed = np.where(block == turned, 1.0 - plan, plan), cost, True
    return plan


@njit(cache=True)
def _cost_turned(terms: Terms, normals: Array, block: npt.NDArray[np.int64], plan: Array, turned: int) -> float:
    """Cost of a plan along the half-planes, with the opposite choice in one block; -1: in no block."""
    positions = np.empty((len(plan), 3))
    x, y, z = terms.initial[0], terms.initial[1], terms.initial[2]
    for k in range(len(plan)):
        mode = int(plan[k]) if block[k] != turned else 1 - int(plan[k])
        x += terms.dt * terms.velocities[mode, k, 0]
        y += terms.dt * terms.velocities[mode, k, 1]
        z += terms.dt * terms.velocities[mode, k, 2]
        positions[k, 0], positions[k, 1], positions[k, 2] = x, y, z
    return half_plane_cost(terms, positions, normals)
