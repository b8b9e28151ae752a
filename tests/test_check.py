"""The independent checker: accepts a report as written, refuses every tampering, shares no code with the rest."""

from __future__ import annotations

import ast
import json
import math
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import pandas as pd
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
    assert lines[-1] == f"{len(lines) - 1} checks: {{'agrees': {len(lines) - 1}}}"


@pytest.mark.parametrize(
    ("changes", "reasons"),
    [
        (["gatekeeper.switching_margin=0", "gatekeeper.min_dwell_s=0.3"], {"reversed", "dwell", "not_cheaper"}),
        (["duration_s=8"], set()),  # nothing triggers: no decisions at all
    ],
)
def test_reports_of_changed_scenarios_agree(changes: list[str], reasons: set[str], tmp_path: Path) -> None:
    settings = [word for change in changes for word in ("--set", change)]
    assert write(["case_b", "-o", str(tmp_path / "r"), "--format", "json", *settings]) in (0, 1)
    assert reasons <= set(pd.read_parquet(tmp_path / "r/trace/d/decisions.parquet")["reason"])
    assert check.main([str(tmp_path / "r")]) == 0


@pytest.mark.parametrize("name", tamper.TAMPERINGS)
def test_a_tampered_report_is_refused(report: Path, name: str) -> None:
    code, lines = tamper.attempt(report, name)
    assert code in (1, 2), "nothing was noticed"
    assert lines


def test_there_are_many_tamperings() -> None:
    assert len(tamper.TAMPERINGS) >= 100


def test_it_can_be_read_in_one_sitting() -> None:
    assert len(SOURCE.read_text().splitlines()) < 400


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


@pytest.mark.parametrize("key", ["scenario", "overall", "runs", "claims"])
@pytest.mark.parametrize("value", [None, [], {}, "x", 3])
def test_a_report_with_a_part_of_another_kind_is_refused(report: Path, key: str, value: Any, tmp_path: Path) -> None:
    document = json.loads((report / "report.json").read_text())
    document[key] = value
    (tmp_path / "report.json").write_text(json.dumps(document))
    for name in ("trace", "certificates"):
        (tmp_path / name).symlink_to(report / name)
    assert check.main([str(tmp_path)]) in (1, 2)


NUMBERS = st.fractions(min_value=-4, max_value=4, max_denominator=8)


@given(a=NUMBERS, b=NUMBERS, c=NUMBERS)
def test_polynomials_are_evaluated_like_numbers(a: Fraction, b: Fraction, c: Fraction) -> None:
    polynomial = check.expand("(x - 2*y)**3*(z + 1/4) - x*y/3 + -(y + 1)*(x**2 - 1)")
    at = {"x": a, "y": b, "z": c}
    value = sum((k * math.prod(at[name] for name in names) for names, k in polynomial.items()), Fraction())
    assert value == (a - 2 * b) ** 3 * (c + Fraction(1, 4)) - a * b / 3 - (b + 1) * (a**2 - 1)


@pytest.mark.parametrize("text", ["x/y", "x**y", "x**-1", "f(x)", "x if y else z", "x.y", "[x]", "'x'", "1/0", "x**13"])
def test_what_is_no_polynomial_is_refused(text: str) -> None:
    with pytest.raises((ValueError, ZeroDivisionError)):
        check.expand(text)
