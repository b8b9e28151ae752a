"""Small maps of the moments that need attention: who was where, and which distance was to be kept."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure as Drawing
from matplotlib.patches import Circle

from airground_drake.base.arrays import Array
from airground_drake.report import attention
from airground_drake.report.figures import canvas
from airground_drake.report.figures.panels import Figure, Table, panel
from airground_drake.report.metrics import place, safe_distance_m
from airground_drake.run.trace import Trace

MAX_MOMENTS = 8
SIDE_IN = 1.9
"""Side of a map, inches."""


def draw(document: Mapping[str, Any], traces: Mapping[str, Trace]) -> list[Figure]:
    """A map for each of the first items of attention that has a time and a place, in the order of the page."""
    found = list[Figure]()
    with canvas.style():
        for position, item in enumerate(attention.items(document)):
            trace = traces.get(item.run)
            if trace is None or item.t_s is None or len(found) == MAX_MOMENTS:
                continue
            bodies = [name for name in item.bodies if name in trace.robots or name in trace.scenario.obstacles]
            if any(name in trace.robots for name in bodies):
                found.append(_figure(position, trace, bodies, item.t_s))
    return found


def _figure(position: int, trace: Trace, bodies: list[str], t_s: float) -> Figure:
    name = f"attention-{position}"
    at = {body: _where(trace, body, t_s) for body in bodies}
    caption = f"{' and '.join(bodies)} at {t_s:.3f} s, and the ways of the robots until then."
    rows = tuple((body, *(f"{x:.3f}" for x in where)) for body, where in at.items())
    table, title = Table("Positions, m", ("", "x", "y", "z"), rows), f"Run {trace.run} at {t_s:.3f} s"
    drawn = panel(_map(trace, at, t_s), name, title, caption, trace.run, table)
    return Figure(name, "The moment", caption, (drawn,), beside=name)


def _where(trace: Trace, body: str, t_s: float) -> Array:
    """Position of a robot or an obstacle, (3,), m."""
    known = place(trace, body)
    return known if known.ndim == 1 else np.array([np.interp(t_s, trace.t, known[:, k]) for k in range(3)])


def _map(trace: Trace, at: Mapping[str, Array], t_s: float) -> Drawing:
    """The bodies in the middle; the second, if there are two, in the circle that the first must not enter."""
    drawing = Drawing(figsize=(SIDE_IN, SIDE_IN))
    axes = drawing.add_axes((0.0, 0.0, 1.0, 1.0))
    names = list(at)
    alone = len(names) == 1 and names[0] in trace.ugvs
    targets = [np.array(trace.scenario.ugvs[names[0]].target_m)] if alone else []
    places = np.array([where[:2] for where in (*at.values(), *targets)])
    d = safe_distance_m(trace, *names[:2]) if len(names) > 1 and names[0] in trace.robots else 1.0
    half = 0.5 * float(np.ptp(places, axis=0).max()) + 1.5 * d
    middle = 0.5 * (places.min(axis=0) + places.max(axis=0))
    for x, y, _ in targets:
        axes.plot(x, y, marker="x", markersize=7, markeredgewidth=2, color=canvas.INK)
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    axes.set_xticks([])
    axes.set_yticks([])
    for name, obstacle in trace.scenario.obstacles.items():
        x, y = obstacle.position_m[:2]
        if max(abs(x - middle[0]), abs(y - middle[1])) < half:
            marked = canvas.ALARM if name in at else canvas.INK
            axes.plot(x, y, marker="h", markersize=6, color=marked)
    before = trace.t <= t_s
    for position, robot in enumerate(trace.robots):
        look = canvas.UAV_LOOK if robot in trace.uavs else canvas.look(position)
        path = trace.position(robot)[before, :2]
        rows = canvas.thin(path, 200)
        axes.plot(*path[rows].T, color=look.color, linestyle=look.dash, linewidth=1.2)
        now = _where(trace, robot, t_s)
        axes.plot(*now[:2], marker=look.marker, markersize=6, color=look.color, markeredgecolor="#ffffff", zorder=4)
    if len(names) > 1:
        axes.add_patch(
            Circle(tuple(places[1]), d, facecolor="none", edgecolor=canvas.ALARM, linestyle=(0, (3, 2)), linewidth=1.0)
        )
        axes.plot(*places[:2].T, color=canvas.ALARM, linewidth=1.2, zorder=3)
    for name, (x, y) in zip(names, places, strict=False):
        level = 0.02 * half if name == names[0] else -0.02 * half  # two bodies at one place: one above the other
        inwards = 1.0 if y - middle[1] < level else -1.0
        axes.annotate(
            canvas.short(name, 14), (x, y), (0.0, -9.0 * inwards), textcoords="offset points", ha="center",
            va="top" if inwards > 0 else "bottom", fontsize=8, zorder=5,
        )  # fmt: skip
    return drawing
