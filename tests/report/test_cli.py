"""The command line: exit codes, one-line errors, files."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from airground_drake.report import make
from airground_drake.report.__main__ import main
from airground_drake.run import trace
from airground_drake.run.simulation import simulate
from airground_drake.scenarios.load import load, shipped
from airground_drake.verify import __main__ as judge

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
Report = Callable[[str], Path]


def test_everything_is_written(report: Report) -> None:
    folder = report("case_a")
    names = {path.name for path in folder.iterdir()}
    assert names == {"report.html", "report.json", "junit.xml", "diagram.dot", "diagram.svg", "trace"}
    assert (folder / "diagram.dot").read_text() == (DIAGRAMS / "case_a.dot").read_text()
    scenario = load("case_a")[0]
    for name in scenario.runs:
        assert trace.load(folder / "trace" / name).run == name


def test_the_reproduction_table_meets_its_targets(report: Report) -> None:
    document = json.loads((report("case_a") / "report.json").read_text())
    rows = {row["id"]: row for row in document["reproduction"]}
    assert max(abs(a - b) for a, b in zip(rows["A1"]["ours"], (3.3, 5.1), strict=True)) < 0.1
    assert all(abs(value - 2.0) < 0.01 for value in rows["A2"]["ours"])
    assert abs(rows["A5"]["ours"] - 14.45) <= 0.05
    assert abs(rows["A6"]["ours"] - 1.7) <= 0.1
    assert {name: row["status"] for name, row in rows.items()} == {
        "A3": "reproduced",
        **dict.fromkeys(("A1", "A2", "A4", "A5", "A6", "A7"), "calibrated"),
        "A8": "not_reproduced",
    }
    assert rows["A8"]["ours"][0] == pytest.approx((3.3 - 1.0) / 2.0, abs=1e-3)  # where Table 1 has 1.1
    assert "ours rounds to 3.4 m, the paper prints 3.3 m" in rows["A1"]["why"]
    page = (report("case_a") / "report.html").read_text()
    assert "With help, all arrive safely. Without it, ugv1 is stuck." in page
    assert "7 of 8 results match: 1 without tuning, 6 after calibration; not reproduced: A8." in page
    assert "10 not tested, 6 allowed either way." in page
    assert page.count("stuck, as declared</span>") >= 1
    assert document["runs"]["d"]["metrics"]["min_distance_m"]["ugv1"]["obstacle_1"]["value"] >= 2.0 - 1e-9


def test_case_b_meets_its_targets_too(report: Report) -> None:
    document = json.loads((report("case_b") / "report.json").read_text())
    statuses = {row["id"]: row["status"] for row in document["reproduction"]}
    wanted = {"B1": "by_construction", "B2": "calibrated", "B3": "calibrated", "B4": "ambiguous", "B5": "calibrated"}
    assert statuses == wanted
    collision = document["runs"]["b"]["metrics"]["min_distance_m"]["ugv1"]["sudden"]["value"]
    assert collision < 0.05
    obstacles = document["scenario"]["resolved"]["obstacles"]
    for found in document["runs"]["d"]["metrics"]["min_distance_m"].values():
        assert all(found[name]["value"] >= 2.0 - 1e-9 for name in obstacles)


def test_an_unexpected_verdict_is_exit_code_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = ["--set", "runs={a: {method: a, expected: {SAFE-TRACE: refuted}}}", "--set", "reproduction=[]"]
    for old in ("report.html", "junit.xml"):
        (tmp_path / old).write_text("of an older run")
    assert main(["case_a", "-o", str(tmp_path), *one, "--format", "json"]) == 1
    said = capsys.readouterr()
    assert "SAFE-TRACE" in said.out
    assert said.out.startswith("[✗] Safe, but not all arrive: ugv1 does not arrive.")
    assert "Proved" not in said.out.replace("Proved: triggers", "")
    assert said.err == ""  # no terminal: no progress
    assert not {"report.html", "junit.xml"} & {path.name for path in tmp_path.iterdir()}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["no_such_scenario"], "case_a"),
        (["case_a", "--set", "control.period_s=-1"], "control.period_s"),
        (["case_a", "--set", "no.such=1"], "no"),
        (["case_a", "--set", "nonsense"], "nonsense"),
        (["case_a", "--seed", "-1"], "seed"),
        (["case_a", "--set", "intervention.policies.0.name=teleport"], "teleport"),
        (["case_a", "--set", "decision.noise_period_s=1e-9"], "allowed: 1e+07 steps, 8 GiB"),
        (["case_a", "--limit-steps", "100"], "allowed: 1e+02 steps, 8 GiB"),
        (["case_a", "--limit-memory", "0.1"], "allowed: 1e+07 steps, 0.1 GiB"),
    ],
)
def test_a_users_mistake_is_one_line_and_exit_code_2(
    arguments: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*arguments, "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_parameter_that_a_policy_does_not_have_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["case_a", "-o", str(tmp_path), "--set", "intervention.policies.0.parameters.warp=9"]) == 2
    error = capsys.readouterr().err
    assert "warp" in error
    assert error.count("\n") == 1
    assert not (tmp_path / "report.json").exists()


@pytest.mark.parametrize(
    "arguments",
    [[], ["case_a", "--format", "pdf"], ["case_a", "--seed", "x"], ["--what"], ["case_a", "--limit-steps", "-1"]],
)
def test_usage_errors_are_exit_code_2(arguments: list[str]) -> None:
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    assert stopped.value.code == 2


def test_a_folder_that_cannot_be_written_is_refused_before_the_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(make, "simulate_all", lambda *_, **__: pytest.fail("simulated"))
    (tmp_path / "file").write_text("in the way")
    assert main(["case_a", "-o", str(tmp_path / "file")]) == 2
    assert "file cannot be written" in capsys.readouterr().err


def test_a_folder_of_something_else_is_exit_code_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "thesis.tex").write_text("mine")
    assert main(["case_a", "-o", str(tmp_path)]) == 2
    assert "holds 'thesis.tex' and no report" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_the_shipped_scenarios_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--list"]) == 0
    assert capsys.readouterr().out.split() == [*shipped(), "audit"]


def test_claims_are_judged_again_from_a_saved_run(report: Report, capsys: pytest.CaptureFixture[str]) -> None:
    folder = report("case_a")
    document = json.loads((folder / "report.json").read_text())
    of_d = {claim["id"]: claim for claim in document["claims"] if claim["run"] in ("d", "")}
    assert judge.main([str(folder / "trace" / "d"), "--json"]) == 0
    again = {claim["id"]: claim for claim in json.loads(capsys.readouterr().out)}
    assert {name: claim["status"] for name, claim in again.items()} == {n: c["status"] for n, c in of_d.items()}
    assert again["SAFE-TRACE"]["margin"] == of_d["SAFE-TRACE"]["margin"]
    assert of_d["SAFE-INV"]["rerun"].endswith("SAFE-INV")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["case_a", "SAFE-TRACE"], "SAFE-TRACE says nothing about case_a"),
        (["nowhere"], "no such scenario"),
    ],
)
def test_what_cannot_be_judged_is_exit_code_2(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert judge.main(arguments) == 2
    assert said in capsys.readouterr().err


def test_a_refuted_claim_that_is_not_expected_is_exit_code_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace.save(simulate(load("minimal", ["decision.trigger=bare", "duration_s=1"])[0], "a"), tmp_path / "a")
    assert judge.main([str(tmp_path / "a"), "ZENO-PROOF", "-v"]) == 1
    assert capsys.readouterr().out.startswith("ZENO-PROOF: refuted")
