"""The plans among which every route chooses by the exact cost (25), and the decision that follows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit

from airground_drake.arrays import Array
from airground_drake.gatekeeper.problem import Evaluation, Problem, Solution, Status
from airground_drake.gatekeeper.rounding import rounding_deviation


@dataclass(frozen=True, eq=False)
class ConstantPlans:
    """The two constant plans, evaluated: accept throughout, refuse throughout."""

    accept: Evaluation
    refuse: Evaluation

    @classmethod
    def of(cls, problem: Problem) -> ConstantPlans:
        """Evaluate them by the exact cost (25)."""
        stages = problem.stages
        return cls(problem.evaluate(np.ones(stages)), problem.evaluate(np.zeros(stages)))

    @property
    def better(self) -> Evaluation:
        """The cheaper of the two; refusing on a tie."""
        return self.accept if self.accept.objective < self.refuse.objective else self.refuse

    def are_finite(self) -> bool:
        """False where finite data overflow in the cost."""
        return bool(np.isfinite(self.accept.objective) and np.isfinite(self.refuse.objective))

    def failed(self) -> Solution:
        """Refuse because the solver gave no optimum; the costs of the constant plans are the evidence."""
        status: Status = "refused_solver_failed"
        accept, refuse = self.accept.objective, self.refuse.objective
        return Solution(False, status, objective_accept=accept, objective_refuse=refuse)


def choose(
    problem: Problem,
    plans: Sequence[Evaluation],
    *,
    status: Status = "optimal",
    lower_bound: float = -1.0,
    gap: float = -1.0,
    normals: Array | None = None,
    relaxed: Array | None = None,
    rounded: Array | None = None,
) -> Solution:
    """The cheapest of some evaluated plans, among them both constant ones; the first on a tie.

    Args:
        problem: what they are plans of.
        plans: at least one that starts by accepting and one that starts by refusing.
        status: 'optimal' or 'budget_spent'.
        lower_bound: of the cost (25), with distances measured along `normals` if there are any.
        gap: of the plans to that bound; with `normals` it is computed.
        normals: of half-planes, (N, m, 3).
        relaxed: omega of the relaxation, (N,), if it was solved.
        rounded: the same after sum-up rounding, (N,).
    """
    best = min(plans, key=lambda plan: plan.objective)
    if normals is not None:
        convexified = min(problem.evaluate_half_planes(plan.positions, normals) for plan in plans)
        gap = (convexified - lower_bound) / max(convexified, 1e-12)
    return Solution(
        accept_first=bool(best.omega[0] == 1.0),
        status=status,
        objective=best.objective,
        lower_bound=lower_bound,
        gap=gap,
        relaxed_first_stage=-1.0 if relaxed is None else float(relaxed[0]),
        rounding_deviation=(
            -1.0 if relaxed is None or rounded is None else rounding_deviation(relaxed, rounded, problem.dt)
        ),
        clearance=min(best.clearance, 1e9),
        objective_accept=min(plan.objective for plan in plans if plan.omega[0] == 1.0),
        objective_refuse=min(plan.objective for plan in plans if plan.omega[0] == 0.0),
        plan=best.omega,
        positions=best.positions,
        relaxed=relaxed,
        rounded=rounded,
        normals=normals,
    )


def cut_short(
    problem: Problem,
    plans: Sequence[Evaluation],
    tail: Array,
    *,
    bound: float = 0.0,
    relaxed: Array | None = None,
    rounded: Array | None = None,
) -> Solution:
    """The decision when the budget is spent: the best plan so far, and a bound for which no solver is needed.

    Args:
        problem: what they are plans of.
        plans: as for `choose`.
        tail: `remaining_cost(problem)`; its first element bounds every plan.
        bound: another lower bound of (25), if there is one.
        relaxed: as for `choose`.
        rounded: as for `choose`.
    """
    best = min(plan.objective for plan in plans)
    bound = min(max(float(tail[0]), bound), best)
    gap = (best - bound) / max(best, 1e-12)
    return choose(problem, plans, status="budget_spent", lower_bound=bound, gap=gap, relaxed=relaxed, rounded=rounded)


def remaining_cost(problem: Problem) -> Array:
    """Lower bound of (25) over the stages from k on, for k = 0..N, (N + 1,): task error from the reachable box.

    Any plan stays, per axis, between the running sums of the smaller and of the larger mode velocity.
    """
    return _remaining_cost(
        problem.dt, problem.initial, problem.accept, problem.refuse, problem.reference, problem.error_weight
    )


@njit(cache=True)
def _remaining_cost(
    dt: float, initial: Array, accept: Array, refuse: Array, reference: Array, error_weight: float
) -> Array:
    stages = len(accept)
    tail = np.zeros(stages + 1)
    low, high = initial.copy(), initial.copy()
    for k in range(stages):
        squared = 0.0
        for a in range(3):
            low[a] += dt * min(accept[k, a], refuse[k, a])
            high[a] += dt * max(accept[k, a], refuse[k, a])
            squared += max(0.0, low[a] - reference[k, a], reference[k, a] - high[a]) ** 2
        tail[k] = dt * error_weight * squared
    for k in range(stages - 1, -1, -1):
        tail[k] += tail[k + 1]
    return (1.0 - 1e-9) * tail  # the last digits of the running sums must not cut an optimum


def block_of_stage(stages: int, blocks: int) -> npt.NDArray[np.int64]:
    """Block (N,) that each stage belongs to: lengths differ by one stage at most, none is empty."""
    used = min(blocks, stages)
    block: npt.NDArray[np.int64] = np.arange(stages, dtype=np.int64) * used // stages
    return block
