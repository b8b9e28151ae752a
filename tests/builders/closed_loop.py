"""A UGV among random discs, and the running controller's law step by step."""

from __future__ import annotations

from copy import copy

import numpy as np

from airground_drake.gatekeeper.problem import Horizon, Problem, predicted_problem
from airground_drake.gatekeeper.rollout import ClosedLoop, View, closed_loop
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.law import UgvLaw
from airground_drake.systems.controllers import UgvController
from airground_drake.world.world import World
from builders.worlds import world

H = 0.0625
"""Control period, s: a binary fraction, so that vertices of motions can lie exactly on control samples."""


AVOIDANCE = Avoidance(3.0, H, 4.0)


FAR = np.array([-30.0, 0.0, 2.0])


class Instance:
    """A UGV among random discs, and another robot passing: its scene, law and controller."""

    def __init__(self, seed: int, *, on_top: bool = False, obstacles: int | None = None, moving: bool = True) -> None:
        rng = np.random.default_rng(seed)
        count = int(rng.integers(0, 5)) if obstacles is None else obstacles
        angle = rng.uniform(-np.pi, np.pi, count)
        discs = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)]) * rng.uniform(2.1, 3.5, (count, 1))
        self.other = np.array([*rng.uniform(2.0, 3.0, 2), 0.0])
        self.drift = np.array([*rng.uniform(-2.0, 0.5, 2), 0.0]) if moving else np.zeros(3)
        self.discs = discs
        self.law = UgvLaw(AVOIDANCE, 2.0, 1.5, on_top)

        def travel(vertices: int, speed: float) -> Motion:
            times = np.concatenate([[-1.0], np.sort(rng.choice(np.arange(1, 64), vertices - 1, replace=False)) * H])
            steps = rng.normal(size=(vertices, 3)) * [1, 1, 0]
            steps *= speed * np.diff(times, prepend=-1.0)[:, None] / np.linalg.norm(steps, axis=1)[:, None]
            return Motion(times, np.cumsum(steps, axis=0))

        self.preset = travel(2, 0.8)
        selection = np.eye(3) if rng.random() < 0.7 else np.array([[rng.normal(), rng.normal(), 0.0]])
        self.proposal = Proposal("way", 0.0, travel(4, 2.8), selection)
        near = self.world.around(slice(0, 1))
        self.scene = View(
            0.0, np.zeros(3), self.preset, np.vstack([discs, self.other, FAR]),
            np.vstack([np.zeros_like(discs), self.drift, np.zeros(3)]), near.distance[0], near.share[0], 3.0,
        )  # fmt: skip

    @property
    def world(self) -> World:
        return world(("ugv1", "ugv2"), self.discs, 2.0, 1.0, 1.0, max_speed=[3.0, 3.0, 9.0])

    @property
    def controller(self) -> UgvController:
        return UgvController(self.world, self.law)

    def problem(self, stages: int, substeps: int = 1, error_weight: float = 1.0) -> Problem:
        return predicted_problem(self.scene, self.law, self.proposal, Horizon(stages, substeps, error_weight, 200.0))

    def loop(self, stages: int, substeps: int = 1) -> ClosedLoop:
        return closed_loop(self.scene, self.law, self.proposal, stages, substeps)


def run_controller(case: Instance, sensed: np.ndarray, answers: np.ndarray, substeps: int) -> np.ndarray:
    """Positions at the ends of the stages by calling the running controller's law step by step."""
    known = copy(case)
    known.discs = case.discs[sensed[:-2]]
    controller = known.controller
    position, ends = np.zeros(3), []
    for k in range(len(answers) * substeps):
        t = k * H
        other = case.other + t * case.drift if sensed[-2] else FAR
        at, rate = case.preset.at(t)
        velocity = controller.velocity(
            t, np.array([position, other, FAR]), np.array([at, other]), np.array([rate, np.zeros(3)]),
            [case.proposal if answers[k // substeps] else None, None],
        )  # fmt: skip
        position = position + H * velocity[0]
        if (k + 1) % substeps == 0:
            ends.append(position)
    return np.array(ends)
