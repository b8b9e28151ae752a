"""The runs of two reports in the same drawings: before thin and dashed, after in the same colour, thick."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.lines import Line2D

from airground_drake.report.figures import canvas
from airground_drake.report.figures.canvas import INK, LOOKS, MUTED, WIDE_IN, look, rule, short, size_in, thin
from airground_drake.report.figures.panels import Figure, Table, panel
from airground_drake.run.trace import Trace

_BEFORE: dict[str, Any] = {"linewidth": 1.0, "linestyle": (0, (3, 2)), "alpha": 0.9, "zorder": 2.0}
_AFTER: dict[str, Any] = {"linewidth": 1.8, "linestyle": "-", "zorder": 2.5}
_HEIGHT_IN = 3.6


def draw(run: str, position: int, before: Trace, after: Trace) -> Figure:
    """Paths in the ground plane and decision variables over time of a run in two reports.

    Args:
        run: its name.
        position: among the figures of the page.
        before: of the older report.
        after: of the newer one.
    """
    ugvs = [ugv for ugv in after.ugvs if ugv in before.ugvs]
    moved = sorted(ugvs, key=lambda ugv: -_apart(before, after, ugv))[: len(LOOKS)]
    drawn = [ugv for ugv in ugvs if ugv in moved]
    left_out = f" The {len(drawn)} of {len(ugvs)} UGVs that differ most." if len(drawn) < len(ugvs) else ""
    ends = tuple((ugv, f"{_apart(before, after, ugv):.4g}", *_ends(before, after, ugv)) for ugv in drawn)
    where = Table("Where the UGVs were", ("UGV", "farthest apart, m", "ends before, m", "ends after, m"), ends)
    tops = _largest(before, after, drawn)
    largest = Table("Largest decision variables", ("UGV", "before, m", "after, m"), tops)
    says = "Before dashed, after solid."
    paths, variables = f"Paths of run {run}", f"Decision variables of run {run}"
    with canvas.style():
        panels = (
            panel(_paths(before, after, drawn), f"paths-{position}", paths, says, "Paths, from above", where),
            panel(
                _decision(before, after, drawn), f"decision-{position}", variables, says, "Decision variables", largest
            ),
        )
    caption = f"Before dashed and thin, after solid and thick.{left_out}"
    return Figure(f"run-{position}", f"Run {run}", caption, panels)


def _paths(before: Trace, after: Trace, ugvs: Sequence[str]) -> Drawing:
    figure, axes = _axes(len(ugvs))
    for obstacle in after.scenario.obstacles.values():
        axes.plot(*obstacle.position_m[:2], marker="h", markersize=6, color=INK, linestyle="none")
    for i, ugv in enumerate(ugvs):
        for trace, how in ((before, _BEFORE), (after, _AFTER)):
            path = trace.position(ugv)[:, :2]
            axes.plot(*path[thin(path)].T, color=look(i).color, **how)
            axes.plot(*path[-1], marker=look(i).marker, markersize=5, color=look(i).color)
    _equal_scales(axes)
    rule(axes, "x, m", "y, m")
    _name(axes, ugvs)
    return figure


def _decision(before: Trace, after: Trace, ugvs: Sequence[str]) -> Drawing:
    figure, axes = _axes(len(ugvs))
    for i, ugv in enumerate(ugvs):
        for trace, how in ((before, _BEFORE), (after, _AFTER)):
            x = trace.column(f"{ugv}.decision_variable_m")
            rows = thin(x[:, None])
            axes.plot(trace.t[rows], x[rows], color=look(i).color, **how)
    axes.set_xlim(0.0, max(float(trace.t[-1]) for trace in (before, after)) or 1.0)
    axes.axhline(float(after.meta["zeta_m"]), color=MUTED, linewidth=0.8)
    rule(axes, "time, s", "decision variable, m; line: threshold after")
    _name(axes, ugvs)
    return figure


def _axes(lines: int) -> tuple[Drawing, Axes]:
    above_in = 0.1 + 0.2 * lines
    height_in = _HEIGHT_IN + above_in
    figure = Drawing(figsize=(WIDE_IN, height_in))
    return figure, figure.add_axes((0.13, 0.45 / height_in, 0.84, (_HEIGHT_IN - 0.5) / height_in))


def _equal_scales(axes: Axes) -> None:
    """Widen the limits of one axis until a metre is as long on both."""
    width_in, height_in = size_in(axes)
    spans = [np.diff(limits)[0] for limits in (axes.get_xlim(), axes.get_ylim())]
    per_inch = max(spans[0] / width_in, spans[1] / height_in)
    for limits, set_limits, length_in in (
        (axes.get_xlim(), axes.set_xlim, width_in),
        (axes.get_ylim(), axes.set_ylim, height_in),
    ):
        middle = float(np.mean(limits))
        set_limits(middle - 0.5 * per_inch * length_in, middle + 0.5 * per_inch * length_in)


def _name(axes: Axes, ugvs: Sequence[str]) -> None:
    handles = [Line2D([], [], color=look(i).color, marker=look(i).marker, markersize=5) for i in range(len(ugvs))]
    axes.legend(
        handles, [short(ugv, 24) for ugv in ugvs], loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False,
        handlelength=3.0, borderaxespad=0.0,
    )  # fmt: skip


def _apart(before: Trace, after: Trace, ugv: str) -> float:
    """Largest distance of where a UGV was at the same time, m, over the time that both runs have."""
    t = after.t[after.t <= before.t[-1]]
    now = after.position(ugv)[: len(t)]
    was = np.column_stack([np.interp(t, before.t, axis) for axis in before.position(ugv).T])
    return float(np.linalg.norm(now - was, axis=1).max(initial=0.0))


def _ends(before: Trace, after: Trace, ugv: str) -> tuple[str, str]:
    one, two = ("({:.3f}, {:.3f})".format(*trace.position(ugv)[-1, :2]) for trace in (before, after))
    return one, two


def _largest(before: Trace, after: Trace, ugvs: Sequence[str]) -> tuple[tuple[str, ...], ...]:
    return tuple(
        (ugv, *(f"{trace.column(f'{ugv}.decision_variable_m').max():.4g}" for trace in (before, after))) for ugv in ugvs
    )
