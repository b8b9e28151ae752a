"""The checker's bounds of distances."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.check.run import ROWS, least_apart_m
from airground_drake.check.scenario import Pair
from airground_drake.verify.engines.geometry import closest_approach


@given(st.integers(0, 2**32 - 1), st.integers(2, 3 * ROWS), st.floats(0.01, 10.0))
def test_no_pair_comes_nearer_than_its_balls(seed: int, rows: int, step: float) -> None:
    rng = np.random.default_rng(seed)
    ways = {name: 5.0 * rng.normal(size=3) + np.cumsum(step * rng.normal(size=(rows, 3)), axis=0) for name in "abc"}
    pairs = [Pair(one, other, 1.0, 0.0, 1.0, 0.5) for one, other in ("ab", "ac", "bc")]
    exact = [closest_approach(np.arange(float(rows)), ways[p.robot], ways[p.other]).distance_m for p in pairs]
    assert (least_apart_m(ways, pairs) <= exact).all()
