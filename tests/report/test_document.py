"""The document: schema, overall verdict, what is missing, audit."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from report.cases import FINE, GOING_ROUND, STALL, Kept, built, make_trace, verdict

from airground_drake.report import document
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.claim import Verdict
from airground_drake.verify.finding import Finding


def test_minimum_of_the_schema_in_strict_json(scenario: Scenario, traces: dict[str, Trace]) -> None:
    report = json.loads(json.dumps(built(scenario, traces, FINE), allow_nan=False))
    assert report["schema"] == "airground_drake.report/2"
    assert {"name", "sha256", "resolved"} <= set(report["scenario"])
    run = report["runs"]["c"]
    assert set(run["events"][0]) == {"t_s", "robot", "kind", "position_m"}
    nearest = run["metrics"]["min_distance_m"]["ugv1"]["obstacle_1"]
    assert nearest["value"] == pytest.approx(np.hypot(STALL[0] - 1.7, STALL[1] - 4.0))
    assert 0.0 < nearest["t_s"] < 30.0
    assert run["metrics"]["final_position_m"]["ugv1"] == pytest.approx([3.3, 13.0, 0.0])
    assert (run["metrics"]["wall_s"], run["metrics"]["realtime_factor"]) == (0.5, pytest.approx(60.0))
    assert run["metrics"]["gatekeeper"]["closest_call"]["relative_cost_margin"] == pytest.approx(0.25)
    assert {
        "id",
        "run",
        "status",
        "expected",
        "margin",
        "unit",
        "evidence",
        "assumptions",
        "does_not_establish",
    } <= set(report["claims"][0])
    assert report["claims"][1]["margin"] is None
    assert {"id", "quantity", "paper", "ours", "unit", "status", "why"} <= set(report["reproduction"][0])
    assert report["choices"][0]["ours"] == 0.5606
    assert {"id", "finding", "paper", "ours", "evidence"} <= set(report["audit"][0])


@pytest.mark.parametrize(
    ("verdicts", "status", "code"),
    [
        (FINE, "as_expected", 0),
        ([*FINE, verdict("a", "refuted")], "not_as_expected", 1),
        ([*FINE, verdict("a", "refuted"), verdict("a", "error")], "not_as_expected", 1),
        ([*FINE, verdict("a", "holds", "refuted")], "not_as_expected", 1),
        ([*FINE, verdict("a", "inconclusive")], "inconclusive", 3),
        ([*FINE, verdict("a", "not_run")], "inconclusive", 3),
        ([*FINE, verdict("a", "error")], "inconclusive", 3),
        ([*FINE, verdict("a", "inconclusive", "inconclusive")], "as_expected", 0),
        ([*FINE, verdict("a", exercised=0)], "as_expected", 0),
        ([*FINE, verdict("a", "holds", "exercised", exercised=4)], "as_expected", 0),
        ([*FINE, verdict("a", "holds", "exercised", exercised=0)], "not_as_expected", 1),
        ([*FINE, verdict("a", "refuted", "exercised", exercised=4)], "not_as_expected", 1),
        ([*FINE, verdict("a", "refuted", "exercised or refuted", exercised=4)], "as_expected", 0),
        ([*FINE, verdict("a", "not_run", "exercised")], "inconclusive", 3),
        (FINE[:2], "inconclusive", 3),
        ([], "inconclusive", 3),
    ],
)
def test_overall(verdicts: list[Verdict], status: str, code: int, scenario: Scenario, traces: dict[str, Trace]) -> None:
    report = built(scenario, traces, verdicts)
    assert (report["overall"]["status"], report["overall"]["exit_code"]) == (status, code)


def test_what_had_nothing_to_check_is_counted_apart(scenario: Scenario, traces: dict[str, Trace]) -> None:
    idle = [verdict("a", exercised=0), verdict("c", exercised=0), verdict("", "proved", "proved", exercised=0)]
    overall = built(scenario, traces, [*FINE, verdict("a", exercised=1), *idle])["overall"]
    assert overall["counts"] == {"holds": 3, "refuted": 1, "not_exercised": 3}
    assert [(item["id"], item["run"]) for item in overall["not_exercised"]] == [("SAFE-TRACE", run) for run in "ac"] + [
        ("SAFE-TRACE", "")
    ]
    assert overall["why"].endswith("3 of them had nothing to check: SAFE-TRACE on run a, c.")
    assert (overall["checks"], overall["as_expected"]) == (7, 7)
    missed = built(scenario, traces, [*FINE, verdict("a", "holds", "exercised", exercised=0)])["overall"]
    assert "SAFE-TRACE on run a (holds, nothing to check, expected exercised)" in missed["why"]


def test_what_may_come_out_either_way_is_counted_apart(scenario: Scenario, traces: dict[str, Trace]) -> None:
    either = [verdict("a", "refuted", "holds or refuted"), verdict("c", "holds", "exercised or refuted", exercised=1)]
    overall = built(scenario, traces, [*FINE, *either])["overall"]
    assert overall["either"] == [{"id": "SAFE-TRACE", "run": run} for run in "ac"]
    assert "2 of them may come out either way: SAFE-TRACE on run a, c." in overall["why"]
    assert built(scenario, traces, FINE)["overall"]["either"] == []


def test_nothing_at_all_is_no_pass(scenario: Scenario) -> None:
    empty = replace(scenario, runs={}, reproduction=[])
    assert built(empty, {}, [])["overall"]["exit_code"] == 3


def test_missing_data_is_listed(scenario: Scenario, traces: dict[str, Trace]) -> None:
    overall = built(scenario, {"a": traces["a"], "a_printed": traces["a_printed"]}, FINE[:1])["overall"]
    assert [(item["run"], item["why"]) for item in overall["missing"]] == [
        ("c", "the run has no trace"),
        ("a_printed", "no claim was checked on the run"),
    ]
    other = Verdict(type("Other", (Kept,), {"id": "OTHER"})(), "a_printed", Finding("holds"), "holds")
    (item,) = built(scenario, traces, [*FINE[:2], other])["overall"]["missing"]
    assert (item["run"], item["id"]) == ("a_printed", "SAFE-TRACE")


def test_audit_is_made_from_the_runs(scenario: Scenario, traces: dict[str, Trace]) -> None:
    recursion, timing = built(scenario, traces, FINE)["audit"]
    assert (recursion["id"], timing["id"]) == (1, 6)
    assert recursion["ours"]["a"] > 1.99 > recursion["ours"]["a_printed"]
    assert "does not stall; the augmented projector" in recursion["finding"]
    assert recursion["finding"].endswith("and stalls.")
    travelled = STALL[1] + np.sqrt(9.0 - 0.069**2)
    assert timing["ours"] == pytest.approx(travelled / 0.5606)
    assert timing["evidence"]["trigger_at_printed_speed_s"] == pytest.approx(travelled)
    assert timing["evidence"]["measured_trigger"] == {"run": "c", "t_s": 14.5}


def test_the_trigger_is_due_at_the_threshold_in_force(scenario: Scenario, traces: dict[str, Trace]) -> None:
    """Which under the rule 'bayes' is not `zeta_m`."""
    lower = {name: replace(trace, meta=trace.meta | {"zeta_m": 1.0}) for name, trace in traces.items()}
    _, timing = built(scenario, lower, FINE)["audit"]
    assert timing["ours"] == pytest.approx((STALL[1] + np.sqrt(1.0 - 0.069**2)) / 0.5606)
    assert timing["evidence"]["zeta_m"] == 1.0


def test_a_choice_may_be_an_entry_of_a_list() -> None:
    resolved = {"ugvs": {"ugv1": {"start_m": [1.0, 2.0]}}, "policies": [{"name": "detour"}]}
    looked = [document._lookup(resolved, key) for key in ("ugvs.ugv1.start_m.1", "policies.0.name", "policies.1.name")]
    assert looked == [2.0, "detour", None]


def test_audit_leaves_out_what_the_runs_do_not_show(scenario: Scenario, traces: dict[str, Trace]) -> None:
    moving = {"a": make_trace(scenario, "a", GOING_ROUND), "c": traces["c"]}
    assert built(scenario, moving, FINE)["audit"] == []
    extra = {"id": 2, "finding": "f", "paper": 1, "ours": 2, "evidence": {}, "demonstrated": True}
    report = document.build(scenario, "", moving, FINE, {}, audit=[extra])
    assert [item["id"] for item in report["audit"]] == [2]
