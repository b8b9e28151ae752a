"""Mode velocities of (23) by rolling out the real closed loop of one UGV under each choice."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from numba import njit

from airground_drake.gatekeeper.problem import Problem
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.kernels import avoid_one, fill_half_spaces
from airground_drake.nsbc.motion import Motion
from airground_drake.nsbc.task import Array


@dataclass(frozen=True)
class UgvLaw:
    """The numbers of a UGV's control law, as `systems.UgvController` runs it.

    Attributes:
        avoidance: the set-based layer.
        motion_gain: B of (6), 1/s.
        intervention_gain: Lambda of (14), 1/s.
        intervention_on_top: priorities of (20) (methods (b), (c)); False: avoidance above the intervention.
    """

    avoidance: Avoidance
    motion_gain: float
    intervention_gain: float
    intervention_on_top: bool


@dataclass(frozen=True, eq=False)
class Scene:
    """What a UGV senses when it decides.

    Attributes:
        t: time, s.
        position: own position, (3,), m.
        preset: own preset trajectory.
        centres: obstacles and other robots, (K, 3), m.
        velocities: their velocities, taken as constant, (K, 3), m/s.
        distances: safe distances to them, (K,), m.
        shares: share of each avoidance inequality, (K,).
        max_speed: own speed limit, m/s.
    """

    t: float
    position: Array
    preset: Motion
    centres: Array
    velocities: Array
    distances: Array
    shares: Array
    max_speed: float

    def restrict(self, sensed: npt.NDArray[np.bool_]) -> Scene:
        """The same scene with only the points (K,) that are marked as sensed."""
        return replace(
            self,
            centres=self.centres[sensed],
            velocities=self.velocities[sensed],
            distances=self.distances[sensed],
            shares=self.shares[sensed],
        )


@dataclass(frozen=True)
class Horizon:
    """Discretisation and weights of (25)-(27).

    Attributes:
        stages: N.
        substeps: control periods per stage.
        error_weight: a_i of (25), 1/(m^2 s).
        slack_weight: b_i of (25), 1/(m^2 s).
    """

    stages: int
    substeps: int
    error_weight: float
    slack_weight: float


def predicted_problem(scene: Scene, law: UgvLaw, proposal: Proposal, horizon: Horizon) -> Problem:
    """(26) for one UGV: roll out both choices and keep the points that it senses and might come near."""
    scene = scene.restrict(np.linalg.norm(scene.centres - scene.position, axis=1) <= law.avoidance.sensing_range)
    dt = horizon.substeps * law.avoidance.period
    accept, refuse = mode_velocities(scene, law, proposal, horizon.stages, horizon.substeps)
    after = dt * np.arange(1.0, horizon.stages + 1.0)
    fastest = np.sqrt(np.maximum(np.square(accept).sum(axis=1), np.square(refuse).sum(axis=1)))
    reach = dt * np.cumsum(fastest)
    centres = scene.centres + after[:, None, None] * scene.velocities
    gap = np.linalg.norm(centres - scene.position, axis=2) - scene.distances - reach[:, None]
    height = np.abs(centres[:, :, 2] - scene.position[2]) - scene.distances
    near = ((gap < 0.0) & (height < 0.0)).any(axis=0)
    return Problem(
        dt=dt,
        initial=scene.position,
        accept=accept,
        refuse=refuse,
        reference=scene.preset.sample(scene.t + after),
        centres=np.ascontiguousarray(centres[:, near]),  # a layout that the kernels are compiled for
        distances=scene.distances[near],
        error_weight=horizon.error_weight,
        slack_weight=horizon.slack_weight,
    )


def mode_velocities(scene: Scene, law: UgvLaw, proposal: Proposal, stages: int, substeps: int) -> tuple[Array, Array]:
    """Mean velocity of each stage with the proposal accepted and refused throughout: two (N, 3), m/s.

    Args:
        scene: what the UGV senses now.
        law: its control law.
        proposal: the intervention in question.
        stages: N.
        substeps: control periods per stage.
    """
    h = law.avoidance.period
    t = scene.t + h * np.arange(0.0, stages * substeps + 1.0)
    preset = scene.preset.sample(t)
    wanted = proposal.motion.sample(t)
    velocities = [
        _roll_out(
            accept, scene.position, preset, wanted, proposal.chosen, scene.centres, scene.velocities, scene.distances,
            scene.shares, scene.max_speed, law.motion_gain, law.intervention_gain, law.avoidance.gain, h,
            law.avoidance.sensing_range, law.avoidance.code, law.intervention_on_top,
        )
        for accept in (True, False)
    ]  # fmt: skip
    accepted, refused = (v.reshape(stages, substeps, 3).mean(axis=1) for v in velocities)
    return accepted, refused


@njit(cache=True)
def _roll_out(
    accept: bool,
    start: Array,
    preset: Array,
    wanted: Array,
    chosen: Array,
    centres: Array,
    velocities: Array,
    distances: Array,
    shares: Array,
    max_speed: float,
    motion_gain: float,
    intervention_gain: float,
    avoidance_gain: float,
    h: float,
    sensing_range: float,
    composition: int,
    on_top: bool,
) -> Array:
    """Velocities (S, 3) of the closed loop over S control periods; rates are those of the sampled motions."""
    count = len(preset) - 1
    mobility = np.array([1.0, 1.0, 0.0])
    position, moved = start.copy(), centres.copy()
    normal, bound = np.empty(centres.shape), np.empty(len(centres))
    own, task, ask = np.empty(3), np.empty(3), np.empty(3)
    result = np.empty((count, 3))
    for k in range(count):
        fill_half_spaces(position, moved, distances, shares, avoidance_gain, h, mobility, sensing_range, normal, bound)
        for a in range(3):
            rate, error = (preset[k + 1, a] - preset[k, a]) / h, preset[k, a] - position[a]
            own[a] = mobility[a] * (rate + motion_gain * error)
            rate, error = (wanted[k + 1, a] - wanted[k, a]) / h, wanted[k, a] - position[a]
            ask[a] = mobility[a] * (rate + intervention_gain * error)
        _limit(own, max_speed)
        if accept:
            below = avoid_one(own, normal, bound, composition) if on_top else own
            for a in range(3):
                task[a] = below[a]  # chosen @ ask + (I - chosen) @ below
                for b in range(3):
                    task[a] += chosen[a, b] * (ask[b] - below[b])
            _limit(task, max_speed)
            velocity = task if on_top else avoid_one(task, normal, bound, composition)
        else:
            velocity = avoid_one(own, normal, bound, composition)
        for a in range(3):
            result[k, a] = velocity[a]
            position[a] += h * velocity[a]
            for c in range(len(moved)):
                moved[c, a] += h * velocities[c, a]
    return result


@njit(cache=True)
def _limit(velocity: Array, max_speed: float) -> None:
    """Scale a velocity down to the speed limit, in place."""
    speed = np.sqrt(velocity[0] ** 2 + velocity[1] ** 2 + velocity[2] ** 2)
    if speed > max_speed:
        for a in range(3):
            velocity[a] *= max_speed / speed
