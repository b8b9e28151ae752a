"""Drawings in the ground plane, each a matplotlib Figure; call them inside `canvas.style`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from airground_drake.base.arrays import Array
from airground_drake.report.figures.canvas import (
    ALARM,
    INK,
    MUTED,
    UAV_LOOK,
    WIDE_IN,
    Look,
    look,
    rule,
    short,
    thin,
)
from airground_drake.report.figures.labels import Label, place
from airground_drake.report.metrics import events_of, radius_m
from airground_drake.report.reproduction import MEASURES
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Obstacle, Scenario
from airground_drake.view.stage import safe_m

MAX_NAMED_OBSTACLES = 12
_VOID_DASH = (0, (1.5, 2.5))
_LEFT_IN, _BESIDE_IN = 0.5, 0.65
"""Margin left of a map, and both side margins together, inches."""


class Frame(NamedTuple):
    """A rectangle of the ground plane, m."""

    left: float
    right: float
    bottom: float
    top: float

    def width_in(self, widest: float, tallest: float) -> float:
        """Width of its largest map within these limits, inches."""
        return min(widest, tallest * (self.right - self.left) / (self.top - self.bottom) + _BESIDE_IN)


def frame_of(traces: Sequence[Trace], robots: Sequence[str]) -> Frame:
    """The rectangle around robots, targets and obstacles with their safe circles."""
    scenario = traces[0].scenario
    ways = [(trace.position(robot)[:, :2], radius_m(trace, robot)) for trace in traces for robot in robots]
    points = [way + side * radius for way, radius in ways for side in ((-1.0, 1.0) if radius else (0.0,))]
    points += [np.array([scenario.ugvs[robot].target_m[:2] for robot in robots if robot in scenario.ugvs])]
    reach = np.array([safe_m(scenario, obstacle) for obstacle in scenario.obstacles.values()])[:, None]
    centres = np.array([obstacle.position_m[:2] for obstacle in scenario.obstacles.values()])
    points += [centres - reach, centres + reach] if len(centres) else []
    every = np.concatenate(points)
    (left, bottom), (right, top) = every.min(axis=0) - 0.4, every.max(axis=0) + 0.4
    return Frame(left, right, bottom - 0.6, top + 0.8)


def plane(trace: Trace, ugvs: Sequence[str], frame: Frame, width_in: float) -> Figure:
    """Trajectories of a run in the plane: starts o, targets x, obstacles with safe circles, the UAV dashed.

    UGVs other than `ugvs` are thin lines that end in a dot.
    """
    figure, axes = _map(trace, frame, width_in)
    labels = list[Label]()
    (uav,) = trace.uavs
    for robot in trace.ugvs:
        if robot not in ugvs:
            axes.plot(*trace.position(robot)[:, :2].T, color=MUTED, linewidth=0.7, zorder=1)
            axes.plot(*trace.position(robot)[-1, :2], marker=".", markersize=3, color=MUTED, zorder=1)
    targets = {**{name: ugv.target_m for name, ugv in trace.scenario.ugvs.items()}, uav: None}
    for position, robot in enumerate([*ugvs, uav]):
        appearance = UAV_LOOK if robot == uav else look(position)
        _path(axes, trace, robot, appearance, linewidth=1.1 if robot == uav else 1.9)
        start, end = trace.position(robot)[0], trace.position(robot)[-1]
        for at in (start, end):
            _body(axes, at, radius_m(trace, robot), appearance.color)
        axes.plot(*start[:2], marker="o", markersize=6, color=appearance.color, markerfacecolor="white", zorder=4)
        target = targets[robot] or end
        if robot != uav:
            axes.plot(*target[:2], marker="x", markersize=7, markeredgewidth=2, color=appearance.color, zorder=4)
            labels.append(_name(robot, start, appearance))
        labels.append(_name(robot, target, appearance))
    for ugv in ugvs:
        labels += _happenings(axes, trace, ugv)
    place(axes, [*labels, *_obstacles(trace.scenario)], [trace.position(robot) for robot in (*ugvs, uav)])
    return figure


def compared_paths(runs: Mapping[str, Trace], robot: str, frame: Frame) -> Figure:
    """Trajectories of one robot in several runs, near the obstacles."""
    first = next(iter(runs.values()))
    figure, axes = _map(first, frame, WIDE_IN, above_in=0.22 * len(runs))
    labels = list[Label]()
    for position, (name, trace) in enumerate(runs.items()):
        path, appearance = trace.position(robot), look(position)
        _path(axes, trace, robot, appearance, linewidth=2.0, label=f"run {short(name, 24)}")
        inside = (path[:, 0] > frame.left) & (path[:, 0] < frame.right)
        inside &= (path[:, 1] > frame.bottom) & (path[:, 1] < frame.top)
        marked = np.flatnonzero(inside)[:: max(1, int(inside.sum()) // 7)]
        axes.plot(*path[marked, :2].T, linestyle="none", marker=appearance.marker, markersize=5, color=appearance.color)
        if MEASURES["stall_position"](trace, robot):
            axes.plot(*path[-1, :2], marker="s", markersize=11, markerfacecolor="none", color=INK, markeredgewidth=1.6)
            labels.append(Label(path[-1], "stands still"))
    place(axes, [*labels, *_obstacles(first.scenario)], [trace.position(robot) for trace in runs.values()])
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False, handlelength=4.0, borderaxespad=0.0)
    return figure


def _map(trace: Trace, frame: Frame, width_in: float, above_in: float = 0.1) -> tuple[Figure, Axes]:
    """Axes with equal scales over a part of the ground plane, with the obstacles."""
    inner_in = width_in - _BESIDE_IN
    inner_height_in = inner_in * (frame.top - frame.bottom) / (frame.right - frame.left)
    height_in = inner_height_in + 0.42 + above_in
    figure = Figure(figsize=(width_in, height_in))
    axes = figure.add_axes((_LEFT_IN / width_in, 0.42 / height_in, inner_in / width_in, inner_height_in / height_in))
    axes.set_xlim(frame.left, frame.right)
    axes.set_ylim(frame.bottom, frame.top)
    axes.set_aspect("equal")
    rule(axes, "x, m", "y, m")
    obstacles = list(trace.scenario.obstacles.values())
    circles = [Circle((each.position_m[0], each.position_m[1]), safe_m(trace.scenario, each)) for each in obstacles]
    dashes = (0, (2, 2))
    axes.add_collection(
        PatchCollection(circles, facecolor="#f3f3f3", edgecolor=MUTED, linestyle=dashes, linewidth=1.0, zorder=1.0)
    )
    for obstacle in obstacles:
        _body(axes, obstacle.position_m, obstacle.radius_m, INK)
    for known, fill in ((True, INK), (False, "white")):
        places = [each.position_m for each in obstacles if each.known_to_uav is known]
        shown = [(x, y) for x, y, _ in places if frame.left < x < frame.right and frame.bottom < y < frame.top]
        axes.plot(
            *np.reshape(shown, (-1, 2)).T, linestyle="none", marker="h", markersize=6, color=INK, markerfacecolor=fill,
            zorder=3,
        )  # fmt: skip
    for x, y, _ in trace.scenario.uav.phantoms_m:
        axes.plot(x, y, marker="x", markersize=6, color=MUTED, zorder=3)
    return figure, axes


def _obstacles(scenario: Scenario) -> list[Label]:
    """Labels of the obstacles, unless they are many, and of phantoms."""
    named = scenario.obstacles if len(scenario.obstacles) <= MAX_NAMED_OBSTACLES else {}
    hint = {True: "", False: "\n(unseen by the UAV)"}
    places = [
        *(
            (obstacle.position_m, short(name, 12) + _since(obstacle) + hint[obstacle.known_to_uav])
            for name, obstacle in named.items()
        ),
        *((at, "(only on the UAV's map)") for at in scenario.uav.phantoms_m),
    ]
    return [Label(np.array(at), text, size_pt=7.5) for at, text in places]


def _since(obstacle: Obstacle) -> str:
    return f", from {obstacle.appears_s:g} s" if obstacle.appears_s else ""


def _body(axes: Axes, at: Sequence[float] | Array, radius: float, color: str) -> None:
    """A robot or an obstacle in its true size."""
    if radius:
        axes.add_patch(Circle((at[0], at[1]), radius, facecolor=color, edgecolor=color, alpha=0.35, zorder=1.5))


def _path(axes: Axes, trace: Trace, robot: str, appearance: Look, **options: Any) -> None:
    """The path of a robot; from its first collision on, where nothing counts, in thin short dashes."""
    path, rows = trace.position(robot)[:, :2], trace.counting_rows(robot)
    parts = ((path[:rows], appearance.dash, options), (path[rows - 1 :], _VOID_DASH, {"linewidth": 0.9}))
    for part, dash, of_line in parts[: 1 + (rows < len(path))]:
        axes.plot(*part[thin(part)].T, color=appearance.color, linestyle=dash, **of_line)


def _name(robot: str, at: Sequence[float] | Array, appearance: Look) -> Label:
    return Label(np.asarray(at), short(robot, 9), appearance.color, weight="bold")


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
        at = trace.position(ugv)[-1, :2]
        mark(at, "stands still", marker="s", markerfacecolor="none", color=INK, markeredgewidth=1.4)
    return [Label(at, "\n".join(lines)) for at, lines in found]
