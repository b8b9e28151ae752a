"""The optimal control problem (21)-(26) of one UGV, discretised: mode velocities by rolling out its closed loop."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.gatekeeper.cost import Terms, error_weights, half_plane_cost, plan_cost
from airground_drake.gatekeeper.rollout import ClosedLoop, View, closed_loop
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.law import UgvLaw


@dataclass(frozen=True)
class Horizon:
    """Discretisation and weights of (25)-(27).

    Attributes:
        stages: N.
        substeps: control periods per stage.
        error_weight: a_i of (25), 1/(m^2 s).
        slack_weight: b_i of (25), 1/(m^2 s).
        terminal_weight: of the terminal cost, see `cost.error_weights`, s.
    """

    stages: int
    substeps: int
    error_weight: float
    slack_weight: float
    terminal_weight: float = 0.0


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
        terminal_weight: of the terminal cost, see `cost.error_weights`, s; 0: none, as the paper has it.
        loop: what the mode velocities were rolled out from; None for a problem that is given by them alone.
        previous: what is left of the plan decided on at the sample before, (N,), 0 or 1; None if there is none. It is
            no part of (26), but a plan to start from.
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
    terminal_weight: float = 0.0
    loop: ClosedLoop | None = None
    previous: Array | None = None

    @property
    def stages(self) -> int:
        """N."""
        return len(self.accept)

    @cached_property
    def terms(self) -> Terms:
        """What (23) and (25) are made of, for compiled code."""
        weights = error_weights(self.stages, self.dt, self.error_weight, self.terminal_weight)
        modes = np.stack([self.refuse, self.accept])
        data = self.initial, modes, self.reference, self.centres, self.distances
        return Terms(float(self.dt), *data, weights, float(self.slack_weight))

    def is_finite(self) -> bool:
        """Whether all data are finite numbers."""
        data = (self.initial, self.accept, self.refuse, self.reference, self.centres, self.distances)
        looped = self.loop is None or self.loop.is_finite()
        return looped and all(np.isfinite(array).all() for array in data)

    def positions(self, omega: Array) -> Array:
        """Predicted positions at the ends of the stages, (23): omega (N,) in [0, 1] to (N, 3), m."""
        velocity = self.refuse + omega[:, None] * (self.accept - self.refuse)
        return self.initial + self.dt * np.cumsum(velocity, axis=0)

    def evaluate(self, omega: Array) -> Evaluation:
        """Cost (25) of a plan, (N,), by the mode velocities of (23), with the exact distances of (26d)."""
        positions = self.positions(omega)
        return Evaluation(omega, positions, *plan_cost(self.terms, positions))

    def evaluate_closed_loop(self, omega: Array) -> Evaluation:
        """Cost (25) of a plan, (N,) of 0 and 1, rolled out on the closed loop, with the exact distances of (26d).

        Raises:
            ValueError: if the problem has no closed loop, or the plan is not one of its plans.
        """
        if self.loop is None:
            raise ValueError("a problem that is given by mode velocities has no closed loop")
        positions = self.loop.positions(omega)
        return Evaluation(omega, positions, *plan_cost(self.terms, positions))

    def evaluate_half_planes(self, positions: Array, normals: Array) -> float:
        """Cost (25) through positions (N, 3) m when distances are measured along unit normals (N, m, 3)."""
        return half_plane_cost(self.terms, positions, normals)


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A plan omega (N,), its positions (N, 3), m, cost (25) and smallest clearance (distance minus d), m."""

    omega: Array
    positions: Array
    objective: float
    clearance: float


def predicted_problem(seen: View, law: UgvLaw, proposal: Proposal, horizon: Horizon) -> Problem:
    """(26) for one UGV: roll out both choices and keep the points that it senses and might come near."""
    seen = seen.restrict(np.linalg.norm(seen.centres - seen.position, axis=1) <= law.avoidance.sensing_range)
    loop = closed_loop(seen, law, proposal, horizon.stages, horizon.substeps)
    accept, refuse = loop.constant_plans()
    dt = horizon.substeps * law.avoidance.period
    after = dt * np.arange(1.0, horizon.stages + 1.0)
    squared = np.maximum(np.square(accept).sum(axis=1), np.square(refuse).sum(axis=1))
    # a plan that switches may be faster than both constant ones, but for a retreat not above the speed limit
    reach = dt * np.cumsum(np.sqrt(np.maximum(squared, seen.max_speed**2)))
    centres = seen.centres + after[:, None, None] * seen.velocities
    gap = np.linalg.norm(centres - seen.position, axis=2) - seen.distances - reach[:, None]
    height = np.abs(centres[:, :, 2] - seen.position[2]) - seen.distances
    near = ((gap < 0.0) & (height < 0.0)).any(axis=0)
    return Problem(
        dt=dt,
        initial=seen.position,
        accept=accept,
        refuse=refuse,
        reference=np.ascontiguousarray(loop.preset[horizon.substeps :: horizon.substeps]),
        centres=np.ascontiguousarray(centres[:, near]),  # the layout that the kernels are compiled for
        distances=seen.distances[near],
        error_weight=horizon.error_weight,
        slack_weight=horizon.slack_weight,
        terminal_weight=horizon.terminal_weight,
        loop=loop,
    )
