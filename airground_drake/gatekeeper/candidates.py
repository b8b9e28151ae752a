"""The plans among which every route chooses by the exact cost (25), and the decision that follows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from airground_drake.gatekeeper.problem import Decision, Evaluation, Problem, Status
from airground_drake.nsbc.task import Array


@dataclass(frozen=True, eq=False)
class Constants:
    """The two constant plans, evaluated: accept throughout, refuse throughout."""

    accept: Evaluation
    refuse: Evaluation

    @classmethod
    def of(cls, problem: Problem) -> Constants:
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

    def failed(self) -> Decision:
        """Refuse because the solver gave no optimum; the costs of the constant plans are the evidence."""
        status: Status = "refused_solver_failed"
        accept, refuse = self.accept.objective, self.refuse.objective
        return Decision(False, status, objective_accept=accept, objective_refuse=refuse)


def choose(
    problem: Problem,
    plans: tuple[Evaluation, ...],
    *,
    lower_bound: float = -1.0,
    gap: float = -1.0,
    normals: Array | None = None,
    relaxed_first_stage: float = -1.0,
    deviation: float = -1.0,
) -> Decision:
    """The cheapest of some evaluated plans, among them both constant ones; the first on a tie.

    Args:
        problem: what they are plans of.
        plans: at least one that starts by accepting and one that starts by refusing.
        lower_bound: of the cost (25), with distances measured along `normals` if there are any.
        gap: of the plans to that bound; with `normals` it is computed.
        normals: of half-planes, (N, m, 3).
        relaxed_first_stage: see `Decision`.
        deviation: see `Decision.rounding_deviation`, s.
    """
    best = min(plans, key=lambda plan: plan.objective)
    if normals is not None:
        convexified = min(problem.evaluate_half_planes(plan.positions, normals) for plan in plans)
        gap = (convexified - lower_bound) / max(convexified, 1e-12)
    return Decision(
        accept=bool(best.omega[0] == 1.0),
        status="optimal",
        objective=best.objective,
        lower_bound=lower_bound,
        gap=gap,
        relaxed_first_stage=relaxed_first_stage,
        rounding_deviation=deviation,
        clearance=min(best.clearance, 1e9),
        objective_accept=min(plan.objective for plan in plans if plan.omega[0] == 1.0),
        objective_refuse=min(plan.objective for plan in plans if plan.omega[0] == 0.0),
    )


def block_of_stage(stages: int, blocks: int) -> npt.NDArray[np.int64]:
    """Block (N,) that each stage belongs to: lengths differ by one stage at most, none is empty."""
    used = min(blocks, stages)
    block: npt.NDArray[np.int64] = np.arange(stages, dtype=np.int64) * used // stages
    return block
