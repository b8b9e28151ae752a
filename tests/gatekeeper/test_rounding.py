"""Sum-up rounding (28)-(29)."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airground_drake.gatekeeper.relaxation import rounding_deviation, sum_up_rounding


@given(arrays(np.float64, st.integers(1, 120), elements=st.floats(0.0, 1.0)))
def test_sum_up_rounding_stays_within_half_a_stage(relaxed: np.ndarray) -> None:
    binary = sum_up_rounding(relaxed)
    assert set(binary.tolist()) <= {0.0, 1.0}
    assert rounding_deviation(relaxed, binary, 0.05) <= 0.025 + 1e-12


def test_sum_up_rounding_follows_28_and_29_literally() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        relaxed = rng.integers(0, 9, 30) / 8.0  # sums are exact, and ties occur
        both = np.column_stack([relaxed, 1.0 - relaxed])
        chosen = np.zeros_like(both)
        for k in range(30):
            h = both[: k + 1].sum(axis=0) - chosen[:k].sum(axis=0)
            chosen[k, 0 if h[0] >= h[1] else 1] = 1.0
        np.testing.assert_array_equal(sum_up_rounding(relaxed), chosen[:, 0])
