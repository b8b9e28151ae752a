"""The optimal control problem (21)-(26) of one UGV, discretised, and what a binary plan costs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numba import njit

from airground_drake.arrays import Array
from airground_drake.gatekeeper.closed_loop import ClosedLoop


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
        loop: what the mode velocities were rolled out from; None for a problem that is given by them alone.
        bend: how much the avoidance inequalities bend the intervention along the roll-out "accept throughout":
            the integral of ||v - v_below|| dt over that of ||v_below|| dt, with v the velocity commanded and
            v_below the one that the task below the inequalities wants, within the speed limit. 0 where nothing
            is wanted, or nothing stands above the intervention (methods (b), (c)); 1 where all that is wanted is
            blocked; more where the inequalities make the UGV retreat.
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
    loop: ClosedLoop | None = None
    bend: float = 0.0

    @property
    def stages(self) -> int:
        """N."""
        return len(self.accept)

    def is_finite(self) -> bool:
        """Whether all data are finite numbers."""
        data = (self.initial, self.accept, self.refuse, self.reference, self.centres, self.distances)
        looped = self.loop is None or self.loop.is_finite()
        return looped and math.isfinite(self.bend) and all(np.isfinite(array).all() for array in data)

    def positions(self, omega: Array) -> Array:
        """Predicted positions at the ends of the stages, (23): omega (N,) in [0, 1] to (N, 3), m."""
        velocity = self.refuse + omega[:, None] * (self.accept - self.refuse)
        return self.initial + self.dt * np.cumsum(velocity, axis=0)

    def evaluate(self, omega: Array) -> Evaluation:
        """Cost (25) of a plan with the exact distances of (26d), by the right-hand rectangle rule."""
        positions = self.positions(omega)
        clearances = _clearances(positions, self.centres, self.distances)
        objective = self.cost(positions, clearances)
        return Evaluation(omega, positions, objective, float(clearances.min(initial=np.inf)))

    def evaluate_half_planes(self, positions: Array, normals: Array) -> float:
        """Cost (25) through positions (N, 3) m when distances are measured along unit normals (N, m, 3)."""
        return self.cost(positions, _reaches(positions, self.centres, self.distances, normals))

    def cost(self, positions: Array, clearances: Array) -> float:
        """(25) for positions (N, 3), m, and the least clearance of each stage (N,), m: slack is its negative part."""
        return _cost(positions, self.reference, clearances, self.error_weight, self.slack_weight, self.dt)


@njit(cache=True)
def _clearances(positions: Array, centres: Array, distances: Array) -> Array:
    """Least distance minus safe distance at each stage, (N,), m; inf without points."""
    least = np.full(len(positions), np.inf)
    for k in range(len(positions)):
        for m in range(len(distances)):
            squared = 0.0
            for a in range(3):
                squared += (positions[k, a] - centres[k, m, a]) ** 2
            least[k] = min(least[k], np.sqrt(squared) - distances[m])
    return least


@njit(cache=True)
def _reaches(positions: Array, centres: Array, distances: Array, normals: Array) -> Array:
    """Least n.(p - o) - d at each stage, (N,), m: never more than the clearance."""
    least = np.full(len(positions), np.inf)
    for k in range(len(positions)):
        for m in range(len(distances)):
            reach = 0.0
            for a in range(3):
                reach += normals[k, m, a] * (positions[k, a] - centres[k, m, a])
            least[k] = min(least[k], reach - distances[m])
    return least


@njit(cache=True)
def _cost(
    positions: Array, reference: Array, clearances: Array, error_weight: float, slack_weight: float, dt: float
) -> float:
    total = 0.0
    for k in range(len(positions)):
        slack = max(0.0, -clearances[k])
        total += slack_weight * slack * slack
        for a in range(3):
            total += error_weight * (reference[k, a] - positions[k, a]) ** 2
    return dt * total


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A plan omega (N,), its positions (N, 3), m, cost (25) and smallest clearance (distance minus d), m."""

    omega: Array
    positions: Array
    objective: float
    clearance: float


Status = Literal["optimal", "budget_spent", "refused_budget_spent", "refused_solver_failed", "refused_not_finite"]
DECIDED: tuple[Status, ...] = ("optimal", "budget_spent")
"""Statuses of a decision that rests on a plan; every other one is a refusal for want of one."""


@dataclass(frozen=True, eq=False)
class Solution:
    """What a route decided, with its evidence. Numbers that do not apply are -1, arrays None.

    Attributes:
        accept: the first stage of the plan.
        status: 'optimal': the route did all that it does; 'budget_spent': the best plan known when the budget
            was spent, with its gap; else why the proposal was refused without a plan.
        objective: cost (25) of the plan returned.
        lower_bound: of the problem that the route solves: relaxed or branched, for the same supporting
            half-planes; enumerated, for the same dwell. A local optimum has none.
        gap: (objective - lower_bound) / objective, the objective being that of the same problem.
        objective_accept: lowest cost found of a plan that starts by accepting.
        objective_refuse: lowest cost found of a plan that starts by refusing.
        relaxed_first_stage: omega_0 of the relaxation.
        rounding_deviation: largest integrated difference of sum-up rounding, s.
        clearance: smallest predicted distance minus d of the plan, m.
        plan: omega of the plan returned, (N,), 0 or 1.
        positions: where that leads, (N, 3), m.
        relaxed: omega of the relaxation, (N,), in [0, 1].
        rounded: `relaxed` after sum-up rounding, (N,), 0 or 1.
        normals: of the half-planes that `lower_bound` and `gap` are about, (N, m, 3).
    """

    accept_first: bool
    status: Status
    objective: float = -1.0
    lower_bound: float = -1.0
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
