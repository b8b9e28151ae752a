"""THR-ROOT."""

from __future__ import annotations

from fractions import Fraction

import mpmath
import pytest
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from verify.model.threshold.cases import INPUTS, OTHERS, TABLE_1

from airground_drake.decision.bayes import optimal_threshold
from airground_drake.scenarios.load import load
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.engines.signs import enclose
from airground_drake.verify.finding import Finding
from airground_drake.verify.model import thr_root
from airground_drake.verify.model.thr_opt import ThrOpt
from airground_drake.verify.model.thr_root import ThrRoot, rule_of


@pytest.mark.parametrize("name", INPUTS)
def test_root_and_optimum_are_proved(found: dict[str, tuple[Finding, Finding]], name: str) -> None:
    root, optimum = found[name]
    assert root.status == optimum.status == "proved", (root, optimum)
    assert root.margin is not None
    assert root.margin > 0.0
    assert optimum.margin is not None
    assert (optimum.margin == 0.0) == (name == "equal costs")


@pytest.mark.parametrize("scenario", ["case_a", "case_a_table1", "case_b", "soft_gate"])
def test_shipped_scenarios(scenario: str) -> None:
    for claim in (ThrRoot(), ThrOpt()):
        assert claim.judge(claim.inputs(load(scenario)[0])).status == "proved"


def test_inputs_name_the_threshold_in_force(case_a: Scenario) -> None:
    assert ThrRoot().inputs(case_a)["zeta_m"] == 3.0
    case_a.decision.threshold.rule = "bayes"
    inputs = ThrOpt().inputs(case_a)
    assert inputs["zeta_m"] == optimal_threshold(6.05, 10.0, 0.5, 1.0)
    assert ThrRoot().check(inputs).status == "proved"


def test_a_threshold_in_force_that_is_not_the_root_is_refuted() -> None:
    wrong = {**OTHERS["audit"], "zeta_m": OTHERS["audit"]["zeta_m"] * (1.0 + 1e-9)}
    finding = ThrRoot().check({**wrong, "rule": "fixed"})
    assert finding.status == "proved"  # a fixed threshold need not be the root
    assert ThrRoot().check(wrong).status == "refuted"


@pytest.mark.parametrize("name", INPUTS)
def test_enclosures_contain_roots_found_by_mpmath(found: dict[str, tuple[Finding, Finding]], name: str) -> None:
    inputs = INPUTS[name]
    enclosures = found[name][1].evidence["enclosures"]
    with mpmath.workdps(40):
        a, s, c1, c2 = (mpmath.mpf(repr(inputs[key])) for key in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2"))
        for key, ratio in (("zeta_m", c2 / c1), ("printed_zeta_m", c1 / c2)):
            low, high = (mpmath.mpf(end) for end in enclosures[key])
            root = mpmath.findroot(
                lambda z, ratio=ratio: s**2 / a**2 * mpmath.sinh(2 * z * a / s**2) + 2 * z / a - ratio,
                (low, high * 1.001),
            )
            assert low * (1 - 1e-15) < root < high * (1 + 1e-15)


@examples(40)
@given(*[st.floats(0.05, 20.0)] * 4)
def test_enclosure_agrees_with_the_running_code(drift: float, noise: float, c1: float, c2: float) -> None:
    rule = rule_of({"drift_m_s": drift, "noise_m_sqrt_s": noise, "c1_1_s": c1, "c2": c2})
    root = enclose(rule.residual(rule.c2 / rule.c1), Fraction(0))
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


def test_a_threshold_with_the_printed_ratio_is_refuted(monkeypatch: pytest.MonkeyPatch) -> None:
    right = optimal_threshold
    monkeypatch.setattr(thr_root, "optimal_threshold", lambda drift, noise, c1, c2: right(drift, noise, c2, c1))
    assert ThrRoot().judge(TABLE_1).status == "refuted"
