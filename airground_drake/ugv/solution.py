"""The result of a route: its plan for problem (26), and the evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.ugv.problem import Evaluation, Problem
from airground_drake.ugv.relaxation import rounding_deviation

Status = Literal["optimal", "budget_spent", "solver_failed", "refused_not_finite"]


@dataclass(frozen=True, eq=False)
class Solution:
    """A solution of (26), with its evidence. Numbers that do not apply are -1, arrays None.

    Attributes:
        accept_first: the first stage of the plan; False without one.
        status: 'optimal': the route did all that it does; 'budget_spent', 'solver_failed': the best plan known when
            the budget was spent or a solver failed, with its gap; 'refused_not_finite': no plan, so that the
            proposal is refused.
        objective: cost (25) of the plan returned.
        route_bound: lower bound of the problem that the route solves, with supporting half-planes for the exact
            distances of (26d), whose optimum may be lower: over binary plans by `mixed_integer`, over relaxed ones by
            `relaxed`. A local optimum has no bound.
        gap: (objective - route_bound) / objective, the objective being that of the same problem.
        objective_accept: lowest cost found of a plan that starts by accepting.
        objective_refuse: lowest cost found of a plan that starts by refusing.
        relaxed_first_stage: omega_0 of the relaxation.
        rounding_deviation: largest integrated difference of sum-up rounding, s.
        clearance: smallest predicted distance minus d of the plan, m.
        plan: omega of the plan returned, (N,), 0 or 1.
        positions: where that leads, (N, 3), m.
        relaxed: omega of the relaxation, (N,), in [0, 1].
        rounded: `relaxed` after sum-up rounding, (N,), 0 or 1.
        normals: of the half-planes that `route_bound` and `gap` are about, (N, m, 3).
    """

    accept_first: bool
    status: Status
    objective: float = -1.0
    route_bound: float = -1.0
    gap: float = -1.0
    objective_accept: float = -1.0
    objective_refuse: float = -1.0
    relaxed_first_stage: float = -1.0
    rounding_deviation: float = -1.0
    clearance: float = -1.0
    plan: Array | None = None
    positions: Array | None = None
    relaxed: Array | None = None
    rounded: Array | None = None
    normals: Array | None = None

    def __post_init__(self) -> None:
        """Raise a ValueError if `accept_first` contradicts the plan."""
        if self.plan is not None and self.accept_first != (self.plan[0] == 1.0):
            raise ValueError(f"accept_first is {self.accept_first}, but the plan begins with {self.plan[0]:g}")

    @property
    def has_plan(self) -> bool:
        """Whether it rests on a plan, by its status."""
        return self.status != "refused_not_finite"


@dataclass(frozen=True, eq=False)
class ConstantPlans:
    """The two constant plans, evaluated: accept throughout, refuse throughout."""

    accept: Evaluation
    refuse: Evaluation

    @classmethod
    def of(cls, problem: Problem) -> ConstantPlans:
        """Evaluate them by the mode velocities, which are exact for them up to rounding."""
        stages = problem.stages
        return cls(problem.evaluate(np.ones(stages)), problem.evaluate(np.zeros(stages)))

    @property
    def both(self) -> tuple[Evaluation, Evaluation]:
        """Accepting, refusing: in the order in which ties are broken."""
        return self.accept, self.refuse

    @property
    def better(self) -> Evaluation:
        """The cheaper of the two; refusing on a tie."""
        return self.accept if self.accept.objective < self.refuse.objective else self.refuse

    def are_finite(self) -> bool:
        """False where finite data overflow in the cost."""
        return bool(np.isfinite(self.accept.objective) and np.isfinite(self.refuse.objective))


def cheapest(
    problem: Problem,
    plans: Sequence[Evaluation],
    *,
    status: Status = "optimal",
    route_bound: float = -1.0,
    normals: Array | None = None,
    relaxed: Array | None = None,
    rounded: Array | None = None,
) -> Solution:
    """The cheapest of some evaluated plans, among them both constant ones; the first on a tie.

    The other arguments are those of `Solution`. With `normals`, the bound and the gap are about distances along them.
    """
    best = min(plans, key=lambda plan: plan.objective)
    reached = best.objective
    if normals is not None:
        reached = min(problem.evaluate_half_planes(plan.positions, normals) for plan in plans)
    deviation = None if relaxed is None or rounded is None else rounding_deviation(relaxed, rounded, problem.dt)
    return Solution(
        accept_first=bool(best.omega[0] == 1.0),
        status=status,
        objective=best.objective,
        route_bound=route_bound,
        gap=-1.0 if route_bound < 0.0 else (reached - route_bound) / max(reached, 1e-12),
        relaxed_first_stage=-1.0 if relaxed is None else float(relaxed[0]),
        rounding_deviation=-1.0 if deviation is None else deviation,
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
    problem: Problem, plans: Sequence[Evaluation], bound: float, status: Status = "budget_spent", **evidence: Any
) -> Solution:
    """The solution when the budget is spent or a solver failed: the best plan so far, and a bound without a solver.

    As `cheapest`, which takes `evidence`; `bound` is a lower bound of every plan.
    """
    bound = min(bound, *(plan.objective for plan in plans))
    return cheapest(problem, plans, status=status, route_bound=bound, **evidence)


def after_failure(problem: Problem, solution: Solution) -> Solution:
    """The solution after a solver failure: the cheapest of its own plan, the constant plans and the previous one."""
    constants = ConstantPlans.of(problem)
    if not (problem.is_finite() and constants.are_finite()):
        return Solution(False, "refused_not_finite")
    known = [problem.evaluate(plan) for plan in (solution.plan, problem.previous) if plan is not None]
    return cut_short(
        problem, (*constants.both, *known), max(0.0, solution.route_bound), "solver_failed",
        normals=solution.normals, relaxed=solution.relaxed, rounded=solution.rounded,
    )  # fmt: skip
