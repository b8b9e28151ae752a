"""Bounds of a probability: against another implementation, and by what they promise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from scipy.stats import binom, binomtest

from airground_drake.campaign.statistics import clopper_pearson, confidence_sequence


@examples(100, fuzz=5000)
@given(st.integers(0, 300).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_the_exact_interval_is_scipys(case: tuple[int, int]) -> None:
    k, n = case
    found = clopper_pearson(k, n)
    if n:
        expected = binomtest(k, n).proportion_ci(0.95, method="exact")
        assert found == pytest.approx((expected.low, expected.high), abs=1e-12)
    else:
        assert found == (0.0, 1.0)


@pytest.mark.parametrize("p", [0.001, 0.05, 0.5, 0.9])
def test_the_exact_interval_covers_for_every_fixed_number(p: float) -> None:
    n = 60
    k = np.arange(n + 1)
    covered = [low <= p <= high for low, high in (clopper_pearson(int(each), n) for each in k)]
    assert binom.pmf(k, n, p) @ covered >= 0.95


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
def test_the_sequence_contains_the_share_and_the_exact_interval_where_it_is_narrow(case: tuple[int, int]) -> None:
    k, n = case
    low, high = confidence_sequence(k, n)
    assert 0.0 <= low <= k / n <= high <= 1.0
    exact = clopper_pearson(k, n, 0.5)
    assert low <= exact.low + 1e-12
    assert high >= exact.high - 1e-12


def test_nothing_seen_in_ten_thousand() -> None:
    assert confidence_sequence(0, 10_000).high < 1.3e-3
    assert clopper_pearson(0, 10_000).high < 3.7e-4
