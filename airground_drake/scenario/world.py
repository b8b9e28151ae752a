"""The world of a scenario."""

import math

import numpy as np

from airground_drake.model.bodies.kinds import Kind
from airground_drake.model.bodies.world import Body, World
from airground_drake.model.geometry import outline
from airground_drake.model.plants.scripted import Scripted
from airground_drake.scenario.courses import course
from airground_drake.scenario.outlines import outlines_of
from airground_drake.scenario.plants import plant_of
from airground_drake.scenario.rounding import SPARE_S
from airground_drake.scenario.schema import Obstacle, Scenario, Uav, Ugv


def make_world(scenario: Scenario) -> World:
    safe = scenario.safe_distance
    control = scenario.control
    robots = [_robot(scenario, name, "ugv", ugv) for name, ugv in scenario.ugvs.items()]
    robots += [_robot(scenario, name, "uav", uav) for name, uav in scenario.aerial.items()]
    obstacles = [_obstacle(scenario, name, body) for name, body in scenario.barriers.items()]
    obstacles.sort(key=lambda body: body.plant is None)
    apart: dict[frozenset[Kind], float] = {
        frozenset(("ugv",)): safe.ugv_m,
        frozenset(("ugv", "uav")): safe.air_ground_m,
        frozenset(("uav",)): safe.uav_m,
    }
    return World(
        (*robots, *obstacles), apart, control.avoidance_gain_1_s, scenario.unsure_s and scenario.unsure_s + SPARE_S
    )


def _obstacle(scenario: Scenario, name: str, given: Obstacle) -> Body:
    start, plant = np.zeros(3), None
    if given.moves:
        way = course(given.moves, scenario.control.period_s, scenario.duration_s)
        start, plant = way.at(0.0)[0], Scripted(way, given.known_motion)
    until = given.disappears_s or math.inf
    return Body(
        name, "obstacle", start, outlines_of(scenario, given), plant, given.expected_speed_m_s, given.appears_s, until
    )  # fmt: skip


def _robot(scenario: Scenario, name: str, kind: Kind, given: Ugv | Uav) -> Body:
    plant = plant_of(given, scenario.control.period_s)
    start = plant.steered(np.array(given.start_m, dtype=np.float64))
    shape = outline.balls(np.zeros(3), given.radius_m)
    return Body(name, kind, start, shape, plant, given.max_speed_m_s, **scenario.seen(name))
