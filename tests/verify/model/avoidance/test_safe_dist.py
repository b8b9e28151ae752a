"""SAFE-DIST."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from airground_drake.nsbc.avoidance import Avoidance, Surroundings
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.avoidance import disturbed_runs
from airground_drake.verify.model.avoidance.safe_dist import SafeDist
from airground_drake.verify.model.avoidance.safe_inv import SafeInv


def test_the_disturbed_bound_is_tight(inputs: dict[str, Any]) -> None:
    """Pinned to an obstacle by the disturbance alone, the robot approaches d - w/A and no further bound would hold."""
    run = disturbed_runs.attack(inputs, disturbed_runs.scenes(inputs)[0], "idle")
    assert 0.0 <= run["worst_margin_m"] < 1e-6
    assert run["unmet"] == run["broken"] == 0


def test_disturbed_deficit_follows_the_recursion(inputs: dict[str, Any]) -> None:
    """(1 - (1 - A h)^N) w/A after N periods, as the statement says, on the running layer."""
    gain, h, w, d = inputs["avoidance_gain_1_s"], inputs["period_s"], inputs["disturbance_m_s"], 2.0
    avoidance, x = Avoidance(gain, h), np.array([[d, 0.0, 0.0]])
    around = Surroundings(np.zeros((1, 1, 3)), np.full((1, 1), d), np.ones((1, 1)))
    for n in range(1, 40):
        v = avoidance.apply(np.array([[-5.0, 0.0, 0.0]]), avoidance.half_spaces(x, np.ones((1, 3)), around))
        x = x + h * (v - [[w, 0.0, 0.0]])
        assert d - x[0, 0] == pytest.approx((1 - (1 - gain * h) ** n) * w / gain, abs=1e-11)


def test_contradictory_inequalities_are_counted_and_not_covered(found: dict[str, Finding]) -> None:
    """A robot squeezed between another and an obstacle cannot meet both: the claim says nothing there, and says so."""
    rows = {row["scene"]: row for row in found["SAFE-DIST"].evidence["runs"]}
    assert rows["squeezed"]["unmet"] > 0
    assert rows["obstacle"]["unmet"] == rows["ugv_pair"]["unmet"] == 0
    assert all(row["broken"] == 0 for row in rows.values())
    assert found["SAFE-DIST"].where["scene"] != "squeezed"


def test_without_gain_nothing_is_restored(case_a: Scenario) -> None:
    case_a.control.avoidance_gain_1_s = 0.0
    assert SafeDist().judge(SafeDist().inputs(case_a)).status == "inconclusive"
    finding = SafeInv().judge(SafeInv().inputs(case_a))
    assert finding.status == "inconclusive"
    assert finding.margin is None
    assert "A = 0" in finding.evidence["reason"]
