"""The optimal control problem (21)-(26) of one UGV, discretised, and what a binary plan costs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from airground_drake.nsbc.task import Array


@dataclass(frozen=True, eq=False)
class Problem:
    """(26) for one UGV over N stages; stage k lasts from k dt to (k + 1) dt.

    (26) couples UGVs only through the predicted motion of the others, which is data here, so the sum over
    UGVs in (25) separates and each UGV solves its own.

    Attributes:
        dt: length of a stage, s.
        initial: rho(0), (26b), (3,), m.
        accept: mode velocity a_k of (23) with the intervention accepted, (N, 3), m/s.
        refuse: mode velocity b_k of (23) with it refused, (N, 3), m/s.
        reference: preset trajectory at the ends of the stages, (N, 3), m.
        centres: obstacles and predicted other robots at the ends of the stages, (N, m, 3), m.
        distances: safe distances d of (26d), (m,), m.
        error_weight: a_i of (25), 1/(m^2 s).
        slack_weight: b_i of (25), 1/(m^2 s).
    """

    dt: float
    initial: Array
    accept: Array
    refuse: Array
    reference: Array
    centres: Array
    distances: Array
    error_weight: float
    slack_weight: float

    @property
    def stages(self) -> int:
        """N."""
        return len(self.accept)

    def positions(self, omega: Array) -> Array:
        """Predicted positions at the ends of the stages, (23): omega (N,) in [0, 1] to (N, 3), m."""
        velocity = self.refuse + omega[:, None] * (self.accept - self.refuse)
        return self.initial + self.dt * np.cumsum(velocity, axis=0)

    def clearance(self, positions: Array) -> Array:
        """Distance to every point minus its safe distance, at positions (N, 3): (N, m), m."""
        offset = positions[:, None, :] - self.centres
        return np.sqrt(np.einsum("kmi,kmi->km", offset, offset)) - self.distances

    def evaluate(self, omega: Array) -> Evaluation:
        """Cost (25) of a plan with the exact distances of (26d)."""
        positions = self.positions(omega)
        clearance = self.clearance(positions).min(axis=1, initial=np.inf)
        slack = np.maximum(0.0, -clearance)
        return Evaluation(omega, positions, self.cost(positions, slack), float(clearance.min(initial=np.inf)))

    def cost(self, positions: Array, slack: Array) -> float:
        """(25) by the right-hand rectangle rule: positions (N, 3) m, slack u (N,) m."""
        error = self.reference - positions
        tracking = self.error_weight * np.einsum("ki,ki->", error, error)
        return float(self.dt * (tracking + self.slack_weight * slack @ slack))


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A plan omega (N,), its positions (N, 3), m, cost (25) and smallest clearance (distance minus d), m."""

    omega: Array
    positions: Array
    objective: float
    clearance: float


Status = Literal["optimal", "refused_solver_failed", "refused_not_finite"]


@dataclass(frozen=True)
class Decision:
    """What a route decided, with its evidence. Numbers that do not apply are -1.

    Attributes:
        accept: the first stage of the plan.
        status: 'optimal', or why the proposal was refused without an optimum.
        objective: cost (25) of the plan returned.
        lower_bound: optimum of the relaxation (for the same supporting half-planes).
        gap: (objective - lower_bound) / objective, the objective being that of the same convexified problem.
        objective_accept: lowest cost found of a plan that starts by accepting.
        objective_refuse: lowest cost found of a plan that starts by refusing.
        relaxed_first_stage: omega_0 of the relaxation.
        rounding_deviation: largest integrated difference of sum-up rounding, s.
        clearance: smallest predicted distance minus d of the plan, m.
    """

    accept: bool
    status: Status
    objective: float = -1.0
    lower_bound: float = -1.0
    gap: float = -1.0
    objective_accept: float = -1.0
    objective_refuse: float = -1.0
    relaxed_first_stage: float = -1.0
    rounding_deviation: float = -1.0
    clearance: float = -1.0
