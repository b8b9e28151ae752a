"""The built diagram against the scenario: it is as demanded, and broken variants of it are noticed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from builders.misbuilt import MISBUILT, Patch
from hypotheses.wiring import differences
from pydrake.systems.primitives import LinearSystem

from airground_drake.base.arrays import Array
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Avoidance, Surroundings, limit_speed
from airground_drake.nsbc.law import UgvLaw
from airground_drake.scenarios.load import load
from airground_drake.systems import controllers, diagram
from airground_drake.world.world import Neighbours


def uav_among(change: Callable[[Array, int], Array], edit: Callable[[Array], None] = lambda bound: None) -> Patch:
    """The UAV's command by other inequalities: centres `change(centres, number of obstacles)`, bounds by `edit`."""

    def wrong(self: Avoidance, lower: Array, positions: Array, near: Neighbours) -> Array:
        around = Surroundings.of(near, positions)
        around = replace(around, centre=change(around.centre, len(near.still)))
        spaces = self.half_spaces(positions[near.members], near.mobility, around)
        edit(spaces.bound)
        return self.apply(limit_speed(lower, near.max_speed), spaces)

    return lambda patch: patch.setattr(Avoidance, "command", wrong)


def far(centre: Array, columns: slice) -> Array:
    moved = centre.copy()
    moved[:, columns] += 1e3
    return moved


def everything_accepted(patch: pytest.MonkeyPatch) -> None:
    def wrong(proposals: Sequence[Proposal | None], answers: Array) -> list[Proposal | None]:
        return list(proposals)

    patch.setattr(controllers, "accepted_proposals", wrong)


def any_issue_answered(patch: pytest.MonkeyPatch) -> None:
    def wrong(proposals: Sequence[Proposal | None], answers: Array) -> list[Proposal | None]:
        return [p if answers[2 * i] == 1.0 else None for i, p in enumerate(proposals)]

    patch.setattr(controllers, "accepted_proposals", wrong)


def swapped(patch: pytest.MonkeyPatch) -> None:
    """Two UGVs' commands exchanged on their way."""
    right = UgvLaw.velocity

    def wrong(self: UgvLaw, *args: Any) -> Array:
        found: Array = right(self, *args)
        return found[::-1]

    patch.setattr(UgvLaw, "velocity", wrong)


MUTANTS: dict[str, Patch] = {name: patch for name, (patch, _) in MISBUILT.items()} | {
    "gather leaves out the UAV": uav_among(lambda centre, m: far(centre, slice(-1, None))),
    "gather leaves out an obstacle": uav_among(lambda centre, m: far(centre, slice(0, min(m, 1)))),
    "gather leaves out the UGVs": uav_among(lambda centre, m: far(centre, slice(m, -1))),
    "gather in another order": uav_among(lambda centre, m: np.roll(centre, 1, axis=1)),
    "everything accepted": everything_accepted,
    "another proposal's answer": any_issue_answered,
    "commands swapped": swapped,
    "one inequality dropped": uav_among(lambda centre, m: centre, lambda bound: bound[:, 0].fill(-np.inf)),
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
