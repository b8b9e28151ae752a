"""A folder of reports gets a page that leads to them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from report.cases import FINE, built, make_scenario, make_traces

from airground_drake.commands.index import MARK, PAGE, main
from airground_drake.run import trace


@pytest.fixture(scope="module")
def report() -> dict[str, Any]:
    scenario = make_scenario()
    return dict(json.loads(json.dumps(built(scenario, make_traces(scenario), FINE))))


def save(folder: Path, report: dict[str, Any], **scenario: str) -> None:
    folder.mkdir(parents=True)
    changed = {**report, "scenario": {**report["scenario"], **scenario}}
    (folder / "report.json").write_text(json.dumps(changed))


def test_every_report_is_there_with_its_verdict_a_link_and_a_picture(
    report: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save(tmp_path / "plain", report)
    save(tmp_path / "a b" / "100%", report, title="<script>alert(1)</script>")
    (tmp_path / "plain" / "report.html").touch()
    scenario = make_scenario()
    run = list(report["runs"])[-1]
    trace.save(make_traces(scenario)[run], tmp_path / "plain" / "trace" / run)
    assert main([str(tmp_path)]) == 0
    assert capsys.readouterr().out == f"{tmp_path / PAGE}\n"
    page = (tmp_path / PAGE).read_text()
    assert 'href="plain/report.html"' in page
    assert 'href="a%20b/100%25/report.json"' in page
    assert page.count("as declared</span>") == 2
    assert page.count("<strong>No method brings everyone home safely. Under (a), ugv1 comes within 1.99999 m of") == 2
    assert page.count("<svg") == 1
    assert "no trace" in page
    assert "<script" not in page
    assert main([str(tmp_path)]) == 0  # again, over its own page


def test_what_cannot_be_used_is_named_not_listed(report: dict[str, Any], tmp_path: Path) -> None:
    save(tmp_path / "good", report)
    save(tmp_path / "bad", {**report, "claims": 3})
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "report.json").write_text("{}")
    assert main([str(tmp_path)]) == 0
    page = (tmp_path / PAGE).read_text()
    assert "1 report in" in page
    assert "bad/report.json is no report" in page


@pytest.mark.parametrize("folder", ["", "none"])
def test_a_folder_without_reports_is_refused(folder: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path / folder)]) == 2
    assert "no reports" in capsys.readouterr().err
    assert not list(tmp_path.rglob(PAGE))


def test_a_page_of_somebody_else_is_left_alone(
    report: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save(tmp_path / "good", report)
    (tmp_path / PAGE).write_text("mine")
    assert main([str(tmp_path)]) == 2
    assert "left alone" in capsys.readouterr().err
    assert (tmp_path / PAGE).read_text() == "mine"
    (tmp_path / PAGE).write_text(MARK)
    assert main([str(tmp_path)]) == 0
