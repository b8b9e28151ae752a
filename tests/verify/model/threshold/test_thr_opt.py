"""THR-OPT."""

from __future__ import annotations

import numpy as np
import pytest
from verify.model.threshold.cases import INPUTS, TABLE_1

from airground_drake.decision.bayes import bayes_risk, optimal_threshold
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.threshold.thr_opt import ThrOpt


@pytest.mark.parametrize("name", INPUTS)
def test_no_threshold_on_a_grid_is_better(found: dict[str, tuple[Finding, Finding]], name: str) -> None:
    constants = [INPUTS[name][key] for key in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2")]
    zeta = found[name][0].evidence["running_threshold_m"]
    best = bayes_risk(zeta, *constants)
    assert all(bayes_risk(z, *constants) > best for z in zeta * np.geomspace(1e-3, 20.0, 200))


def test_table_1_is_optimal_for_two_drifts(found: dict[str, tuple[Finding, Finding]]) -> None:
    """About 6.07 m/s, and one beyond any robot here; as printed, for two others."""
    drifts = found["table 1"][1].evidence["enclosures"]
    assert drifts["drift_low_m_s"][0] == pytest.approx(6.0667, abs=1e-4)
    assert drifts["drift_high_m_s"][0] == pytest.approx(99.015, abs=1e-3)
    for name in ("drift_low_m_s", "drift_high_m_s"):
        assert optimal_threshold(drifts[name][0], 10.0, 0.5, 1.0) == pytest.approx(3.0, rel=1e-9)
        assert optimal_threshold(drifts[f"printed_{name}"][0], 10.0, 1.0, 0.5) == pytest.approx(3.0, rel=1e-9)


def test_a_threshold_that_is_optimal_for_no_drift() -> None:
    finding = ThrOpt().check(TABLE_1 | {"zeta_m": 30.0})
    assert finding.status == "proved"
    assert finding.evidence["statements"]["drift_none"] == "true"
    assert all(optimal_threshold(drift, 10.0, 0.5, 1.0) < 30.0 for drift in np.geomspace(1e-3, 1e3, 100))


@pytest.mark.parametrize("name", ["table 1", "audit"])
def test_slope_with_a_deviation_is_that_of_the_running_code(
    found: dict[str, tuple[Finding, Finding]], name: str
) -> None:
    evidence = found[name][1].evidence
    low, high = evidence["enclosures"]["ahead_slope_1_m"]
    assert evidence["difference_quotient_with_deviation_ahead_1_m"] == pytest.approx(low, rel=1e-6)
    assert 0.0 < low < high < low * (1.0 + 1e-8)
    assert evidence["enclosures"]["behind_slope_1_m"][1] < 0.0
