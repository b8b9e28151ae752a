"""Bounds of distances against the distances themselves."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.verify.engines.boxes import ROWS, apart_at_least, boxes_of
from airground_drake.verify.engines.segments import closest_approach
from airground_drake.verify.runs.pairs import least_of


@given(st.integers(0, 2**32 - 1), st.integers(1, 3 * ROWS), st.floats(0.01, 10.0))
def test_no_pair_comes_nearer_than_its_boxes(seed: int, rows: int, step: float) -> None:
    rng = np.random.default_rng(seed)
    positions = rng.normal(size=(4, 1, 3)) * 5.0 + np.cumsum(step * rng.normal(size=(4, rows, 3)), axis=1)
    first, second = np.triu_indices(4, 1)
    least = apart_at_least(boxes_of(positions), first, second)
    t = np.arange(float(rows))
    exact = [closest_approach(t, positions[i], positions[j]).distance_m for i, j in zip(first, second, strict=True)]
    assert (least <= exact).all()


def test_boxes_of_things_that_stand_touch_them() -> None:
    places = np.repeat(np.array([[[0.0, 0.0, 0.0]], [[3.0, 4.0, 0.0]]]), 40, axis=1)
    assert abs(apart_at_least(boxes_of(places), np.array([0]), np.array([1]))[0] - 5.0) < 1e-8


@given(st.lists(st.tuples(st.floats(0.0, 9.0), st.floats(0.0, 3.0)), max_size=30), st.integers(1, 8))
def test_the_least_values_are_found_from_their_bounds(pairs: list[tuple[float, float]], most: int) -> None:
    values = [bound + more for bound, more in pairs]
    found = least_of(np.array([bound for bound, _ in pairs]), most, values.__getitem__)
    assert found == sorted(found)
    assert sorted(values[k] for k in found) == sorted(values)[:most]
