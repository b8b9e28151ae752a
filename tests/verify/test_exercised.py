"""How often a claim was put to the test: counted by every claim, 0 where nothing tested it, demanded by scenarios."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import persons
import pytest
from builders.edits import with_cells, with_meta
from verify.judging import CLAIMS, decided

from airground_drake.base.statuses import NOTHING, declared, meets, outcome
from airground_drake.scenario.load import load
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify import Finding, judge
from airground_drake.verify.claim import Verdict, well_formed

IDLE = [
    "duration_s=0.5",
    "obstacles={post: {position_m: [90, 90, 0], max_speed_m_s: 1.0}}",
    "ugvs.ugv1.target_m=[0, 0, 0]",
    "ugvs.ugv1.preset={waypoints_m: [[0, 0, 0], [0.01, 0, 0]], speed_m_s: 0.01}",
    "uav.target_m=[0, 0, 2]",
    "runs={c: {method: c}, d: {method: d}}",
]
"""Nothing near to avoid, nothing to trigger, nowhere to go."""


@pytest.fixture(scope="module")
def idle() -> dict[str, Verdict]:
    scenario = load("dwell", IDLE)
    return {verdict.claim.id: verdict for name in scenario.runs for verdict in judge(simulate(scenario, name))}


@pytest.mark.parametrize("claim", CLAIMS)
def test_a_run_without_anything_to_check_exercises_no_claim(claim: str, idle: dict[str, Verdict]) -> None:
    """A claim that always says that it was exercised does not pass here."""
    finding = idle[claim]
    assert (finding.status, finding.exercised) == ("holds", 0), finding
    assert outcome(finding.status, finding.exercised) == "not_exercised"
    assert idle[claim].as_expected
    assert not replace(idle[claim], expected="exercised").as_expected


@pytest.mark.parametrize("claim", CLAIMS)
def test_a_run_with_several_triggers_and_proposals_exercises_every_claim(
    claim: str, run: Callable[[str, str], Trace]
) -> None:
    of = {"LIVE-HYP": ("contact", "d")}
    trace = persons.run("standing") if claim == "SAFE-OWN" else run(*of.get(claim, ("dwell", "d")))
    (verdict,) = judge(trace, [claim])
    count = verdict.exercised
    assert count
    assert verdict.as_expected
    assert {"ZENO-TRACE": 2, "THR-TRIG": 7, "LIVE-GOAL": 2}.get(claim, count) == count


def without_messages(trace: Trace) -> Trace:
    tables = {name: getattr(trace, name).iloc[:0] for name in ("decisions", "problems", "proposals")}
    kept = [event for event in trace.events if event["kind"] not in ("proposal", "accept", "refuse")]
    idle = with_cells(trace, "samples", slice(None), [f"{ugv}.executing" for ugv in trace.ugvs], -1.0)
    return replace(with_meta(idle, events=kept), **tables)


@pytest.mark.parametrize("claim", ["GATE-PLAN", "LIVE-HYP"])
def test_where_the_uav_found_no_way_there_was_nothing_to_decide(claim: str, run: Callable[[str, str], Trace]) -> None:
    found = decided(claim, without_messages(run("minimal", "d")))
    assert (found.status, found.exercised) == ("holds", 0)


@pytest.mark.parametrize(
    ("status", "count", "counted", "allowed"),
    [
        ("holds", 0, "things", True), ("holds", None, "things", False), ("not_run", None, "things", True),
        ("holds", None, "", True),  # a third-party claim that counts nothing
        ("holds", -1, "things", False), ("holds", True, "things", False), ("holds", 2.0, "things", False),
    ],
)  # fmt: skip
def test_a_claim_that_says_what_exercises_it_must_count_it(
    status: Any, count: Any, counted: str, allowed: bool
) -> None:
    claim = type(CLAIMS["LIVE-GOAL"])()
    claim.exercised_by = counted
    try:
        well_formed(claim, Finding(status, exercised=count))
    except ValueError:
        assert not allowed
    else:
        assert allowed


@pytest.mark.parametrize(
    ("expected", "status", "count", "met"),
    [
        ("exercised", "holds", 1, True), ("exercised", "proved", 9, True), ("exercised", "holds", 0, False),
        ("exercised", "holds", None, False), ("exercised", "refuted", 5, False),
        ("exercised or error", "error", 5, True), ("exercised or error", "holds", 0, False),
        ("holds", "holds", 0, True), ("holds or supported", "supported", None, True),
        *(("nothing", status, count, None) for status in ("holds", "refuted") for count in (0, 5)),
        ("nothing", "inconclusive", None, None), ("nothing", "error", None, False), ("nothing", "not_run", None, False),
    ],
)  # fmt: skip
def test_exercised_is_established_on_something(expected: str, status: Any, count: int | None, met: bool | None) -> None:
    assert meets(expected, status, count) is met
    assert Verdict.of(CLAIMS["LIVE-GOAL"], "d", Finding(status, exercised=count), expected).as_expected is met


def test_an_expectation_that_admits_either_verdict_expects_nothing() -> None:
    for expected in ("holds or refuted", "exercised or refuted", "refuted or supported or error", NOTHING):
        assert declared(expected) == NOTHING
        run = load("minimal", [f"runs.d.expected.LIVE-GOAL={expected}"]).runs["d"]
        assert run.expected["LIVE-GOAL"] == NOTHING
    for expected in ("holds", "refuted", "holds or supported", "refuted or error"):
        assert declared(expected) == expected
