"""Ways that are left, round circles."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from airground_drake.check import foresight, rollouts
from airground_drake.check.foresight import _way_around_m
from airground_drake.check.run import read_run

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


def test_what_is_rolled_out_beside_a_loop_changes_nothing(report: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Places, ends and integrals of a run's loops, one after the other and all of them side by side."""
    run = read_run(report / "trace" / "d", "d", json.loads((report / "report.json").read_text(encoding="utf-8")))
    together = foresight.foreseen.__wrapped__(run)
    monkeypatch.setattr(rollouts, "TOGETHER", 1)
    alone = foresight.foreseen.__wrapped__(run)
    assert together.keys() == alone.keys()
    assert len({len(rolled.places_m) for pair in alone.values() for rolled in pair}) > 1
    for asked, pair in alone.items():
        for one, other in zip(pair, together[asked], strict=True):
            assert np.allclose(one.places_m, other.places_m, rtol=0.0, atol=1e-9)
            assert (one.stalls, one.home) == (other.stalls, other.home)
            assert one.integral_m2_s == pytest.approx(other.integral_m2_s, rel=1e-9)
