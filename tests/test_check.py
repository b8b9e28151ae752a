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
from airground_drake.verify.engines.obligation import Obligation

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
        (["duration_s=10.56"], set()),  # the run ends before a decision is due
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


NAMES = st.lists(st.sampled_from(["x", "y", "z"]), max_size=4)
PRODUCTS = st.lists(
    st.tuples(st.fractions(min_value=-4, max_value=4, max_denominator=8), NAMES), min_size=1, max_size=5
)


@given(
    one=PRODUCTS, other=PRODUCTS, at=st.fixed_dictionaries(dict.fromkeys("xyz", st.fractions(-3, 3, max_denominator=4)))
)
def test_polynomials_are_evaluated_like_numbers(one: Any, other: Any, at: dict[str, Fraction]) -> None:
    def text(products: Any) -> str:
        return " ".join(f"{'-' if size < 0 else '+'} {'*'.join([str(abs(size)), *names])}" for size, names in products)

    def value(polynomial: Any) -> Fraction:
        return sum((k * math.prod(at[name] for name in names) for names, k in polynomial.items()), Fraction())

    expected = [sum(size * math.prod(at[n] for n in names) for size, names in products) for products in (one, other)]
    a, b = check.expand(text(one)), check.expand(text(other))
    assert [value(a), value(b)] == expected
    assert value(check.combine([a, b, b], [a])) == expected[0] * expected[1] ** 2 + expected[0]


@pytest.mark.parametrize("polynomial", ["(1 - A*h)*(d - D)**2", "-x", "0", "3 - 2*h*h + h", "x*y - y*x"])
def test_polynomials_in_files_are_those_of_the_proofs(polynomial: str) -> None:
    names = ("A", "h", "d", "D", "x", "y")
    text = Obligation("o", "", names, polynomial).to_json()["goal"]
    at = {name: Fraction(3 * i + 1, i + 2) for i, name in enumerate(names)}
    found = sum((k * math.prod(at[n] for n in factors) for factors, k in check.expand(text).items()), Fraction())
    assert found == eval(polynomial, {}, at)
    assert Obligation("o", "", names, "(h - 2*d)/20").to_json()["goal"] == "1/20*h - 1/10*d"


@pytest.mark.parametrize("text", ["x**2", "f(x)", "x.y", "[x]", "'x'", "1/0", "1e9", "(x)", "x/y", None, 3])
def test_what_is_no_sum_of_products_is_refused(text: Any) -> None:
    with pytest.raises((ValueError, ZeroDivisionError, TypeError)):
        check.expand(text)
