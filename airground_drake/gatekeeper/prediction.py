"""(26) of one UGV from what it senses: mode velocities of (23) by rolling out its real closed loop."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from airground_drake.arrays import Array
from airground_drake.gatekeeper.closed_loop import ClosedLoop
from airground_drake.gatekeeper.problem import Problem
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.law import UgvLaw
from airground_drake.nsbc.motion import Motion


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
        terminal_weight: of the terminal cost, see `cost.error_weights`, s.
    """

    stages: int
    substeps: int
    error_weight: float
    slack_weight: float
    terminal_weight: float = 0.0


def predicted_problem(scene: Scene, law: UgvLaw, proposal: Proposal, horizon: Horizon) -> Problem:
    """(26) for one UGV: roll out both choices and keep the points that it senses and might come near."""
    scene = scene.restrict(np.linalg.norm(scene.centres - scene.position, axis=1) <= law.avoidance.sensing_range)
    loop = closed_loop(scene, law, proposal, horizon.stages, horizon.substeps)
    accept, refuse = loop.constant_plans()
    dt = horizon.substeps * law.avoidance.period
    after = dt * np.arange(1.0, horizon.stages + 1.0)
    squared = np.maximum(np.square(accept).sum(axis=1), np.square(refuse).sum(axis=1))
    # a plan that switches may be faster than both constant ones, but for a retreat not above the speed limit
    reach = dt * np.cumsum(np.sqrt(np.maximum(squared, scene.max_speed**2)))
    centres = scene.centres + after[:, None, None] * scene.velocities
    gap = np.linalg.norm(centres - scene.position, axis=2) - scene.distances - reach[:, None]
    height = np.abs(centres[:, :, 2] - scene.position[2]) - scene.distances
    near = ((gap < 0.0) & (height < 0.0)).any(axis=0)
    return Problem(
        dt=dt,
        initial=scene.position,
        accept=accept,
        refuse=refuse,
        reference=np.ascontiguousarray(loop.preset[horizon.substeps :: horizon.substeps]),
        centres=np.ascontiguousarray(centres[:, near]),  # the layout that the kernels are compiled for
        distances=scene.distances[near],
        error_weight=horizon.error_weight,
        slack_weight=horizon.slack_weight,
        terminal_weight=horizon.terminal_weight,
        loop=loop,
    )


def closed_loop(scene: Scene, law: UgvLaw, proposal: Proposal, stages: int, substeps: int) -> ClosedLoop:
    """The UGV's closed loop over `stages` of `substeps` control periods each.

    Args:
        scene: what the UGV senses now.
        law: its control law.
        proposal: the intervention in question.
        stages: N.
        substeps: control periods per stage.
    """
    h = law.avoidance.period
    after = h * np.arange(0.0, stages * substeps + 1.0)
    points = scene.centres + after[:, None, None] * scene.velocities
    return loop_among(scene, law, proposal, after, points, substeps)


def loop_among(
    scene: Scene, law: UgvLaw, proposal: Proposal, after: Array, points: Array, substeps: int = 1
) -> ClosedLoop:
    """The UGV's closed loop among points that move in any way.

    Args:
        scene: what the UGV knows; its `centres` and `velocities` are not looked at.
        law: its control law.
        proposal: the intervention in question.
        after: control samples from now on, (S + 1,), s.
        points: where the points are at these, (S + 1, K, 3), m.
        substeps: control periods per stage.
    """
    avoidance = law.avoidance
    t = scene.t + after
    return ClosedLoop(
        start=scene.position,
        preset=scene.preset.sample(t),
        wanted=proposal.motion.sample(t),
        chosen=proposal.chosen,
        points=points,
        distances=scene.distances,
        shares=scene.shares,
        max_speed=float(scene.max_speed),
        motion_gain=float(law.motion_gain),
        intervention_gain=float(law.intervention_gain),
        avoidance_gain=float(avoidance.gain),
        period=float(avoidance.period),
        sensing_range=float(avoidance.sensing_range),
        composition=avoidance.code,
        intervention_on_top=law.intervention_on_top,
        substeps=substeps,
    )
