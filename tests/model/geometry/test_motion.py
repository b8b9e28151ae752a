"""Motions along waypoints."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.model.geometry import moving
from airground_drake.model.geometry.motion import Motion


def test_motion_interpolates_and_rests_at_its_ends() -> None:
    motion = Motion.at_speed(np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0]]), 0.5, start=1.0)
    assert motion.end == 7.0
    for t, position, rate in [
        (0.0, [0, 0, 0], [0, 0, 0]),
        (1.0, [0, 0, 0], [0.5, 0, 0]),
        (3.0, [1, 0, 0], [0.5, 0, 0]),
        (5.0, [2, 0, 0], [0, 0.5, 0]),
        (9.0, [2, 1, 0], [0, 0, 0]),
    ]:
        np.testing.assert_allclose(motion.at(t)[0], position, atol=1e-12)
        np.testing.assert_allclose(motion.at(t)[1], rate, atol=1e-12)
        np.testing.assert_allclose(motion.sample(np.array([t]))[0], position, atol=1e-12)


@pytest.mark.parametrize(
    ("times", "positions"),
    [([], np.zeros((0, 3))), ([0, 0], np.zeros((2, 3))), ([0, np.nan], np.zeros((2, 3))), ([0, 1], np.zeros((2, 2)))],
)
def test_bad_motions_are_refused(times: list[float], positions: np.ndarray) -> None:
    with pytest.raises(ValueError, match="motion"):
        Motion(np.array(times), positions)


@given(st.lists(st.floats(0.1, 2.0), min_size=1, max_size=5), st.floats(-1.0, 12.0))
def test_the_compiled_motion_is_the_same_to_the_bit(steps: list[float], t: float) -> None:
    times = np.cumsum(steps)
    motion = Motion(times, np.random.default_rng(len(steps)).normal(size=(len(times), 3)))
    for ours, compiled in zip(motion.at(t), moving.at(motion.times, motion.positions, motion.slopes, t), strict=True):
        assert ours.tolist() == compiled.tolist()
