"""The way of an obstacle that moves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.scenario.courses import course
from airground_drake.scenario.schema import Moves

TIMES = st.floats(0.01, 5.0)


@given(st.lists(st.tuples(TIMES, TIMES), min_size=2, max_size=5, unique=True), TIMES, TIMES, st.sampled_from(
    ["stop", "reverse", "loop"]), st.sampled_from([0.025, 0.05, 0.1, 1.0 / 3.0]))  # fmt: skip
def test_it_is_straight_between_control_samples_and_no_faster_than_it_says(
    corners: list[tuple[float, float]], speed: float, start: float, at_end: str, period: float
) -> None:
    moves = Moves([[x, y, 0.0] for x, y in corners], speed, start, at_end)
    way = course(moves, period, 20.0)
    steps = way.times / period
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    assert way.max_speed <= speed * (1.0 + 1e-6)
    assert start - 1e-6 <= way.times[0] < start + period
    assert way.positions[: len(corners)].tolist() == moves.waypoints_m[: len(way.positions)]
    assert at_end == "stop" or way.end >= 20.0


@pytest.mark.parametrize(
    ("at_end", "xs"),
    [("stop", [0, 1, 2, 3, 3, 3, 3, 3]), ("reverse", [0, 1, 2, 3, 2, 1, 0, 1]), ("loop", [0, 1, 2, 3, 0, 1, 2, 3])],
)
def test_what_it_does_at_the_end(at_end: str, xs: list[int]) -> None:
    """A loop leads straight back to the first waypoint, at the same speed."""
    way = course(Moves([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]], 1.0, 0.0, at_end), 0.05, 9.0)
    found = [float(way.at(float(t))[0][0]) for t in range(8)]
    assert found == pytest.approx(xs if at_end != "loop" else [0, 1, 2, 3, 2, 1, 0, 1])
