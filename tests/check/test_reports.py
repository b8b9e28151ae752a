"""Reports as written agree everywhere, whatever the scenario."""

import json
from pathlib import Path

import pandas as pd
import pytest
from check.forging import claim_of, copy, edited_report, edited_scenarios, judged, mend

from airground_drake import check
from airground_drake.check.report import DECIDED
from airground_drake.report import rebuild
from airground_drake.report.__main__ import main as write
from airground_drake.report.document import overall


def test_an_untouched_report_agrees_everywhere(report: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert check.main([str(report)]) == 0
    *lines, summary, taken = capsys.readouterr().out.splitlines()
    runs = json.loads((report / "report.json").read_text())["runs"]
    due = {(claim, run) for claim in ("trace", "events", *DECIDED) for run in runs}
    assert due <= {tuple(line.split()[:2]) for line in lines}
    assert all(" agrees (checker): " in line for line in lines)
    assert taken.startswith("Taken as recorded: policies, seeds and faults")
    assert summary == f"{len(lines)} checks: {len(lines)} agrees"


GATED = ("runs={c: {method: c}, d: {method: d}}", "reproduction=[]")
"""The runs that have a gatekeeper: the others are those of the report above."""
LATE = ("obstacles.obstacle_2.appears_s=7.02", "obstacles.sudden.appears_s=99")
"""Near UGV1's preset from 7 s on, and never: an obstacle counts from where it appears."""
BARE = ("decision.trigger=bare", "duration_s=17.01", "gatekeeper.switching_margin=0", "gatekeeper.min_dwell_s=0.3")
"""ZENO-PROOF is refuted by a run; an acceptance is taken back."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "reasons"),
    [
        (["obstacles={}", "choices=[]", *GATED], set()),  # those of SAFE-DIST's experiment are its own
        (["gatekeeper.period_s=30", *GATED], set()),  # a proposal, and the run ends before a decision is due
        ([*LATE, *BARE, *GATED], {"reversed", "dwell"}),
    ],
)
def test_reports_of_changed_scenarios_agree(
    changes: list[str], reasons: set[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = [word for change in changes for word in ("--set", change)]
    assert write(["case_b", "-o", str(tmp_path / "r"), "--format", "json", "-q", *settings]) in (0, 1)
    assert capsys.readouterr() == ("", "")
    found = set(pd.read_parquet(tmp_path / "r/trace/c/decisions.parquet")["reason"])
    assert reasons <= found if reasons else not found
    assert check.main([str(tmp_path / "r")]) == 0, capsys.readouterr().out


def _with_a_third_party_claim(report: Path, folder: Path) -> None:
    """Put a claim that the scenario adds into a copy of a report without pages, about run d and about the model."""
    copy(report, folder)
    for page in ("report.html", "junit.xml"):  # they do not show it
        (folder / page).unlink()
    with edited_scenarios(folder) as scenarios:
        for scenario in scenarios:
            scenario["claims"] = {"MINE": "mine:Mine"}
    with edited_report(folder) as document:
        for run in ("d", ""):
            entry = dict(claim_of(document, "ZENO-TRACE" if run else "SAFE-INV", run))
            more = {"status": "holds", "expected": "holds", "evidence": {}, "exercised": 1}
            document["claims"].append(entry | {"id": "MINE"} | more)
        document["overall"] = overall(document["claims"], (), (), ())
    mend(folder)


def test_third_party_claims_are_taken_as_recorded_and_counted(report: Path, tmp_path: Path) -> None:
    _with_a_third_party_claim(report, tmp_path / "r")
    assert check.main([str(tmp_path / "r")]) == 0
    again = [line for line in rebuild.lines(tmp_path / "r", judge=judged) if line["claim"] == "MINE"]
    assert [(line["claim"], line["run"], line["outcome"]) for line in again] == [
        ("MINE", "d", "as recorded"), ("MINE", "", "as recorded"),
    ]  # fmt: skip


def test_the_scenario_says_what_is_expected_of_a_third_party_claim(report: Path, tmp_path: Path) -> None:
    _with_a_third_party_claim(report, tmp_path / "r")
    with edited_scenarios(tmp_path / "r") as scenarios:
        for scenario in scenarios:
            scenario["runs"]["d"]["expected"]["MINE"] = "refuted"
    mend(tmp_path / "r")
    (line,) = (line for line in rebuild.lines(tmp_path / "r", judge=judged) if line["claim"] == "MINE" and line["run"])
    assert (line["outcome"], line["about"], line["recomputed"]) == ("DISAGREES", "expected", "refuted")


def test_a_difference_says_where_other_code_wrote_the_report(report: Path, tmp_path: Path) -> None:
    """An older version may have drawn the page otherwise; the reader must not take it for a forgery."""
    said = []
    for k, commit in enumerate((None, "c933ccd")):
        copy(report, folder := tmp_path / str(k))
        page = folder / "report.html"
        page.write_text(page.read_text(encoding="utf-8").replace("<title>", "<title>Old: "), encoding="utf-8")
        with edited_report(folder) as document:
            document["provenance"]["git"] = commit or document["provenance"]["git"]
        said += [line["text"] for line in rebuild.lines(folder, judge=judged) if line["claim"] == "report.html"]
    assert ["; other code wrote the report (0.1.0, c933ccd); this is" in text for text in said] == [False, True]
