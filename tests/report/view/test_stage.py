"""What a stage has of walls: how large they are drawn, where they end, and what of the arena."""

import numpy as np
import pytest
from report.cases import make_scenario

from airground_drake.report.view.draw import barrier_path, draw, served
from airground_drake.report.view.stage import HIGHEST, Barrier, arena_of, barriers_of, stage
from airground_drake.scenario.schema import Moves, Obstacle, Scenario

U = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]]


def scenario_with(**obstacles: Obstacle) -> Scenario:
    scenario = make_scenario()
    scenario.obstacles = obstacles
    return scenario


def length(barrier: Barrier) -> float:
    return float(np.linalg.norm(barrier.rim[1] - barrier.rim[0], axis=1).sum())


def test_the_rim_goes_once_round_all_parts_together() -> None:
    own = 0.5
    straight, bent, box = barriers_of(
        scenario_with(
            straight=Obstacle(segment_m=[[0.0, 0.0], [3.0, 0.0], [7.0, 0.0]], distance_m=own),
            bent=Obstacle(segment_m=U, distance_m=own),
            box=Obstacle([0.0, 0.0, 0.0], size_m=[2.0, 1.0], radius_m=0.25, heading_rad=0.3, distance_m=own),
        )
    )
    assert length(straight) == pytest.approx(2.0 * 7.0 + 2.0 * np.pi * own, rel=0.02)
    outside, inside = 4.0 + 3.0 + 4.0 + np.pi * own, 2.0 * (4.0 - own) + 3.0 - 2.0 * own
    twice = np.pi * own  # the quarters of a circle at two corners belong to two parts each
    assert length(bent) == pytest.approx(outside + inside + 2.0 * np.pi * own + twice, rel=0.02)
    assert length(box) == pytest.approx(6.0 + 2.0 * np.pi * (own + 0.25), rel=0.02)


def test_a_stage_holds_walls_to_their_tops_if_these_are_no_higher_than_twice_a_robot() -> None:
    low = stage(scenario_with(box=Obstacle([50.0, 0.0, 0.0], size_m=[2.0, 40.0], height_m=3.5)))
    away = make_scenario().safe_distance.obstacle_m
    assert low.high_m == pytest.approx([51.0 + away, 20.0 + away, 3.5])
    assert low.low_m[1] == pytest.approx(-20.0 - away)
    high = stage(scenario_with(box=Obstacle([50.0, 0.0, 0.0], size_m=[2.0, 40.0], height_m=1e5)))
    assert high.high_m[2] == HIGHEST * make_scenario().uav.start_m[2]


def test_what_moves_stands_where_it_starts_within_bounds_that_hold_its_way() -> None:
    way = Moves([[10.0, 0.0, 0.0], [10.0, 30.0, 0.0], [-40.0, 30.0, 0.0]], 1.0)
    (cart,) = barriers_of(scenario_with(cart=Obstacle(size_m=[2.0, 1.0], moves=way, distance_m=0.5, disappears_s=9.0)))
    assert (cart.place_m.tolist(), cart.disappears_s) == ([10.0, 0.0, 0.0], 9.0)
    assert np.concatenate(cart.corners) == pytest.approx([-41.5, -1.0, 11.5, 31.0])
    assert np.mean(cart.body[0], axis=0).tolist() == [10.0, 0.0]


def test_an_arena_is_a_frame_and_the_one_that_surfaces_keep_to_and_no_barrier() -> None:
    scenario = scenario_with(rock=Obstacle([0.0, 0.0, 0.0]))
    assert arena_of(scenario) == ()
    scenario.arena_m = [[30.0, -20.0], [-10.0, 40.0]]
    frame, inner = arena_of(scenario)
    gap = scenario.safe_distance.obstacle_m
    assert frame.tolist() == [[-10.0, -20.0], [30.0, -20.0], [30.0, 40.0], [-10.0, 40.0]]
    assert inner == pytest.approx(frame + gap * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]))
    made = stage(scenario)
    assert [each.name for each in made.barriers] == ["rock"]
    assert (made.low_m[:2].tolist(), made.high_m[:2].tolist()) == ([-10.0, -20.0], [30.0, 40.0])


def test_meshcat_takes_walls_posts_and_an_arena() -> None:
    scenario = scenario_with(
        wall=Obstacle(segment_m=U, height_m=1.0), post=Obstacle([20.0, 3.0, 0.0], height_m=2.0)
    )  # fmt: skip
    scenario.arena_m = [[-90.0, -90.0], [90.0, 90.0]]
    meshcat = served()
    draw(meshcat, stage(scenario))
    for k in range(2):
        assert all(meshcat.HasPath(f"{barrier_path(k)}/{part}") for part in ("body", "safe", "rim"))
    assert all(meshcat.HasPath(f"/arena/{part}") for part in ("walls", "frame", "safe"))
