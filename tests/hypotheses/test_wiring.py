"""The built diagram against the scenario: it is as demanded, and broken variants of it are noticed."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import pytest
from builders.misbuilt import MISBUILT, Patch
from builders.worlds import among_points
from hypotheses.wiring import differences
from pydrake.systems.primitives import LinearSystem

from airground_drake.base.arrays import Array
from airground_drake.model.bodies.world import Neighbours
from airground_drake.model.geometry.outline import BASE, MIDDLE
from airground_drake.model.law.avoidance import Avoidance, limit_speed
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.scenario.load import load
from airground_drake.sim import diagram
from airground_drake.sim.blocks import controllers
from airground_drake.sim.blocks.plant import OwnPlant, declared
from airground_drake.uav.policy import Proposal


def uav_among(
    change: Callable[[Array], Array] = lambda centre: centre, edit: Callable[[Array], None] = lambda bound: None
) -> Patch:
    """The UAV's command by other inequalities: centres by `change`, bounds by `edit`."""

    def wrong(self: Avoidance, lower: Array, positions: Array, near: Neighbours) -> Array:
        still = np.tile(near.still[:, [MIDDLE, MIDDLE + 1, BASE]], (len(near.members), 1, 1))
        points = change(np.concatenate([still, positions[near.others]], axis=1))
        given = near.distance, near.share, near.mobility
        spaces = self.half_spaces(*among_points(positions[near.members], points, *given))
        edit(spaces.bound)
        return self.apply(limit_speed(lower, near.max_speed), spaces)

    return lambda patch: patch.setattr(Avoidance, "command", wrong)


def answering(rule: Callable[[Proposal | None, float], bool]) -> Patch:
    def wrong(proposals: Sequence[Proposal | None], answers: Array) -> list[Proposal | None]:
        return [p if rule(p, answers[2 * i]) else None for i, p in enumerate(proposals)]

    return lambda patch: patch.setattr(controllers, "accepted_proposals", wrong)


def swapped(patch: pytest.MonkeyPatch) -> None:
    right = UgvLaw.velocity

    def wrong(self: UgvLaw, *args: Any) -> Array:
        found: Array = right(self, *args)
        return found[::-1]

    patch.setattr(UgvLaw, "velocity", wrong)


MUTANTS: dict[str, Patch] = {name: patch for name, (patch, _) in MISBUILT.items()} | {
    "centres in another order": uav_among(lambda centre: np.roll(centre, 1, axis=1)),
    "one inequality dropped": uav_among(edit=lambda bound: bound[:, 0].fill(-np.inf)),
    "everything accepted": answering(lambda proposal, answer: True),
    "another proposal's answer": answering(lambda proposal, answer: answer == 1.0),
    "commands swapped": swapped,
}


@pytest.mark.parametrize("name", ["case_a", "case_b"])
def test_the_built_diagram_is_what_the_scenario_says(name: str) -> None:
    scenario = load(name)
    wrong, bound = differences(scenario)
    assert wrong == []
    robots = [*scenario.ugvs, scenario.uav.name]
    things = [*(f"obstacle {k}" for k in range(len(scenario.obstacles))), *robots]
    assert bound == {(robot, thing) for robot in robots for thing in things if robot != thing}


@pytest.mark.parametrize("name", MUTANTS)
def test_running_code_that_differs_from_the_scenario_is_noticed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    MUTANTS[name](monkeypatch)
    assert differences(load("case_a"))[0]


def test_plants_that_are_faster_than_commanded_are_noticed() -> None:
    eye, zero = np.eye(3), np.zeros((3, 3))

    def plant(start: Array) -> LinearSystem:
        found = LinearSystem(A=zero, B=1.1 * eye, C=eye, D=zero)
        found.configure_default_state(start)
        return found

    plants = {"ugv1": OwnPlant(plant, drift_m_s=0.0, cover_m=0.0)}
    wrong, _ = differences(declared(load("case_a"), plants), partial(diagram.build_model, plants=plants))
    assert "a plant does not move as its robot is commanded" in wrong
