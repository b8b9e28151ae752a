"""The command line: exit codes, one-line errors, files."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from report.cases import make_scenario

from airground_drake.report import after_runs, make, screen
from airground_drake.report.__main__ import main
from airground_drake.report.model import of
from airground_drake.scenario.load import load
from airground_drake.scenario.shipped import shipped
from airground_drake.sim import trace
from airground_drake.sim.simulation import simulate
from airground_drake.verify import __main__ as judge

ROOT = Path(__file__).parents[2]
Report = Callable[[str], Path]


def document_of(folder: Path) -> dict[str, Any]:
    return dict(json.loads((folder / "report.json").read_text(encoding="utf-8")))


def test_everything_is_written_and_the_readme_shows_the_first_screen(report: Report) -> None:
    folder = report("case_a")
    names = {path.name for path in folder.iterdir()}
    assert names == {"report.html", "report.json", "junit.xml", "diagram.dot", "diagram.svg", "trace"}
    assert (folder / "diagram.dot").read_text() == (ROOT / "diagrams" / "case_a.dot").read_text()
    for name in load("case_a").runs:
        assert trace.load(folder / "trace" / name).run == name
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert re.findall(r"```text\n(.*?)```", readme, re.DOTALL) == [screen.text(of(document_of(folder))) + "\n"]


def test_the_reproduction_table_meets_its_targets(report: Report) -> None:
    document = document_of(report("case_a"))
    rows = {row["id"]: row for row in document["reproduction"]}
    for name, wanted, within in (
        ("A1", [3.3, 5.1], 0.1), ("A2", [2.0, 2.0], 0.01), ("A5", 14.45, 0.05), ("A6", 1.7, 0.1),
    ):  # fmt: skip
        assert rows[name]["ours"] == pytest.approx(wanted, abs=within)
    assert {name: row["status"] for name, row in rows.items()} == {
        "A3": "reproduced",
        **dict.fromkeys(("A1", "A2", "A4", "A5", "A6", "A7"), "calibrated"),
        "A7L": "not_reproduced",
        "A8": "not_reproduced",
    }
    assert rows["A8"]["ours"][0] == pytest.approx((3.3 - 1.0) / 2.0, abs=1e-3)  # where Table 1 has 1.1
    assert "stuck, as declared</span>" in (report("case_a") / "report.html").read_text()
    assert document["runs"]["d"]["metrics"]["min_distance_m"]["ugv1"]["obstacle_1"]["value"] >= 2.0 - 1e-9

    document = document_of(report("case_b"))
    statuses = {row["id"]: row["status"] for row in document["reproduction"]}
    assert statuses == {
        "B4": "ambiguous",
        "B10L": "not_reproduced",
        **dict.fromkeys(("B1", "B6", "B7"), "by_construction"),
        **dict.fromkeys(("B2", "B3", "B5", "B8", "B9", "B10"), "calibrated"),
    }
    assert document["runs"]["b"]["metrics"]["min_distance_m"]["ugv1"]["sudden"]["value"] < 0.05
    for found in document["runs"]["d"]["metrics"]["min_distance_m"].values():
        assert all(found[name]["value"] >= 2.0 - 1e-9 for name in document["scenario"]["resolved"]["obstacles"])


@pytest.mark.slow
def test_an_unexpected_verdict_is_exit_code_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = ["--set", "runs={a: {method: a, expected: {SAFE-TRACE: refuted}}}", "--set", "reproduction=[]"]
    for old in ("report.html", "junit.xml"):
        (tmp_path / old).write_text("of an older run")
    assert main(["case_a", "-o", str(tmp_path), *one, "--format", "json"]) == 1
    said = capsys.readouterr()
    assert said.out.startswith("[≈] Without the UAV (a): 1 of 2 arrive, every distance kept.\n")
    assert "SAFE-TRACE on run a" in said.out[said.out.index("As declared?        ✗") :]
    assert all(line.endswith(" done") for line in said.err.splitlines())  # no terminal: a line for a long stage
    assert not {"report.html", "junit.xml"} & {path.name for path in tmp_path.iterdir()}


def test_a_folder_that_cannot_be_used_is_refused_before_the_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(make, "simulate_all", lambda *_, **__: pytest.fail("simulated"))
    (tmp_path / "thesis.tex").write_text("mine")
    for folder, why in ((tmp_path / "thesis.tex", "cannot be written"), (tmp_path, "holds 'thesis.tex'")):
        assert main(["case_a", "-o", str(folder)]) == 2
        assert why in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_report_without_the_command_line_has_the_findings_of_its_runs_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`airground check` makes these findings again, and would not agree with a report that lacks them."""
    monkeypatch.setattr(after_runs, "judge_all", lambda *_, **__: [])
    scenario = make_scenario()
    trigger = replace(scenario.reproduction[1], run="a")
    stalling = replace(scenario, duration_s=12.0, runs={"a": scenario.runs["a"]}, reproduction=[trigger])
    made = make.write_report(stalling, tmp_path, make.Wanted(("json",)))
    assert [item["id"] for item in made["audit"]] == [6]


def test_the_shipped_scenarios_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--list"]) == 0
    assert capsys.readouterr().out.split() == [*shipped(), "audit"]


def test_exit_codes_of_judging_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for arguments, said in ((["case_a", "SAFE-TRACE"], "says nothing about case_a"), (["x"], "no such scenario")):
        assert judge.main(arguments) == 2
        assert said in capsys.readouterr().err
    trace.save(simulate(load("minimal", ["decision.trigger=bare", "duration_s=1"]), "a"), tmp_path / "a")
    assert judge.main([str(tmp_path / "a"), "ZENO-PROOF"]) == 1
    assert judge.main([str(tmp_path / "a"), "SAFE-TRACE", "SAFE-HYP"]) == 0
    assert "ZENO-PROOF: refuted" in capsys.readouterr().out
