"""Every measure with its failing side, and the rows of the table."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.paths import Corners
from report.cases import GOING_ROUND, STALL, STALLING, SUCCESS, event, make_scenario, make_trace

from airground_drake.report import reproduction
from airground_drake.report.reproduction import MEASURES
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace


def measured(name: str, corners: Corners = STALLING, events: Sequence[dict[str, Any]] = (), **more: Any) -> list[float]:
    return MEASURES[name](make_trace(make_scenario(), "a", corners, events, **more), "ugv1")


MOVING: Corners = [(0, 3.3, 0.5), (30, *STALL)]
AND_BACK: Corners = [(0, 3.3, 0.5), (29, *STALL), (29.5, 3.37, 5.105), (30, *STALL)]
NEAR: Corners = [(0, 3.3, 0.5), (9, 3.9, 5.3), (30, 3.9, 5.3)]
PASSING: Corners = [(0, 0.7, 1.0), (30, 0.7, 7.3)]
TWO = [float(np.hypot(3.9 - x, 5.3 - y)) for x, y in ((1.7, 4.0), (4.0, 7.0))]
TIMES = [
    event(3, "trigger", "ugv2"), event(4, "proposal"), event(5, "refuse"), event(5.5, "proposal"), event(6, "accept"),
    event(7, "trigger"), event(8, "proposal"),
]  # fmt: skip
RECOVERY = {0: 0.0, 9.9: 2.0, 10.0: 3.0 - 2e-9, 10.1: 3.0 - 1e-9, 11.0: 4.0, 12.0: 3.04, 12.1: 2.94, 30.0: 0.0}
TRIGGERED = [event(10.0, "trigger")]
ANSWERED = [*TRIGGERED, event(12.0, "accept")]


@pytest.mark.parametrize(
    ("name", "expected", "corners", "events", "more"),
    [
        ("stall_position", list(STALL), STALLING, [], {}),
        ("stall_position", [], MOVING, [], {}),
        ("stall_position", [], AND_BACK, [], {}),
        ("stall_position", [], GOING_ROUND, [], {}),
        ("stall_position", [], [(0, *STALL), (0.5, *STALL)], [], {}),  # the run is too short
        ("stall_position", [], MOVING, [], {"step_s": 30.0}),  # the rows are too sparse
        ("distances_while_stalled", TWO, NEAR, [], {}),  # in the order of names, not of distances
        ("distances_while_stalled", [], MOVING, [], {}),
        ("grows_past_threshold", [1], STALLING, [], {}),
        ("grows_past_threshold", [0], GOING_ROUND, [], {}),
        ("grows_past_threshold", [0], STALLING, [event(20, "release")], {}),
        ("grows_past_threshold", [0], STALLING, [], {"x": {0: 0.0, 30: 2.9}}),  # stays below
        ("grows_past_threshold", [0], STALLING, [], {"x": {0: 0.0, 10: 4.0, 20: 3.9, 24: 2.0, 30: 3.5}}),  # shrinks
        ("grows_until_acceptance", [1], GOING_ROUND, ANSWERED, {"x": {0: 0.0, 10: 3.0, 12: 4.0, 20: 0.0}}),
        (
            "grows_until_acceptance",
            [0],
            GOING_ROUND,
            ANSWERED,
            {"x": {0: 0.0, 10: 3.0, 12: 2.9, 20: 0.0}},
        ),  # fell before
        ("grows_until_acceptance", [0], GOING_ROUND, ANSWERED, {"x": {0: 0.0, 10: 3.0, 12: 4.0, 20: 5.0}}),  # no help
        ("grows_until_acceptance", [], GOING_ROUND, TRIGGERED, {}),
        ("path_shifts", [1], GOING_ROUND, SUCCESS, {}),
        ("path_shifts", [0], MOVING, SUCCESS, {}),
        ("path_shifts", [], [(0, *STALL), (10, *STALL)], [], {}),  # ends before any is executed
        ("arrives", [1], GOING_ROUND, [], {}),
        ("arrives", [0], STALLING, [], {}),
        ("trigger_time", [7], STALLING, TIMES, {}),
        ("trigger_time", [], STALLING, [], {}),
        ("accepted_proposal_time", [5.5], STALLING, TIMES, {}),
        ("accepted_proposal_time", [], STALLING, TIMES[:4], {}),
        ("refused_proposal_time", [4], STALLING, TIMES, {}),
        ("acceptance_lasts", [1], GOING_ROUND, [event(11.0, "refuse"), *ANSWERED[1:]], {}),
        ("acceptance_lasts", [0], GOING_ROUND, [*ANSWERED, event(14.7, "refuse")], {}),
        ("acceptance_lasts", [0], STALLING, ANSWERED, {}),
        ("acceptance_lasts", [], GOING_ROUND, TRIGGERED, {}),
        ("execution_time", [14.5], STALLING, TIMES, {}),  # the row before the signal rises, whatever the events say
        ("recovery_duration", [2.04], STALLING, TRIGGERED, {"x": RECOVERY}),  # not the fall at the trigger itself
        ("recovery_duration", [], STALLING, [], {"x": RECOVERY}),
        ("recovery_duration", [], STALLING, TRIGGERED, {"x": {0: 0.0, 10: 3, 30: 9}}),
        ("intervention_succeeds", [1], GOING_ROUND, SUCCESS, {}),
        ("intervention_succeeds", [0], STALLING, SUCCESS, {}),
        ("intervention_succeeds", [0], GOING_ROUND, [e for e in SUCCESS if e["kind"] != "accept"], {}),
        ("intervention_succeeds", [0], GOING_ROUND, [e for e in SUCCESS if e["kind"] != "trigger"], {}),
        ("intervention_succeeds", [0], GOING_ROUND, [*SUCCESS, event(14.7, "refuse")], {}),
        ("intervention_succeeds", [0], GOING_ROUND, [*SUCCESS, event(14.3, "trigger")], {}),  # below the threshold
        ("intervention_succeeds", [1], GOING_ROUND, [*SUCCESS, event(14.7, "refuse", "ugv2")], {}),
        ("minimum_distance", [1.0], PASSING, [], {"step_s": 30.0}),  # between rows
        ("collision_position", list(STALL), STALLING, [event(9, "collision")], {}),
        ("collision_position", [], STALLING, [], {}),
        ("final_position", [3.3, 13.0], GOING_ROUND, [], {}),
    ],
)
def test_a_measure(
    name: str, expected: list[float], corners: Corners, events: list[dict[str, Any]], more: dict[str, Any]
) -> None:
    assert measured(name, corners, events, **more) == pytest.approx(expected)


def test_every_measure_is_tested_and_none_needs_obstacles() -> None:
    (marked,) = (mark for mark in test_a_measure.pytestmark if mark.name == "parametrize")
    assert {case[0] for case in marked.args[1]} == set(MEASURES)
    assert MEASURES["minimum_distance"](make_trace(replace(make_scenario(), obstacles={})), "ugv1") == []


def test_rows_and_what_they_say_of_the_tolerance(scenario: Scenario, traces: dict[str, Trace]) -> None:
    stall, trigger, success = reproduction.rows(scenario, traces)
    assert [row["status"] for row in (stall, trigger, success)] == ["reproduced", "calibrated", "reproduced"]
    assert (stall["ours"], stall["difference"]) == (pytest.approx(list(STALL)), pytest.approx(0.069))
    assert (trigger["paper"], trigger["ours"]) == (14.45, 14.5)
    assert stall["why"] == "within the tolerance only: ours rounds to 3.4 m, the paper prints 3.3 m; as it is"
    assert trigger["why"] == "within the tolerance only: ours rounds to 14.5 s, the paper prints 14.45 s; speed set"
    assert success["why"] == "all of it"
    exact = replace(scenario.reproduction[1], paper=[14.5])
    own = replace(exact, by_construction=True)
    found = reproduction.rows(replace(scenario, reproduction=[exact, own, replace(own, paper=[10.6])]), traces)
    assert [row["status"] for row in found] == ["calibrated", "by_construction", "not_reproduced"]
    assert found[0]["why"] == "speed set"


def test_reasons_tell_what_happened_in_the_run_at_hand(scenario: Scenario) -> None:
    row = replace(scenario.reproduction[2], measure="intervention_succeeds", run="a", why="ours")
    told = []
    for events in (SUCCESS, [*SUCCESS, event(14.7, "refuse"), event(15.7, "refuse")], TRIGGERED):
        trace = make_trace(make_scenario(), "a", GOING_ROUND, events)
        told += [each["why"] for each in reproduction.rows(replace(scenario, reproduction=[row]), {"a": trace})]
    assert told[0] == "ours"
    assert told[1] == "the answer differs; the gatekeeper refuses at 14.70, 15.70 s; ours"
    assert "the gatekeeper never accepts; ours" in told[2]
    sent = replace(row, measure="refused_proposal_time", paper=[4.05], unit="s", tolerance=0.1)
    trace = make_trace(make_scenario(), "a", STALLING, TIMES)
    (found,) = reproduction.rows(replace(scenario, reproduction=[sent]), {"a": trace})
    assert (found["ours"], found["why"].endswith("; refused at 5.00 s; ours")) == (4.0, True)


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"paper": [3.3, 5.3]}, "differs by 0.198 m, 0.1 m are allowed; as it is"),
        ({"paper": [3.3]}, "2 components measured, the paper's value has 1"),
        ({"run": "b"}, "run 'b' has no trace"),
        ({"measure": "stahl"}, "there is no measure 'stahl'; there are"),
        ({"robot": "ugv2"}, "no value"),
        ({"robot": "ugv7"}, "could not be measured: run a: the trace has no column"),
        ({"measure": "arrives", "paper": [1.0], "unit": "yes/no", "tolerance": 9.0}, "the answer differs"),
        ({"measure": "broken"}, "not finite"),
    ],
)
def test_a_row_that_is_not_reproduced_says_why(
    change: dict[str, Any], why: str, scenario: Scenario, traces: dict[str, Trace], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(MEASURES, "broken", lambda trace, robot: [float("nan"), 0.0])
    (row,) = reproduction.rows(replace(scenario, reproduction=[replace(scenario.reproduction[0], **change)]), traces)
    assert row["status"] == "not_reproduced"
    assert why in row["why"]
