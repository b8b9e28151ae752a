"""The world of a scenario."""

from __future__ import annotations

import numpy as np

from airground_drake.scenarios.plants import plant_of
from airground_drake.scenarios.schema import Scenario, Uav, Ugv
from airground_drake.world.shape import Ball
from airground_drake.world.world import Body, Kind, World


def make_world(scenario: Scenario) -> World:
    """All bodies of a scenario, and the distances that they keep."""
    safe = scenario.safe_distance
    robots = [_robot(name, "ugv", ugv) for name, ugv in scenario.ugvs.items()]
    robots += [_robot(scenario.uav.name, "uav", scenario.uav)]
    obstacles = [
        Body(
            name, "obstacle", np.array(each.position_m, dtype=np.float64), Ball(each.radius_m),
            appears_s=each.appears_s,
        )
        for name, each in scenario.obstacles.items()
    ]  # fmt: skip
    apart: dict[frozenset[Kind], float] = {
        frozenset(("ugv",)): safe.ugv_m,
        frozenset(("ugv", "uav")): safe.air_ground_m,
        frozenset(("ugv", "obstacle")): safe.obstacle_m,
        frozenset(("uav", "obstacle")): safe.obstacle_m,
    }
    return World((*robots, *obstacles), apart)


def _robot(name: str, kind: Kind, given: Ugv | Uav) -> Body:
    start = np.array(given.start_m, dtype=np.float64)
    return Body(name, kind, start, Ball(given.radius_m), plant_of(given), given.max_speed_m_s)
