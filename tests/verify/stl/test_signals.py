"""Signals of the formulas."""

from __future__ import annotations

import numpy as np
import pytest

from airground_drake.verify.stl.signals import square


@pytest.mark.parametrize(
    ("intervals", "inside"),
    [
        ([], []),
        ([(0.0, 1.0)], [(0.0, 1.0)]),
        ([(-1.0, 1.0)], [(0.0, 1.0)]),
        ([(2.0, 3.0), (1.0, 2.5)], [(1.0, 3.0)]),
        ([(1.0, 2.0), (2.0, 4.0)], [(1.0, 4.0)]),
        ([(1.0, 4.0), (2.0, 3.0), (5.0, 9.0)], [(1.0, 4.0), (5.0, 9.0)]),
    ],
)
def test_square_signals(intervals: list[tuple[float, float]], inside: list[tuple[float, float]]) -> None:
    t, value = square(intervals, 8.0)
    assert t[0] == 0.0
    assert (np.diff(t) > 0.0).all()
    assert t[-1] >= 8.0
    for at in np.arange(0.0, 8.0, 0.25):
        held = value[np.searchsorted(t, at, side="right") - 1]
        assert held == (1.0 if any(a <= at < b for a, b in inside) else -1.0)
