"""Controllers and teams that are built otherwise than the scenario says, for whoever must notice it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from airground_drake.base.arrays import Array
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.law import UgvLaw
from airground_drake.nsbc.team import Neighbourhood, Team
from airground_drake.scenarios.schema import Scenario
from airground_drake.systems import components, controllers

Patch = Callable[[pytest.MonkeyPatch], None]


def distance_between(first_uav: bool, factor: float) -> Patch:
    right = Team.pair_distance

    def wrong(self: Team) -> Array:
        found = right(self)
        rows = np.arange(len(found))
        with_uav = (rows == rows[-1]) | (rows == rows[-1])[:, None]
        return np.where(with_uav == first_uav, factor * found, found)

    return lambda patch: patch.setattr(Team, "pair_distance", wrong)


def neighbourhood(change: Callable[[Team, Neighbourhood], Neighbourhood]) -> Patch:
    right = Team.neighbourhood
    return lambda patch: patch.setattr(Team, "neighbourhood", lambda self, rows: change(self, right(self, rows)))


def shares(value: float) -> Patch:
    return neighbourhood(lambda team, given: replace(given, share=np.where(given.share < 1.0, value, given.share)))


def obstacle_distance(factor: float) -> Patch:
    def change(team: Team, given: Neighbourhood) -> Neighbourhood:
        obstacle = np.arange(given.distance.shape[1]) < len(team.obstacles)
        return replace(given, distance=np.where(obstacle, factor * given.distance, given.distance))

    return neighbourhood(change)


def layer(**changed: Any) -> Patch:
    right = components.make_avoidance

    def wrong(*args: Any) -> Avoidance:
        return replace(right(*args), **changed)

    return lambda patch: patch.setattr(components, "make_avoidance", wrong)


def mobility_lost(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Team, "mobility", property(lambda self: np.ones((len(self.robots), 3))))


def on_top(patch: pytest.MonkeyPatch) -> None:
    right = components.make_law
    patch.setattr(components, "make_law", lambda *args: replace(right(*args), intervention_on_top=True))


def unlayered(patch: pytest.MonkeyPatch) -> None:
    """The UAV without its layer."""

    class Blind(controllers.UavController):
        def __init__(self, team: Team, avoidance: Avoidance, **given: Any) -> None:
            super().__init__(team, replace(avoidance, sensing_range=0.0), **given)

    patch.setattr("airground_drake.systems.diagram.UavController", Blind)


def speeding(patch: pytest.MonkeyPatch) -> None:
    right = components.make_team

    def wrong(scenario: Scenario) -> Team:
        found = right(scenario)
        return replace(found, max_speed=1.5 * found.max_speed)

    patch.setattr(components, "make_team", wrong)


def half_rate(patch: pytest.MonkeyPatch) -> None:
    """The UGVs sampled at half the rate."""

    class Slow(controllers.UgvController):
        def __init__(self, team: Team, law: UgvLaw) -> None:
            period = law.avoidance.period
            super().__init__(team, replace(law, avoidance=replace(law.avoidance, period=2.0 * period)))
            self.avoidance = law.avoidance
            self.law = law

    patch.setattr("airground_drake.systems.diagram.UgvController", Slow)


MISBUILT: dict[str, tuple[Patch, str]] = {
    "distance UAV/UGV times 0.9": (distance_between(True, 0.9), "safe_m"),
    "distance UAV/UGV times 0.9999": (distance_between(True, 0.9999), "safe_m"),
    "distance UGV/UGV times 0.9": (distance_between(False, 0.9), "safe_m"),
    "distance UGV/UGV times 1.1": (distance_between(False, 1.1), "safe_m"),
    "distance UGV/UGV times 1.000001": (distance_between(False, 1.000001), "safe_m"),
    "distance to obstacles times 0.9": (obstacle_distance(0.9), "safe_m"),
    "share 1 for robots": (shares(1.0), "share"),
    "share 0 for robots": (shares(0.0), "share"),
    "share 0.51 for robots": (shares(0.51), "share"),
    "no gain": (layer(gain=0.0), "gain_1_s"),
    "range cut": (layer(sensing_range=2.1), "sensing_range_m"),
    "twice the period": (layer(period=0.1), "sampling_s"),
    "planar mobility lost": (mobility_lost, "mobility"),
    "intervention on top": (on_top, "intervention_on_top"),
    "UAV without its layer": (unlayered, "sensing_range_m"),
    "speed limits times 1.5": (speeding, "max_speed_m_s"),
    "UGVs at half the rate": (half_rate, "sampling_s"),
}
"""What is wrong: how it comes about, and the parameter of a controller that shows it."""
