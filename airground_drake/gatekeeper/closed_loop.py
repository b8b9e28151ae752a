"""The closed loop of one UGV under switching answers, as its running controller steps it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from airground_drake.arrays import Array
from airground_drake.nsbc.kernels import avoid_one, fill_half_spaces

REFUSED, ACCEPTED = 0, 1
"""Modes of a control period: whether the proposal is in force."""


class ClosedLoop(NamedTuple):
    """All that the motion of one UGV over the horizon depends on, besides the answers to the proposal.

    N stages of `substeps` control periods each, S = N * substeps in all. A named tuple because that is what
    numba takes as one argument; the arrays are never written to.

    Attributes:
        start: position at the beginning, (3,), m, world frame.
        preset: own preset trajectory at the control samples, (S + 1, 3), m.
        wanted: the proposed motion at the control samples, (S + 1, 3), m.
        chosen: J_int^+ J_int, projector onto the directions in which the UAV intervenes, (3, 3).
        points: where the points to keep away from are at the control samples, (S + 1, K, 3), m.
        distances: safe distances to them, (K,), m.
        shares: share of each avoidance inequality, (K,).
        max_speed: own speed limit, m/s.
        motion_gain: B of (6), 1/s.
        intervention_gain: Lambda of (14), 1/s.
        avoidance_gain: A of (8), 1/s.
        period: control period h, s.
        sensing_range: farther points are not seen, m.
        composition: of the avoidance tasks, see `Avoidance.code`.
        intervention_on_top: priorities of (20) (methods (b), (c)); False: avoidance above the intervention.
        substeps: control periods per stage.
    """

    start: Array
    preset: Array
    wanted: Array
    chosen: Array
    points: Array
    distances: Array
    shares: Array
    max_speed: float
    motion_gain: float
    intervention_gain: float
    avoidance_gain: float
    period: float
    sensing_range: float
    composition: int
    intervention_on_top: bool
    substeps: int

    @property
    def stages(self) -> int:
        """N."""
        return (len(self.preset) - 1) // self.substeps

    def is_finite(self) -> bool:
        """Whether all arrays hold finite numbers."""
        return bool(_is_finite(self))

    def positions(self, omega: Array) -> Array:
        """Positions at the ends of the stages, (N, 3), m, when stage k runs with the answer omega[k].

        Args:
            omega: (N,), 1 where the proposal is accepted, 0 where it is refused.

        Raises:
            ValueError: if there are not N answers or one is neither 0 nor 1.
        """
        answers = np.asarray(omega)
        if answers.shape != (self.stages,) or not np.isin(answers, (REFUSED, ACCEPTED)).all():
            raise ValueError(f"a plan needs {self.stages} answers that are 0 or 1, got {omega!r}")
        return _follow(self, answers.astype(np.int64))[0]

    def constant_plans(self) -> tuple[Array, Array]:
        """Mean velocity of each stage, (N, 3) m/s, accepted throughout and refused throughout."""
        return _constant_plans(self)


class Workspace(NamedTuple):
    """Arrays that one control period writes to.

    Attributes:
        mobility: (3,), 1 where the UGV can move, 0 where it cannot; not written to.
        normal: of the avoidance inequalities, (K, 3).
        bound: of the avoidance inequalities, (K,), m/s.
        own: velocity that the UGV's own task wants, (3,), m/s.
        task: velocity that the highest task below the avoidance inequalities, or above them, wants, (3,), m/s.
    """

    mobility: Array
    normal: Array
    bound: Array
    own: Array
    task: Array


@njit(cache=True)
def workspace(loop: ClosedLoop) -> Workspace:
    """Uninitialised arrays for `velocity_of`."""
    count = len(loop.distances)
    plane = np.array([1.0, 1.0, 0.0])
    return Workspace(plane, np.empty((count, 3)), np.empty(count), np.empty(3), np.empty(3))


@njit(cache=True)
def velocity_of(loop: ClosedLoop, mode: int, k: int, position: Array, work: Workspace) -> Array:
    """Velocity (3,), m/s, that `UgvController` commands in control period k; rates are of the sampled motions.

    Args:
        loop: the closed loop.
        mode: REFUSED or ACCEPTED.
        k: control period, from 0.
        position: of the UGV at its beginning, (3,), m.
        work: overwritten.
    """
    mobility, normal, bound, own, task = work
    h = loop.period
    fill_half_spaces(
        position, loop.points[k], loop.distances, loop.shares, loop.avoidance_gain, h, mobility, loop.sensing_range,
        normal, bound,
    )  # fmt: skip
    for a in range(3):
        rate = (loop.preset[k + 1, a] - loop.preset[k, a]) / h
        own[a] = mobility[a] * (rate + loop.motion_gain * (loop.preset[k, a] - position[a]))
    _limit(own, loop.max_speed)
    if mode == REFUSED:
        for a in range(3):
            task[a] = own[a]
        return avoid_one(own, normal, bound, loop.composition)
    below = avoid_one(own, normal, bound, loop.composition) if loop.intervention_on_top else own
    for a in range(3):
        task[a] = below[a]  # chosen @ asked + (I - chosen) @ below
    for b in range(3):
        rate = (loop.wanted[k + 1, b] - loop.wanted[k, b]) / h
        asked = mobility[b] * (rate + loop.intervention_gain * (loop.wanted[k, b] - position[b]))
        for a in range(3):
            task[a] += loop.chosen[a, b] * (asked - below[b])
    for a in range(3):
        task[a] *= mobility[a]
    _limit(task, loop.max_speed)
    return task if loop.intervention_on_top else avoid_one(task, normal, bound, loop.composition)


@njit(cache=True)
def _follow(loop: ClosedLoop, answers: npt.NDArray[np.int64]) -> tuple[Array, Array]:
    """Positions at the ends of the stages, (N, 3), m, and mean velocities of the stages, (N, 3), m/s."""
    stages = len(answers)
    positions, mean = np.empty((stages, 3)), np.zeros((stages, 3))
    position, work = loop.start.copy(), workspace(loop)
    for stage in range(stages):
        for k in range(stage * loop.substeps, (stage + 1) * loop.substeps):
            velocity = velocity_of(loop, answers[stage], k, position, work)
            for a in range(3):
                position[a] += loop.period * velocity[a]
                mean[stage, a] += velocity[a] / loop.substeps
        positions[stage] = position
    return positions, mean


@njit(cache=True)
def _constant_plans(loop: ClosedLoop) -> tuple[Array, Array]:
    stages = (len(loop.preset) - 1) // loop.substeps
    accept = _follow(loop, np.ones(stages, dtype=np.int64))[1]
    return accept, _follow(loop, np.zeros(stages, dtype=np.int64))[1]


@njit(cache=True)
def _is_finite(loop: ClosedLoop) -> bool:
    motions = np.isfinite(loop.preset).all() and np.isfinite(loop.wanted).all() and np.isfinite(loop.chosen).all()
    keep = np.isfinite(loop.distances).all() and np.isfinite(loop.shares).all()
    return bool(motions and np.isfinite(loop.points).all() and keep and np.isfinite(loop.start).all())


@njit(cache=True)
def _limit(velocity: Array, max_speed: float) -> None:
    """Scale a velocity down to the speed limit, in place."""
    speed = np.sqrt(velocity[0] ** 2 + velocity[1] ** 2 + velocity[2] ** 2)
    if speed > max_speed:
        for a in range(3):
            velocity[a] *= max_speed / speed
