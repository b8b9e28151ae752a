"""Bounds of a probability: against another implementation, and by what they promise."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from scipy.stats import binomtest

from airground_drake.study.campaign.statistics import clopper_pearson, confidence_sequence


@examples(100, fuzz=5000)
@given(st.integers(1, 300).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_the_exact_interval_is_scipys(case: tuple[int, int]) -> None:
    expected = binomtest(*case).proportion_ci(0.95, method="exact")
    assert clopper_pearson(*case) == pytest.approx((expected.low, expected.high), abs=1e-12)


@pytest.mark.parametrize("p", [0.02, 0.3])
def test_the_sequence_covers_for_all_numbers_at_once(p: float) -> None:
    rng = np.random.default_rng(5)
    lost = 0
    for _ in range(120):
        counts = np.cumsum(rng.random(200) < p)
        bounds = [confidence_sequence(int(k), n) for n, k in enumerate(counts, 1)]
        lost += not all(low <= p <= high for low, high in bounds)
    assert lost <= 0.05 * 120 + 3.0 * (0.05 * 0.95 * 120) ** 0.5


@examples(100, fuzz=5000)
@given(st.integers(1, 10**6).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_the_sequence_contains_the_share_and_a_narrow_exact_interval(case: tuple[int, int]) -> None:
    (k, n), (low, high), exact = case, confidence_sequence(*case), clopper_pearson(*case, 0.5)
    assert 0.0 <= low <= k / n <= high <= 1.0
    assert low <= exact.low + 1e-12
    assert high >= exact.high - 1e-12


def test_extremes() -> None:
    assert confidence_sequence(0, 0) == clopper_pearson(0, 0) == (0.0, 1.0)
    assert confidence_sequence(0, 10_000).high < 1.3e-3
