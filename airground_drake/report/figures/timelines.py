"""Drawings over time, each a matplotlib Figure; call them inside `canvas.style`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from airground_drake.arrays import Array
from airground_drake.report.figures.canvas import (
    ALARM,
    INK,
    MUTED,
    WIDE_IN,
    label_right,
    level,
    look,
    rule,
    short,
    size_in,
    time_line,
)
from airground_drake.report.metrics import closest_obstacle, events_of, gap_m
from airground_drake.trace import Trace

_MARKS = {"trigger": "^", "release": "v", "proposal": "D", "accept": "o", "refuse": "X"}
_FORBIDDEN: dict[str, Any] = {
    "facecolor": "#eeeeee", "hatch": "///", "edgecolor": "#d4d4d4", "linewidth": 0.0, "zorder": 0,
}  # fmt: skip
"""Look of the band below the safe distance."""


def decision(trace: Trace, ugvs: Sequence[str], top: float, width_in: float) -> Figure:
    """Decision variables of a run with the threshold and the release level."""
    figure, (axes,) = _time_axes(1, 2.5, trace, width_in, above_in=0.08)
    zeta, release = float(trace.meta["zeta_m"]), float(trace.scenario["decision"]["release_m"])
    labels = [(zeta, f"threshold {zeta:.3g}", INK)]
    level(axes, zeta, "-")
    if trace.scenario["decision"]["trigger"] == "automaton":
        level(axes, release, (0, (1, 1.5)))
        labels.append((release, f"release {release:.3g}", INK))
    for position, ugv in enumerate(ugvs):
        x = trace.column(f"{ugv}.decision_variable_m")
        time_line(axes, trace.t, x, look(position))
        labels.append((float(x[-1]), short(ugv, 12), look(position).color))
        for event in events_of(trace, ugv, "trigger"):
            at = float(np.interp(event["t_s"], trace.t, x))
            axes.plot(event["t_s"], at, marker="^", markersize=8, color=look(position).color, markeredgecolor="white")
    axes.set_ylim(0.0, top)
    rule(axes, "time, s", "decision variable, m")
    label_right(axes, labels)
    return figure


def distances(trace: Trace, ugvs: Sequence[str], obstacles: Sequence[str], top: float, width_in: float) -> Figure:
    """Distances of each UGV to the obstacles, of surfaces, the safe distance d, and the exact minimum."""
    d = float(trace.scenario["safe_distance"]["obstacle_m"])
    figure, every = _time_axes(len(ugvs), 0.5 + 1.75 * len(ugvs), trace, width_in)
    for axes, ugv in zip(every, ugvs, strict=True):
        level(axes, d, "-")
        axes.axhspan(0.0, d, **_FORBIDDEN)
        labels = [(d, f"d = {d:g}", INK)]
        for position, name in enumerate(obstacles):
            gap = gap_m(trace, ugv, name)
            if gap.min() > top:
                continue
            time_line(axes, trace.t, gap, look(position))
            labels.append((float(gap[-1]), short(name, 12), look(position).color))
        axes.set_ylim(0.0, top)
        rule(axes, "time, s" if axes is every[-1] else "", "distance, m")
        label_right(axes, labels)
        nearest = closest_obstacle(trace, ugv)
        if nearest is None:
            axes.set_title(short(ugv))
            continue
        below = nearest.value < d - 1e-9
        axes.plot(
            nearest.t_s, nearest.value, marker="o", markersize=9, markerfacecolor="none", markeredgewidth=1.6,
            color=ALARM if below else INK, zorder=5,
        )  # fmt: skip
        note = f"{short(ugv)}: minimum {nearest.value:.3f} m ({short(nearest.other, 14)}, {nearest.t_s:.1f} s)"
        axes.set_title(f"{note} < d" if below else note, color=ALARM if below else INK)
    return figure


def events(trace: Trace, ugvs: Sequence[str], width_in: float) -> Figure:
    """Triggers, proposals and decisions over time, a row each per UGV."""
    rows = [(ugv, row) for ugv in ugvs for row in ("trigger", "proposal", "decision")]
    figure, (axes,) = _time_axes(1, 0.55 + 0.33 * len(rows), trace, width_in, left_in=1.4, right_in=0.15, above_in=0.05)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    rule(axes, "time, s", "")
    for y, (ugv, row) in enumerate(rows):
        name = f"{short(ugv, 9)} {row}"
        axes.text(-0.1 / size_in(axes)[0], y, name, transform=axes.get_yaxis_transform(), ha="right", va="center")
        if row == "trigger":
            _bars(axes, trace, trace.column(f"{ugv}.mode") == 1, y, facecolor="#dddddd")
        if row == "decision":
            _bars(axes, trace, trace.column(f"{ugv}.accepted") == 1, y, facecolor="#cfe6dc", hatch="////")
        kinds = {"trigger": ("trigger", "release"), "decision": ("accept", "refuse")}.get(row, (row,))
        for kind in kinds:
            times = [event["t_s"] for event in events_of(trace, ugv, kind)]
            color = {"refuse": ALARM, "release": MUTED}.get(kind, "#0060a8")
            axes.plot(times, [y] * len(times), linestyle="none", marker=_MARKS[kind], markersize=7, color=color)
    return figure


def nothing_happened(trace: Trace, width_in: float) -> Figure:
    """The event panel of a run without events."""
    figure, (axes,) = _time_axes(1, 0.9, trace, width_in, left_in=1.4, right_in=0.15, above_in=0.05)
    rule(axes, "time, s", "")
    axes.text(0.5, 0.5, "no trigger, no proposal, no decision", transform=axes.transAxes, ha="center", va="center")
    return figure


def compared_distances(runs: Mapping[str, Trace], robot: str) -> Figure:
    """Distance to the nearest obstacle over time of one robot in several runs, with the minima."""
    first = next(iter(runs.values()))
    d = float(first.scenario["safe_distance"]["obstacle_m"])
    figure, (axes,) = _time_axes(
        1,
        3.0 + 0.22 * len(runs),
        first,
        right_in=0.65,
        above_in=0.22 * len(runs),
    )
    gaps = {name: nearest_distance(trace, robot) for name, trace in runs.items()}
    low = min(d, *(float(gap.min()) for gap in gaps.values()))
    axes.set_ylim(max(0.0, low - 0.15 * d), 1.6 * d)
    axes.axhspan(0.0, d, **_FORBIDDEN)
    level(axes, d, "-")
    rule(axes, "time, s", "distance to the nearest obstacle, m")
    label_right(axes, [(d, f"d = {d:g}", INK)])
    for position, (name, trace) in enumerate(runs.items()):
        appearance = look(position)
        minimum = closest_obstacle(trace, robot)
        if minimum is None:
            continue
        text = f"run {short(name, 24)}: minimum {minimum.value:.3f} m"
        time_line(axes, trace.t, gaps[name], appearance, label=text)
        axes.plot(minimum.t_s, minimum.value, marker="o", markersize=9, markerfacecolor="none", color=appearance.color)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False, handlelength=4.0)
    return figure


def nearest_distance(trace: Trace, robot: str) -> Array:
    """Distance to the nearest obstacle at the rows, of surfaces, (T,), m."""
    nearest: Array = np.min([gap_m(trace, robot, name) for name in trace.scenario["obstacles"]], axis=0)
    return nearest


def _time_axes(
    count: int,
    height_in: float,
    trace: Trace,
    width_in: float = WIDE_IN,
    *,
    left_in: float = 0.55,
    right_in: float = 1.05,
    above_in: float = 0.24,
) -> tuple[Figure, list[Axes]]:
    """Axes over time, one above the other, with room for labels on the right."""
    figure = Figure(figsize=(width_in, height_in))
    below_in, between_in = 0.42, 0.32
    inner_in = (height_in - below_in - above_in - between_in * (count - 1)) / count
    every = []
    for row in range(count):
        bottom_in = below_in + (count - 1 - row) * (inner_in + between_in)
        inner_width_in = width_in - left_in - right_in
        box = (left_in / width_in, bottom_in / height_in, inner_width_in / width_in, inner_in / height_in)
        axes = figure.add_axes(box)
        axes.set_xlim(float(trace.t[0]), float(trace.t[-1]) if len(trace.t) > 1 else float(trace.t[0]) + 1.0)
        every.append(axes)
    return figure, every


def _bars(axes: Axes, trace: Trace, active: npt.NDArray[np.bool_], y: float, **options: Any) -> None:
    """Bars over the times at which a held signal is true; row k holds what was in force since row k-1."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], active, [False]]).astype(np.int8)))
    begins, ends = trace.t[np.maximum(edges[::2] - 1, 0)], trace.t[edges[1::2] - 1]
    spans = [(float(begin), float(end - begin)) for begin, end in zip(begins, ends, strict=True)]
    axes.broken_barh(spans, (y - 0.3, 0.6), edgecolor=MUTED, linewidth=0.7, **options)
