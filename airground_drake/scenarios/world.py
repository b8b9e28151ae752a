"""The world of a scenario."""

from __future__ import annotations

import numpy as np

from airground_drake.geometry import convex
from airground_drake.scenarios.plants import plant_of
from airground_drake.scenarios.schema import Scenario, Uav, Ugv
from airground_drake.scenarios.shapes import outlines_of
from airground_drake.world.world import Body, Kind, World


def make_world(scenario: Scenario) -> World:
    """All bodies of a scenario, and the distances that they keep."""
    safe = scenario.safe_distance
    robots = [_robot(name, "ugv", ugv) for name, ugv in scenario.ugvs.items()]
    robots += [_robot(scenario.uav.name, "uav", scenario.uav)]
    obstacles = [
        Body(name, "obstacle", np.zeros(3), outlines_of(scenario, each), appears_s=each.appears_s)
        for name, each in scenario.barriers.items()
    ]
    apart: dict[frozenset[Kind], float] = {
        frozenset(("ugv",)): safe.ugv_m,
        frozenset(("ugv", "uav")): safe.air_ground_m,
    }
    return World((*robots, *obstacles), apart)


def _robot(name: str, kind: Kind, given: Ugv | Uav) -> Body:
    start = np.array(given.start_m, dtype=np.float64)
    return Body(name, kind, start, convex.balls(np.zeros(3), given.radius_m), plant_of(given), given.max_speed_m_s)
