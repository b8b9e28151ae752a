"""THR-ROOT."""

from __future__ import annotations

import json
from fractions import Fraction
from typing import Any

import mpmath
import pytest
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from verify.judging import Judged
from verify.model.threshold.cases import INPUTS, OTHERS, TABLE_1

from airground_drake.decision.bayes import optimal_threshold
from airground_drake.scenarios.load import load
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.engines.ball_arithmetic import enclose
from airground_drake.verify.engines.smt import Result
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.threshold import expressions, thr_root
from airground_drake.verify.model.threshold.constants import ThresholdRule
from airground_drake.verify.model.threshold.thr_opt import ThrOpt
from airground_drake.verify.model.threshold.thr_root import ThrRoot


@pytest.mark.parametrize("name", INPUTS)
def test_root_and_optimum_are_proved(found: dict[str, tuple[Finding, Finding]], name: str) -> None:
    root, optimum = found[name]
    assert root.status == "proved", root
    assert root.evidence["cvc5_on_two_roots"] == "unsat"
    assert root.margin is not None
    assert root.margin > 0.0
    assert optimum.status == "proved", optimum
    assert (optimum.margin is None) == (name == "equal costs")
    assert optimum.margin is None or optimum.margin > 0.0


@pytest.mark.parametrize("scenario", ["case_a", "case_a_table1", "case_b", "soft_gate"])
def test_shipped_scenarios(scenario: str, judged: Judged) -> None:
    for claim in (ThrRoot(), ThrOpt()):
        assert judged(claim, claim.inputs(load(scenario)[0])).status == "proved"


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
    certificate = json.loads(found[name][1].certificates["statements.json"])
    with mpmath.workdps(40):
        a, s, c1, c2 = (mpmath.mpf(repr(inputs[key])) for key in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2"))
        for key, ratio in (("zeta_m", c2 / c1), ("printed_zeta_m", c1 / c2)):
            if key not in certificate["enclosures"]:
                assert name == "equal costs"
                continue
            low, high = (Fraction(x) for x in certificate["enclosures"][key])
            root = mpmath.findroot(
                lambda z, ratio=ratio: s**2 / a**2 * mpmath.sinh(2 * z * a / s**2) + 2 * z / a - ratio,
                (mpmath.mpf(float(low)), mpmath.mpf(float(high) * 1.001)),
            )
            assert mpmath.mpf(low.numerator) / low.denominator < root < mpmath.mpf(high.numerator) / high.denominator


@examples(40)
@given(*[st.floats(0.05, 20.0)] * 4)
def test_enclosure_agrees_with_the_running_code(drift: float, noise: float, c1: float, c2: float) -> None:
    constants = ThresholdRule.of({"drift_m_s": drift, "noise_m_sqrt_s": noise, "c1_1_s": c1, "c2": c2})
    low, high = enclose(expressions.RESIDUAL, constants.values, Fraction(0))
    assert high - low <= low / 10**12
    zeta = optimal_threshold(drift, noise, c1, c2)
    assert float(constants.zeta(low)) * (1 - 1e-12) <= zeta <= float(constants.zeta(high)) * (1 + 1e-12)


@pytest.mark.parametrize(
    ("answer", "status", "says"),
    [("unknown", "proved", "undecided"), ("timeout", "proved", "undecided"), ("sat", "error", "contradicts")],
)
def test_cvc5_neither_passes_nor_is_overruled(
    monkeypatch: pytest.MonkeyPatch, answer: Any, status: str, says: str
) -> None:
    monkeypatch.setattr(thr_root, "solve", lambda *_: [Result(answer)])
    finding = ThrRoot().check(TABLE_1)
    assert finding.status == status
    assert finding.evidence["cvc5_says"] == says


def test_cvc5_finds_two_roots_where_there_are_some() -> None:
    """The script can fail: without the order of u and v it has a model, and says no more than 'unknown' or 'sat'."""
    weaker = thr_root.UNIQUE_SMT2.replace("(assert (< u v))\n", "(assert (= u v))\n")
    assert weaker != thr_root.UNIQUE_SMT2
    assert thr_root.solve([weaker], "cvc5", 2.0)[0].answer != "unsat"
