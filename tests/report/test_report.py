"""The report: every measure with its failing side, the document, the figures, HTML and JUnit, from small traces."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from html.parser import HTMLParser
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
import pytest

from airground_drake.errors import TraceError
from airground_drake.registry import STATUSES, Status
from airground_drake.report import document, html, junit, metrics, reproduction
from airground_drake.report.figures import canvas, draw, svg
from airground_drake.report.figures.panels import Figure
from airground_drake.report.reproduction import MEASURES
from airground_drake.scenarios.schema import (
    Choice,
    Decision,
    Obstacle,
    Preset,
    Reproduction,
    Run,
    Scenario,
    Uav,
    Ugv,
)
from airground_drake.trace import DECISION_COLUMNS, SCHEMA, Trace
from airground_drake.verify.claim import TraceClaim, Verdict
from airground_drake.verify.finding import Finding

HOSTILE = "<script>alert('$x$')</script>"
STALL = (3.369, 5.102)
Keys = list[tuple[float, float, float]]
"""Corners (t, x, y) of a path."""
APPROACH: Keys = [(0, 3.3, 0.5), (4, 4.2, 3), (7, 4.2, 4.6), (9, *STALL)]
STALLING: Keys = [*APPROACH, (30, *STALL)]
GOING_ROUND: Keys = [*APPROACH, (14.5, *STALL), (16, 6.5, 4), (18, 6.5, 9), (23, 3.3, 13), (30, 3.3, 13)]
SQUEEZING: Keys = [*APPROACH, (11, 2.83, 5.65), (13, 2.0, 7), (23, 3.3, 13), (30, 3.3, 13)]
BESIDE: Keys = [(0, -2.6, 0.5), (23, -2.6, 13), (30, -1.0, 13)]


def event(t: float, kind: str, robot: str = "ugv1") -> dict[str, Any]:
    return {"t_s": t, "robot": robot, "kind": kind, "position_m": [*STALL, 0.0]}


def make_scenario(ugv1: str = "ugv1", **more: Any) -> Scenario:
    """Case A in small, as far as a report looks at it."""
    return Scenario(
        name="case_a",
        title="Case A",
        description="A small case.",
        duration_s=30.0,
        ugvs={
            ugv1: Ugv([3.3, 0.5, 0.0], [3.3, 13.0, 0.0], Preset([[3.3, 0.0, 0.0], [3.3, 13.0, 0.0]], 0.5606)),
            "ugv2": Ugv([-2.6, 0.5, 0.0], [-1.0, 13.0, 0.0], Preset([[-2.6, 0.0, 0.0], [-2.6, 13.0, 0.0]], 0.5606)),
        },
        uav=Uav("uav", [0.0, 1.0, 2.0], [0.0, 13.0, 2.0]),
        obstacles={
            "obstacle_1": Obstacle([1.7, 4.0, 0.0]),
            "obstacle_2": Obstacle([4.0, 7.0, 0.0]),
            "obstacle_0": Obstacle([-20.0, 5.0, 0.0], known_to_uav=False),
        },
        decision=Decision(release_m=1.5),
        runs={
            "a": Run("a", stalls_m={ugv1: [3.37, 5.1, 0.0]}),
            "c": Run("c"),
            "a_printed": Run("a", "recursion_listed", expected={"SAFE-TRACE": "refuted"}),
        },
        reproduction=[
            Reproduction("A1", "stalls at", "stall_position", "a", ugv1, [3.3, 5.1], "m", 0.1, why="as it is"),
            Reproduction("A5", "triggered at", "trigger_time", "c", ugv1, [14.45], "s", 0.1, True, "speed set"),
            Reproduction("A7", "succeeds", "intervention_succeeds", "c", ugv1, [1.0], "yes/no", why="all of it"),
        ],
        choices=[Choice(f"ugvs.{ugv1}.preset.speed_m_s", "calibrated", "1 m/s", "the trigger time")],
        **more,
    )


def make_trace(
    scenario: Scenario,
    run: str = "a",
    keys: Keys = STALLING,
    events: list[dict[str, Any]] | None = None,
    *,
    step_s: float = 0.1,
    x: Mapping[float, float] | None = None,
) -> Trace:
    """The first UGV along corners, the second beside it, with their true decision variables (or the given one)."""
    end = keys[-1][0]
    t = np.linspace(0.0, end, round(end / step_s) + 1)
    ugvs, uav = list(scenario.ugvs), scenario.uav.name
    columns: dict[str, Any] = {"t_s": t}
    flight: Keys = [(0, 0, 1), (23, 0, 13), (30, 0, 13)]
    for robot, corners, height in ((ugvs[0], keys, 0.0), (ugvs[1], BESIDE, 0.0), (uav, flight, 2.0)):
        times, east, north = zip(*corners, strict=True)
        position = np.column_stack([np.interp(t, times, east), np.interp(t, times, north), np.full_like(t, height)])
        for k, axis in enumerate("xyz"):
            columns[f"{robot}.{axis}_m"] = position[:, k]
            columns[f"{robot}.v{axis}_m_s"] = np.gradient(position[:, k], t) if len(t) > 1 else 0.0
        if robot == uav:
            continue
        preset = scenario.ugvs[robot].preset
        reference = np.array([preset.waypoints_m[0][0], 0.0, 0.0]) + np.outer(
            np.minimum(preset.speed_m_s * t, 13.0), [0, 1, 0]
        )
        for k, axis in enumerate("xyz"):
            columns[f"{robot}.ref_{axis}_m"] = reference[:, k]
        columns[f"{robot}.decision_variable_m"] = np.linalg.norm(reference - position, axis=1)
        columns[f"{robot}.mode"] = ((t > 14.5) & (t < 17)).astype(int)
        columns[f"{robot}.accepted"] = columns[f"{robot}.mode"]
    if x is not None:
        columns[f"{ugvs[0]}.decision_variable_m"] = np.interp(t, list(x), list(x.values()))
    decisions: dict[str, Any] = dict.fromkeys(DECISION_COLUMNS, -1.0) | {
        "robot": ugvs[0],
        "policy": "detour",
        "decision": "accept",
    }
    costs: list[dict[str, Any]] = [
        {"t_s": 14.5, "accept_throughout": 80.0, "refuse_throughout": 100.0, "gap": 0.01},
        {"t_s": 15.0},
    ]
    meta = {
        "schema": SCHEMA, "run": run, "method": scenario.runs[run].method, "seed": 1, "zeta_m": 3.0,
        "robots": [*ugvs, uav], "ugvs": ugvs, "scenario": asdict(scenario), "events": events or [], "faults": [],
    }  # fmt: skip
    table = pd.DataFrame([decisions | cost for cost in costs] if run == "c" else [], columns=list(DECISION_COLUMNS))
    return Trace(meta, pd.DataFrame(columns), table, {"wall_s": 0.5, "decision_times_s": [0.001, 0.002]})


class Kept(TraceClaim):
    id = "SAFE-TRACE"
    statement = "Every robot keeps its distance"
    formula = "D >= d"
    method = "geometry"
    equations = "(7)"
    assumptions = ("straight lines",)
    does_not_establish = "anything else"

    def check(self, trace: Trace) -> Finding:
        raise NotImplementedError


def verdict(run: str, status: Status = "holds", expected: Status = "holds", **finding: Any) -> Verdict:
    return Verdict(Kept(), run, Finding(status, **finding), expected)


SUCCESS = [event(14.5, "trigger"), event(14.6, "proposal"), event(14.65, "accept"), event(17, "release")]


def make_traces(scenario: Scenario) -> dict[str, Trace]:
    ugv1 = next(iter(scenario.ugvs))
    success = [{**each, "robot": ugv1} for each in SUCCESS]
    return {
        "a": make_trace(scenario, "a", STALLING, [event(14.5, "trigger", ugv1)]),
        "c": make_trace(scenario, "c", GOING_ROUND, success),
        "a_printed": make_trace(scenario, "a_printed", SQUEEZING),
    }


FINE = [verdict("a"), verdict("c", margin=float("nan")), verdict("a_printed", "refuted", "refuted", margin=-0.2)]


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return make_scenario()


@pytest.fixture(scope="module")
def traces(scenario: Scenario) -> dict[str, Trace]:
    return make_traces(scenario)


@pytest.fixture(scope="module")
def drawn(scenario: Scenario, traces: dict[str, Trace]) -> list[Figure]:
    return draw.draw(scenario, traces)


def built(scenario: Scenario, traces: dict[str, Trace], verdicts: list[Verdict]) -> dict[str, Any]:
    return document.build(scenario, "ab" * 32, traces, verdicts, {"package": "0.1.0", "seed": 1, "started": "now"})


# Measures


class TestMeasures:
    @staticmethod
    def of(name: str, keys: Keys = STALLING, events: list[dict[str, Any]] | None = None, **more: Any) -> list[float]:
        return MEASURES[name](make_trace(make_scenario(), "a", keys, events, **more), "ugv1")

    @staticmethod
    def test_a_stalled_robot_is_where_it_stands() -> None:
        assert TestMeasures.of("stall_position") == pytest.approx(STALL)

    @staticmethod
    @pytest.mark.parametrize(
        ("keys", "step_s"),
        [
            ([(0, 3.3, 0.5), (30, *STALL)], 0.1),
            ([(0, 3.3, 0.5), (29, *STALL), (29.5, 3.37, 5.105), (30, *STALL)], 0.1),
            (GOING_ROUND, 0.1),
            ([(0, *STALL), (0.5, *STALL)], 0.1),
            ([(0, 3.3, 0.5), (30, *STALL)], 30.0),
        ],
        ids=["moves", "moves and returns", "stands at its target", "run too short", "rows too sparse"],
    )
    def test_others_have_not_stalled(keys: Keys, step_s: float) -> None:
        assert TestMeasures.of("stall_position", keys, step_s=step_s) == []
        assert TestMeasures.of("distances_while_stalled", keys, step_s=step_s) == []

    @staticmethod
    def test_distances_are_the_two_nearest_in_the_order_of_names() -> None:
        near = [float(np.hypot(3.9 - x, 5.3 - y)) for x, y in ((1.7, 4.0), (4.0, 7.0))]
        assert near[0] > near[1]
        assert TestMeasures.of(
            "distances_while_stalled", [(0, 3.3, 0.5), (9, 3.9, 5.3), (30, 3.9, 5.3)]
        ) == pytest.approx(near)

    @staticmethod
    @pytest.mark.parametrize(
        ("grows", "keys", "events", "x"),
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
        grows: int, keys: Keys, events: list[dict[str, Any]], x: Mapping[float, float] | None
    ) -> None:
        assert TestMeasures.of("grows_past_threshold", keys, events, x=x) == [grows]

    @staticmethod
    def test_arrives() -> None:
        assert TestMeasures.of("arrives", GOING_ROUND) == [1]
        assert TestMeasures.of("arrives", STALLING) == [0]

    @staticmethod
    def test_times_of_first_events() -> None:
        events = [event(3, "trigger", "ugv2"), event(5, "refuse"), event(6, "accept"), event(7, "trigger")]
        found = {name: TestMeasures.of(name, events=events) for name in MEASURES if name.endswith("_time")}
        executed = found.pop("execution_time")
        assert found == {"trigger_time": [7], "acceptance_time": [6], "refusal_time": [5]}
        assert executed == [14.5]  # the row before the signal rises, whatever the events say
        assert TestMeasures.of("trigger_time") == []

    @staticmethod
    def test_recovery_is_interpolated_and_skips_the_trigger_itself() -> None:
        x = {0: 0.0, 9.9: 2.0, 10.0: 3.0 - 2e-9, 10.1: 3.0 - 1e-9, 11.0: 4.0, 12.0: 3.04, 12.1: 2.94, 30.0: 0.0}
        assert TestMeasures.of("recovery_duration", events=[event(10.0, "trigger")], x=x) == pytest.approx([2.04])
        assert TestMeasures.of("recovery_duration", events=[], x=x) == []
        assert TestMeasures.of("recovery_duration", events=[event(10.0, "trigger")], x={0: 0.0, 10: 3, 30: 9}) == []

    @staticmethod
    @pytest.mark.parametrize(
        ("succeeds", "keys", "events"),
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
    def test_intervention_succeeds(succeeds: int, keys: Keys, events: list[dict[str, Any]]) -> None:
        assert TestMeasures.of("intervention_succeeds", keys, events) == [succeeds]

    @staticmethod
    def test_minimum_distance_is_found_between_rows() -> None:
        passing: Keys = [(0, 0.7, 1.0), (30, 0.7, 7.3)]
        assert TestMeasures.of("minimum_distance", passing, step_s=30.0) == pytest.approx([1.0])
        assert MEASURES["minimum_distance"](make_trace(replace(make_scenario(), obstacles={})), "ugv1") == []

    @staticmethod
    def test_collision_position() -> None:
        assert TestMeasures.of("collision_position", events=[event(9, "collision")]) == list(STALL)
        assert TestMeasures.of("collision_position") == []

    @staticmethod
    def test_an_unknown_robot_is_named() -> None:
        with pytest.raises(TraceError, match="no robot 'ugv9'; there are ugv1, ugv2, uav"):
            MEASURES["arrives"](make_trace(make_scenario()), "ugv9")


class TestRows:
    @staticmethod
    def test_statuses_and_scalars(scenario: Scenario, traces: dict[str, Trace]) -> None:
        stall, trigger, success = reproduction.rows(scenario, traces)
        assert (stall["status"], trigger["status"], success["status"]) == ("reproduced", "calibrated", "reproduced")
        assert stall["ours"] == pytest.approx(list(STALL))
        assert stall["difference"] == pytest.approx(0.069)
        assert (trigger["paper"], trigger["ours"], trigger["why"]) == (14.45, 14.5, "speed set")

    @staticmethod
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
        (row,) = reproduction.rows(
            replace(scenario, reproduction=[replace(scenario.reproduction[0], **change)]), traces
        )
        assert row["status"] == "not_reproduced"
        assert why in row["why"]


# Document


class TestDocument:
    @staticmethod
    def test_minimum_of_the_schema_in_strict_json(scenario: Scenario, traces: dict[str, Trace]) -> None:
        report = json.loads(json.dumps(built(scenario, traces, FINE), allow_nan=False))
        assert report["schema"] == "airground_drake.report/1"
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

    @staticmethod
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
            (FINE[:2], "inconclusive", 3),
            ([], "inconclusive", 3),
        ],
    )
    def test_overall(
        verdicts: list[Verdict], status: str, code: int, scenario: Scenario, traces: dict[str, Trace]
    ) -> None:
        report = built(scenario, traces, verdicts)
        assert (report["overall"]["status"], document.exit_code(report)) == (status, code)

    @staticmethod
    def test_nothing_at_all_is_no_pass(scenario: Scenario) -> None:
        empty = replace(scenario, runs={}, reproduction=[])
        assert document.exit_code(built(empty, {}, [])) == 3

    @staticmethod
    def test_missing_data_is_listed(scenario: Scenario, traces: dict[str, Trace]) -> None:
        overall = built(scenario, {"a": traces["a"], "a_printed": traces["a_printed"]}, FINE[:1])["overall"]
        assert [(item["run"], item["why"]) for item in overall["missing"]] == [
            ("c", "the run has no trace"),
            ("a_printed", "no claim was checked on the run"),
        ]
        other = Verdict(type("Other", (Kept,), {"id": "OTHER"})(), "a_printed", Finding("holds"), "holds")
        (item,) = built(scenario, traces, [*FINE[:2], other])["overall"]["missing"]
        assert (item["run"], item["id"]) == ("a_printed", "SAFE-TRACE")

    @staticmethod
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

    @staticmethod
    def test_audit_leaves_out_what_the_runs_do_not_show(scenario: Scenario, traces: dict[str, Trace]) -> None:
        moving = {"a": make_trace(scenario, "a", GOING_ROUND), "c": traces["c"]}
        assert built(scenario, moving, FINE)["audit"] == []
        extra = {"id": 2, "finding": "f", "paper": 1, "ours": 2, "evidence": {}, "demonstrated": True}
        report = document.build(scenario, "", moving, FINE, {}, audit=[extra])
        assert [item["id"] for item in report["audit"]] == [2]


# Figures


class TestFigures:
    @staticmethod
    def test_kinds_numbers_and_panels(drawn: list[Figure]) -> None:
        assert [figure.id for figure in drawn] == ["trajectories", "decision", "distances", "events", "recursion"]
        assert "Figure 3" in drawn[0].title
        assert [len(figure.panels) for figure in drawn] == [2, 2, 2, 2, 2]

    @staticmethod
    def test_bytes_do_not_depend_on_the_time_or_the_user(
        scenario: Scenario, traces: dict[str, Trace], drawn: list[Figure]
    ) -> None:
        with matplotlib.rc_context({"font.size": 30.0, "axes.linewidth": 9.0, "svg.fonttype": "path"}):
            assert draw.draw(scenario, traces) == drawn

    @staticmethod
    def test_named_small_and_with_data(drawn: list[Figure]) -> None:
        panels = [panel for figure in drawn for panel in figure.panels]
        for panel in panels:
            root = ET.fromstring(panel.svg)
            title, description = list(root)[:2]
            assert (title.tag, description.tag) == (f"{{{svg.NAMESPACE}}}title", f"{{{svg.NAMESPACE}}}desc")
            assert title.text
            assert description.text
            assert root.get("role") == "img"
            assert root.get("aria-labelledby") == f"{title.get('id')} {description.get('id')}"
            assert 0 < len(panel.table.rows) <= 40 or "events" in panel.table.caption
            assert all(len(row) == len(panel.table.columns) for row in panel.table.rows)
        assert sum(len(panel.svg) for panel in panels) < 600_000

    @staticmethod
    def test_labels_carry_units(drawn: list[Figure]) -> None:
        for figure, labels in zip(
            drawn[:3], (["x, m", "y, m"], ["time, s", "decision variable, m"], ["time, s", "distance, m"]), strict=True
        ):
            assert all(f">{label}</text>" in panel.svg for panel in figure.panels for label in labels)

    @staticmethod
    def test_without_traces_there_are_none(scenario: Scenario) -> None:
        assert draw.draw(scenario, {}) == []

    @staticmethod
    def test_a_single_row_can_be_drawn(scenario: Scenario) -> None:
        assert draw.draw(scenario, {"a": make_trace(scenario, "a", [(0, 3.3, 0.5), (0.1, 3.3, 0.5)], step_s=0.3)})

    @staticmethod
    def test_thinning_keeps_ends_and_extremes() -> None:
        values = np.zeros(50_000)
        values[31_234] = 7.0
        rows = canvas.thin(values)
        assert len(rows) <= canvas.MAX_POINTS
        assert {0, 31_234, 49_999} <= set(rows.tolist())
        assert len(canvas.thin(np.zeros((50_000, 2)))) <= canvas.MAX_POINTS
        assert len(canvas.thin(values[:100])) == 100

    @staticmethod
    def test_long_names_keep_both_ends() -> None:
        assert canvas.short("obstacle_1", 12) == "obstacle_1"
        assert canvas.short("vehicle_number_17", 12) == "vehic…ber_17"
        assert len(canvas.short("vehicle_number_17", 9)) == 9

    @staticmethod
    def test_labels_are_spread() -> None:
        assert canvas.spread([0.5, 0.51, 0.99], 0.1) == pytest.approx([0.5, 0.6, 0.99])
        assert canvas.spread([0.98, 0.99], 0.1) == pytest.approx([0.9, 1.0])


class TestSvg:
    SOURCE = (
        '<?xml version="1.0"?><svg xmlns="http://www.w3.org/2000/svg" xmlns:x="http://www.w3.org/1999/xlink" '
        'width="9pt" viewBox="0 0 9 9" onload="a()"><script>a()</script><style>@import "http://e"</style>'
        '<image href="http://e/i.png"/><defs><path id="p" d="M 0.123456 1"/><path id="unused" d="M 0 1"/></defs>'
        '<a x:href="http://e"><use x:href="#p" fill="url(#p)"/></a><rect fill="url(http://e)"/></svg>'
    )

    @staticmethod
    def test_inert_and_prefixed() -> None:
        text = svg.inline(TestSvg.SOURCE, "n", "T & t", "D")
        assert not any(word in text for word in ("script", "style", "onload", "http://e", "image", "unused", "width"))
        assert 'id="n-p"' in text
        assert text.count("href=") == text.count('href="#n-p"') == 1
        assert "url(#n-p)" in text
        assert 'd="M 0.12 1"' in text
        assert '<title id="n-title">T &amp; t</title>' in text

    @staticmethod
    @pytest.mark.parametrize("source", ["<svg", "<html/>", "no"])
    def test_refuses_what_is_no_svg(source: str) -> None:
        with pytest.raises(ValueError, match=r"XML|root element"):
            svg.inline(source, "n", "t", "d")


# HTML


class Page(HTMLParser):
    """What the tests look at in a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.parents: list[tuple[str, str]] = []
        self.open: list[str] = []
        self.unbalanced: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self.parents.append((tag, self.open[-1] if self.open else ""))
        if tag not in ("meta", "br", "link", "wbr"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.unbalanced.append(tag)

    def of(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]


DIAGRAM = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"><text>plant</text></svg>'


@pytest.fixture(scope="module")
def hostile_page() -> str:
    """Everything that a user can name is hostile."""
    scenario = make_scenario(HOSTILE)
    scenario = replace(scenario, name=HOSTILE, title=HOSTILE, description=HOSTILE)
    scenario.choices[0].reason = scenario.reproduction[0].why = HOSTILE
    scenario.runs[HOSTILE] = Run("b")
    traces = make_traces(scenario)
    traces[HOSTILE] = make_trace(scenario, HOSTILE, events=[event(1.0, HOSTILE, HOSTILE)])
    traces[HOSTILE].meta["faults"].append({"what": HOSTILE})
    claim = type(
        "Hostile", (Kept,), {"id": HOSTILE, "statement": HOSTILE, "formula": HOSTILE, "assumptions": (HOSTILE,)}
    )
    finding = Finding("refuted", -1.0, HOSTILE, {HOSTILE: HOSTILE}, {"x": HOSTILE}, {HOSTILE: [HOSTILE]})
    report = built(scenario, traces, [*FINE, Verdict(claim(), HOSTILE, finding, "holds")])
    report["provenance"][HOSTILE] = report["provenance"]["command"] = HOSTILE
    return html.render(report, draw.draw(scenario, traces), DIAGRAM)


@pytest.fixture(scope="module")
def page(scenario: Scenario, traces: dict[str, Trace], drawn: list[Figure]) -> str:
    return html.render(built(scenario, traces, FINE), drawn, DIAGRAM)


@pytest.fixture(params=["page", "hostile_page"])
def text(request: pytest.FixtureRequest) -> str:
    return str(request.getfixturevalue(request.param))


class TestHtml:
    @staticmethod
    def test_hostile_names_are_escaped(hostile_page: str) -> None:
        assert "<script" not in hostile_page
        assert hostile_page.count("&lt;script&gt;") > 30
        assert not any(name.startswith("on") for _, attributes in Page(hostile_page).tags for name in attributes)

    @staticmethod
    def test_self_contained(text: str) -> None:
        assert not any(tag in ("script", "link", "iframe", "img", "object", "embed") for tag, _ in Page(text).tags)
        targets = [a[name] for _, a in Page(text).tags for name in ("href", "src", "data", "action") if name in a]
        assert targets
        assert all(target and target.startswith("#") for target in targets)
        assert "@import" not in text
        assert "url(http" not in text.replace(" ", "").replace('"', "")
        assert len(text.encode()) < 1_500_000

    @staticmethod
    def test_well_formed_with_unique_ids_and_live_links(text: str) -> None:
        page = Page(text)
        assert page.unbalanced == []
        assert page.open == []
        ids = [attributes["id"] for _, attributes in page.tags if "id" in attributes]
        assert len(ids) == len(set(ids))

    @staticmethod
    def test_links_lead_somewhere(page: str) -> None:
        parsed = Page(page)
        ids = {attributes["id"] for _, attributes in parsed.tags if "id" in attributes}
        assert {str(a["href"])[1:] for a in parsed.of("a")} <= ids

    @staticmethod
    def test_accessible(text: str) -> None:
        page = Page(text)
        assert page.of("html")[0]["lang"] == "en"
        assert len(page.of("h1")) == 1
        assert page.of("title")
        assert {a.get("scope") for a in page.of("th")} == {"row", "col"}
        assert len(page.of("caption")) == len(page.of("table")) > 10
        assert page.of("a")[0] == {"class": "skip", "href": "#content"}
        drawings = page.of("svg")
        assert len(drawings) == sum(a.get("role") == "img" for a in drawings) > 5
        for tag in ("title", "desc"):
            assert page.parents.count((tag, "svg")) == len(drawings)

    @staticmethod
    def test_a_pass_says_so(page: str) -> None:
        assert "All 3 checks gave the verdict" in page
        assert "What needs attention" not in page
        assert "refuted, as expected" in page

    @staticmethod
    def test_an_unexpected_refutation_is_in_the_banner(
        scenario: Scenario, traces: dict[str, Trace], drawn: list[Figure]
    ) -> None:
        failed = verdict("c", "refuted", margin=-0.25, unit="m", where={"robot": "ugv1"}, counterexample={"t_s": 4.25})
        report = built(scenario, traces, [FINE[0], failed, FINE[2]])
        assert document.exit_code(report) == 1
        text = html.render(report, drawn)
        banner = text[text.index('class="banner') : text.index("</section>")]
        assert 'class="banner bad"' in text
        assert "Not as expected" in banner
        assert "SAFE-TRACE on run c (refuted, expected holds)" in banner
        attention = text[text.index("What needs attention") : text.index('aria-label="Contents"')]
        assert "\N{MINUS SIGN}0.25 m at robot ugv1" in attention
        assert "4.25" in attention

    @staticmethod
    def test_a_row_that_is_not_reproduced_shows(scenario: Scenario, traces: dict[str, Trace]) -> None:
        changed = replace(scenario.reproduction[1], id="A5", paper=[10.6])
        text = html.render(built(replace(scenario, reproduction=[changed]), traces, FINE), [])
        assert "not reproduced: A5" in text
        assert "differs by 3.9 s, 0.1 s are allowed; speed set" in text

    @staticmethod
    def test_an_empty_report_renders(scenario: Scenario) -> None:
        empty = replace(scenario, runs={}, reproduction=[], choices=[])
        text = html.render(document.build(empty, "", {}, [], {}), [], "no svg")
        assert "Inconclusive" in text
        assert Page(text).unbalanced == []

    @staticmethod
    def test_numbers_for_reading() -> None:
        assert [html.number(x) for x in (None, 3, 14.0, -0.21984, 2.5e-14, "x")] == [
            "\N{EN DASH}", "3", "14", "\N{MINUS SIGN}0.2198", "2.5e\N{MINUS SIGN}14", "x",
        ]  # fmt: skip
        assert html.value([3.3, 5.1], "m") == "(3.3, 5.1) m"
        assert html.value(1.0, "yes/no") == "yes"
        assert html.value(None, "m") == "no value"

    @staticmethod
    def test_json_for_reading_is_json() -> None:
        data = {"a": [{"x": 1.5, "long": "y" * 90}, {"x": None}], "b": {}}
        assert json.loads(html.pretty(data)) == data
        assert html.pretty(["z" * 9000]).endswith("report.json has all of it")


# JUnit


def test_junit_counts(scenario: Scenario, traces: dict[str, Trace]) -> None:
    verdicts = [
        FINE[0],
        verdict("a", "refuted", margin=-1.0, unit="m", counterexample={"bad": "\x00\x1b"}),
        verdict("a", "error"),
        verdict("a", "not_run"),
        verdict("a", "inconclusive"),
        FINE[2],
    ]
    root = ET.fromstring(junit.render(built(scenario, traces, verdicts)))
    assert root.tag == "testsuites"
    assert {key: root.get(key) for key in ("tests", "failures", "errors", "skipped")} == {
        "tests": "7", "failures": "2", "errors": "2", "skipped": "1",
    }  # fmt: skip
    suites = {suite.get("name"): suite for suite in root}
    assert set(suites) == {"case_a.a", "case_a.c", "case_a.a_printed"}
    assert suites["case_a.a"].get("tests") == "5"
    assert [case.get("name") for case in suites["case_a.c"]] == ["run"]
    failure = suites["case_a.a"].find("testcase/failure")
    assert failure is not None
    assert "refuted, expected holds, margin -1 m: Every robot keeps its distance" in str(failure.get("message"))
    assert not suites["case_a.a_printed"].findall("testcase/*")


# Metrics


def test_metrics_of_robot_pairs_and_events(traces: dict[str, Trace]) -> None:
    found = metrics.of_run(traces["c"])
    assert found["event_counts"]["ugv1"] == {"accept": 1, "proposal": 1, "release": 1, "trigger": 1}
    ((other, nearest),) = found["min_robot_distance_m"]["uav"].items()
    assert other in ("ugv1", "ugv2")
    assert nearest["safe_distance_m"] == 1.0
    assert found["gatekeeper"]["decisions"] == {"accept": 2}
    assert metrics.of_run(traces["a"])["gatekeeper"] is None


def test_least_pair_margin_is_the_exact_one_not_that_at_the_rows() -> None:
    trace = make_trace(make_scenario(), "a", [(0, 1.5, 0.5), (30, -8.0, 3.0)], step_s=30.0)
    found = metrics.of_run(trace)["min_robot_distance_m"]
    fine = {}
    for robot in trace.robots:
        first, last = trace.position(robot)
        fine[robot] = np.linspace(first, last, 30_001)
    to_ugv2, to_uav = (np.linalg.norm(fine["ugv1"] - fine[other], axis=1) for other in ("ugv2", "uav"))
    assert min(to_uav[0], to_uav[-1]) - 1.0 < min(to_ugv2[0], to_ugv2[-1]) - 2.0
    assert to_uav.min() - 1.0 > to_ugv2.min() - 2.0
    assert found["ugv1"]["ugv2"]["value"] == pytest.approx(to_ugv2.min(), abs=1e-6)


def test_readers_of_many_names_know_every_status() -> None:
    known: Callable[[str], bool] = html.CHIPS.__contains__
    assert all(map(known, (*STATUSES, *document.EXIT_CODES, "reproduced", "calibrated", "not_reproduced")))
