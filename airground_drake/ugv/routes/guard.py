"""Checks that every route does before and after its own search."""

import abc

from airground_drake.base.arrays import Array
from airground_drake.ugv.budget import COUNTED, Budget
from airground_drake.ugv.problem import Problem
from airground_drake.ugv.relaxation import unavoidable_cost
from airground_drake.ugv.solution import ConstantPlans, Solution, Status, cut_short


class Guarded(abc.ABC):
    """A route that searches unless numbers are not finite, or the budget is spent once constant plans are known."""

    def solve(self, problem: Problem, budget: Budget = COUNTED) -> Solution:
        if not problem.is_finite():
            return Solution(False, "refused_not_finite")
        constants = ConstantPlans.of(problem)
        if not constants.are_finite():
            return Solution(False, "refused_not_finite")
        if budget.spent():
            return cut_short(problem, constants.both, unavoidable_cost(problem))
        return self._solve(problem, constants, budget)

    @abc.abstractmethod
    def _solve(self, problem: Problem, constants: ConstantPlans, budget: Budget) -> Solution: ...


def without_optimum(
    problem: Problem,
    constants: ConstantPlans,
    budget: Budget,
    normals: Array | None = None,
    ended: Status = "solver_failed",
) -> Solution:
    """The better constant plan, if a solver gave no solution; a spent budget takes precedence as the reason."""
    status: Status = "budget_spent" if budget.spent() else ended
    return cut_short(problem, constants.both, unavoidable_cost(problem), status, normals=normals)
