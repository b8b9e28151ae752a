"""The ground plane: what of it is shown, and what says what is known of an obstacle."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure
from report.cases import make_scenario

from airground_drake.scenarios.schema import Obstacle
from airground_drake.view.plane import MAX_NAMED_OBSTACLES, draw_obstacles, frame_of


def test_a_frame_holds_ways_targets_radii_and_safe_circles() -> None:
    scenario = make_scenario()
    scenario.obstacles = {"rock": Obstacle([30.0, 0.0, 0.0], radius_m=1.0)}
    scenario.ugvs["ugv1"].radius_m, scenario.ugvs["ugv1"].target_m = 3.0, [0.0, 50.0, 0.0]
    frame = frame_of(scenario, [("ugv1", np.array([[-20.0, -9.0, 0.0], [0.0, 0.0, 0.0]]))])
    assert frame.right == pytest.approx(31.0 + scenario.safe_distance.obstacle_m, abs=0.5)
    assert (frame.left, frame.bottom, frame.top) == pytest.approx((-23.0, -12.0, 50.0), abs=1.5)
    assert frame.left < -23.0
    assert frame.bottom < -12.0


def test_obstacles_that_the_uav_does_not_know_are_hollow_and_few_obstacles_have_their_names() -> None:
    scenario = make_scenario()
    scenario.obstacles = {f"rock_{k}": Obstacle([float(k), 0.0, 0.0], known_to_uav=k != 1) for k in range(3)}
    scenario.obstacles["rock_2"].appears_s = 4.0
    scenario.uav.phantoms_m = [[9.0, 9.0, 0.0]]
    axes = Figure().subplots()
    said = [label.text for label in draw_obstacles(axes, scenario)]
    assert said == ["rock_0", "rock_1\n(unseen by the UAV)", "rock_2, from 4 s", "(only on the UAV's map)"]
    hollow = [float(line.get_xdata()[0]) for line in axes.lines if line.get_markerfacecolor() == "white"]
    assert hollow == [1.0]
    scenario.obstacles = {f"rock_{k}": Obstacle([float(k), 0.0, 0.0]) for k in range(MAX_NAMED_OBSTACLES + 1)}
    assert [label.text for label in draw_obstacles(axes, scenario)] == ["(only on the UAV's map)"]
