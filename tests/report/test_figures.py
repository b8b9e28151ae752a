"""Figures: panels, tables, labels, SVG for a page."""

import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from random import Random

import matplotlib
import matplotlib.figure
import numpy as np
import pytest
from builders.paths import Corners, along
from hypothesis import example, given, settings
from hypothesis import strategies as st
from report.cases import FLIGHT, event, make_scenario, make_trace

from airground_drake.report.figures import draw, maps, timelines
from airground_drake.report.figures.panels import Figure
from airground_drake.report.view import canvas, svg
from airground_drake.report.view.plane import frame_of, thumbnail_of
from airground_drake.scenario.schema import Run, Scenario
from airground_drake.sim.trace import Trace
from airground_drake.study.campaign.page import _histogram


def test_bytes_do_not_depend_on_the_time_or_the_user(
    scenario: Scenario, traces: dict[str, Trace], drawn: list[Figure]
) -> None:
    with matplotlib.rc_context({"font.size": 30.0, "axes.linewidth": 9.0, "svg.fonttype": "path"}):
        assert draw.draw(scenario, traces) == drawn


def test_every_panel_is_named_small_and_has_its_data(drawn: list[Figure]) -> None:
    assert {f.id: len(f.panels) for f in drawn} == {
        "trajectories": 2, "distances": 2, "timelines": 2, "audit-1": 1,
    }  # fmt: skip
    panels = [panel for figure in drawn for panel in figure.panels]
    for panel in panels:
        root = ET.fromstring(panel.svg)
        title, description = list(root)[:2]
        assert title.text
        assert description.text
        assert root.get("aria-labelledby") == f"{title.get('id')} {description.get('id')}"
        assert 0 < len(panel.table.rows) <= 40
        assert all(len(row) == len(panel.table.columns) for row in panel.table.rows)
    assert sum(len(panel.svg) for panel in panels) < 600_000


def test_every_colour_has_another_one_in_the_dark(drawn: list[Figure]) -> None:
    diagram = Path(__file__).parents[2] / "diagrams" / "case_a.svg"
    texts = [diagram.read_text(encoding="utf-8"), *(panel.svg for figure in drawn for panel in figure.panels)]
    used = {color for text in texts for color in re.findall(r'(?:fill|stroke)="([^"(]+)"', text)}
    assert len(used) > 8
    assert used - {"none", "transparent"} <= canvas.DARK.keys()


def team(scenario: Scenario, size: int, *, triggered: str = "") -> tuple[Scenario, dict[str, Trace]]:
    names = [f"ugv{k}" for k in range(1, size + 1)]
    own = replace(
        scenario, name="mine", reproduction=[], ugvs={name: replace(scenario.ugvs["ugv1"]) for name in names},
        runs={"a": scenario.runs["a"]},
    )  # fmt: skip
    ways: list[Corners] = [[(0, 20.0 + 3.0 * k, 0.5), (30, 20.0 + 3.0 * k, 13.0)] for k in range(size)]
    happened = [event(14.5, "trigger", triggered)] if triggered else []
    return own, {"a": along(asdict(own), "a", [*ways, FLIGHT], happened)}


@settings(max_examples=2)
@given(
    size=st.sampled_from([1, 2, 7, 13]),
    scale_m=st.sampled_from([0.0, 1e-12, 1e-3, 10.0, 1e4, 1e9]),
    apart_m=st.sampled_from([0.0, 1e-12, 3.0, 1e9]),
    end_s=st.sampled_from([1e-6, 30.0, 1e5]),
    rows=st.sampled_from([1, 2, 300]),
    triggered=st.booleans(),
    alone=st.booleans(),
    x_m=st.none() | st.sampled_from([0.0, -1e-9, 2.0, 1e12]),
)
@example(size=7, scale_m=0.0, apart_m=0.0, end_s=30.0, rows=300, triggered=False, alone=True, x_m=2.0)
@example(size=7, scale_m=1e9, apart_m=1e9, end_s=1e5, rows=2, triggered=True, alone=False, x_m=1e12)
@example(size=1, scale_m=1e9, apart_m=0.0, end_s=1e-6, rows=1, triggered=True, alone=True, x_m=None)
@example(size=1, scale_m=1e4, apart_m=0.0, end_s=1e-6, rows=300, triggered=False, alone=False, x_m=None)
@example(size=13, scale_m=1e-12, apart_m=1e-12, end_s=30.0, rows=2, triggered=False, alone=True, x_m=None)
def test_every_figure_is_drawn_of_equal_empty_single_and_huge_data(
    size: int, scale_m: float, apart_m: float, end_s: float, rows: int, triggered: bool, alone: bool, x_m: float | None
) -> None:
    """Teams that go so far in parallel, side by side; `alone`: without obstacles; `x_m`: nearly that of every UGV."""
    scenario = make_scenario()
    names = [f"ugv{k}" for k in range(1, size + 1)]
    own = replace(
        scenario, reproduction=[], ugvs={name: replace(scenario.ugvs["ugv1"]) for name in names},
        obstacles={} if alone else scenario.obstacles, runs={"a": Run("a"), "a_printed": Run("a", "recursion_listed")},
    )  # fmt: skip
    ways: list[Corners] = [[(0.0, apart_m * k, 0.0), (end_s, apart_m * k, scale_m)] for k in range(size)]
    flight: Corners = [(0.0, 0.0, 0.0, 2.0), (end_s, 0.0, scale_m, 2.0)]
    happened = [event(0.0, kind, name) for name in names for kind in ("trigger", "arrival")] if triggered else []
    traces = {
        name: along(asdict(own), name, [*ways, flight], happened, step_s=2.0 * end_s / max(rows - 1, 0.5))
        for name in own.runs
    }
    if x_m is not None:
        values = {f"{name}.decision_variable_m": x_m * (1.0 + 2.0**-52 * (k % 2)) for k, name in enumerate(names)}
        traces = {name: replace(trace, states=trace.states.assign(**values)) for name, trace in traces.items()}
    figures = draw.draw(own, traces)
    texts = [panel.svg for figure in figures for panel in figure.panels]
    texts.append(thumbnail_of(traces["a"], "p"))
    texts += [_histogram(np.array(values), "t", "s", 0.0)[1] for values in ([scale_m], [apart_m, apart_m + scale_m])]
    for text in texts:
        ET.fromstring(text)
        assert not re.search(r"[\s\"](nan|-?inf)\b", text)


def test_a_small_team_is_drawn_by_name_and_a_large_one_in_histograms_with_who_was_triggered(scenario: Scenario) -> None:
    trajectories, distances, timelines, *_ = draw.draw(*team(scenario, 5))
    assert all(f">ugv{k}</text>" in trajectories.panels[0].svg for k in range(1, 6))
    assert "nothing happens; largest" in timelines.panels[0].svg
    assert "1 more UGVs are not drawn" in distances.caption
    drawn = {figure.id: figure for figure in draw.draw(*team(scenario, 12, triggered="ugv11"))}
    assert "Run a: 0 of 12 UGVs arrive, 1 triggered." in drawn["team"].caption
    assert drawn["team"].panels[0].table.rows[0][:2] == ("a", "12")
    assert re.findall(r">(ugv\d+|trigger 14.50)", drawn["timelines"].panels[0].svg) == ["ugv11", "trigger 14.50"]
    assert "8 more UGVs" in drawn["trajectories"].caption


def test_runs_with_identical_paths_share_a_panel(scenario: Scenario, traces: dict[str, Trace]) -> None:
    again = replace(traces["c"], meta={**traces["c"].meta, "run": "b", "method": "b"})
    both = replace(scenario, runs={"a": Run("a"), "b": Run("b"), "c": Run("c")})
    trajectories, *_ = draw.draw(both, {"a": traces["a"], "b": again, "c": traces["c"]})
    headings = [panel.heading for panel in trajectories.panels]
    assert headings == ["Run a: method (a), no intervention", "Runs b = c: identical paths"]
    hit = replace(again, meta={**again.meta, "events": [*again.events, event(29.0, "collision")]})
    trajectories, *_ = draw.draw(both, {"a": traces["a"], "b": hit, "c": traces["c"]})
    assert len(trajectories.panels) == 3


def test_a_shortfall_says_from_whom(scenario: Scenario, traces: dict[str, Trace], drawn: list[Figure]) -> None:
    assert {"ugv1 to obstacle_2", "ugv1 to uav"} <= set(drawn[1].panels[0].table.columns)
    one = {"printed": replace(traces["a_printed"], meta={**traces["a_printed"].meta, "run": "printed"})}
    _, distances, *_ = draw.draw(replace(scenario, runs={"printed": Run("a")}), one)
    assert distances.caption.startswith("Too close: ugv1 is 1.")
    assert "not 2 m" in distances.panels[0].svg
    assert canvas.ALARM in distances.panels[0].svg


@given(st.lists(st.floats(0.0, 100.0), max_size=30))
def test_time_is_left_out_only_where_nothing_happens(times: list[float]) -> None:
    shown = timelines.Clock.around(times, 0.0, 100.0)
    assert shown.shows(np.array(times)).all()
    assert len(shown.begin) <= timelines.MAX_CUTS + 1
    assert (shown.begin[1:] - shown.end[:-1] >= timelines.CUT_S).all()
    every = np.sort([*times, *shown.begin, *shown.end])
    assert (np.diff(shown.at(every)) >= 0.0).all()
    assert shown.length == pytest.approx(shown.at([100.0])[0])
    assert shown.shown_s == pytest.approx(100.0) or len(times) > 0


@settings(max_examples=10, deadline=None)
@given(st.lists(st.floats(0.0, 30.0), min_size=1, max_size=2 * timelines.MAX_TOLD), st.randoms())
def test_labels_of_events_are_inside_the_figure_and_apart(times: list[float], random: Random) -> None:
    happened = [event(t, random.choice([*timelines.MARKS])) for t in sorted(times)]
    trace = make_trace(make_scenario(), "c", events=[each for each in happened if each["kind"] != "proposal"])
    with canvas.style():
        drawing = timelines.events(trace, ["ugv1"])
        drawing.draw_without_rendering()
        texts = [text.get_window_extent() for axes in drawing.axes for text in axes.texts if text.get_bbox_patch()]
    width, height = drawing.get_size_inches() * drawing.dpi
    assert all(box.x0 >= 0.0 and box.x1 <= width and box.y0 >= 0.0 and box.y1 <= height for box in texts)
    assert not any(one.overlaps(other) for k, one in enumerate(texts) for other in texts[:k])


def test_a_map_says_where_a_ugv_stood_and_how_it_answered(run: Callable[[str, str], Trace]) -> None:
    trace = run("case_b", "d")
    frame = frame_of(trace.scenario, [("ugv1", trace.body("ugv1"))])
    (entry,) = maps.key_of(trace, trace.ugvs, frame)
    first, last = (
        trace.decisions["t_s"].iloc[0],
        trace.decisions.loc[trace.decisions["decision"] == "accept", "t_s"].iloc[0],
    )
    assert re.fullmatch(
        r"ugv1 stood 6\.\d to 13\.\d s, held by obstacle_1 and obstacle_2; "
        rf"refused at {first:.2f} s: it would have stalled on the way; accepted at {last:.2f} s",
        entry.text.replace("\N{NO-BREAK SPACE}", " "),
    )
    for mark, when in zip(entry.marks[1:], (first, last), strict=True):
        row = np.searchsorted(trace.t, when)
        assert mark.at == pytest.approx(trace.body("ugv1")[row, :2])
        assert mark.way[0] == pytest.approx(mark.at, abs=0.05)
    with canvas.style():
        drawing = maps.plane(trace, trace.ugvs, frame, [entry], 3)
        drawing.draw_without_rendering()
    assert [text.get_text() for text in drawing.texts][::2] == [entry.letter, "", ""] == ["A", "", ""]
    boxes = [text.get_window_extent() for text in drawing.texts]
    assert all(box.x0 >= 0.0 and box.x1 <= drawing.bbox.x1 and box.y0 >= 0.0 for box in boxes)


def test_no_trace_and_a_single_row(scenario: Scenario) -> None:
    assert draw.draw(scenario, {}) == []
    assert draw.draw(scenario, {"a": make_trace(scenario, "a", [(0, 3.3, 0.5), (0.1, 3.3, 0.5)], step_s=0.3)})


def test_thinning_keeps_ends_and_extremes() -> None:
    values = np.zeros(50_000)
    values[31_234] = 7.0
    rows = canvas.thin(values)
    assert len(rows) <= canvas.MAX_POINTS
    assert {0, 31_234, 49_999} <= set(rows.tolist())
    assert len(canvas.thin(np.zeros((50_000, 2)))) <= canvas.MAX_POINTS
    assert len(canvas.thin(values[:100])) == 100


def test_numbers_far_from_0_count_from_one_that_the_label_states() -> None:
    axes = matplotlib.figure.Figure().add_axes((0.2, 0.2, 0.6, 0.6))
    axes.set(xlim=(499_999.9, 500_000.8), ylim=(-4_801.0, -4_799.0))
    canvas.rule(axes, "x, m", "y, m")
    texts = {text.get_text() for text in axes.texts}
    assert {"x \N{MINUS SIGN} 500000, m", "y + 4800, m", "0", "0.2", "0.6", "1"} <= texts


STYLE = "fill: #123456; font: 700 9px 'A', sans-serif; text-anchor: middle; background: url(http://e); x: y"
SOURCE = (
    '<?xml version="1.0"?><svg xmlns="http://www.w3.org/2000/svg" xmlns:x="http://www.w3.org/1999/xlink" '
    'width="9pt" viewBox="0 0 9 9" onload="a()" overflow="visible" class="skip"><script>a()</script><style>@import "http://e"</style>'
    '<image href="http://e/i.png"/><defs><path id="p" d="M 0.123456 1"/><path id="unused" d="M 0 1"/></defs>'
    '<a x:href="http://e"><use x:href="#p" fill="url(#p)"/></a><rect fill="url(http://e)"/>'
    f'<text style="{STYLE}"/></svg>'
)


def test_svg_becomes_inert_and_named_and_keeps_its_looks() -> None:
    text = svg.inline(SOURCE, "n", "T & t", "D")
    for word in ("script", "style", "onload", "http://e", "image", "unused", "width", "background", "overflow", "skip"):
        assert word not in text
    assert text.count("href=") == text.count('href="#n-p"') == 1
    for part in (
        'id="n-p"', "url(#n-p)", 'd="M 0.12 1"', '<title id="n-title">T &amp; t</title>', 'fill="#123456"',
        'font-weight="700"', 'font-size="9px"', 'text-anchor="middle"',
    ):  # fmt: skip
        assert part in text
    for source in ("<svg", "<html/>"):
        with pytest.raises(ValueError, match=r"XML|root element"):
            svg.inline(source, "n", "t", "d")
