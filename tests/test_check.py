"""The independent checker: accepts a report as written, refuses every tampering, shares no code with the rest."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
import tamper
from hypothesis import given
from hypothesis import strategies as st

from airground_drake import check
from airground_drake.report.__main__ import main as write

SOURCE = Path(check.__file__)


@pytest.fixture(scope="session")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("checked") / "report"
    assert write(["case_b", "-o", str(folder), "--format", "json"]) in (0, 1)  # 1: a slow machine misses GATE-TIME
    return folder


def test_an_untouched_report_agrees_everywhere(report: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert check.main([str(report)]) == 0
    lines = capsys.readouterr().out.splitlines()
    claims = json.loads((report / "report.json").read_text())["claims"]
    assert {(claim["id"], claim["run"] or "-") for claim in claims} <= {tuple(line.split()[:2]) for line in lines}
    assert all("agrees:" in line for line in lines[:-1])
    assert lines[-1].endswith("0 DISAGREES, 0 cannot be re-established")


NOTICED_BY = {
    "position_commands_and_decision_variable_changed": "GATE-FEAS",
    "decision_variable_changed": "THR-TRIG",
    "lower_bound_raised": "GATE-OPT",
    "rounding_error_hidden": "GATE-SUR",
    "decision_times_lowered": "GATE-TIME",
    "proposal_added": "COMM",
    "stall_declared_where_none_was": "LIVE-GOAL",
    "distance_in_the_evidence_changed": "SAFE-TRACE",
    "margin_of_the_broken_hypothesis_changed": "SAFE-HYP",
    "time_between_triggers_invented": "ZENO-TRACE",
    "goal_weakened": "SAFE-INV",
    "hypothesis_added": "SAFE-DIST",
    "equation_added": "SAFE-GATE",
    "dwell_of_the_proof_changed": "ZENO-PROOF",
    "code_in_a_certificate": "SAFE-LEMMA",
    "enclosure_moved": "THR-ROOT",
    "sign_turned": "THR-OPT",
    "counts_of_paths_changed": "THR-DDM",
    "counts_of_triggers_lowered": "ZENO-REFINE",
    "exit_code_changed": "report",
}
"""Tamperings that only one line may notice."""


@pytest.mark.parametrize("name", tamper.TAMPERINGS)
def test_a_tampered_report_is_refused(report: Path, name: str) -> None:
    code, lines = tamper.attempt(report, name)
    assert code in (1, 2), "nothing was noticed"
    assert lines
    if name in NOTICED_BY:
        assert {line.subject for line in lines} == {NOTICED_BY[name]}
    if name in ("position_changed_digest_left", "position_changed"):  # a trace that is refused takes its claims along
        assert lines[0].subject == "trace"
        assert {line.run for line in lines} == {tamper.RUN}


def test_there_are_tamperings_for_every_claim() -> None:
    assert set(NOTICED_BY) <= set(tamper.TAMPERINGS)
    assert {*check.MODEL, *check.EVERY, *check.GATED} <= set(NOTICED_BY.values())
    assert len(tamper.TAMPERINGS) >= 130


def test_it_imports_nothing_but_the_standard_library_numpy_and_pandas() -> None:
    allowed = {*sys.stdlib_module_names, "numpy", "pandas"}
    for node in ast.walk(ast.parse(SOURCE.read_text())):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
        assert {name.split(".")[0] for name in names} <= allowed
        assert not (isinstance(node, ast.Name) and node.id in ("eval", "exec", "compile", "__import__"))


def test_it_runs_without_drake_or_any_solver(report: Path) -> None:
    program = (
        "import runpy, sys\n"
        f"sys.argv = ['check', {str(report)!r}]\n"
        "try:\n    runpy.run_module('airground_drake.check', run_name='__main__')\n"
        "except SystemExit as end:\n    print('code', end.code)\n"
        "loaded = sorted(sys.modules)\n"
        "print([n for n in loaded if '.' not in n], [n for n in loaded if n.startswith('airground_drake')])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    *_, code, loaded = done.stdout.splitlines()
    assert code == "code 0"
    for name in ("pydrake", "scipy", "sympy", "flint", "z3", "cvc5", "cvxpy", "numba", "airground_drake.trace"):
        assert f"'{name}'" not in loaded
    assert loaded.endswith("['airground_drake']")


@pytest.mark.parametrize("arguments", [[], ["a", "b"], ["--help"], ["no/such/folder"]])
def test_usage_errors_and_missing_reports_are_exit_code_2(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert check.main(arguments) == 2
    said = capsys.readouterr()
    assert not said.out
    assert said.err.count("\n") == 1


@pytest.mark.parametrize(
    "content", ["", "{", "[]", "null", "1", '{"schema": "airground_drake.report/1"}', "\x00", "{}"]
)
def test_anything_else_is_no_report(content: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "report.json").write_text(content)
    assert check.main([str(tmp_path)]) == 2
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize("key", ["scenario", "provenance", "overall", "runs", "claims"])
@pytest.mark.parametrize("value", [None, [], {}, "x", 3])
def test_a_report_with_a_part_of_another_kind_is_refused(report: Path, key: str, value: Any, tmp_path: Path) -> None:
    document = json.loads((report / "report.json").read_text())
    document[key] = value
    (tmp_path / "report.json").write_text(json.dumps(document))
    for name in ("trace", "certificates"):
        (tmp_path / name).symlink_to(report / name)
    assert check.main([str(tmp_path)]) in (1, 2)


# ------------------------------------------------------------------------------------- its arithmetic

NUMBERS = st.fractions(min_value=-4, max_value=4, max_denominator=8)


@given(a=NUMBERS, b=NUMBERS, c=NUMBERS)
def test_polynomials_are_evaluated_like_numbers(a: Fraction, b: Fraction, c: Fraction) -> None:
    text = "(x - 2*y)**3*(z + 0.25) - x*y/3 + -(y + 1)*(x**2 - 1)"
    polynomial = check.evaluate(text)
    at = {"x": a, "y": b, "z": c}
    value = sum((k * check.math.prod(at[name] for name in names) for names, k in polynomial.items()), Fraction())
    assert value == (a - 2 * b) ** 3 * (c + Fraction(1, 4)) - a * b / 3 - (b + 1) * (a**2 - 1)
    assert check.evaluate(text, {name: check.number(str(v)) for name, v in at.items()}) == check.number(str(value))


@pytest.mark.parametrize("text", ["x/y", "x**y", "x**-1", "f(x)", "x if y else z", "x.y", "[x]", "'x'", "1/0", "x**13"])
def test_what_is_no_polynomial_is_refused(text: str) -> None:
    with pytest.raises((ValueError, TypeError, ZeroDivisionError, KeyError, check.Disagreement)):
        check.evaluate(text)


def obligation(**changes: Any) -> dict[str, Any]:
    """(a - b)^2 >= 0 gives a^2 + b^2 >= 2 a b; times c > 0."""
    return {
        "name": "square", "goal": "a**2 + b**2 - 2*a*b", "variables": ["a", "b", "c"], "hypotheses": {},
        "strict": {"c": "c"}, "multiplier": [{"coefficient": "1", "factors": ["c"], "square": "1"}],
        "certificate": [{"coefficient": "1", "factors": ["c"], "square": "a - b"}], "equations": {},
        "equation_multipliers": {},
    } | changes  # fmt: skip


def test_a_certificate_is_an_identity_with_a_positive_multiplier() -> None:
    assert check.certified(obligation())
    assert not check.certified(obligation(goal="a**2 + b**2 - 3*a*b"))
    assert not check.certified(obligation(strict={}, hypotheses={"c": "c"}))  # c = 0 would prove anything
    assert check.certified(
        obligation(multiplier=[], certificate=[{"coefficient": "1", "factors": [], "square": "a - b"}])
    )
    negative = [{"coefficient": "-1", "factors": ["c"], "square": "a - b"}]
    with pytest.raises(check.Disagreement):
        check.certified(obligation(goal="-(a - b)**2", certificate=negative))


@given(st.fractions(min_value=Fraction(1, 100), max_value=30, max_denominator=1000))
def test_sinh_is_enclosed(u: Fraction) -> None:
    low, high = check.sinh(u)
    assert low < high <= low * (1 + Fraction(1, 10**25))
    with check.localcontext() as context:
        context.prec = 60
        e = (check.Decimal(u.numerator) / u.denominator).exp()
        exact = Fraction((e - 1 / e) / 2)
    assert low * (1 - Fraction(1, 10**50)) <= exact <= high
