"""The optimal control problem (21)-(26) of one UGV, discretised: mode velocities by rolling out its closed loop."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from airground_drake.base.arrays import Array, read_only
from airground_drake.model.geometry import convex, outline
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.cost import Terms, half_plane_cost, plan_cost, positions_of
from airground_drake.ugv.rollout import ACCEPTED, REFUSED, ClosedLoop, View, closed_loop, follow


@dataclass(frozen=True)
class Horizon:
    """N stages of (25)-(27), control periods per stage, and weights as in `Problem`."""

    stages: int
    substeps: int
    error_weight: float
    slack_weight: float
    terminal_weight: float = 0.0


@dataclass(frozen=True, eq=False)
class Problem:
    """(26) for one UGV over N stages; stage k lasts from k dt to (k + 1) dt.

    (26) couples UGVs only through the predicted motion of the others, which is data here, so the sum over
    UGVs in (25) separates and each UGV solves its own. Its arrays are read-only copies.

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
        terminal_weight: w of the terminal cost, see `terms`, s; 0: none, as the paper has it.
        previous: the rest of the plan of the last sample, (N,), 0 or 1, for a search to start from; None without one.
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
    previous: Array | None = None

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray):
                object.__setattr__(self, name, read_only(value))

    @property
    def stages(self) -> int:
        """N."""
        return len(self.accept)

    @cached_property
    def terms(self) -> Terms:
        """The data of (23) and (25) for compiled code.

        The terminal cost w a ||rho_rd - rho_N||^2 of the stability theory of model predictive control (Mayne et al.,
        Automatica 36, 2000) is part of the last weight of the task error: dt a becomes (dt + w) a.
        """
        weights = np.full(self.stages, self.error_weight)
        weights[-1] *= 1.0 + self.terminal_weight / self.dt
        modes = np.stack([self.refuse, self.accept])
        data = self.initial, modes, self.reference, self.centres, self.distances
        return Terms(float(self.dt), *data, weights, float(self.slack_weight))

    @cached_property
    def boxes(self) -> tuple[Array, Array]:
        """Least and largest coordinates, (N, 3) each, m, that any plan, relaxed or not, can have at ends of stages."""
        slower, faster = np.minimum(self.accept, self.refuse), np.maximum(self.accept, self.refuse)
        low, high = (np.cumsum(np.vstack([self.initial, self.dt * v]), axis=0)[1:] for v in (slower, faster))
        return low, high

    def is_finite(self) -> bool:
        """Whether all data are finite numbers."""
        data = (self.initial, self.accept, self.refuse, self.reference, self.centres, self.distances)
        return all(np.isfinite(array).all() for array in data)

    def positions(self, omega: Array) -> Array:
        """Predicted positions at the ends of the stages, (23): omega (N,) in [0, 1] to (N, 3), m."""
        return np.asarray(positions_of(self.terms, np.ascontiguousarray(omega, dtype=np.float64)))

    def evaluate(self, omega: Array) -> Evaluation:
        """Cost (25) of a plan, (N,), by the mode velocities of (23), with the exact distances of (26d)."""
        positions = self.positions(omega)
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


def sensed(seen: View, law: UgvLaw) -> View:
    """The view restricted to the sensing range, on which predictions are based."""
    return seen.restrict(seen.apart() <= law.avoidance.sensing_range)


def predicted_loop(seen: View, law: UgvLaw, proposal: Proposal, horizon: Horizon) -> ClosedLoop:
    """One UGV's closed loop over the horizon, among bodies that keep their velocities; of a view as `sensed`."""
    samples = law.avoidance.period * np.arange(0.0, horizon.stages * horizon.substeps + 1.0)
    places = seen.places + samples[:, None, None] * seen.velocities
    return closed_loop(seen, law, proposal, samples, places, horizon.substeps)


def predicted_problem(seen: View, law: UgvLaw, proposal: Proposal, horizon: Horizon) -> Problem:
    """(26) for one UGV: roll out both choices, with the sensed bodies that it might come near.

    (26) is about points. A core that is not a point is replaced, at each stage, by its nearest point to the refused
    roll-out; an accepted one may come too near to other points of the core.
    """
    seen = sensed(seen, law)
    dt, stages = horizon.substeps * law.avoidance.period, np.ones(horizon.stages, dtype=np.int64)
    loop = predicted_loop(seen, law, proposal, horizon)
    places = loop.places
    (_, accept), (standing, refuse) = (follow(loop, mode * stages) for mode in (ACCEPTED, REFUSED))
    squared = np.maximum(np.square(accept).sum(axis=1), np.square(refuse).sum(axis=1))
    # a plan that switches may be faster than both constant ones, but for a retreat not above the speed limit
    reach = dt * np.cumsum(np.sqrt(np.maximum(squared, seen.max_speed**2)))
    moving = places[horizon.substeps :: horizon.substeps]
    own = standing[:, None] - moving
    offsets = [convex.nearest_points(row[None], own[:, j]) for j, row in enumerate(seen.parts)]
    points = moving + np.concatenate(offsets, axis=1) if offsets else moving
    centres = np.concatenate([convex.nearest_points(seen.still, standing), points], axis=1)
    extent = np.hypot(*seen.parts[:, outline.MIDDLE : outline.EXTENT].T) + seen.parts[:, outline.EXTENT]
    away = np.linalg.norm(moving - seen.position, axis=2) - extent
    fixed = np.tile(seen.apart()[: len(seen.still)], (len(moving), 1))
    away = np.column_stack([fixed, away]) - seen.distances - reach[:, None]
    rise = np.column_stack([np.zeros((len(moving), len(seen.still))), moving[:, :, 2]]) - seen.position[2]
    base, top = (np.append(seen.still[:, k], seen.parts[:, k]) for k in (outline.BASE, outline.TOP))
    height = np.maximum(np.maximum(rise + base, -rise - top), 0.0) - seen.distances
    near = ~((away >= 0.0) | (height >= 0.0)).all(axis=0)  # NaN counts as near, so that the problem is refused
    return Problem(
        dt=dt,
        initial=seen.position,
        accept=accept,
        refuse=refuse,
        reference=loop.preset[horizon.substeps :: horizon.substeps],
        centres=centres[:, near],
        distances=seen.distances[near],
        error_weight=horizon.error_weight,
        slack_weight=horizon.slack_weight,
        terminal_weight=horizon.terminal_weight,
    )
