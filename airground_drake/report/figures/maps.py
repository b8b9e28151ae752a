"""Maps of runs, each a matplotlib Figure; call them inside `canvas.style`."""

from collections.abc import Iterable, Iterator, Sequence
from textwrap import wrap
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from airground_drake.base.arrays import Array
from airground_drake.base.registry import method_of
from airground_drake.report.interventions import interventions
from airground_drake.report.metrics import events_of
from airground_drake.report.sentences import grouped
from airground_drake.report.stalls import stalls
from airground_drake.report.view.canvas import ALARM, GOOD, INK, MUTED, WIDE_IN, short, stretches, thin
from airground_drake.report.view.labels import Label, place
from airground_drake.report.view.plane import Frame, axes_over, draw_barriers, draw_robot, looks_of
from airground_drake.sim.trace import Trace
from airground_drake.ugv.reasons import refusal
from airground_drake.verify.runs.proposals import proposal_of

MAX_MARKS = 8  # maximum number of marks of a run that are told one by one
NEAR = 0.03  # marks of a UGV within this share of the map's diagonal share a letter
# Maximum height of a map, inches; characters in a line below it, and height of a line, inches.
HIGHEST_IN, LINE_CHARS, _LINE_IN = 4.4, 62, 0.16
# Looks of marks by kind, and of proposed paths.
LOOKS: dict[str, dict[str, Any]] = {
    "accepted": {"marker": "o", "color": GOOD, "linestyle": (0, (4, 2))},
    "refused": {"marker": "X", "color": ALARM, "linestyle": (0, (1, 1.3))},
    "unanswered": {"marker": "D", "color": MUTED, "linestyle": (0, (7, 2, 1, 2))},
    "stall": {"marker": "s", "color": INK, "markerfacecolor": "none"},
    "collision": {"marker": "*", "color": ALARM},
}


class Mark(NamedTuple):
    """An event of a UGV on a map."""

    ugv: str  # its name
    t_s: float  # when, s
    kind: str  # key of LOOKS
    # what, when, why: in words.
    what: str
    when: str
    why: str
    at: Array  # where, (2,), m
    way: Array = np.empty((0, 2))  # corners of the proposed path, (M, 2), m


class Entry(NamedTuple):
    """Text below a map, the letter of its place in the map, '' without one, and the marks that are drawn for it."""

    letter: str
    text: str
    marks: list[Mark]


def marks_of(trace: Trace, ugvs: Sequence[str]) -> list[Mark]:
    """Events of UGVs in a run, by time: stalls, answers to proposals, and first collisions."""
    every = trace.derived("marks of maps", lambda: [*_stalls(trace), *_answers(trace), *_collisions(trace)])
    return sorted((mark for mark in every if mark.ugv in ugvs), key=lambda mark: mark.t_s)


def _stalls(trace: Trace) -> Iterator[Mark]:
    for stall in stalls(trace):
        ugv, begin_s, end_s = stall["robot"], stall["from_s"], stall["until_s"]
        when = f"{begin_s:.1f} to {_s(end_s, 1)}" if end_s < trace.t[-1] else f"from {_s(begin_s, 1)} on"
        held = f", held by {' and '.join(stall['held_by'])}" if stall["held_by"] else ""
        yield Mark(ugv, begin_s, "stall", "stood", when, held, _at(trace, ugv, end_s))


def _answers(trace: Trace) -> Iterator[Mark]:
    """Positions of UGVs when they answered proposals, or when an unanswered proposal was sent."""
    for sent in interventions(trace):
        ugv, end = sent["robot"], sent["ended"]
        kind, t_s, why = "unanswered", sent["sent_s"], f": {end['how']}"
        if sent["accepted_s"] is not None:
            given_up = end["how"] == "given up"
            kind, t_s = "accepted", sent["accepted_s"]
            why = f", given up at {_s(end['t_s'])}: {refusal(end['reason'])}" if given_up else ""
        elif end["how"] == "refused":
            kind, t_s, why = "refused", end["t_s"], f": {refusal(end['reason'])}"
        obeyed = kind == "accepted" and not method_of(trace.meta["method"]).gated
        way = proposal_of(trace, sent["number"]).positions_m[:, :2]
        what = "obeyed" if obeyed else kind
        yield Mark(ugv, t_s, kind, what, f"at {_s(t_s)}", why, _at(trace, ugv, t_s), way)


def _collisions(trace: Trace) -> Iterator[Mark]:
    for event in (event for ugv in trace.ugvs for event in events_of(trace, ugv, "collision")[:1]):
        other = event.get("other") or event.get("obstacle")
        at = np.array(event["position_m"][:2], dtype=np.float64)
        with_ = f" with {other}" if other else ""
        yield Mark(event["robot"], event["t_s"], "collision", "collided", f"at {_s(event['t_s'])}", with_, at)


def _s(t_s: float, digits: int = 2) -> str:
    """A time with a no-break space before its unit."""
    return f"{t_s:.{digits}f}\N{NO-BREAK SPACE}s"


def summary(marks: Iterable[Mark]) -> str:
    """Marks in words; those that differ only in time are grouped."""
    alike = grouped(((mark.what, mark.why), mark.when) for mark in marks)
    return "; ".join(f"{what} {', '.join(times)}{why}" for (what, why), times in alike.items())


def _at(trace: Trace, robot: str, t_s: float) -> Array:
    return np.array([np.interp(t_s, trace.t, axis) for axis in trace.body(robot)[:, :2].T])


def key_of(trace: Trace, ugvs: Sequence[str], frame: Frame) -> list[Entry]:
    """The text below a map: an entry per place of a UGV, or per UGV if there are too many."""
    marks = marks_of(trace, ugvs)
    if len(marks) > MAX_MARKS:
        return [_of_ugv(trace, ugv, of) for ugv in ugvs if (of := [mark for mark in marks if mark.ugv == ugv])]
    near_m = NEAR * np.hypot(frame.right - frame.left, frame.top - frame.bottom)
    groups = list[list[Mark]]()
    for mark in marks:
        known = (group for group in groups if group[0].ugv == mark.ugv and np.hypot(*(group[0].at - mark.at)) < near_m)
        group = next(known, None)
        groups.append([mark]) if group is None else group.append(mark)
    letters = (chr(ord("A") + k) for k in range(MAX_MARKS))
    return [Entry(letter, f"{short(of[0].ugv)} {summary(of)}", of) for letter, of in zip(letters, groups, strict=False)]


def _of_ugv(trace: Trace, ugv: str, marks: Sequence[Mark]) -> Entry:
    """An entry for a UGV with many events; its stalls, collisions and last proposal are drawn."""
    sent = [mark for mark in marks if len(mark.way)]
    others = [mark for mark in marks if not len(mark.way)]
    arrived = events_of(trace, ugv, "arrival")
    words = [f"arrived at {_s(arrived[-1]['t_s'], 1)}"] if arrived else [summary(others[-1:])] if others else []
    answers = {what: len(of) for what, of in grouped((mark.what, mark) for mark in sent).items()}
    numbers = ", ".join(f"{n} {what}" for what, n in answers.items())
    listed = f": {numbers}" if len(answers) > 1 else f", all {''.join(answers)}"
    words += [f"{len(sent)} proposals{listed}, the last {summary(sent[-1:])}"] if len(sent) > 1 else []
    words += [f"proposal {summary(sent)}"] if len(sent) == 1 else []
    return Entry("", f"{short(ugv)} {'; '.join(words)}", [*others, *sent[-1:]])


def lines_of(key: Sequence[Entry]) -> list[tuple[str, str]]:
    """The lines below a map: a letter at the beginning of an entry that has one, and text."""
    texts = ((entry.letter, wrap(entry.text, LINE_CHARS)) for entry in key)
    return [("" if k else letter, line) for letter, lines in texts for k, line in enumerate(lines)]


def plane(trace: Trace, ugvs: Sequence[str], frame: Frame, key: Sequence[Entry], lines: int) -> Figure:
    """The ways of a run in the plane: starts o, targets x, barriers with safe outlines, proposals, the UAV dashed.

    UGVs other than `ugvs` are thin lines that end in a dot. There is room for so many lines of text below the map.
    """
    figure, axes = axes_over(frame, frame.width_in(WIDE_IN, HIGHEST_IN), WIDE_IN, _LINE_IN * lines + 0.1 * (lines > 0))
    of_barriers, edges = draw_barriers(axes, trace.scenario)
    labels = list[Label]()
    for robot in trace.ugvs:
        if robot not in ugvs:
            axes.plot(*trace.body(robot)[:, :2].T, color=MUTED, linewidth=0.7, zorder=1)
            axes.plot(*trace.body(robot)[-1, :2], marker=".", markersize=3, color=MUTED, zorder=1)
    robots = looks_of(trace.scenario, ugvs)
    for robot, appearance in robots.items():
        way, rows = trace.body(robot), trace.counting_rows(robot)
        labels += draw_robot(axes, trace.scenario, robot, way, appearance, rows, trace.heading(robot))
        for first, after in stretches(trace.executing(robot) >= 0) if robot in ugvs else ():
            band = way[max(first - 1, 0) : after, :2]
            axes.plot(*band[thin(band)].T, color=appearance.color, linewidth=5.0, alpha=0.3, zorder=1.8)
    for entry in key:
        _draw(axes, entry.marks)
        labels += [Label(entry.marks[0].at, entry.letter, weight="bold", size_pt=9.0)] if entry.letter else []
    place(axes, [*labels, *of_barriers], [*(trace.body(robot) for robot in robots), *edges])
    top_in = _LINE_IN * lines
    for letter, text in lines_of(key):
        for left_in, part, weight in ((0.1, letter, "bold"), (0.3, text, "normal")):
            at = left_in / WIDE_IN, top_in / figure.get_figheight()
            figure.text(*at, part, va="top", fontsize=8.5, weight=weight)
        top_in -= _LINE_IN
    return figure


def _draw(axes: Axes, marks: Sequence[Mark]) -> None:
    for mark in marks:
        of_mark = dict(LOOKS[mark.kind])
        dash = of_mark.pop("linestyle", "none")
        if len(mark.way):
            way = mark.way[thin(mark.way)]
            axes.plot(*way.T, color=of_mark["color"], linestyle=dash, linewidth=1.3, zorder=3.5)
        edge = {"markeredgewidth": 1.6} if mark.kind == "stall" else {"markeredgecolor": "white"}
        size = {"stall": 10.0, "collision": 12.0}.get(mark.kind, 7.0)
        axes.plot(*mark.at, linestyle="none", markersize=size, zorder=6, **of_mark, **edge)
