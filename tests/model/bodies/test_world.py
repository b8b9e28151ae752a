"""Who keeps what distance from whom, in which order, and how bodies move."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.worlds import world
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airground_drake.model.bodies.kinds import ROBOTS
from airground_drake.model.bodies.motion import PeriodMotion
from airground_drake.model.bodies.world import Body, World
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.plants.first_order import FirstOrder

WORLD = world(
    ("one", "two"), [[5.0, 0.0, 0.0], [9.0, 0.0, 0.0]], 2.0, 1.5, 1.0,
    radius=np.array([0.5, 0.25, 0.125]), obstacle_radius=np.array([3.0, 0.0]),
)  # fmt: skip
VECTORS = arrays(np.float64, (4, 3), elements=st.floats(-9.0, 9.0))


def test_distances_and_shares() -> None:
    near = WORLD.around(WORLD.select(*ROBOTS))
    assert near.distance.tolist() == [
        [5.5, 2.5, 2.25, 1.625],  # shelf, point, two, UAV
        [5.25, 2.25, 2.25, 1.375],
        [5.125, 2.125, 1.625, 1.375],
    ]
    assert WORLD.around(slice(1, 2)).distance.tolist() == [near.distance[1].tolist()]
    assert near.share.tolist() == [[1.0, 1.0, 0.5, 0.5]] * 3


@given(st.lists(st.floats(0.0, 5.0), min_size=5, max_size=5))
def test_both_of_a_pair_keep_the_same_to_the_bit_and_their_shares_make_one(radii: list[float]) -> None:
    found = world(2, np.zeros((2, 3)), radius=np.array(radii[:3]), obstacle_radius=np.array(radii[3:]))
    near = found.around(found.select(*ROBOTS))
    assert (near.share[:, :2] == 1.0).all()
    for i, others in enumerate(near.others):
        for column, j in enumerate(others, start=2):
            back = 2 + int(np.flatnonzero(near.others[j] == i)[0])
            assert near.distance[i, column] == near.distance[j, back]
            assert near.share[i, column] + near.share[j, back] == 1.0


@pytest.mark.parametrize(
    ("bodies", "told"),
    [
        (WORLD.bodies[::-1], "in the order"),
        (WORLD.bodies[:1] * 2, "same name"),
        ((replace(WORLD.bodies[0], plant=None),), "needs a plant"),
        ((*WORLD.bodies, replace(WORLD.bodies[-1], name="cart", plant=FirstOrder())), "in the order"),
    ],
)
def test_a_world_in_another_order_is_refused(bodies: tuple, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        World(bodies, {})


def test_ugvs_stay_on_the_ground_whatever_is_above_them() -> None:
    """Only the UAV has a third direction; what a UGV avoids from below pushes it sideways at most."""
    places = np.array([[0.0, 0.0, 0.0], [40.0, 0.0, 0.0], [0.1, 0.0, 1.0]])
    velocity = Avoidance(gain=3.0, period=0.05).command(np.zeros((3, 3)), places, WORLD.around(slice(0, 3)))
    assert velocity[0, 0] < -0.1  # away from below the UAV
    assert velocity[:2, 2].tolist() == [0.0, 0.0]
    assert velocity[2, 2] > 0.1


@given(VECTORS, VECTORS, VECTORS, VECTORS, st.floats(0.0, 2.0))
def test_no_point_of_two_motions_is_nearer_than_the_least_distance(
    start: np.ndarray, end: np.ndarray, other: np.ndarray, moved: np.ndarray, off: float
) -> None:
    apart = PeriodMotion(start, end, off).seen_from(PeriodMotion(other, moved))
    least, share = apart.least_distance()
    change = apart.end - apart.start
    for s in np.linspace(0.0, 1.0, 9):
        assert (np.maximum(np.linalg.norm(apart.start + s * change, axis=-1) - off, 0.0) >= least - 1e-9).all()
    nearest = np.linalg.norm(apart.start + share[:, None] * change, axis=-1)
    np.testing.assert_allclose(np.maximum(nearest - off, 0.0), least, atol=1e-12)


@pytest.mark.parametrize(("kind", "speed"), [("truck", 1.0), ("ugv", -2.0), ("ugv", np.nan)])
def test_a_body_of_no_kind_or_speed_is_refused(kind: Any, speed: float) -> None:
    with pytest.raises(ValueError, match=r"'robot' is .*; allowed: "):
        Body("robot", kind, np.zeros(3), max_speed_m_s=speed)
