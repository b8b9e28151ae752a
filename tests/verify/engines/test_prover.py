"""Obligations and their proofs."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st
from verify.engines.cases import STEP

from airground_drake.verify.engines import prover
from airground_drake.verify.engines.obligation import Obligation, Term, rational
from airground_drake.verify.engines.smt import Result

WEAKER = replace(STEP, hypotheses={**STEP.hypotheses, "inequality": "h*r + 2*D - 2*d"})


def test_a_true_obligation_is_proved_in_all_ways() -> None:
    (proof,) = prover.discharge([STEP])
    assert (proof.certified, proof.z3.answer, proof.cvc5.answer, proof.premises.answer) == (
        True,
        "unsat",
        "unsat",
        "sat",
    )
    found = prover.finding([proof])
    assert found.status == "proved"
    assert set(found.certificates) == {"obligations.json", "step.smt2"}
    assert json.loads(found.certificates["obligations.json"])[0]["goal"] == STEP.to_json()["goal"]


def test_a_false_one_comes_with_an_exact_counterexample() -> None:
    found = prover.finding(prover.discharge([STEP, WEAKER]))
    assert found.status == "refuted"
    assert found.counterexample is not None
    assert found.counterexample["exactly_checked"] is True
    point = {name: Fraction(value) for name, value in found.counterexample["point"].items()}
    assert not WEAKER.holds_at(point)


@pytest.mark.parametrize(
    "broken",
    [
        replace(STEP, certificate=STEP.certificate[:1]),
        replace(STEP, certificate=(*STEP.certificate, Term("1/1000"))),
        replace(STEP, certificate=(Term("-1", ("forward", "inequality")), *STEP.certificate[1:])),
        replace(STEP, multiplier=()),
        replace(STEP, goal="D + s*r - d - 1/1000"),
        replace(STEP, multiplier=(Term(factors=("safe",)),), certificate=(Term(factors=("safe",)),), goal="1"),
    ],
)
def test_a_certificate_with_any_flaw_is_none(broken: Obligation) -> None:
    assert not broken.certified()


def test_what_is_only_certified_or_only_solved_is_not_proved() -> None:
    (proof,) = prover.discharge([replace(STEP, certificate=())])
    assert proof.status == "inconclusive"
    for answer in ("unknown", "timeout", "error"):
        assert replace(proof, certified=True, z3=Result(answer)).status == "inconclusive"


def test_contradictory_hypotheses_prove_nothing() -> None:
    vacuous = Obligation("vacuous", "x < 0 < x", ("x",), goal="-1", strict={"a": "x", "b": "-x"},
                         multiplier=(Term(factors=("a",)), Term(factors=("b",))), certificate=())  # fmt: skip
    (proof,) = prover.discharge([vacuous])
    assert proof.status == "error"


def test_strangers_in_a_text_are_refused() -> None:
    with pytest.raises(ValueError, match="among the variables"):
        replace(STEP, goal="D + evil").certified()
    with pytest.raises(ValueError, match="among the hypotheses"):
        replace(STEP, certificate=(Term(factors=("nobody",)),)).certified()


@given(st.tuples(*[st.fractions(-4, 4)] * 5))
def test_a_certified_implication_is_true_everywhere(values: tuple[Fraction, ...]) -> None:
    assert STEP.holds_at(dict(zip(STEP.variables, values, strict=True)))


@given(st.floats(-1e6, 1e6, allow_nan=False))
def test_rational_is_the_decimal_that_is_printed(x: float) -> None:
    assert float(Fraction(rational(x))) == x
    assert Fraction(rational(0.05)) == Fraction(1, 20)


def test_premises_that_were_not_seen_to_be_satisfiable_prove_nothing() -> None:
    (proof,) = prover.discharge([STEP])
    assert (proof.certified, proof.premises.answer, proof.status) == (True, "sat", "proved")
    for answer in ("unknown", "timeout", "error"):
        assert replace(proof, premises=Result(answer)).status == "inconclusive"
    assert replace(proof, premises=Result("unsat")).status == "error"
    assert prover.finding([replace(proof, premises=Result("unknown"))]).status == "inconclusive"
