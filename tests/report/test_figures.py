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
from report.cases import FLIGHT, make_trace

from airground_drake.report.figures import canvas, draw, labels, svg
from airground_drake.report.figures.panels import Figure
from airground_drake.scenarios.schema import Scenario
from airground_drake.trace import Trace


def test_kinds_numbers_and_panels(drawn: list[Figure]) -> None:
    assert [figure.id for figure in drawn] == ["trajectories", "decision", "distances", "events", "recursion"]
    assert "Figure 3" in drawn[0].title
    assert [len(figure.panels) for figure in drawn] == [2, 2, 2, 2, 2]


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


def test_own_scenarios_are_drawn_at_full_width_with_the_whole_team(scenario: Scenario) -> None:
    fifth = {f"ugv{k}": replace(scenario.ugvs["ugv1"]) for k in range(1, 6)}
    own = replace(scenario, name="mine", reproduction=[], ugvs=fifth, runs={"a": scenario.runs["a"]})
    ways: list[Corners] = [[(0, 2.0 * k, 0.5), (30, 2.0 * k, 13.0)] for k in range(5)]
    trajectories, decision, distances, *_ = draw.draw(own, {"a": along(asdict(own), "a", [*ways, FLIGHT])})
    assert all(figure.wide for figure in (trajectories, decision, distances))
    assert all(f">{name}</text>" in figure.panels[0].svg for name in fifth for figure in (trajectories, decision))
    assert "2 more UGVs are not drawn" in distances.caption
    width = ET.fromstring(decision.panels[0].svg).get("width")
    assert width is not None
    assert 1100 < int(width) < 1240


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
        drawn[:3], (["x, m", "y, m"], ["time, s", "decision variable, m"], ["time, s", "distance, m"]), strict=True
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
