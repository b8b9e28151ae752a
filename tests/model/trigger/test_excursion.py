"""The least and the largest decision variable over a step, against sampling and by hand."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.base.arrays import Array
from airground_drake.model.trigger.excursion import extremes

NUMBER = st.floats(-10.0, 10.0) | st.sampled_from([0.0, 1e-160, -1e-12, 3.0])
PARTS = st.tuples(NUMBER, NUMBER, NUMBER, NUMBER)


def x_at(before: Array, after: Array, share: Array) -> Array:
    way = before + share[:, None] * (after - before)
    return np.linalg.norm(way[:, :3], axis=1) + way[:, 3]


def ranges(before: Array, after: Array) -> Array:
    x = [np.linalg.norm(parts[:, :3], axis=1) + parts[:, 3] for parts in (before, after)]
    return extremes(before, after, np.array(x))


@examples(200)
@given(before=PARTS, after=PARTS)
def test_no_sample_is_outside_and_both_ends_are_met(before: tuple[float, ...], after: tuple[float, ...]) -> None:
    one, other = np.array(before), np.array(after)
    least, most = ranges(one[None], other[None])[:, 0]
    sampled = x_at(one, other, np.linspace(0.0, 1.0, 4001))
    slack = 1e-12 * (1.0 + np.abs([*before, *after]).max())
    assert least - slack <= sampled.min() <= least + 0.01 * np.linalg.norm(other - one) + slack
    assert sampled.max() - slack <= most <= sampled.max() + slack


def test_by_hand() -> None:
    before = np.array([[3.0, 1.0, 0.0, 0.0], [3.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0]])
    after = np.array([[-3.0, 1.0, 0.0, 0.0], [-3.0, 0.0, 0.0, 3.0], [1.0, 0.0, 0.0, -2.0], [2.0, 0.0, 0.0, 0.0]])
    least, most = ranges(before, after)
    assert least.tolist() == [1.0, 1.5, -1.0, 2.0]  # passes at 1 m; through the origin; noise alone; at rest
    np.testing.assert_allclose(most, [np.sqrt(10.0), 6.0, 1.0, 2.0])
