"""THR-OPT."""

from __future__ import annotations

import numpy as np
import pytest
from verify.model.threshold.cases import INPUTS, TABLE_1

from airground_drake.decision.bayes import bayes_risk, optimal_threshold
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.thr_opt import ThrOpt


@pytest.mark.parametrize("name", INPUTS)
def test_no_threshold_on_a_grid_is_better(found: dict[str, tuple[Finding, Finding]], name: str) -> None:
    constants = [INPUTS[name][key] for key in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2")]
    zeta = found[name][0].evidence["computed_threshold_m"]
    best = bayes_risk(zeta, *constants)
    assert all(bayes_risk(z, *constants) > best for z in zeta * np.geomspace(1e-3, 20.0, 200))


def test_table_1_is_optimal_for_two_drifts(found: dict[str, tuple[Finding, Finding]]) -> None:
    """About 6.07 m/s, and one beyond any robot here."""
    low, high = found["table 1"][1].evidence["optimal_for_drifts_m_s"]
    assert low[0] == pytest.approx(6.0667, abs=1e-4)
    assert high[0] == pytest.approx(99.015, abs=1e-3)
    for drift in (low[0], high[0]):
        assert optimal_threshold(drift, 10.0, 0.5, 1.0) == pytest.approx(3.0, rel=1e-9)


def test_a_threshold_that_is_optimal_for_no_drift() -> None:
    finding = ThrOpt().judge(TABLE_1 | {"zeta_m": 30.0})
    assert finding.status == "proved"
    assert finding.evidence["optimal_for_drifts_m_s"] == []
    assert all(optimal_threshold(drift, 10.0, 0.5, 1.0) < 30.0 for drift in np.geomspace(1e-3, 1e3, 100))


@pytest.mark.parametrize("name", [name for name in INPUTS if name != "equal costs"])
def test_the_margin_is_the_difference_in_risk(found: dict[str, tuple[Finding, Finding]], name: str) -> None:
    constants = [INPUTS[name][key] for key in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2")]
    printed, root = (found[name][1].evidence["enclosures"][key][0] for key in ("printed_zeta_m", "zeta_m"))
    worse = bayes_risk(printed, *constants) - bayes_risk(root, *constants)
    assert found[name][1].margin == pytest.approx(worse, rel=1e-6)


@pytest.mark.parametrize("share", [0.5, -0.5])
def test_with_a_deviation_another_threshold_is_better(found: dict[str, tuple[Finding, Finding]], share: float) -> None:
    constants = [TABLE_1[key] for key in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2")]
    root = found["table 1"][0].evidence["computed_threshold_m"]
    best = bayes_risk(root, *constants, share * root)
    assert any(bayes_risk(root * factor, *constants, share * root) < best for factor in (0.999, 1.001))
