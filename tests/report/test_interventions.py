"""What the help of the UAV came to: every proposal, messages beside always-on supervision, avoidance meanwhile."""

from collections.abc import Callable
from dataclasses import replace

import pandas as pd
import pytest
from builders.runs import run_of
from oracles.mutants import PATIENCE

from airground_drake.report.document import expected_numbers
from airground_drake.report.interventions import avoidance, farthest_from_prediction, interventions, messages
from airground_drake.report.metrics import of_run
from airground_drake.scenario.load import load
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge

Run = Callable[[str, str], Trace]


def test_what_became_of_a_proposal(run: Run) -> None:
    (found,) = interventions(run("case_a", "d"))
    release_s = next(event["t_s"] for event in run("case_a", "d").events if event["kind"] == "release")
    assert found == {
        "number": 0, "robot": "ugv1", "policy": "detour", "cause": "ugv1", "sent_s": pytest.approx(14.5),
        "accepted_s": pytest.approx(14.55), "begun_s": pytest.approx(14.55),
        "ended": {"how": "released", "t_s": pytest.approx(release_s, abs=0.05), "reason": ""}, "tries": 1,
    }  # fmt: skip
    (obeyed,) = interventions(run("case_a", "b"))
    assert (obeyed["accepted_s"], obeyed["tries"]) == (pytest.approx(14.5), None)


def test_why_proposals_end() -> None:
    trace = simulate(load("case_b", PATIENCE), "d")
    found = interventions(trace)
    ends = [each["ended"] for each in found]
    assert {"over", "refused"} <= {end["how"] for end in ends}
    assert {"exhausted", "stalls"} <= {end["reason"] for end in ends if end["how"] == "refused"}
    for each, end in zip(found, ends, strict=True):
        assert (each["begun_s"] is not None) == (end["how"] in ("over", "released", "end of the run"))
        assert each["begun_s"] is None or each["accepted_s"] == each["begun_s"] < end["t_s"]


def test_a_refusal_that_is_reversed_at_once_ends_a_proposal_all_the_same(run: Run) -> None:
    end = interventions(run("case_b", "c_literal"))[-1]["ended"]
    assert end == {"how": "given up", "t_s": pytest.approx(14.1), "reason": "first_stage"}


def test_why_a_proposal_was_not_answered(run: Run) -> None:
    """It was withdrawn before an answer, never delivered, or still open at the end: these are different things."""
    trace = run("case_a", "d")
    trace = replace(trace, decisions=trace.decisions.iloc[:0], samples=trace.samples.assign(**{"ugv1.executing": -1}))
    table = trace.messages
    (first,) = interventions(trace)
    assert (first["ended"]["how"], first["accepted_s"]) == ("withdrawn first", None)
    (still,) = interventions(replace(trace, messages=table[table["kind"] != "withdrawal"]))
    assert still["ended"] == {"how": "end of the run", "t_s": 30.0, "reason": ""}
    missed = table.assign(received_s=table["received_s"].where(table["kind"] != "proposal"))
    (lost,) = interventions(replace(trace, messages=missed))
    assert (lost["ended"]["how"], lost["ended"]["t_s"]) == ("lost", lost["sent_s"])


def test_messages_beside_always_on_supervision(run: Run) -> None:
    """`case_a` lasts 30 s, has two UGVs, and periods of 0.05 s."""
    trace = run("case_a", "d")
    assert messages(trace) == {
        "proposals": 1, "withdrawals": 1, "answers": 1,
        "always_on": {"proposals": 1200, "answers": 1200},
        "robots": {
            "ugv1": {"proposals": 1, "withdrawals": 1, "answers": 1},
            "ugv2": {"proposals": 0, "withdrawals": 0, "answers": 0},
        },
    }  # fmt: skip
    assert (messages(run("case_a", "b")) or {})["always_on"] == {"proposals": 1200, "answers": 0}
    assert messages(run("case_a", "a")) is None


def test_avoidance_binds_where_a_robot_saw_itself() -> None:
    measured = ["sensing.position_error_m=0.02", "control.avoidance_gain_1_s=20", "duration_s=8"]
    trace = simulate(load("minimal", measured), "a")
    (found,) = judge(trace, ["SAFE-HYP"])
    assert avoidance(trace)["ugv1"]["binding"] == found.evidence["inequalities_that_bind"]["ugv beside obstacle"] > 20


def test_a_ugv_is_near_its_prediction_but_not_on_it(run: Run) -> None:
    found = farthest_from_prediction(run("case_a", "c"))
    assert found is not None
    assert 0.0 < found["away_m"] < 0.1
    assert farthest_from_prediction(run("case_a", "d")) is None


def test_who_did_not_decide(run: Run) -> None:
    trace = run("case_a", "d")
    assert of_run(trace)["without_decisions"] == []
    assert of_run(replace(trace, decisions=trace.decisions.iloc[:0]))["without_decisions"] == ["ugv1"]


def test_numbers_that_a_scenario_expects() -> None:
    trace = run_of("d")
    scenario = load("case_a")
    scenario.runs["d"].expected = {"interventions": 1, "messages": 10_000}
    sent = {"metrics": {"interventions": [{"begun_s": 1.0}, {"begun_s": None}], "messages": messages(trace)}}
    both = expected_numbers(scenario, {"d": sent})
    assert [(each["id"], each["found"] >= each["least"], each["as_expected"]) for each in both] == [
        ("interventions", True, True), ("messages", False, False),
    ]  # fmt: skip
    idle = {"metrics": {"interventions": [], "messages": None}}
    assert [each["found"] for each in expected_numbers(scenario, {"d": idle})] == [0, 0]


def test_a_lost_message_is_not_delivered_and_a_doubled_one_is_delivered_twice(run: Run) -> None:
    trace = run("case_b", "d")
    before, table = messages(trace), trace.messages
    answers = table.index[table["kind"] == "answer"]
    lost = table.assign(received_s=table["received_s"].where(table.index != answers[1]))
    doubled = pd.concat([table, table.loc[answers[:2]].assign(copy=1)], ignore_index=True)
    assert before is not None
    for changed, by in ((lost, -1), (doubled, 2)):
        after = messages(replace(trace, messages=changed))
        assert after is not None
        assert after["answers"] == before["answers"] + by
