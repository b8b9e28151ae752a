"""The contract of a solution route, built in or added from outside."""

from typing import Protocol, runtime_checkable

from airground_drake.ugv.budget import Budget
from airground_drake.ugv.problem import Problem
from airground_drake.ugv.solution import Solution


@runtime_checkable
class Route(Protocol):
    """A way to solve (26): any object with this method, whose class can be constructed without arguments.

    A gatekeeper keeps one object for all its UGVs, samples and Contexts. Threads may call it at the same time, and runs
    may be repeated: nothing that it keeps between calls may change a solution. The contract:

    - It never raises, whatever the problem. For data that are not finite, and costs that overflow, it returns
      `Solution(False, "refused_not_finite")`, as `guard.Guarded` does.
    - It does not write into the problem, whose arrays are read-only.
    - If its solver fails, it returns the best plan that it has evaluated, with status 'solver_failed'. The gatekeeper
      compares that with the previous plan, and with the constant plans (`solution.after_failure`).
    - It keeps the budget: the counts, and the deadline but for one step of its own. At the end of the budget it
      returns the best plan known, with status 'budget_spent'. Counts alone give the same solution on every machine
      and at every call.
    - `plan` is binary. `positions` and the cost `objective` are those of `Problem.evaluate`; no constant plan is
      cheaper.
    - `objective_accept` and `objective_refuse` are costs of plans as well. `objective` is the lower of the two, and
      `accept_first` says which.
    - `route_bound` and `gap` are valid as `Solution` describes them, or -1. The verifier computes them again.
    - `relaxed` and `rounded` are both there or both None, `rounded` by `relaxation.sum_up_rounding`.
    """

    def solve(self, problem: Problem, budget: Budget, /) -> Solution:
        """Solve (26) for one UGV within the budget; never raises."""
