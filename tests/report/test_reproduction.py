"""Every measure with its failing side, and the rows of the table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.paths import Corners
from report.cases import GOING_ROUND, STALL, STALLING, SUCCESS, event, make_scenario, make_trace

from airground_drake.base.errors import TraceError
from airground_drake.report import reproduction
from airground_drake.report.reproduction import MEASURES
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Scenario


def measured(name: str, corners: Corners = STALLING, events: Sequence[dict[str, Any]] = (), **more: Any) -> list[float]:
    return MEASURES[name](make_trace(make_scenario(), "a", corners, events, **more), "ugv1")


def test_a_stalled_robot_is_where_it_stands() -> None:
    assert measured("stall_position") == pytest.approx(STALL)


@pytest.mark.parametrize(
    ("corners", "step_s"),
    [
        ([(0, 3.3, 0.5), (30, *STALL)], 0.1),
        ([(0, 3.3, 0.5), (29, *STALL), (29.5, 3.37, 5.105), (30, *STALL)], 0.1),
        (GOING_ROUND, 0.1),
        ([(0, *STALL), (0.5, *STALL)], 0.1),
        ([(0, 3.3, 0.5), (30, *STALL)], 30.0),
    ],
    ids=["moves", "moves and returns", "stands at its target", "run too short", "rows too sparse"],
)
def test_others_have_not_stalled(corners: Corners, step_s: float) -> None:
    assert measured("stall_position", corners, step_s=step_s) == []
    assert measured("distances_while_stalled", corners, step_s=step_s) == []


def test_distances_are_the_two_nearest_in_the_order_of_names() -> None:
    near = [float(np.hypot(3.9 - x, 5.3 - y)) for x, y in ((1.7, 4.0), (4.0, 7.0))]
    assert near[0] > near[1]
    assert measured("distances_while_stalled", [(0, 3.3, 0.5), (9, 3.9, 5.3), (30, 3.9, 5.3)]) == pytest.approx(near)


@pytest.mark.parametrize(
    ("grows", "corners", "events", "x"),
    [
        (1, STALLING, [], None),
        (0, GOING_ROUND, [], None),
        (0, STALLING, [event(20, "release")], None),
        (0, STALLING, [], {0: 0.0, 30: 2.9}),
        (0, STALLING, [], {0: 0.0, 10: 4.0, 20: 3.9, 24: 2.0, 30: 3.5}),
    ],
    ids=["grows", "comes back", "released", "stays below", "shrinks in between"],
)
def test_grows_past_threshold(
    grows: int, corners: Corners, events: list[dict[str, Any]], x: Mapping[float, float] | None
) -> None:
    assert measured("grows_past_threshold", corners, events, x=x) == [grows]


def test_arrives() -> None:
    assert measured("arrives", GOING_ROUND) == [1]
    assert measured("arrives", STALLING) == [0]


def test_times_of_first_events() -> None:
    events = [event(3, "trigger", "ugv2"), event(5, "refuse"), event(6, "accept"), event(7, "trigger")]
    found = {name: measured(name, events=events) for name in MEASURES if name.endswith("_time")}
    executed = found.pop("execution_time")
    assert found == {"trigger_time": [7], "acceptance_time": [6], "refusal_time": [5]}
    assert executed == [14.5]  # the row before the signal rises, whatever the events say
    assert measured("trigger_time") == []


def test_recovery_is_interpolated_and_skips_the_trigger_itself() -> None:
    x = {0: 0.0, 9.9: 2.0, 10.0: 3.0 - 2e-9, 10.1: 3.0 - 1e-9, 11.0: 4.0, 12.0: 3.04, 12.1: 2.94, 30.0: 0.0}
    assert measured("recovery_duration", events=[event(10.0, "trigger")], x=x) == pytest.approx([2.04])
    assert measured("recovery_duration", events=[], x=x) == []
    assert measured("recovery_duration", events=[event(10.0, "trigger")], x={0: 0.0, 10: 3, 30: 9}) == []


@pytest.mark.parametrize(
    ("succeeds", "corners", "events"),
    [
        (1, GOING_ROUND, SUCCESS),
        (0, STALLING, SUCCESS),
        (0, GOING_ROUND, [e for e in SUCCESS if e["kind"] != "accept"]),
        (0, GOING_ROUND, [e for e in SUCCESS if e["kind"] != "trigger"]),
        (0, GOING_ROUND, [*SUCCESS, event(14.7, "refuse")]),
        (0, GOING_ROUND, [*SUCCESS, event(14.3, "trigger")]),
        (1, GOING_ROUND, [*SUCCESS, event(14.7, "refuse", "ugv2")]),
    ],
    ids=["succeeds", "stays", "not accepted", "not triggered", "refused", "too early", "another one refused"],
)
def test_intervention_succeeds(succeeds: int, corners: Corners, events: list[dict[str, Any]]) -> None:
    assert measured("intervention_succeeds", corners, events) == [succeeds]


def test_minimum_distance_is_found_between_rows() -> None:
    passing: Corners = [(0, 0.7, 1.0), (30, 0.7, 7.3)]
    assert measured("minimum_distance", passing, step_s=30.0) == pytest.approx([1.0])
    assert MEASURES["minimum_distance"](make_trace(replace(make_scenario(), obstacles={})), "ugv1") == []


def test_collision_position() -> None:
    assert measured("collision_position", events=[event(9, "collision")]) == list(STALL)
    assert measured("collision_position") == []


def test_an_unknown_robot_is_named() -> None:
    with pytest.raises(TraceError, match="no robot 'ugv9'; there are ugv1, ugv2, uav"):
        MEASURES["arrives"](make_trace(make_scenario()), "ugv9")


def test_statuses_and_scalars(scenario: Scenario, traces: dict[str, Trace]) -> None:
    stall, trigger, success = reproduction.rows(scenario, traces)
    assert (stall["status"], trigger["status"], success["status"]) == ("reproduced", "calibrated", "reproduced")
    assert stall["ours"] == pytest.approx(list(STALL))
    assert stall["difference"] == pytest.approx(0.069)
    assert (trigger["paper"], trigger["ours"]) == (14.45, 14.5)


def test_a_value_that_only_the_tolerance_lets_pass_says_so(scenario: Scenario, traces: dict[str, Trace]) -> None:
    stall, trigger, success = reproduction.rows(scenario, traces)
    assert stall["why"] == "within the tolerance only: ours rounds to 3.4 m, the paper prints 3.3 m; as it is"
    assert trigger["why"] == "within the tolerance only: ours rounds to 14.5 s, the paper prints 14.45 s; speed set"
    assert success["why"] == "all of it"
    exact = replace(scenario.reproduction[1], paper=[14.5])
    assert reproduction.rows(replace(scenario, reproduction=[exact]), traces)[0]["why"] == "speed set"


def test_what_the_scenario_itself_says_is_not_reproduced(scenario: Scenario, traces: dict[str, Trace]) -> None:
    own = replace(scenario.reproduction[1], by_construction=True)
    missed = replace(own, paper=[10.6])
    found = reproduction.rows(replace(scenario, reproduction=[own, missed]), traces)
    assert [row["status"] for row in found] == ["by_construction", "not_reproduced"]


def test_final_position() -> None:
    assert measured("final_position", GOING_ROUND) == [3.3, 13.0]
    with pytest.raises(TraceError, match="no robot 'ugv9'; there are ugv1, ugv2, uav"):
        MEASURES["final_position"](make_trace(make_scenario(), "a"), "ugv9")


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"paper": [3.3, 5.3]}, "differs by 0.198 m, 0.1 m are allowed; as it is"),
        ({"paper": [3.3]}, "2 components measured, the paper's value has 1"),
        ({"run": "b"}, "run 'b' has no trace"),
        ({"measure": "stahl"}, "there is no measure 'stahl'; there are"),
        ({"robot": "ugv2"}, "no value"),
        ({"robot": "ugv7"}, "could not be measured: run a: there is no robot 'ugv7'"),
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
