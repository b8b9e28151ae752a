"""The checker's bounds of distances."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.check import metrics, safety
from airground_drake.check.nearness import ROWS, least_apart_m
from airground_drake.check.rules import Disagreement
from airground_drake.check.run import Run, read_run
from airground_drake.check.scenario import Pair
from airground_drake.verify.engines.segments import closest_approach


@given(st.integers(0, 2**32 - 1), st.integers(2, 3 * ROWS), st.floats(0.01, 10.0))
def test_no_pair_comes_nearer_than_its_balls(seed: int, rows: int, step: float) -> None:
    rng = np.random.default_rng(seed)
    ways = {name: 5.0 * rng.normal(size=3) + np.cumsum(step * rng.normal(size=(rows, 3)), axis=0) for name in "abc"}
    pairs = [Pair(one, other, 1.0, 1.0, 0.5) for one, other in ("ab", "ac", "bc")]
    exact = [closest_approach(np.arange(float(rows)), ways[p.robot], ways[p.other]).distance_m for p in pairs]
    assert (least_apart_m(ways, pairs) <= exact).all()


@pytest.fixture(scope="module")
def judged(report: Path) -> tuple[Run, dict[str, Any], dict[str, Any]]:
    """A run, its claim SAFE-TRACE, and its metrics."""
    document = json.loads((report / "report.json").read_text(encoding="utf-8"))
    claim = next(claim for claim in document["claims"] if (claim["id"], claim["run"]) == ("SAFE-TRACE", "d"))
    return read_run(report / "trace" / "d", "d", document), claim, document["runs"]["d"]["metrics"]


def test_the_pairs_that_are_listed_are_those_of_least_margin(
    judged: tuple[Run, dict[str, Any], dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    run, claim, _ = judged
    monkeypatch.setattr(safety, "MOST_LISTED", 3)
    pairs = sorted(claim["evidence"]["pairs"], key=lambda pair: float(pair["margin_m"]))
    listed = {**claim, "evidence": {**claim["evidence"], "pairs": pairs[:3]}}
    assert safety.safe_trace(run, listed).exercised == (claim["exercised"],) * 2
    listed["evidence"]["pairs"] = [*pairs[:2], pairs[-1]]
    with pytest.raises(Disagreement, match="a pair that is not listed is farther apart"):
        safety.safe_trace(run, listed)


def test_the_obstacles_in_the_metrics_are_those_of_least_margin(
    judged: tuple[Run, dict[str, Any], dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    run, _, recorded = judged
    monkeypatch.setattr(metrics, "MOST_OBSTACLES", 1)

    def keeping(rank: int) -> dict[str, Any]:
        ranked = {
            robot: sorted(found.items(), key=lambda one: float(one[1]["value"]))
            for robot, found in recorded["min_distance_m"].items()
        }
        return {**recorded, "min_distance_m": {robot: dict([found[rank]]) for robot, found in ranked.items()}}

    metrics.check_metrics(run, keeping(0))
    with pytest.raises(Disagreement, match="an obstacle that is not in the metrics is farther"):
        metrics.check_metrics(run, keeping(-1))
