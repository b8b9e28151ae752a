"""Who keeps what distance from whom: the kind of pair, and both radii."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.team import Team

TEAM = Team(
    ("one", "two"), "uav", np.array([[5.0, 0.0, 0.0], [9.0, 0.0, 0.0]]), 2.0, 1.5, 1.0, np.ones(3),
    radius=np.array([0.5, 0.25, 0.125]), obstacle_radius=np.array([3.0, 0.0]),
)  # fmt: skip


def test_distances_of_a_pair() -> None:
    around = TEAM.neighbourhood(slice(None))
    assert around.distance.tolist() == [
        [5.5, 2.5, 2.25, 1.625],  # shelf, point, two, UAV
        [5.25, 2.25, 2.25, 1.375],
        [5.125, 2.125, 1.625, 1.375],
    ]
    assert TEAM.neighbourhood(slice(1, 2)).distance.tolist() == [around.distance[1].tolist()]


def test_both_of_a_pair_keep_the_same_to_the_bit() -> None:
    found = replace(TEAM, radius=np.array([0.1, 0.7, 1e-3])).pair_distance()
    assert np.array_equal(found, found.T)


def test_points_keep_the_distance_of_their_kind() -> None:
    points = replace(TEAM, radius=0.0, obstacle_radius=0.0).neighbourhood(slice(None)).distance
    assert points.tolist() == [[2.0, 2.0, 1.5, 1.0], [2.0, 2.0, 1.5, 1.0], [2.0, 2.0, 1.0, 1.0]]


def test_ugvs_stay_on_the_ground_whatever_is_above_them() -> None:
    """Only the UAV has a third direction; what a UGV avoids from below pushes it sideways at most."""
    assert TEAM.mobility.tolist() == [[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0]]
    places = np.array([[0.0, 0.0, 0.0], [40.0, 0.0, 0.0], [0.1, 0.0, 1.0]])
    avoidance = Avoidance(gain=3.0, period=0.05)
    spaces = avoidance.half_spaces(places, TEAM.mobility, TEAM.neighbourhood(slice(None)).around(places))
    velocity = avoidance.apply(np.zeros((3, 3)), spaces)
    assert velocity[0, 0] < -0.1  # away from below the UAV
    assert velocity[:2, 2].tolist() == [0.0, 0.0]
    assert velocity[2, 2] > 0.1
