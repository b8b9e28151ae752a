"""The shipped deadlocks: somebody is stuck without the UAV, and a joint plan exists with room to spare."""

import numpy as np
import pytest
from feasible import joint_plan, shortest_length
from scenario.cases import DEADLOCKS

from airground_drake.base.arrays import Array
from airground_drake.model.geometry.outline import as_tuple
from airground_drake.scenario.load import load
from airground_drake.scenario.outlines import outlines_of
from airground_drake.scenario.schema import Scenario
from airground_drake.scenario.shapes import convex_parts
from airground_drake.sim.components import make_map, positions

ROOM_M = 0.1
MANY_POINTS = 50
"""The shortest path among more points takes too long; the plan of the team is one, too."""


POST_M = 0.25
"""Distance between points that stand for an edge: between two of them a robot comes 0.02 m nearer at most."""


def points_of(scenario: Scenario) -> Array:
    """Points, (m, 2), m, along the edges of all walls and obstacles at rest."""
    found = list[Array]()
    for barrier in (each for each in scenario.barriers.values() if not each.moves):
        for part in convex_parts(barrier) or [[(barrier.position_m[0], barrier.position_m[1])]]:
            corners = np.array(part)
            for begin, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
                shares = np.linspace(0.0, 1.0, 1 + int(np.ceil(np.linalg.norm(end - begin) / POST_M)))
                found.append(begin + shares[:, None] * (end - begin))
    return np.unique(np.concatenate(found), axis=0)


@pytest.mark.parametrize("name", DEADLOCKS)
def test_everybody_can_arrive_with_room_to_spare(name: str) -> None:
    scenario = load(name)
    safe, ugvs = scenario.safe_distance, scenario.ugvs.values()
    radius = max(ugv.radius_m for ugv in ugvs)
    centres = np.concatenate([points_of(scenario), np.reshape(scenario.uav.phantoms_m, (-1, 3))[:, :2]])
    starts, targets = (positions([getattr(each, at) for each in ugvs])[:, :2] for at in ("start_m", "target_m"))
    if len(centres) <= MANY_POINTS:
        for start, target in zip(starts, targets, strict=True):
            assert np.isfinite(shortest_length(start, target, centres, safe.obstacle_m + 2.0 * ROOM_M))
    plan = joint_plan(
        starts,
        targets,
        centres,
        obstacle_m=safe.obstacle_m + radius + ROOM_M,
        ugv_m=safe.ugv_m + 2.0 * radius + ROOM_M,
        speed_m_s=min(ugv.preset.speed_m_s for ugv in ugvs),
        duration_s=0.8 * scenario.duration_s,
    )
    assert plan is not None
    assert [*scenario.runs] in (["a", "b", "c", "d"], ["a", "d"])
    assert set(scenario.runs["d"].expected.values()) <= {"exercised", 1, 2}
    assert not scenario.runs["d"].stalls_m


def test_the_map_of_the_warehouse_is_wrong() -> None:
    scenario = load("warehouse")
    real = {as_tuple(row) for each in scenario.barriers.values() for row in outlines_of(scenario, each)}
    on_map = set(map(as_tuple, make_map(scenario, scenario.uav)[0]))
    assert (len(real - on_map), len(on_map - real)) == (1, 1)
