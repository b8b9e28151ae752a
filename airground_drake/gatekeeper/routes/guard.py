"""What every route does before and after its own work."""

from __future__ import annotations

from collections.abc import Callable

from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.problem import Problem
from airground_drake.gatekeeper.reachable_box import remaining_cost
from airground_drake.gatekeeper.solution import ConstantPlans, Solution, cut_short

Search = Callable[[Problem, ConstantPlans, Budget], Solution]
"""A route's own work on a finite problem, with its constant plans, while there is budget left."""


def guarded(problem: Problem, budget: Budget, search: Search, *, closed_loop: bool = False) -> Solution:
    """Search, unless the problem or its costs are not finite, or the budget is spent.

    Args:
        problem: data of (26).
        budget: asked before and after the constant plans are evaluated.
        search: what to do then.
        closed_loop: evaluate the constant plans on the closed loop.
    """
    if not problem.is_finite():
        return Solution(False, "refused_not_finite")
    if budget.spent():
        return Solution(False, "refused_budget_spent")
    constants = ConstantPlans.of_closed_loop(problem) if closed_loop else ConstantPlans.of(problem)
    if not constants.are_finite():
        return Solution(False, "refused_not_finite")
    if budget.spent():
        # the box is one of the mode velocities: it bounds nothing on the closed loop
        return cut_short(problem, constants.both, 0.0 if closed_loop else unavoidable_cost(problem))
    return search(problem, constants, budget)


def without_optimum(problem: Problem, constants: ConstantPlans, budget: Budget) -> Solution:
    """The solution when a solver gave nothing: for want of time the better constant plan, else a refusal."""
    if budget.spent():
        return cut_short(problem, constants.both, unavoidable_cost(problem))
    return constants.failed()


def unavoidable_cost(problem: Problem) -> float:
    """Lower bound of (25) over all plans, relaxed or not, for which no solver is needed."""
    return float(remaining_cost(problem)[0])
