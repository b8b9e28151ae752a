"""Faults of the running code, as patches, and what tests run them on."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.misbuilt import Patch

from airground_drake.base.arrays import Array
from airground_drake.model.bodies.kinds import Kind
from airground_drake.model.bodies.world import Neighbours, World
from airground_drake.model.geometry.outline import moved
from airground_drake.model.law import ugv_law as law
from airground_drake.sim import components, diagram
from airground_drake.sim.blocks import controllers
from airground_drake.uav import database
from airground_drake.uav.messages import accepted_proposals
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.patience import Commitment, Patience
from airground_drake.ugv.rollout import ClosedLoop

PATIENCE = ["gatekeeper.tries=1", "gatekeeper.longest_s=1.0", "gatekeeper.rest_s=3.0", "intervention.retry_s=0.5"]
"""A UGV goes along once, for 1 s, and then not before it has been on its own for 3 s."""


def gain(name: str, factor: float) -> Patch:
    made = components.make_law

    def wrong(*arguments: Any) -> law.UgvLaw:
        honest = made(*arguments)
        return replace(honest, **{name: factor * getattr(honest, name)})

    return lambda patch: patch.setattr(components, "make_law", wrong)


def formation_gain(patch: pytest.MonkeyPatch) -> None:
    made = diagram.UavController
    patch.setattr(diagram, "UavController", lambda *a, gain, **k: made(*a, gain=0.5 * gain, **k))


def no_feed_forward(patch: pytest.MonkeyPatch) -> None:
    made = controllers.FormationTask

    class Tasks:
        def load(self, name: str, of: type) -> Any:
            return lambda p, v, z, g: made(p, 0.0 * v, z, g)

    patch.setattr(diagram, "UAV_TASKS", Tasks())


def executed(choose: Callable[[list[Any], list[Any]], list[Any]]) -> Patch:
    """What is executed, from what was accepted at the sample before and what is accepted now."""
    before: list[list[Any]] = [[None, None], [None, None]]

    def accepted(proposals: Sequence[Proposal | None], answers: Array) -> list[Proposal | None]:
        now = accepted_proposals(proposals, answers)
        before[:] = [now, choose(before, now)]
        return before[1]

    return lambda patch: patch.setattr(controllers, "accepted_proposals", accepted)


def ugv2_avoids_nothing(patch: pytest.MonkeyPatch) -> None:
    honest = law.UgvLaw.velocity

    def velocity(self: Any, positions: Array, near: Neighbours, *rest: Any) -> Array:
        distance = near.distance.copy()
        distance[1] = -1e6
        return honest(self, positions, near._replace(distance=distance), *rest)

    patch.setattr(law.UgvLaw, "velocity", velocity)


def no_limit_of(kind: Kind) -> Patch:
    honest = World.around

    def around(self: World, rows: slice) -> Neighbours:
        near = honest(self, rows)
        return near._replace(max_speed=near.max_speed * (1e9 if rows == self.select(kind) else 1.0))

    return lambda patch: patch.setattr(World, "around", around)


def one_direction(patch: pytest.MonkeyPatch) -> None:
    """Not a mutant: proposals concern one direction."""
    along = np.array([[1.0, 0.0, 0.0]])
    patch.setattr(database, "Proposal", lambda *given, **more: Proposal(*given, selection=along, **more))


def selection_ignored(patch: pytest.MonkeyPatch) -> None:
    one_direction(patch)
    honest = law.UgvLaw.velocity

    def velocity(self: Any, positions: Array, near: Any, target: Array, rate: Array, asked: Any, *rest: Any) -> Array:
        everywhere = [None if one is None else one._replace(chosen=np.eye(3)) for one in asked]
        return honest(self, positions, near, target, rate, everywhere, *rest)

    patch.setattr(law.UgvLaw, "velocity", velocity)


FAR_UAV = "uav.start_m=[20.0, -30.0, 2.0]"
"""Far away, so that its limit matters."""


def sent_with(change: Callable[[dict[str, Any]], None]) -> Patch:
    def proposal(*given: Any, **more: Any) -> Proposal:
        change(more)
        return Proposal(*given, **more)

    return lambda patch: patch.setattr(database, "Proposal", proposal)


def moved_map(given: dict[str, Any]) -> None:
    given["mapped"] = moved(given["mapped"], np.array([1e-3, 0.0, 0.0]))


def with_law(name: str, value: Callable[[Any], Any]) -> Callable[[ClosedLoop], ClosedLoop]:
    return lambda loop: loop._replace(law=loop.law._replace(**{name: value(getattr(loop.law, name))}))


class NoRest(Patience):
    def rested(self, now: Commitment, t: float) -> Commitment:
        return now if now.executing else replace(now, tries=0)


class LateByASample(Patience):
    def over(self, now: Commitment, t: float) -> bool:
        return t >= now.until + 0.05
