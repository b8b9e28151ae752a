"""The command line: exit codes, JSON, and other files than reports."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from check.forgeries import RULES
from check.forging import copy, mend, no_constants

from airground_drake import check
from airground_drake.check import files, limits, rules


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["a", "b"],
        ["--unknown"],
        ["no/such/folder"],
        *(["-", "--limit-s", s] for s in ("-1", "0", "nan", "inf", "x")),
    ],
)
def test_usage_errors_and_missing_reports_are_exit_code_2(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert check.main(arguments) == 2
    said = capsys.readouterr()
    assert not said.out
    assert said.err.count("\n") == 1


@pytest.mark.parametrize("content", ["", "[]", "null", "1", '{"schema": "airground_drake.report/1"}', "\x00", "{}"])
def test_anything_else_is_no_report(content: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "report.json").write_text(content)
    assert check.main([str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_check_that_takes_too_long_is_no_agreement() -> None:
    with pytest.raises(rules.NotEstablished) as stopped, limits.at_most_s(0.01):  # noqa: PT012
        while True:
            pass
    assert (stopped.value.rule, stopped.value.why) == ("the check comes to an end", "not within 0.01 s")


def test_a_folder_of_too_many_files_is_no_report(report: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "MOST_FILES", 5)
    assert check.main([str(report)]) == 2


BROKEN = """
import runpy
from airground_drake.check import command
command.main = lambda: 1 / 0
runpy.run_module("airground_drake.check", run_name="__main__")
"""


def test_a_fault_of_the_checker_is_no_verdict() -> None:
    done = subprocess.run([sys.executable, "-c", BROKEN], capture_output=True, text=True, check=False)
    assert done.returncode == 4
    assert "ZeroDivisionError" in done.stderr


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("decision variable", ("THR-TRIG", "d", "decision variable", "ugv1", 0.0)),
        ("not a number", ("trace", "d", "numbers are finite", "uav.z_m", None)),
    ],
)
def test_a_refusal_names_rule_place_and_both_values_in_strict_json(
    name: str, found: tuple[Any, ...], report: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = copy(report, tmp_path / "r")
    RULES[name][1](folder)
    mend(folder)
    assert check.main(["--json", str(folder)]) == 1
    said = json.loads(capsys.readouterr().out, parse_constant=no_constants)
    (first, *_) = (entry for entry in said["checks"] if entry["outcome"] == "DISAGREES")
    assert tuple(first[key] for key in ("claim", "run", "rule", "about", "t_s")) == found
    due = "nan" if name == "not a number" else pytest.approx(first["recomputed"] - 1e-4, abs=1e-9)
    assert first["recorded"] == due
    assert said["summary"]["DISAGREES"] == 1
