"""Maps of runs, each a matplotlib Figure; call them inside `canvas.style`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from airground_drake.base.arrays import Array
from airground_drake.report.metrics import events_of
from airground_drake.report.reproduction import MEASURES
from airground_drake.run.trace import Trace
from airground_drake.view.canvas import ALARM, INK, MUTED
from airground_drake.view.labels import Label, place
from airground_drake.view.plane import Frame, axes_over, draw_barriers, draw_robot, looks_of


def plane(trace: Trace, ugvs: Sequence[str], frame: Frame, width_in: float) -> Figure:
    """The ways of a run in the plane: starts o, targets x, barriers with safe outlines, the UAV dashed.

    UGVs other than `ugvs` are thin lines that end in a dot.
    """
    figure, axes = axes_over(frame, width_in)
    (of_barriers, edges), labels = draw_barriers(axes, trace.scenario), list[Label]()
    for robot in trace.ugvs:
        if robot not in ugvs:
            axes.plot(*trace.body(robot)[:, :2].T, color=MUTED, linewidth=0.7, zorder=1)
            axes.plot(*trace.body(robot)[-1, :2], marker=".", markersize=3, color=MUTED, zorder=1)
    robots = looks_of(trace.scenario, ugvs)
    for robot, appearance in robots.items():
        way, rows = trace.body(robot), trace.counting_rows(robot)
        labels += draw_robot(axes, trace.scenario, robot, way, appearance, rows, trace.heading(robot))
    for ugv in ugvs:
        labels += _happenings(axes, trace, ugv)
    place(axes, [*labels, *of_barriers], [*(trace.body(robot) for robot in robots), *edges])
    return figure


def _happenings(axes: Axes, trace: Trace, ugv: str) -> list[Label]:
    """Mark where a UGV triggered, collided or stands still; the labels of these marks."""
    found: list[tuple[Array, list[str]]] = []

    def mark(at: Array, text: str, **options: Any) -> None:
        axes.plot(*at, markersize=10, zorder=6, **options)
        near = next((lines for known, lines in found if np.linalg.norm(known - at) < 0.3), None)
        if near is None:
            found.append((at, [text]))
        else:
            near.append(text)

    for event in [*events_of(trace, ugv, "trigger")[:2], *events_of(trace, ugv, "collision")[:1]]:
        options = {"marker": "^", "color": INK} if event["kind"] == "trigger" else {"marker": "X", "color": ALARM}
        at = np.asarray(event["position_m"][:2], dtype=np.float64)
        mark(at, f"{event['kind']} {event['t_s']:.2f} s", markeredgecolor="white", **options)
    if MEASURES["stall_position"](trace, ugv):
        at = trace.body(ugv)[-1, :2]
        mark(at, "stands still", marker="s", markerfacecolor="none", color=INK, markeredgewidth=1.4)
    return [Label(at, "\n".join(lines)) for at, lines in found]
