"""THR-ROOT and THR-OPT."""

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from verify.model.threshold.cases import INPUTS, TABLE_1

from airground_drake.model.trigger.bayes import bayes_risk, optimal_threshold
from airground_drake.scenario.schema import Scenario
from airground_drake.verify.claims import thr_root
from airground_drake.verify.claims.thr_opt import ThrOpt
from airground_drake.verify.claims.thr_root import ThrRoot, rule_of
from airground_drake.verify.model.levels import NUMBERS


@pytest.mark.parametrize("name", INPUTS)
def test_root_and_optimum_are_proved_and_agree_with_mpmath_and_a_grid(name: str) -> None:
    inputs = INPUTS[name]
    root, optimum = ThrRoot().judge(inputs), ThrOpt().judge(inputs)
    assert root.status == optimum.status == "proved", (root, optimum)
    assert root.margin is not None
    assert root.margin > 0.0
    enclosures = optimum.evidence["enclosures"]
    with mpmath.workdps(40):
        a, s, c1, c2 = (mpmath.mpf(repr(inputs[key])) for key in NUMBERS)
        for key, ratio in (("zeta_m", c2 / c1), ("printed_zeta_m", c1 / c2)):
            low, high = (mpmath.mpf(end) for end in enclosures[key])
            exact = mpmath.findroot(
                lambda z, ratio=ratio: s**2 / a**2 * mpmath.sinh(2 * z * a / s**2) + 2 * z / a - ratio,
                (low, high * 1.001),
            )
            assert low * (1 - 1e-15) < exact < high * (1 + 1e-15)
    constants, zeta = [inputs[key] for key in NUMBERS], root.evidence["computed_threshold_m"]
    best = bayes_risk(zeta, *constants)
    assert all(bayes_risk(z, *constants) > best for z in zeta * np.geomspace(1e-3, 20.0, 200))
    worse = bayes_risk(enclosures["printed_zeta_m"][0], *constants) - bayes_risk(enclosures["zeta_m"][0], *constants)
    assert optimum.margin == pytest.approx(worse, rel=1e-6)
    assert (optimum.margin == 0.0) == (name == "equal costs")
    assert ("Threshold.printed_is_worse" in optimum.evidence["theorems"]) == (name != "equal costs")


def test_inputs_name_the_threshold_in_force(case_a: Scenario) -> None:
    assert ThrRoot().inputs(case_a)["zeta_m"] == 3.0
    case_a.decision.threshold.rule = "bayes"
    assert ThrOpt().inputs(case_a)["zeta_m"] == optimal_threshold(6.05, 10.0, 0.5, 1.0)


@pytest.mark.parametrize(("rule", "status"), [("fixed", "proved"), ("bayes", "refuted")])
def test_a_bayes_threshold_in_force_must_be_the_root(rule: str, status: str) -> None:
    wrong = {**INPUTS["audit"], "zeta_m": INPUTS["audit"]["zeta_m"] * (1.0 + 1e-9), "rule": rule}
    assert ThrRoot().check(wrong).status == status


@examples(40)
@given(*[st.floats(0.05, 20.0)] * 4)
def test_enclosure_agrees_with_the_running_code(drift: float, noise: float, c1: float, c2: float) -> None:
    rule = rule_of(dict(zip(NUMBERS, (drift, noise, c1, c2), strict=True)))
    root = rule.root
    assert root.signs == (-1, 1)
    assert root.high - root.low <= root.low / 10**12
    zeta = optimal_threshold(drift, noise, c1, c2)
    assert float(rule.zeta(root.low)) * (1 - 1e-12) <= zeta <= float(rule.zeta(root.high)) * (1 + 1e-12)


@pytest.mark.parametrize(("factor", "status"), [(0.5, "proved"), (2.0, "refuted")])
def test_the_tolerance_of_the_program_is_a_trillionth(
    monkeypatch: pytest.MonkeyPatch, factor: float, status: str
) -> None:
    right = optimal_threshold
    monkeypatch.setattr(thr_root, "optimal_threshold", lambda *of: right(*of) * (1.0 + factor * 1e-12 + 5e-13))
    finding = ThrRoot().judge(TABLE_1)
    assert finding.status == status, finding
    assert (finding.counterexample is None) == (status == "proved")


def test_table_1_is_optimal_for_two_drifts_and_30_m_for_none() -> None:
    """For about 6.07 m/s, and one beyond any robot here."""
    low, high = ThrOpt().judge(TABLE_1).evidence["optimal_for_drifts_m_s"]
    assert (low[0], high[0]) == (pytest.approx(6.0667, abs=1e-4), pytest.approx(99.015, abs=1e-3))
    for drift in (low[0], high[0]):
        assert optimal_threshold(drift, 10.0, 0.5, 1.0) == pytest.approx(3.0, rel=1e-9)
    finding = ThrOpt().judge(TABLE_1 | {"zeta_m": 30.0})
    assert (finding.status, finding.evidence["optimal_for_drifts_m_s"]) == ("proved", [])
    assert all(optimal_threshold(drift, 10.0, 0.5, 1.0) < 30.0 for drift in np.geomspace(1e-3, 1e3, 100))


@pytest.mark.parametrize("share", [0.5, -0.5])
def test_with_a_deviation_another_threshold_is_better(share: float) -> None:
    constants = [TABLE_1[key] for key in NUMBERS]
    root = optimal_threshold(*constants)
    best = bayes_risk(root, *constants, share * root)
    assert any(bayes_risk(root * factor, *constants, share * root) < best for factor in (0.999, 1.001))
