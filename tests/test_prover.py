"""Obligations, their certificates, the solvers in their processes, and findings that are kept."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.scenarios.schema import Scenario
from airground_drake.verify import cache as findings
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.engines import prover
from airground_drake.verify.engines.obligation import Obligation, Term, rational
from airground_drake.verify.engines.smt import Result, solve
from airground_drake.verify.finding import Finding

STEP = Obligation(
    name="step",
    says="a step along an inequality keeps the distance",
    variables=("D", "d", "s", "h", "r"),
    goal="D + s*r - d",
    hypotheses={"safe": "D - d", "forward": "s", "within": "h - s", "inequality": "h*r + D - d"},
    strict={"period": "h"},
    multiplier=(Term(factors=("period",)),),
    certificate=(Term(factors=("forward", "inequality")), Term(factors=("safe", "within"))),
)
"""h (D + s r - d) = s (h r + D - d) + (D - d) (h - s)."""
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


def test_a_solver_that_hangs_is_killed_and_the_next_script_still_runs() -> None:
    hard = "(set-logic QF_NRA)\n" + "".join(f"(declare-const x{i} Real)\n" for i in range(12))
    hard += "".join(f"(assert (= (+ (* x{i} x{i} x{i}) (* x{i + 1} x{i + 2})) {i + 1}.5))\n" for i in range(10))
    hard += "(assert (> (* x0 x1 x2 x3 x4 x5 x6 x7 x8 x9) 1000.0))\n(check-sat)\n"
    first, second = solve([hard, STEP.smt2()], "z3", limit_s=0.5)
    assert first.answer in ("timeout", "unknown", "sat")
    assert second.answer == "unsat"


@pytest.mark.parametrize("solver", ["z3", "cvc5"])
def test_a_script_that_cannot_be_read_decides_nothing(solver: Any) -> None:
    broken, good = solve(["(set-logic QF_NRA)\n(assert (> x 0.0))\n(check-sat)\n", STEP.smt2()], solver)
    assert broken.answer == "error"
    assert good.answer == "unsat"


def test_spacer_finds_an_invariant() -> None:
    rule = "(assert (forall ((x Int) (y Int)) (=> (and (inv x) (= y (+ x 1)) (< x 10)) (inv y))))\n"
    head = "(set-logic HORN)\n(declare-fun inv (Int) Bool)\n(assert (forall ((x Int)) (=> (= x 0) (inv x))))\n"
    bad = "(assert (forall ((x Int)) (=> (and (inv x) (> x {})) false)))\n(check-sat)\n"
    assert [r.answer for r in solve([head + rule + bad.format(10), head + rule + bad.format(9)])] == ["sat", "unsat"]


def test_the_solvers_processes_load_no_drake() -> None:
    code = (
        "import sys, airground_drake.verify.engines.smt; print(any(name.startswith('pydrake') for name in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"


class Counting(ModelClaim):
    """A claim that counts how often it is decided."""

    id, statement, formula, method, equations = "COUNTING", "s", "f", "m", "e"
    assumptions, does_not_establish = (), "n"

    def __init__(self, found: Finding | Exception) -> None:
        self.found, self.calls = found, 0

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        return {}

    def check(self, inputs: dict[str, Any]) -> Finding:
        self.calls += 1
        if isinstance(self.found, Exception):
            raise self.found
        return self.found


def test_findings_are_kept_by_their_inputs(tmp_path: Path) -> None:
    claim = Counting(Finding("proved", certificates={"a": "b"}))
    first = findings.find([claim], [{"x": 1.0}], folder=tmp_path)
    assert findings.find([claim], [{"x": 1.0}], folder=tmp_path) == first
    assert claim.calls == 1
    findings.find([claim], [{"x": 2.0}], folder=tmp_path)
    findings.find([claim], [{"x": 1.0}], folder=None)
    assert claim.calls == 3


def test_what_was_left_open_is_tried_again(tmp_path: Path) -> None:
    for found in (Finding("inconclusive"), RuntimeError("no luck"), Finding("proved", margin=float("nan"))):
        claim = Counting(found)
        for _ in range(2):
            (made,) = findings.find([claim], [{}], folder=tmp_path)
        assert claim.calls == 2
        assert made.status in ("inconclusive", "error")
    assert not list(tmp_path.iterdir())


def test_a_kept_finding_that_cannot_be_read_is_made_anew(tmp_path: Path) -> None:
    claim = Counting(Finding("proved"))
    findings.find([claim], [{}], folder=tmp_path)
    (kept,) = tmp_path.iterdir()
    kept.write_text("{", encoding="utf-8")
    assert findings.find([claim], [{}], folder=tmp_path)[0].status == "proved"
    assert claim.calls == 2
