"""(26) with its binary variables: a proven optimum along half-planes, and a search by its own cost."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.ugv.binary_program import BinaryProgram, Programs
from airground_drake.ugv.budget import Budget
from airground_drake.ugv.drake_solvers import Minimiser, relax
from airground_drake.ugv.plan_search import cheap_plan, distinct, improve
from airground_drake.ugv.problem import Evaluation, Problem
from airground_drake.ugv.relaxation import dual_bound, normals_along, sum_up_rounding, unavoidable_cost
from airground_drake.ugv.routes.guard import Guarded
from airground_drake.ugv.solution import ConstantPlans, Solution, Status, cheapest

_AGREE = 1e-6  # costs that differ by less than this, relative, are equal: the solver's tolerances and ours
# Another search is made only if the relaxation comes nearer to the plan than this, relative: it is long otherwise.
_WORTH = 0.02
# A search has this share of the time at first: within it, nearly every one ends or is longer than may count.
_FIRST = 0.125


@dataclass(frozen=True, eq=False)
class _Proof:
    """The outcome of a search along half-planes."""

    status: Status  # 'optimal' if the bound is the optimum
    bound: float  # lower bound along the half-planes
    normals: Array  # of these, (N, m, 3)
    optimum: Evaluation | None = None  # the plan; None without one


class MixedIntegerRoute(Guarded):
    """Mixed-integer quadratic programs with one binary per stage, or per block of stages, and a proof of optimality.

    With half-planes for the exact distances, (26) is convex but for its binary variables. A solver finds the optimum
    along half-planes at the better constant plan. That need not be the optimum of (26): it may cost several times as
    much. So the route also looks for plans by (26) itself. `plan_search` takes the best of a beam, sum-up rounding, the
    constant plans, the rest of the previous plan and the solver's optimum, and changes one or two choices while that
    makes it cheaper. If the result is cheaper than the optimum along the half-planes, there are better half-planes: at
    that plan, which along these costs what it costs by (26). The route solves again along these, improves what it
    finds, and goes on until nothing becomes cheaper, unless the relaxation shows that the search would be long.

    The plan returned is the cheapest by (26) of all these and of the same with the other first choice. `route_bound`
    is the optimum along the half-planes of the last search that ended; the gap is 0.

    Budget: only the clock can stop DAQP during a search, but it says how many iterations it took. If all searches
    together take more than `search_iterations`, or the time `search_s` is up, or the solver fails, the best plan so far
    decides. It does not depend on the clock: a search that is stopped early, and has not taken too many iterations, is
    made again with all of the time. If no search ended, its bound is that of the relaxation.
    """

    def __init__(self, blocks: int | None = None, solver: str = "daqp") -> None:
        # blocks: binaries, each for a block of stages; they need not divide the stages. None: one per stage.
        if blocks is not None and blocks < 1:
            raise ValueError(f"blocks: {blocks}, allowed: 1 or more")
        self._blocks = blocks
        self._search, self._programs = Minimiser(solver), Programs()

    def _solve(self, problem: Problem, constants: ConstantPlans, budget: Budget) -> Solution:
        binary = self._programs.of(problem.stages, min(self._blocks or problem.stages, problem.stages))
        binary.update(problem, normals_along(problem, constants.better.positions))
        shares, bound = _relaxed(binary)
        known = _known(binary, shares)
        plan = problem.evaluate(cheap_plan(problem.terms, binary.block, known))
        plans = [plan, *map(problem.evaluate, known)]
        search = _Searches(self._search, budget)
        proof = search.along(binary, plans, bound)
        while proof.optimum is not None:
            optimum = proof.optimum.omega
            if not any(np.array_equal(optimum, candidate.omega) for candidate in plans):
                plans += [proof.optimum, problem.evaluate(improve(problem.terms, binary.block, optimum, True)[0])]
            plan = min(plans, key=lambda candidate: candidate.objective)
            if plan.objective >= proof.bound * (1.0 - _AGREE):
                break
            again = search.again(binary, plan)
            if again is None or again.status != "optimal":
                proof = replace(proof, status=again.status if again else proof.status)
                break
            proof = again
        turned = [np.where(binary.block == 0, 1.0 - candidate.omega[0], candidate.omega) for candidate in plans]
        return cheapest(
            problem,
            (constants.accept, constants.refuse, *plans, *map(problem.evaluate, turned)),
            status=proof.status,
            route_bound=max(proof.bound, unavoidable_cost(problem)),
            normals=proof.normals,
        )


class _Searches:
    """Searches for the optimum of one problem along several half-planes, which share a budget."""

    def __init__(self, search: Minimiser, budget: Budget) -> None:
        self._search, self._budget = search, budget
        self._iterations, self._until = budget.search_iterations, time.monotonic() + budget.search_s

    def along(self, binary: BinaryProgram, known: Sequence[Evaluation], relaxed: float) -> _Proof:
        """Search from the best of known plans; `relaxed` is the lower bound by the relaxation."""
        problem, normals = binary.problem, binary.normals
        costs = [problem.evaluate_half_planes(plan.positions, normals) for plan in known]
        best = int(np.argmin(costs))
        for share in (_FIRST, 1.0):
            seconds = share * min(self._until - time.monotonic(), self._budget.left_s())
            if seconds <= 0.0:
                return _Proof("budget_spent", relaxed, normals)
            result = self._search.minimise(binary, binary.guess(known[best]), seconds)
            if result.ended != "budget_spent" or result.iterations > self._iterations:
                break
        self._iterations -= result.iterations
        status: Status = result.ended if self._iterations >= 0 else "budget_spent"
        if result.omega is None or status != "optimal":
            return _Proof(status, relaxed, normals)
        optimum = problem.evaluate(binary.plan(result.omega.round()))
        cost = problem.evaluate_half_planes(optimum.positions, normals)
        if cost > costs[best] * (1.0 + _AGREE):  # the solver is wrong
            return _Proof("solver_failed", relaxed, normals)
        return _Proof("optimal", min(cost, costs[best]), normals, optimum)

    def again(self, binary: BinaryProgram, plan: Evaluation) -> _Proof | None:
        """Search along half-planes at a plan; None if the relaxation shows that this would be long."""
        binary.update(binary.problem, normals_along(binary.problem, plan.positions))
        bound = _relaxed(binary)[1]
        return None if bound < (1.0 - _WORTH) * plan.objective else self.along(binary, [plan], bound)


def _known(binary: BinaryProgram, shares: Array | None) -> list[Array]:
    """Plans (N,) without a search: constant ones, the rest of the previous one, sum-up rounding."""
    known = [np.ones(binary.count), np.zeros(binary.count)]
    if binary.problem.previous is not None:
        known.append(binary.blocked(binary.problem.previous))
    if shares is not None:
        known.append(sum_up_rounding(shares))
    return distinct([binary.plan(values) for values in known])


def _relaxed(binary: BinaryProgram) -> tuple[Array | None, float]:
    """Shares (B,) of the relaxation along the half-planes, and its lower bound."""
    shares = relax(binary).omega
    if shares is None:
        return None, -math.inf
    shares = shares.clip(0.0, 1.0)
    return shares, dual_bound(binary.problem, binary.normals, binary.plan(shares))
