"""`airground index`: a folder of reports gets a page that leads to them."""

import json
from pathlib import Path
from typing import Any

import pytest
from commands.conftest import Airground
from report.cases import FINE, built, make_scenario, make_traces

from airground_drake.commands.index import MARK, PAGE
from airground_drake.sim import trace


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    scenario = make_scenario()
    return dict(json.loads(json.dumps(built(scenario, make_traces(scenario), FINE))))


def save(folder: Path, document: dict[str, Any], **scenario: str) -> None:
    folder.mkdir(parents=True)
    (folder / "report.json").write_text(json.dumps({**document, "scenario": {**document["scenario"], **scenario}}))


def test_every_report_is_there_with_its_verdict_a_link_and_a_picture(
    document: dict[str, Any], tmp_path: Path, airground: Airground
) -> None:
    save(tmp_path / "plain", document)
    save(tmp_path / "a b" / "100%", document, title="<script>alert(1)</script>")
    save(tmp_path / "bad", {**document, "claims": 3})
    save(tmp_path / "empty", document)
    (tmp_path / "empty" / "report.json").write_text("")
    (tmp_path / "latest").symlink_to(tmp_path / "plain")
    (tmp_path / "plain" / "report.html").touch()
    run = list(document["runs"])[-1]
    trace.save(make_traces(make_scenario())[run], tmp_path / "plain" / "trace" / run)
    for _ in range(2):  # again, over its own page
        assert airground("index", tmp_path) == f"{tmp_path / PAGE}\n"
    page = (tmp_path / PAGE).read_text()
    for words, times in (
        ("2 reports in", 1), ('href="plain/report.html"', 1), ('href="a%20b/100%25/report.json"', 1), ("<svg", 1),
        ("as declared</span>", 2), ("<strong>With the UAV (c): 1 of 2 arrive, ugv1 and obstacle_1 too close.", 2),
        ("bad/report.json is not a report", 1), ("empty/report.json is not a report", 1), ("latest is a link", 1),
        ("<script", 0),
    ):  # fmt: skip
        assert page.count(words) == times, words
    assert "no trace" in page


def test_a_foreign_page_is_left_alone(document: dict[str, Any], tmp_path: Path, airground: Airground) -> None:
    save(tmp_path / "good", document)
    (tmp_path / PAGE).write_text("mine")
    assert "left alone" in airground("index", tmp_path, code=2)
    assert (tmp_path / PAGE).read_text() == "mine"
    (tmp_path / PAGE).write_text(MARK)
    airground("index", tmp_path)
