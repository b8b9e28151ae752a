"""Drawings over time, each a matplotlib Figure; call them inside `canvas.style`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from airground_drake.base.arrays import Array, Flags
from airground_drake.report.metrics import events_of, gap_m
from airground_drake.report.model import Approach
from airground_drake.report.sentences import metres
from airground_drake.report.view import canvas
from airground_drake.report.view.canvas import ticks_of
from airground_drake.report.view.labels import BOX
from airground_drake.sim.trace import Trace

# Time shown before and after an event, shortest time that is cut out, s, and maximum number of cuts.
AROUND_S, CUT_S, MAX_CUTS = 0.7, 1.0, 5
CUT_SHARE = 0.05  # width of a cut on the axis, as a share of the time shown


class Clock(NamedTuple):
    """The stretches of time that are shown."""

    # begin, end: of the stretches, (n,), s.
    begin: Array
    end: Array
    place: Array  # of their begins on the axis, (n,), s

    @classmethod
    def around(cls, times_s: Sequence[float], first_s: float, last_s: float) -> Clock:
        """The stretches of a run around some times; the whole run without such times."""
        times = np.sort(times_s) if len(times_s) else np.array([first_s, last_s])
        gaps = np.diff(times) if len(times_s) else np.zeros(1)
        longest = np.sort(np.argsort(-gaps, kind="stable")[:MAX_CUTS])
        cuts = longest[gaps[longest] > 2.0 * AROUND_S + CUT_S]
        begin = np.maximum(times[np.append(0, cuts + 1)] - AROUND_S, first_s)
        end = np.minimum(times[np.append(cuts, -1)] + AROUND_S, last_s)
        steps = end - begin + CUT_SHARE * (end - begin).sum()
        return cls(begin, end, np.cumsum(steps) - steps)

    @property
    def shown_s(self) -> float:
        return float((self.end - self.begin).sum())

    @property
    def cuts(self) -> Array:
        """Begins and ends of the cuts on the axis, (n - 1, 2), s."""
        return np.column_stack([self.place[:-1] + (self.end - self.begin)[:-1], self.place[1:]])

    @property
    def length(self) -> float:
        return float(self.place[-1] + self.end[-1] - self.begin[-1])

    def at(self, t: Array | Sequence[float]) -> Array:
        """Places of times on the axis; a time that is left out is in a cut, or at an end."""
        knots, places = ([start, start + self.end - self.begin] for start in (self.begin, self.place))
        return np.asarray(np.interp(t, np.column_stack(knots).ravel(), np.column_stack(places).ravel()))

    def shows(self, t: Array) -> Flags:
        k = np.maximum(np.searchsorted(self.begin, t, side="right") - 1, 0)
        return np.asarray((self.begin[k] <= t) & (t <= self.end[k]))

    def numbers(self, apart: float) -> dict[float, str]:
        """Round times in the stretches by their places, so far apart at least; the middle of a stretch without one."""
        first, second = ticks_of((0.0, self.shown_s), 5)[:2]
        step, numbers = second - first, dict[float, str]()
        for begin, end in zip(self.begin.tolist(), self.end.tolist(), strict=True):
            times = step * np.arange(np.ceil(begin / step), np.floor(end / step) + 1.0)
            for t in times.tolist() or [round((begin + end) / 2.0, 1)]:
                place = float(self.at([t])[0])
                if not numbers or place - max(numbers) >= apart:
                    numbers[place] = f"{round(t, 12):g}"
        return numbers


# Markers of events by kind.
MARKS = {"trigger": "^", "release": "v", "proposal": "D", "accept": "o", "refuse": "X", "over": "s"}
# Names of kinds of events, where they are not those of the trace.
WORDS = {"accept": "accepted", "refuse": "refused", "over": "time over"}
# Maximum number of labels of a row, and of events in a label or a heading, more are counted; characters in a line.
MAX_TOLD, TOLD_CHARS = 8, 52
TOGETHER_S = 0.2  # events that follow each other within this time share a label, s
# Margins beside axes, heights of a row and of a line of text above it, width of a character, inches.
_LEFT_IN, _RIGHT_IN, _ROW_IN, _LINE_IN, _CHAR_IN = 0.55, 1.05, 0.75, 0.15, 0.066
_COLORS = {"accept": canvas.GOOD, "refuse": canvas.ALARM, "release": canvas.MUTED, "over": canvas.MUTED}


def distances(
    trace: Trace, near: Mapping[str, Sequence[Approach]], looks: Mapping[str, Mapping[str, int]], top: float
) -> Figure:
    """Distances between the surfaces of each UGV and bodies near it, the required ones, and the exact minimum."""
    figure, every = _time_axes(1.45, [0.24, *[0.32] * (len(near) - 1)], trace)
    required = sorted({at.safe_distance_m for those in near.values() for at in those})
    for axes, (ugv, those) in zip(every, near.items(), strict=True):
        bottom = min(0.0, *(at.value for at in those)) if those else 0.0
        axes.axhspan(bottom, required[0], **canvas.FORBIDDEN)
        labels = [(d, f"required {d:.3g}", canvas.INK) for d in required]
        for d in required:
            canvas.level(axes, d, "-")
        highest = required[-1]
        for at in those:
            gap = gap_m(trace, ugv, at.second)
            appearance = canvas.look(looks[ugv][at.second])
            canvas.time_line(axes, trace.t, gap, appearance)
            labels.append((min(float(gap[-1]), top), canvas.short(at.second, 12), appearance.color))
            highest = max(highest, float(np.nanmax(gap)))
        axes.set_ylim(bottom, min(1.05 * highest, top))
        canvas.rule(axes, "time, s" if axes is every[-1] else "", "distance, m")
        canvas.label_right(axes, labels)
        if not those:
            axes.set_title(canvas.short(ugv))
            continue
        least = those[0]
        below = least.is_short
        axes.plot(
            least.t_s, least.value, marker="o", markersize=9, markerfacecolor="none", markeredgewidth=1.6,
            color=canvas.ALARM if below else canvas.INK, zorder=5, clip_on=False,
        )  # fmt: skip
        value = metres(least.value, least.safe_distance_m)
        value = f"{value}, not {least.safe_distance_m:g} m," if below else value
        note = f"{canvas.short(ugv, 14)}: {value} from {canvas.short(least.second, 14)} at {least.t_s:.2f} s"
        axes.set_title(note, color=canvas.ALARM if below else canvas.INK)
    return figure


class _Label(NamedTuple):
    """A text above a row: place of its event, begin and end of the text on the axis, s; its lowest line."""

    at: float
    begin: float
    end: float
    line: int
    text: str
    color: str

    @property
    def top(self) -> int:
        return self.line + self.text.count("\n") + 1


def events(trace: Trace, ugvs: Sequence[str]) -> Figure:
    """Decision variables and events of UGVs, a row each, without long times without events."""
    happened = {ugv: events_of(trace, ugv, *MARKS) for ugv in ugvs}
    clock = Clock.around([event["t_s"] for those in happened.values() for event in those], *_ends_s(trace))
    labels = {ugv: _labels(those, clock) for ugv, those in happened.items()}
    heads = [
        canvas.short(ugv) if labels[ugv] else fill(f"{canvas.short(ugv)}: {events_in_words(trace, ugv)}", TOLD_CHARS)
        for ugv in ugvs
    ]
    lines = [max((label.top for label in labels[ugv]), default=0) for ugv in ugvs]
    above_in = [_LINE_IN * (line + head.count("\n") + 1) + 0.14 for line, head in zip(lines, heads, strict=True)]
    figure, every = _time_axes(_ROW_IN, above_in, trace)
    for axes, ugv, line, head in zip(every, ugvs, lines, heads, strict=True):
        axes.set_xlim(0.0, clock.length)
        _behind(axes, trace, ugv, clock)
        across = axes.get_xaxis_transform()
        axes.text(0.0, _height(line), head, transform=across, va="bottom", weight="bold" if labels[ugv] else "normal")
        for label in labels[ugv]:
            y, color = _height(label.line), label.color
            axes.plot([label.at] * 2, [0.0, y], transform=across, color=color, linewidth=0.6, clip_on=False)
            axes.text(label.begin, y, label.text, color=color, transform=across, va="bottom", fontsize=8, bbox=BOX)
        for event in happened[ugv]:
            kind = event["kind"]
            t_s = event["t_s"]
            low, high = axes.get_ylim()
            share = {"trigger": None, "release": None, "proposal": 0.36}.get(kind, 0.09)
            x = np.interp(t_s, trace.t, trace.column(f"{ugv}.decision_variable_m"))
            axes.plot(
                clock.at([t_s]), x if share is None else low + share * (high - low), MARKS[kind], markersize=6.5,
                color=_COLORS.get(kind, "#0060a8"), markeredgecolor="white", markeredgewidth=0.6, zorder=5,
                clip_on=False,
            )  # fmt: skip
        numbers = clock.numbers(0.13 * clock.length)
        canvas.rule(axes, f"time, s{_left_out(trace, clock)}" if axes is every[-1] else "", "m", numbers=numbers)
    return figure


def _height(line: int) -> float:
    """Where a line of text above a row is, as a multiple of the row's height."""
    return 1.0 + (0.05 + _LINE_IN * line) / _ROW_IN


def _left_out(trace: Trace, clock: Clock) -> str:
    first_s, last_s = _ends_s(trace)
    left_out_s = last_s - first_s - clock.shown_s
    return f" (nothing happens in the other {left_out_s:.1f} s)" if left_out_s >= CUT_S else ""


def _behind(axes: Axes, trace: Trace, ugv: str, clock: Clock) -> None:
    """The background of a UGV's events: its decision variable, both levels, interventions, and cuts."""
    t = np.union1d(trace.t[clock.shows(trace.t)], [clock.begin, clock.end])
    zeta = float(trace.meta["zeta_m"])
    x = np.interp(t, trace.t, trace.column(f"{ugv}.decision_variable_m"))
    bottom, top = min(0.0, *x), max(zeta, *x)
    axes.set_ylim(bottom, top + 0.15 * (top - bottom))
    labels = [(zeta, f"threshold {zeta:.3g}", canvas.INK)]
    canvas.level(axes, zeta, "-")
    if trace.scenario.decision.trigger == "automaton":
        release = float(trace.scenario.decision.release_m)
        canvas.level(axes, release, (0, (1, 1.5)))
        labels.append((release, f"release {release:.3g}", canvas.INK))
    canvas.label_right(axes, labels)
    _bars(axes, trace, clock, trace.column(f"{ugv}.mode") == 1, 1.0, facecolor="#eeeeee", zorder=0.4)
    follows = trace.executing(ugv) >= 0
    _bars(axes, trace, clock, follows, 0.18, facecolor="#cfe6dc", edgecolor=canvas.MUTED, hatch="////", zorder=0.6)
    axes.plot(clock.at(t[canvas.thin(x)]), x[canvas.thin(x)], color=canvas.look(0).color)
    for begin, end in clock.cuts:
        axes.axvspan(begin, end, facecolor="white", edgecolor="none", zorder=3)
        axes.text((begin + end) / 2.0, 0.5, "//", transform=axes.get_xaxis_transform(), ha="center", va="center",
                  color=canvas.MUTED, zorder=4)  # fmt: skip


def _labels(happened: Sequence[Mapping[str, Any]], clock: Clock) -> list[_Label]:
    """Labels of events, from the last one to the first: a line to an event passes no earlier label. [] for too many."""
    groups = list[list[Mapping[str, Any]]]()
    for event in happened:
        together = groups and event["t_s"] - groups[-1][-1]["t_s"] < TOGETHER_S
        groups[-1].append(event) if together else groups.append([event])
    labels = list[_Label]()
    if len(groups) > MAX_TOLD or any(len(group) > MAX_TOLD for group in groups):
        return labels
    for group in reversed(groups):
        text = fill(
            f"{', '.join(_word(event['kind'], event['t_s']) for event in group)}\N{NO-BREAK SPACE}s", TOLD_CHARS
        )
        s_per_in = clock.length / (canvas.WIDE_IN - _LEFT_IN - _RIGHT_IN)
        width = s_per_in * _CHAR_IN * max(map(len, text.split("\n")))
        at = float(clock.at([group[0]["t_s"]])[0])
        begin = max(min(at, clock.length + s_per_in * _RIGHT_IN - width), -s_per_in * _LEFT_IN)
        over = [label.top for label in labels if label.begin < begin + width and begin < label.end]
        color = next((_COLORS[event["kind"]] for event in group if event["kind"] in ("refuse", "accept")), canvas.INK)
        labels.append(_Label(at, begin, begin + width, max(over, default=0), text, color))
    return labels


def _word(kind: str, t_s: float) -> str:
    return f"{WORDS.get(kind, kind)} {t_s:.2f}"


def events_in_words(trace: Trace, ugv: str) -> str:
    """The events of a UGV with their times; many events are counted by kind; without any, its largest value."""
    marks = events_of(trace, ugv, *MARKS)
    if not marks:
        x = trace.column(f"{ugv}.decision_variable_m")
        return f"nothing happens; largest {x.max():.3g} m at {trace.t[x.argmax()]:.2f} s"
    if len(marks) <= MAX_TOLD:
        return f"{', '.join(_word(event['kind'], event['t_s']) for event in marks)} s"
    times = {kind: [event["t_s"] for event in marks if event["kind"] == kind] for kind in MARKS}
    counts = [
        _word(kind, t[0]) if len(t) == 1 else f"{len(t)} \N{MULTIPLICATION SIGN} {_word(kind, t[0])}"
        for kind, t in times.items()
        if t
    ]
    return f"{', '.join(counts)} s (first times)"


def histogram(quantity: str, of_runs: Mapping[str, Sequence[float]]) -> Figure:
    figure = Figure(figsize=(canvas.WIDE_IN, 2.0))
    axes = figure.add_axes((0.13, 0.24, 0.6, 0.7))
    every = np.concatenate([np.asarray(values) for values in of_runs.values()])
    edges = np.histogram_bin_edges(every, bins=min(20, max(4, len(every) // 3)), range=canvas.interval(every))
    top, labels = 1.0, []
    for position, (name, values) in enumerate(of_runs.items()):
        counts, _ = np.histogram(values, edges)
        color, dash, _ = canvas.look(position)
        axes.stairs(counts, edges, color=color, linestyle=dash, fill=len(of_runs) == 1, linewidth=1.6)
        labels.append((float(counts[-1]), f"run {canvas.short(name, 10)}", color))
        top = max(top, float(counts.max()))
    axes.set_xlim(float(edges[0]), float(edges[-1]))
    axes.set_ylim(0.0, 1.1 * top)
    canvas.rule(axes, quantity, "UGVs")
    canvas.label_right(axes, labels)
    return figure


def nearest_distance(trace: Trace, robot: str) -> Array:
    """Distance between surfaces to the nearest obstacle that is there, (T,), m."""
    there = [name for name in trace.scenario.barriers if trace.there_from(name) < len(trace.t)]
    nearest: Array = np.fmin.reduce([gap_m(trace, robot, name) for name in there])
    return nearest


def _ends_s(trace: Trace) -> tuple[float, float]:
    return float(trace.t[0]), float(trace.t[-1]) if len(trace.t) > 1 else float(trace.t[0]) + 1.0


def _time_axes(inner_in: float, above_in: Sequence[float], trace: Trace) -> tuple[Figure, list[Axes]]:
    """Axes over time, stacked, of the same height, with room above each, and on the right for labels."""
    height_in = 0.42 + sum(above_in) + inner_in * len(above_in)
    figure = Figure(figsize=(canvas.WIDE_IN, height_in))
    every = []
    top_in = height_in
    for room_in in above_in:
        top_in -= room_in + inner_in
        size = (canvas.WIDE_IN - _LEFT_IN - _RIGHT_IN) / canvas.WIDE_IN, inner_in / height_in
        every.append(figure.add_axes((_LEFT_IN / canvas.WIDE_IN, top_in / height_in, *size)))
        every[-1].set_xlim(*_ends_s(trace))
    return figure, every


def _bars(axes: Axes, trace: Trace, clock: Clock, active: Flags, share: float, **options: Any) -> None:
    """Bars over the times at which a held signal is true; row k holds its value since row k-1."""
    # They start at the bottom of the axes and reach up to a share of them.
    begins, ends = clock.at(trace.t[np.maximum(canvas.stretches(active) - 1, 0)]).T
    axes.broken_barh(
        np.column_stack([begins, ends - begins]).tolist(),
        (0.0, share),
        transform=axes.get_xaxis_transform(),
        linewidth=0.0,
        **options,
    )
