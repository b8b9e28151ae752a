from airground_drake.ugv.budget import Budget
from airground_drake.ugv.problem import Problem
from airground_drake.ugv.solution import ConstantPlans, Solution


class ConstantRoute:
    """The cheaper of the two constant plans."""

    def solve(self, problem: Problem, budget: Budget) -> Solution:
        """Accept throughout or refuse throughout."""
        if not problem.is_finite():
            return Solution(False, "refused_not_finite")
        plans = ConstantPlans.of(problem)
        best = plans.better
        return Solution(
            accept_first=best is plans.accept,
            status="optimal",
            objective=best.objective,
            objective_accept=plans.accept.objective,
            objective_refuse=plans.refuse.objective,
            clearance=min(best.clearance, 1e9),
            plan=best.omega,
            positions=best.positions,
        )
