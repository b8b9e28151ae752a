"""The checker's closest velocities, where inequalities contradict each other, against linear programming."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from airground_drake.check import law
from airground_drake.check.law import ABOVE_LEAST, ABOVE_LEAST_M_S, Inequalities


def torn(seed: int, count: int, dimensions: int, opposite: bool) -> Inequalities:
    """Of inequalities n_k.v >= b_k in the plane (2) or in space (3) those samples that nothing meets."""
    random = np.random.default_rng(seed)
    normal = random.normal(size=(8, count, 3))
    normal[:, :, dimensions:] = 0.0
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    if opposite:
        normal[:, 1] = -normal[:, 0]
    bound = random.normal(1.0, 1.0, size=(8, count)) * 10.0 ** random.integers(-3, 2)
    given = Inequalities(normal, bound)
    return given.rows(np.array([least(*each) > 1e-6 for each in zip(normal, bound, strict=True)]))


def least(normal: np.ndarray, bound: np.ndarray) -> float:
    """What has to be missed at least, by linear programming."""
    rows = np.column_stack([-normal, -np.ones(len(bound))])
    found = linprog([0.0, 0.0, 0.0, 1.0], rows, -bound, bounds=[(None, None)] * 3 + [(0.0, None)], method="highs")
    return float(found.fun)


@given(st.integers(0, 10**6), st.integers(2, 7), st.sampled_from([2, 3]), st.booleans())
@settings(max_examples=25)
def test_no_more_is_missed_than_has_to_be(seed: int, count: int, dimensions: int, opposite: bool) -> None:
    given = torn(seed, count, dimensions, opposite)
    assume(len(given.bound))
    missed = -law.least_spare(law._least_missing(given), given)
    for found, normal, bound in zip(missed, *given, strict=True):
        due = least(normal, bound)
        assert found == pytest.approx((1.0 + ABOVE_LEAST) * due + ABOVE_LEAST_M_S, rel=1e-9, abs=1e-8)
        assert found <= bound.max()


@pytest.mark.parametrize("wrong", [0.0, 0.5, 2.0, np.inf])
def test_a_wrong_guess_costs_time_only(wrong: float, monkeypatch: pytest.MonkeyPatch) -> None:
    given = torn(1, 6, 2, opposite=False)
    right = law._least_missing(given)
    guess = law._equally_missing(given)
    monkeypatch.setattr(law, "_equally_missing", lambda given: np.where(guess > 0.0, guess * wrong, 0.0))
    assert law._least_missing(given) == pytest.approx(right, rel=1e-8, abs=1e-8)


def test_one_that_no_velocity_can_change_is_missed_by_all() -> None:
    """A point straight above: its normal has nothing in the plane."""
    given = Inequalities(np.zeros((1, 1, 3)), np.array([[0.25]]))
    assert law._least_missing(given).tolist() == [[0.0, 0.0, 0.0]]
    beside = Inequalities(np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]]), np.array([[0.25, 0.5]]))
    assert law._least_missing(beside)[0] == pytest.approx([0.25, 0.0, 0.0], abs=1e-8)
