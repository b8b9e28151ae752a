"""Figures: panels, tables, labels."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import asdict, replace
from pathlib import Path

import matplotlib
import matplotlib.figure
import numpy as np
import pytest
from builders.paths import Corners, along
from report.cases import FLIGHT, event, make_trace

from airground_drake.report.figures import canvas, draw, labels, svg
from airground_drake.report.figures.panels import Figure
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Run, Scenario


def test_kinds_numbers_and_panels(drawn: list[Figure]) -> None:
    assert [figure.id for figure in drawn] == ["trajectories", "distances", "decision", "events", "recursion"]
    assert "Figure 3" in drawn[0].title
    assert [len(figure.panels) for figure in drawn] == [2, 2, 2, 1, 2]


def test_bytes_do_not_depend_on_the_time_or_the_user(
    scenario: Scenario, traces: dict[str, Trace], drawn: list[Figure]
) -> None:
    with matplotlib.rc_context({"font.size": 30.0, "axes.linewidth": 9.0, "svg.fonttype": "path"}):
        assert draw.draw(scenario, traces) == drawn


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


def test_every_colour_has_another_one_in_the_dark(drawn: list[Figure]) -> None:
    used = {color for f in drawn for p in f.panels for color in re.findall(r'(?:fill|stroke)="([^"(]+)"', p.svg)}
    assert len(used) > 8
    diagram = Path(__file__).parents[2] / "diagrams" / "case_a.svg"
    used.update(re.findall(r'(?:fill|stroke)="([^"]+)"', diagram.read_text(encoding="utf-8")))
    assert used - {"none", "transparent"} <= canvas.DARK.keys()


def team(scenario: Scenario, size: int, *, triggered: str = "") -> tuple[Scenario, dict[str, Trace]]:
    """UGVs side by side, far from each other, in one run."""
    names = [f"ugv{k}" for k in range(1, size + 1)]
    own = replace(
        scenario, name="mine", reproduction=[], ugvs={name: replace(scenario.ugvs["ugv1"]) for name in names},
        runs={"a": scenario.runs["a"]},
    )  # fmt: skip
    ways: list[Corners] = [[(0, 20.0 + 3.0 * k, 0.5), (30, 20.0 + 3.0 * k, 13.0)] for k in range(size)]
    happened = [event(14.5, "trigger", triggered)] if triggered else []
    return own, {"a": along(asdict(own), "a", [*ways, FLIGHT], happened)}


def test_a_small_team_is_drawn_by_name(scenario: Scenario) -> None:
    trajectories, distances, decision, *_ = draw.draw(*team(scenario, 5))
    assert all(f">ugv{k}</text>" in f.panels[0].svg for k in range(1, 6) for f in (trajectories, decision))
    assert "1 more UGVs are not drawn" in distances.caption


def test_a_large_team_is_in_histograms_and_who_was_triggered_is_drawn(scenario: Scenario) -> None:
    drawn = {figure.id: figure for figure in draw.draw(*team(scenario, 12, triggered="ugv11"))}
    assert "Run a: 0 of 12 UGVs arrive, 1 triggered." in drawn["team"].caption
    assert drawn["team"].panels[0].table.rows[0][:2] == ("a", "12")
    assert ">ugv11 ▲ 14.50 s</text>" in drawn["decision"].panels[0].svg
    assert "ugv12" not in drawn["decision"].panels[0].svg
    assert "8 more UGVs" in drawn["trajectories"].caption


def test_runs_with_identical_paths_share_a_panel(scenario: Scenario, traces: dict[str, Trace]) -> None:
    again = replace(traces["c"], meta={**traces["c"].meta, "run": "b", "method": "b"})
    both = replace(scenario, runs={"a": Run("a"), "b": Run("b"), "c": Run("c")})
    trajectories, *_ = draw.draw(both, {"a": traces["a"], "b": again, "c": traces["c"]})
    assert [panel.heading for panel in trajectories.panels] == [
        "Run a: method (a), no intervention", "Runs b = c: identical paths",
    ]  # fmt: skip
    assert trajectories.caption.startswith(
        "Run a: ugv1 stands still at (3.37, 5.10) m. Run b = c: not all UGVs arrive."
    )


def test_each_ugv_has_its_nearest_obstacles_and_robot_and_a_shortfall_says_from_whom(
    scenario: Scenario, traces: dict[str, Trace]
) -> None:
    _, distances, *_ = draw.draw(scenario, traces)
    assert distances.caption.startswith(("Closest: ugv", "Too close: ugv"))
    assert {"ugv1 to obstacle_2", "ugv1 to uav"} <= set(distances.panels[0].table.columns)
    one = {"printed": replace(traces["a_printed"], meta={**traces["a_printed"].meta, "run": "printed"})}
    _, distances, *_ = draw.draw(replace(scenario, runs={"printed": Run("a")}), one)
    assert distances.caption.startswith("Too close: ugv1 comes to 1.")
    assert "required 2 m" in distances.panels[0].svg
    assert canvas.ALARM in distances.panels[0].svg


def test_times_of_events_are_written_and_gaps_between_triggers_drawn(scenario: Scenario, drawn: list[Figure]) -> None:
    events = next(figure for figure in drawn if figure.id == "events")
    assert "trigger 14.50, proposal 14.60, accept 14.65, release" in events.panels[0].svg
    twice = [event(14.5, "trigger"), event(16.0, "release"), event(17.25, "trigger")]
    figures = {figure.id: figure for figure in draw.draw(scenario, {"a": make_trace(scenario, "a", events=twice)})}
    assert "gaps" not in {figure.id for figure in drawn}
    assert figures["gaps"].caption.startswith("Smallest gap 2.750 s; the minimum inter-event time is 0.5 s")
    assert figures["gaps"].panels[0].table.rows == (("a", "17.250", "2.7500"),)


def test_labels_keep_off_each_other() -> None:
    at = np.random.default_rng(3).uniform(0.3, 0.7, (9, 2))
    with canvas.style():
        drawing = matplotlib.figure.Figure(figsize=(5.0, 5.0))
        axes = drawing.add_axes((0.0, 0.0, 1.0, 1.0))
        labels.place(axes, [labels.Label(each, f"label {k}") for k, each in enumerate(at)], [at])
        labels.place(axes, [labels.Label(np.array([2.0, 0.0]), "outside")], [])
        drawing.draw_without_rendering()
        boxes = [text.get_window_extent() for text in axes.texts]
    assert [text.get_text() for text in axes.texts] == [f"label {k}" for k in range(9)]
    assert not any(one.overlaps(other) for k, one in enumerate(boxes) for other in boxes[:k])


def test_labels_carry_units(drawn: list[Figure]) -> None:
    for figure, wanted in zip(
        drawn[:3], (["x, m", "y, m"], ["time, s", "distance, m"], ["time, s", "decision variable, m"]), strict=True
    ):
        assert all(f">{label}</text>" in panel.svg for panel in figure.panels for label in wanted)


def test_without_traces_there_are_none(scenario: Scenario) -> None:
    assert draw.draw(scenario, {}) == []


def test_a_single_row_can_be_drawn(scenario: Scenario) -> None:
    assert draw.draw(scenario, {"a": make_trace(scenario, "a", [(0, 3.3, 0.5), (0.1, 3.3, 0.5)], step_s=0.3)})


def test_thinning_keeps_ends_and_extremes() -> None:
    values = np.zeros(50_000)
    values[31_234] = 7.0
    rows = canvas.thin(values)
    assert len(rows) <= canvas.MAX_POINTS
    assert {0, 31_234, 49_999} <= set(rows.tolist())
    assert len(canvas.thin(np.zeros((50_000, 2)))) <= canvas.MAX_POINTS
    assert len(canvas.thin(values[:100])) == 100


def test_long_names_keep_both_ends() -> None:
    assert canvas.short("obstacle_1", 12) == "obstacle_1"
    assert canvas.short("vehicle_number_17", 12) == "vehic…ber_17"
    assert len(canvas.short("vehicle_number_17", 9)) == 9


def test_labels_are_spread() -> None:
    assert canvas.spread([0.5, 0.51, 0.99], 0.1) == pytest.approx([0.5, 0.6, 0.99])
    assert canvas.spread([0.98, 0.99], 0.1) == pytest.approx([0.9, 1.0])
