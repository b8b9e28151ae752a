"""Drawings over time, each a matplotlib Figure; call them inside `canvas.style`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from textwrap import fill
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from airground_drake.base.arrays import Array
from airground_drake.report.metrics import Nearby, closest_obstacle, events_of, gap_m
from airground_drake.report.outcomes import SLACK_M, metres
from airground_drake.run.trace import Trace
from airground_drake.view.canvas import (
    ALARM,
    FULL_IN,
    INK,
    MUTED,
    WIDE_IN,
    interval,
    label_right,
    level,
    look,
    rule,
    short,
    size_in,
    time_line,
)

MARKS = {"trigger": "^", "release": "v", "proposal": "D", "accept": "o", "refuse": "X", "over": "s"}
"""Markers of events by kind."""
MAX_ROWS, MAX_TOLD, TOLD_CHARS = 16, 7, 58
"""Maximum number of rows of the event figure, of events listed beside a row, and of characters in a line."""
_FORBIDDEN: dict[str, Any] = {
    "facecolor": "#eeeeee", "hatch": "///", "edgecolor": "#d4d4d4", "linewidth": 0.0, "zorder": 0,
}  # fmt: skip
"""Look of the band below the safe distance."""


def decision(trace: Trace, ugvs: Sequence[str], top: float) -> Figure:
    """Decision variables of a run, the threshold and the release level."""
    figure, (axes,) = _time_axes(1, 2.5, trace, above_in=0.08)
    zeta, release = float(trace.meta["zeta_m"]), float(trace.scenario.decision.release_m)
    labels = [(zeta, f"threshold {zeta:.3g}", INK)]
    level(axes, zeta, "-")
    if trace.scenario.decision.trigger == "automaton":
        level(axes, release, (0, (1, 1.5)))
        labels.append((release, f"release {release:.3g}", INK))
    axes.set_ylim(0.0, top)
    for position, ugv in enumerate(ugvs):
        x = trace.column(f"{ugv}.decision_variable_m")
        time_line(axes, trace.t, x, look(position))
        times = [event["t_s"] for event in events_of(trace, ugv, "trigger")]
        color = look(position).color
        axes.plot(times, np.interp(times, trace.t, x), "^", markersize=8, color=color, markeredgecolor="white")
        labels.append((float(x[-1]), short(ugv, 12) + (f" ▲ {times[0]:.2f} s" if times else ""), color))
    rule(axes, "time, s", "decision variable, m")
    label_right(axes, labels)
    return figure


def distances(
    trace: Trace, near: Mapping[str, Sequence[Nearby]], looks: Mapping[str, Mapping[str, int]], top: float
) -> Figure:
    """Distances between the surfaces of each UGV and bodies near it, the required ones, and the exact minimum."""
    figure, every = _time_axes(len(near), 0.5 + 1.75 * len(near), trace)
    required = sorted({found.required_m for each in near.values() for found in each})
    for axes, (ugv, those) in zip(every, near.items(), strict=True):
        bottom = min(0.0, *(found.value for found in those)) if those else 0.0
        axes.axhspan(bottom, required[0], **_FORBIDDEN)
        labels = [(d, f"required {d:.3g}", INK) for d in required]
        for d in required:
            level(axes, d, "-")
        highest = required[-1]
        for found in those:
            gap, appearance = gap_m(trace, ugv, found.other), look(looks[ugv][found.other])
            time_line(axes, trace.t, gap, appearance)
            labels.append((min(float(gap[-1]), top), short(found.other, 12), appearance.color))
            highest = max(highest, float(np.nanmax(gap)))
        axes.set_ylim(bottom, min(1.05 * highest, top))
        rule(axes, "time, s" if axes is every[-1] else "", "distance, m")
        label_right(axes, labels)
        if not those:
            axes.set_title(short(ugv))
            continue
        least = those[0]
        below = least.value < least.required_m - SLACK_M
        axes.plot(
            least.t_s, least.value, marker="o", markersize=9, markerfacecolor="none", markeredgewidth=1.6,
            color=ALARM if below else INK, zorder=5, clip_on=False,
        )  # fmt: skip
        value = metres(least.value, least.required_m)
        value = f"{value}, not {least.required_m:g} m," if below else value
        note = f"{short(ugv, 14)}: {value} from {short(least.other, 14)} at {least.t_s:.2f} s"
        axes.set_title(note, color=ALARM if below else INK)
    return figure


def events(rows: Sequence[tuple[Trace, str]]) -> Figure:
    """Triggers, proposals and decisions over time: a row per UGV and run, with the times beside it."""
    longest = max((trace for trace, _ in rows), key=lambda trace: float(trace.t[-1]))
    figure, (axes,) = _time_axes(1, 0.6 + 0.5 * len(rows), longest, FULL_IN, left_in=1.3, right_in=4.3, above_in=0.05)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    rule(axes, "time, s", "")
    for y, (trace, ugv) in enumerate(rows):
        across = axes.get_yaxis_transform()
        name = f"run {short(trace.run, 9)}, {short(ugv, 9)}"
        axes.text(-0.1 / size_in(axes)[0], y, name, transform=across, ha="right", va="center")
        axes.text(1.0 + 0.1 / size_in(axes)[0], y, told(trace, ugv), transform=across, va="center", fontsize=8.5)
        _bars(axes, trace, trace.column(f"{ugv}.mode") == 1, y - 0.17, facecolor="#dddddd")
        _bars(axes, trace, trace.executing(ugv) >= 0, y + 0.17, facecolor="#cfe6dc", hatch="////")
        for kind, marker in MARKS.items():
            times = [event["t_s"] for event in events_of(trace, ugv, kind)]
            color = {"refuse": ALARM, "release": MUTED, "over": MUTED}.get(kind, "#0060a8")
            level_y = y + (-0.17 if kind in ("trigger", "release") else 0.17)
            axes.plot(times, [level_y] * len(times), linestyle="none", marker=marker, markersize=6, color=color)
    return figure


def told(trace: Trace, ugv: str) -> str:
    """The events of a UGV with their times; many events are counted by kind."""
    found = events_of(trace, ugv, *MARKS)
    if len(found) <= MAX_TOLD:
        return _wrapped(f"{event['kind']} {event['t_s']:.2f}" for event in found)
    counts = {kind: [event["t_s"] for event in found if event["kind"] == kind] for kind in MARKS}
    return _wrapped(
        f"{len(t)} \N{MULTIPLICATION SIGN} {kind} from {t[0]:.2f}" if len(t) > 1 else f"{kind} {t[0]:.2f}"
        for kind, t in counts.items()
        if t
    )


def _wrapped(words: Iterable[str]) -> str:
    return fill(f"{', '.join(words)}\N{NO-BREAK SPACE}s", TOLD_CHARS)


def histogram(quantity: str, of_runs: Mapping[str, Sequence[float]]) -> Figure:
    """Histogram of a quantity over the UGVs, a line per run."""
    figure = Figure(figsize=(WIDE_IN, 2.0))
    axes = figure.add_axes((0.13, 0.24, 0.6, 0.7))
    every = np.concatenate([np.asarray(values) for values in of_runs.values()])
    edges = np.histogram_bin_edges(every, bins=min(20, max(4, len(every) // 3)), range=interval(every))
    top, labels = 1.0, []
    for position, (name, values) in enumerate(of_runs.items()):
        counts, _ = np.histogram(values, edges)
        color, dash, _ = look(position)
        axes.stairs(counts, edges, color=color, linestyle=dash, fill=len(of_runs) == 1, linewidth=1.6)
        labels.append((float(counts[-1]), f"run {short(name, 10)}", color))
        top = max(top, float(counts.max()))
    axes.set_xlim(float(edges[0]), float(edges[-1]))
    axes.set_ylim(0.0, 1.1 * top)
    rule(axes, quantity, "UGVs")
    label_right(axes, labels)
    return figure


def compared_distances(runs: Mapping[str, Trace], robot: str) -> Figure:
    """Distance from one robot to its nearest obstacle over time in several runs, with the minima."""
    first = next(iter(runs.values()))
    minima = {name: closest_obstacle(trace, robot) for name, trace in runs.items()}
    d = max((minimum.required_m for minimum in minima.values() if minimum), default=0.0)
    figure, (axes,) = _time_axes(1, 3.0 + 0.22 * len(runs), first, right_in=0.65, above_in=0.22 * len(runs))
    gaps = {name: nearest_distance(trace, robot) for name, trace in runs.items()}
    low = min(d, *(float(gap.min()) for gap in gaps.values()))
    bottom = max(min(0.0, low), low - 0.15 * d)
    axes.set_ylim(bottom, 1.6 * d)
    axes.axhspan(min(0.0, bottom), d, **_FORBIDDEN)
    level(axes, d, "-")
    rule(axes, "time, s", "distance to the nearest obstacle, m")
    label_right(axes, [(d, f"d = {d:g}", INK)])
    for position, (name, trace) in enumerate(runs.items()):
        appearance, minimum = look(position), minima[name]
        if minimum is None:
            continue
        text = f"run {short(name, 24)}: minimum {minimum.value:.3f} m"
        time_line(axes, trace.t, gaps[name], appearance, label=text)
        axes.plot(minimum.t_s, minimum.value, marker="o", markersize=9, markerfacecolor="none", color=appearance.color)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False, handlelength=4.0)
    return figure


def nearest_distance(trace: Trace, robot: str) -> Array:
    """Distance between surfaces to the nearest obstacle that is there, (T,), m."""
    there = [name for name in trace.scenario.barriers if trace.there_from(name) < len(trace.t)]
    nearest: Array = np.fmin.reduce([gap_m(trace, robot, name) for name in there])
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
    """Axes over time, stacked, with room for labels on the right."""
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
    """Bars over the times at which a held signal is true; row k holds its value since row k-1."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], active, [False]]).astype(np.int8)))
    begins, ends = trace.t[np.maximum(edges[::2] - 1, 0)], trace.t[edges[1::2] - 1]
    spans = [(float(begin), float(end - begin)) for begin, end in zip(begins, ends, strict=True)]
    axes.broken_barh(spans, (y - 0.14, 0.28), edgecolor=MUTED, linewidth=0.7, **options)
