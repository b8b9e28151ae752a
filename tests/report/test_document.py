"""The document: schema, overall verdict, what is missing, audit."""

import json
import xml.etree.ElementTree as ET
from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
from report.cases import FINE, GOING_ROUND, STALL, Kept, built, make_trace, verdict

from airground_drake.report import attention, document, junit, screen
from airground_drake.report.audit import of_runs
from airground_drake.report.model import of
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import Verdict
from airground_drake.verify.finding import Finding


def test_minimum_of_the_schema_in_strict_json(scenario: Scenario, traces: dict[str, Trace]) -> None:
    report = json.loads(json.dumps(built(scenario, traces, FINE), allow_nan=False))
    assert report["schema"] == "airground_drake.report/4"
    run = report["runs"]["c"]
    for found, keys in (
        (report["scenario"], "name sha256 resolved"),
        (run["events"][0], "t_s robot kind position_m"),
        (report["claims"][0], "id run status expected margin unit evidence assumptions does_not_establish"),
        (report["reproduction"][0], "id quantity paper ours unit status why"),
        (report["audit"][0], "id finding paper ours evidence"),
    ):
        assert {*keys.split()} <= found.keys()
    metrics = run["metrics"]
    nearest = metrics["min_distance_m"]["ugv1"]["obstacle_1"]
    assert nearest["value"] == pytest.approx(np.hypot(STALL[0] - 1.7, STALL[1] - 4.0))
    assert 0.0 < nearest["t_s"] < 30.0
    assert metrics["final_position_m"]["ugv1"] == pytest.approx([3.3, 13.0, 0.0])
    assert (metrics["wall_s"], metrics["realtime_factor"]) == (0.5, pytest.approx(60.0))
    assert metrics["gatekeeper"]["closest_call"]["relative_cost_margin"] == pytest.approx(0.25)
    assert report["claims"][1]["margin"] is None
    assert report["choices"][0]["ours"] == 0.5606


@pytest.mark.parametrize(
    ("verdicts", "status", "code"),
    [
        (FINE, "as_expected", 0),
        ([*FINE, verdict("a", "refuted"), verdict("a", "error")], "not_as_expected", 1),
        ([*FINE, verdict("a", "holds", "refuted")], "not_as_expected", 1),
        *(([*FINE, verdict("a", status)], "inconclusive", 3) for status in ("inconclusive", "not_run", "error")),
        ([*FINE, verdict("a", "inconclusive", "inconclusive")], "as_expected", 0),
        ([*FINE, verdict("a", exercised=0)], "as_expected", 0),
        ([*FINE, verdict("a", "holds", "exercised", exercised=4)], "as_expected", 0),
        ([*FINE, verdict("a", "holds", "exercised", exercised=0)], "not_as_expected", 1),
        ([*FINE, verdict("a", "refuted", "exercised", exercised=4)], "not_as_expected", 1),
        ([*FINE, verdict("a", "refuted", "nothing", exercised=4)], "as_expected", 0),
        ([*FINE, verdict("a", "error", "nothing")], "inconclusive", 3),
        ([*FINE, verdict("a", "not_run", "nothing")], "inconclusive", 3),
        ([*FINE, verdict("a", "not_run", "exercised")], "inconclusive", 3),
        (FINE[:2], "inconclusive", 3),
        ([], "inconclusive", 3),
    ],
)
def test_overall(verdicts: list[Verdict], status: str, code: int, scenario: Scenario, traces: dict[str, Trace]) -> None:
    report = built(scenario, traces, verdicts)
    assert (report["overall"]["status"], report["overall"]["exit_code"]) == (status, code)


def test_too_few_interventions_or_messages_are_not_as_declared(scenario: Scenario, traces: dict[str, Trace]) -> None:
    scenario = deepcopy(scenario)
    scenario.runs["c"].expected = {"interventions": 1, "messages": 2}
    report = built(scenario, traces, FINE)
    sent = report["runs"]["c"]["metrics"]["messages"]
    assert sent["proposals"] + sent["answers"] >= 2
    overall = report["overall"]
    assert (overall["status"], overall["exit_code"], overall["checks"]) == ("not_as_expected", 1, len(FINE) + 2)
    why = "1 of 5 checks differs from what the scenario declares: interventions on run c (0, expected at least 1)."
    assert overall["why"] == why
    assert overall["missing"] == []
    assert screen.declared(of(report)).lines[1] == "c: interventions 0"
    (item,) = (each for each in attention.items(of(report)) if each.run == "c" and each.chip == "not_as_expected")
    assert (item.words, item.about) == ("0 interventions", "expected: at least 1")
    failed = ET.fromstring(junit.render(of(report))).find("*/*[@name='interventions']/failure")
    assert failed is not None
    assert failed.get("message") == "0 interventions, expected at least 1"


def test_what_nothing_tested_and_what_is_not_promised_is_counted_apart(
    scenario: Scenario, traces: dict[str, Trace]
) -> None:
    idle = [verdict("c", exercised=0), verdict("", "proved", "proved", exercised=0)]
    open_ = [verdict("a", "refuted", "nothing"), verdict("c", "holds", "nothing", exercised=1)]
    report = built(scenario, traces, [*FINE, verdict("a", exercised=1), *idle, *open_])
    overall = report["overall"]
    assert overall["counts"] == {"holds": 4, "refuted": 2, "not_exercised": 2}
    assert overall["not_exercised"] == [{"id": "SAFE-TRACE", "run": run} for run in ("c", "")]
    assert overall["unpromised"] == [{"id": "SAFE-TRACE", "run": run} for run in "ac"]
    assert [claim["as_expected"] for claim in report["claims"][-2:]] == [None, None]
    assert (overall["checks"], overall["as_expected"]) == (6, 6)


def test_missing_data_is_listed(scenario: Scenario, traces: dict[str, Trace]) -> None:
    overall = built(scenario, {"a": traces["a"], "a_printed": traces["a_printed"]}, FINE[:1])["overall"]
    assert [(item["run"], item["why"]) for item in overall["missing"]] == [
        ("c", "the run has no trace"),
        ("a_printed", "no claim was checked on the run"),
    ]
    other = Verdict.of(type("Other", (Kept,), {"id": "OTHER"})(), "a_printed", Finding("holds"), "holds")
    (item,) = built(scenario, traces, [*FINE[:2], other])["overall"]["missing"]
    assert (item["run"], item["id"]) == ("a_printed", "SAFE-TRACE")
    (item,) = built(replace(scenario, claims={"MINE": "m:M"}), traces, FINE)["overall"]["missing"]
    assert (item["run"], item["id"]) == ("", "MINE")
    assert built(replace(scenario, runs={}, reproduction=[]), {}, [])["overall"]["exit_code"] == 3


def test_audit_is_made_from_the_runs_and_leaves_out_what_they_do_not_show(
    scenario: Scenario, traces: dict[str, Trace]
) -> None:
    recursion, timing = built(scenario, traces, FINE)["audit"]
    assert (recursion["id"], timing["id"]) == (1, 6)
    assert recursion["ours"]["a"] > 1.99 > recursion["ours"]["a_printed"]
    travelled = STALL[1] + np.sqrt(9.0 - 0.069**2)
    assert timing["ours"] == pytest.approx(travelled / 0.5606)
    assert timing["evidence"]["trigger_at_printed_speed_s"] == pytest.approx(travelled)
    assert timing["evidence"]["measured_trigger"] == {"run": "c", "t_s": 14.5}
    lower = {name: replace(trace, meta=trace.meta | {"zeta_m": 1.0}) for name, trace in traces.items()}
    _, timing = built(scenario, lower, FINE)["audit"]  # the threshold in force, not that of the scenario
    assert timing["ours"] == pytest.approx((STALL[1] + np.sqrt(1.0 - 0.069**2)) / 0.5606)
    moving = {"a": make_trace(scenario, "a", GOING_ROUND), "c": traces["c"]}
    extra = {"id": 2, "finding": "f", "paper": 1, "ours": 2, "evidence": {}, "demonstrated": False}
    report = document.build(scenario, moving, FINE, {}, audit=[*of_runs(scenario, moving), extra], audited=True)
    assert [item["id"] for item in report["audit"]] == [2]
    assert (report["overall"]["status"], report["overall"]["undemonstrated"]) == ("not_as_expected", [2])
