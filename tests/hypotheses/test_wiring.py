"""The built diagram against the scenario: it is as demanded, and 25 broken variants of it are noticed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from hypotheses.wiring import differences
from pydrake.systems.primitives import LinearSystem

from airground_drake.base.arrays import Array
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc import team as team_module
from airground_drake.nsbc.avoidance import Avoidance, HalfSpaces, Surroundings
from airground_drake.nsbc.law import UgvLaw
from airground_drake.nsbc.team import Neighbourhood, Team
from airground_drake.scenarios.load import load
from airground_drake.scenarios.schema import Scenario
from airground_drake.systems import components, controllers, diagram

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


def gathered(change: Callable[[Array, int], Array]) -> Patch:
    """Another `kernels.gather`: `change(centres, number of obstacles)`."""
    right = team_module.kernels.gather

    def wrong(self: Neighbourhood, positions: Array) -> Surroundings:
        centre = change(right(positions, self.obstacles, self.others), len(self.obstacles))
        return Surroundings(centre, self.distance, self.share)

    return lambda patch: patch.setattr(Neighbourhood, "around", wrong)


def far(centre: Array, columns: slice) -> Array:
    moved = centre.copy()
    moved[:, columns] += 1e3
    return moved


def layer(**changed: Any) -> Patch:
    right = components.make_avoidance

    def wrong(*args: Any) -> Avoidance:
        return replace(right(*args), **changed)

    return lambda patch: patch.setattr(components, "make_avoidance", wrong)


def everything_accepted(patch: pytest.MonkeyPatch) -> None:
    def wrong(proposals: Sequence[Proposal | None], answers: Array) -> list[Proposal | None]:
        return list(proposals)

    patch.setattr(controllers, "accepted_proposals", wrong)


def any_issue_answered(patch: pytest.MonkeyPatch) -> None:
    def wrong(proposals: Sequence[Proposal | None], answers: Array) -> list[Proposal | None]:
        return [p if answers[2 * i] == 1.0 else None for i, p in enumerate(proposals)]

    patch.setattr(controllers, "accepted_proposals", wrong)


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


def swapped(patch: pytest.MonkeyPatch) -> None:
    """Two UGVs' commands exchanged on their way."""
    right = UgvLaw.velocity

    def wrong(self: UgvLaw, *args: Any) -> Array:
        found: Array = right(self, *args)
        return found[::-1]

    patch.setattr(UgvLaw, "velocity", wrong)


def half_rate(patch: pytest.MonkeyPatch) -> None:
    """The UGVs sampled at half the rate."""

    class Slow(controllers.UgvController):
        def __init__(self, team: Team, law: UgvLaw) -> None:
            period = law.avoidance.period
            super().__init__(team, replace(law, avoidance=replace(law.avoidance, period=2.0 * period)))
            self.avoidance = law.avoidance
            self.law = law

    patch.setattr("airground_drake.systems.diagram.UgvController", Slow)


def first_half_space_dropped(patch: pytest.MonkeyPatch) -> None:
    right = Avoidance.half_spaces

    def wrong(self: Avoidance, *args: Any) -> HalfSpaces:
        found = right(self, *args)
        bound = found.bound.copy()
        bound[0, 0] = -np.inf
        return HalfSpaces(found.normal, bound)

    patch.setattr(Avoidance, "half_spaces", wrong)


MUTANTS: dict[str, Patch] = {
    "distance UAV/UGV times 0.9": distance_between(True, 0.9),
    "distance UAV/UGV times 0.9999": distance_between(True, 0.9999),
    "distance UGV/UGV times 0.9": distance_between(False, 0.9),
    "distance UGV/UGV times 1.1": distance_between(False, 1.1),
    "distance to obstacles times 0.9": obstacle_distance(0.9),
    "share 1 for robots": shares(1.0),
    "share 0 for robots": shares(0.0),
    "share 0.51 for robots": shares(0.51),
    "gather leaves out the UAV": gathered(lambda centre, m: far(centre, slice(-1, None))),
    "gather leaves out an obstacle": gathered(lambda centre, m: far(centre, slice(0, min(m, 1)))),
    "gather leaves out the UGVs": gathered(lambda centre, m: far(centre, slice(m, -1))),
    "gather in another order": gathered(lambda centre, m: np.roll(centre, 1, axis=1)),
    "no gain": layer(gain=0.0),
    "range cut": layer(sensing_range=2.1),
    "twice the period": layer(period=0.1),
    "everything accepted": everything_accepted,
    "another proposal's answer": any_issue_answered,
    "planar mobility lost": mobility_lost,
    "intervention on top": on_top,
    "UAV without its layer": unlayered,
    "speed limits times 1.5": speeding,
    "commands swapped": swapped,
    "UGVs at half the rate": half_rate,
    "one inequality dropped": first_half_space_dropped,
}


@pytest.mark.parametrize("name", ["case_a", "case_b"])
def test_the_built_diagram_is_what_the_scenario_says(name: str) -> None:
    scenario = load(name)[0]
    wrong, bound = differences(scenario)
    assert wrong == []
    robots = [*scenario.ugvs, scenario.uav.name]
    things = [*(f"obstacle {k}" for k in range(len(scenario.obstacles))), *robots]
    assert bound == {(robot, thing) for robot in robots for thing in things if robot != thing}


@pytest.mark.parametrize("name", MUTANTS)
def test_running_code_that_differs_from_the_scenario_is_noticed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    MUTANTS[name](monkeypatch)
    assert differences(load("case_a")[0])[0]


def test_plants_that_are_faster_than_commanded_are_noticed() -> None:
    eye, zero = np.eye(3), np.zeros((3, 3))

    def plant(robot: str, start: Array) -> LinearSystem:
        found = LinearSystem(A=zero, B=1.1 * eye, C=eye, D=zero)
        found.configure_default_state(start)
        return found

    wrong, _ = differences(load("case_a")[0], partial(diagram.build_model, plants=plant))
    assert "a plant does not move as its robot is commanded" in wrong


@pytest.mark.parametrize("factor", [1.0 - 1e-6, 1.0 + 1e-6])
def test_a_millionth_of_a_distance_is_noticed(factor: float, monkeypatch: pytest.MonkeyPatch) -> None:
    distance_between(True, factor)(monkeypatch)
    assert differences(load("case_a")[0])[0]
