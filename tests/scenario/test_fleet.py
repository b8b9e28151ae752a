"""Generated fleets."""

import math
from itertools import combinations

import pytest
import yaml

from airground_drake.scenario.fleet import fleet
from airground_drake.scenario.load import from_data
from airground_drake.scenario.shipped import shipped_files


def test_the_shipped_fleet_is_what_the_generator_makes() -> None:
    assert shipped_files()["fleet"].read_text(encoding="utf-8").endswith("\n" + fleet(20, 100))


@pytest.mark.parametrize(("ugvs", "obstacles"), [(3, 0), (1, 1), (3, 1), (7, 40), (40, 5)])
def test_any_size_is_a_valid_scenario_with_room_between_things(ugvs: int, obstacles: int) -> None:
    scenario = from_data(yaml.safe_load(fleet(ugvs, obstacles, seed=3)), "a fleet")
    assert (len(scenario.ugvs), len(scenario.obstacles)) == (ugvs, obstacles)
    rocks = [obstacle.position_m for obstacle in scenario.obstacles.values()]
    places = [*rocks, *(place for ugv in scenario.ugvs.values() for place in (ugv.start_m, ugv.target_m))]
    assert all(
        math.dist(one, other) > 2.0 * scenario.safe_distance.obstacle_m for one, other in combinations(places, 2)
    )
    middles = [[0.5 * (a + b) for a, b in zip(u.start_m, u.target_m, strict=True)] for u in scenario.ugvs.values()]
    blocked = sum(any(math.dist(middle, rock) < 0.01 for rock in rocks) for middle in middles)
    assert blocked == min(ugvs // 3, obstacles)
    assert ("interventions" in scenario.runs["d"].expected) == (blocked > 0)


def test_another_seed_is_another_field() -> None:
    assert fleet(3, 5, seed=1) == fleet(3, 5, seed=1) != fleet(3, 5, seed=2)
