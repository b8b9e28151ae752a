"""Ways that are left, round circles."""

from __future__ import annotations

import numpy as np
import pytest

from airground_drake.check.foresight import _way_around_m

START, GOAL = np.zeros(3), np.array([10.0, 0.0, 0.0])


def ring(number: int) -> np.ndarray:
    """Centres on a circle of 3 m around the start."""
    angle = 2.0 * np.pi * np.arange(number) / number
    return np.stack([3.0 * np.cos(angle), 3.0 * np.sin(angle), 0.0 * angle], axis=1)


def test_a_start_that_is_shut_in_has_no_way() -> None:
    assert _way_around_m(START, GOAL, ring(12), np.full(12, 1.0)) == np.inf


def test_a_start_inside_a_circle_has_no_way() -> None:
    discs = np.array([[0.5, 0.0, 0.0], [5.0, 0.0, 0.0]])
    assert _way_around_m(START, GOAL, discs, np.array([1.0, 1.0])) == np.inf


def test_a_way_round_one_circle_is_little_longer_than_tangents_and_an_arc() -> None:
    tangent = np.sqrt(5.0**2 - 1.0)
    least = 2.0 * tangent + 2.0 * np.arcsin(1.0 / 5.0)
    found = _way_around_m(START, GOAL, np.array([[5.0, 0.0, 0.0]]), np.array([1.0]))
    assert found == pytest.approx(least, rel=2e-3)
    assert found >= least
