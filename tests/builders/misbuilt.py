"""Controllers and teams that are built otherwise than the scenario says."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from airground_drake.model.bodies.kinds import Kind
from airground_drake.model.bodies.world import Body, Neighbours, World
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.sim import components
from airground_drake.sim.blocks import controllers

Patch = Callable[[pytest.MonkeyPatch], None]


def neighbours(change: Callable[[Neighbours], Neighbours]) -> Patch:
    right = World.around
    return lambda patch: patch.setattr(World, "around", lambda self, rows: change(right(self, rows)))


def distances(factor: float, *kinds: Kind) -> Patch:
    def apply(patch: pytest.MonkeyPatch) -> None:
        right = World.apart

        def wrong(self: World, first: Kind, second: Kind) -> float:
            return right(self, first, second) * (factor if {first, second} == set(kinds) else 1.0)

        patch.setattr(World, "apart", wrong)

    return apply


def to_obstacles(factor: float) -> Patch:
    return neighbours(lambda given: given._replace(distance=np.where(given.share < 1.0, 1.0, factor) * given.distance))


def shares(value: float) -> Patch:
    return neighbours(lambda given: given._replace(share=np.where(given.share < 1.0, value, given.share)))


def layer(**changed: Any) -> Patch:
    right = components.make_avoidance

    def wrong(*args: Any) -> Avoidance:
        return replace(right(*args), **changed)

    return lambda patch: patch.setattr(components, "make_avoidance", wrong)


def on_top(patch: pytest.MonkeyPatch) -> None:
    right = components.make_law
    patch.setattr(components, "make_law", lambda *args: replace(right(*args), intervention_on_top=True))


def unlayered(patch: pytest.MonkeyPatch) -> None:
    class Blind(controllers.UavController):
        def __init__(self, world: World, avoidance: Avoidance, **given: Any) -> None:
            super().__init__(world, replace(avoidance, sensing_range=0.0), **given)

    patch.setattr("airground_drake.sim.diagram.UavController", Blind)


speeding = neighbours(lambda given: given._replace(max_speed=1.5 * given.max_speed))


def half_rate(patch: pytest.MonkeyPatch) -> None:
    class Slow(controllers.UgvController):
        def __init__(self, world: World, law: UgvLaw) -> None:
            period = law.avoidance.period
            super().__init__(world, replace(law, avoidance=replace(law.avoidance, period=2.0 * period)))
            self.avoidance = law.avoidance
            self.law = law

    patch.setattr("airground_drake.sim.blocks.positions.UgvController", Slow)


MISBUILT: dict[str, tuple[Patch, str]] = {
    "distance UAV/UGV times 0.9999": (distances(0.9999, "ugv", "uav"), "safe_m"),
    "distance UGV/UGV times 1.000001": (distances(1.000001, "ugv"), "safe_m"),
    "distance to obstacles times 0.9": (to_obstacles(0.9), "safe_m"),
    "share 0.51 for robots": (shares(0.51), "share"),
    "no gain": (layer(gain=0.0), "gain_1_s"),
    "range cut": (layer(sensing_range=2.1), "sensing_range_m"),
    "twice the period": (layer(period=0.1), "sampling_s"),
    "planar mobility lost": (lambda patch: patch.setattr(Body, "mobility", np.ones(3)), "mobility"),
    "intervention on top": (on_top, "intervention_on_top"),
    "UAV without its layer": (unlayered, "sensing_range_m"),
    "speed limits times 1.5": (speeding, "max_speed_m_s"),
    "UGVs at half the rate": (half_rate, "sampling_s"),
}
"""What is wrong: how it comes about, and the parameter of a controller that shows it."""
