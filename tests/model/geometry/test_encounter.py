"""The least distance of a way from a core is that of its segments, though most of them are passed over."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.model.geometry import convex, outline
from airground_drake.model.geometry.encounter import least_apart


@given(st.integers(0, 2**32 - 1), st.integers(2, 60), st.integers(1, 4), st.booleans())
def test_nothing_nearer_is_passed_over(seed: int, places: int, corners: int, planar: bool) -> None:
    rng = np.random.default_rng(seed)
    steps = rng.normal(size=(places, 3)) * rng.choice([0.02, 0.5], size=(places, 1))
    way = 2.0 * rng.normal(size=3) + np.cumsum(steps, axis=0)
    way[places // 2 : 2 * places // 3] = way[places // 2]
    if planar or rng.random() < 0.3:
        way[:, 2] = 0.0
    angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, corners))
    row = outline.prism(np.column_stack([np.cos(angles), np.sin(angles)]), top=float(rng.choice([0.0, 1.0])))
    due = convex.approaches(row, way[:-1], way[1:], planar)[0].min()
    assert least_apart(row, way, planar) == pytest.approx(due, abs=1e-12)
