"""The picture of a chart: named lines and marked points."""

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure as Drawing

from airground_drake.report.figures.panels import MAX_TABLE_ROWS, Figure, Table, panel
from airground_drake.report.view import canvas
from airground_drake.verify.finding import Chart

NAME_CHARS = 24  # longest name that fits beside the axes
MARKERS = "os^Dv"


def of_finding(chart: Chart, number: int) -> Figure:
    """The figure beside finding `number` about the paper; call it inside `canvas.style`."""
    marked, name = _marked(chart), f"audit-{number}"
    return of_chart(replace(chart, caption=marked and f"{marked}."), name, f"Finding {number}", beside=name)


def of_chart(chart: Chart, name: str, heading: str, beside: str) -> Figure:
    """The figure with this identifier and heading, at a place of the page; call it inside `canvas.style`."""
    text = f"Up: {chart.y}. Across: {chart.x}. {_marked(chart)}".rstrip()
    rows = []
    for line, (x, y) in chart.lines.items():
        chosen = np.unique(np.linspace(0, len(x) - 1, MAX_TABLE_ROWS // len(chart.lines)).round().astype(int))
        rows += [(line, f"{x[k]:.4g}", f"{y[k]:.4g}") for k in chosen]
    rows += [(mark, f"{x:.4g}", f"{y:.4g}") for mark, (x, y) in chart.marks.items()]
    table = Table(f"{chart.title}, some of its points", ("line", chart.x, chart.y), tuple(rows))
    drawn = panel(_drawing(chart), name, chart.title, text, heading, table)
    return Figure(name, chart.title, chart.caption, (drawn,), beside=beside)


def _marked(chart: Chart) -> str:
    return "; ".join(f"{mark}: ({x:.3g}, {y:.3g})" for mark, (x, y) in chart.marks.items())


def _drawing(chart: Chart) -> Drawing:
    drawing = Drawing(figsize=(canvas.WIDE_IN, 2.3))
    axes = drawing.add_axes((0.14, 0.19, 0.43, 0.78))
    across, up = (np.log10 if axis in chart.log else np.asarray for axis in "xy")
    for position, (name, (x, y)) in enumerate(chart.lines.items()):
        look, label = canvas.look(position), canvas.short(name, NAME_CHARS)
        axes.plot(across(x), up(y), color=look.color, linestyle=look.dash, label=label)
    for marker, (name, at) in zip(MARKERS, chart.marks.items(), strict=False):
        axes.plot(
            across(at[0]), up(at[1]), label=canvas.short(name, NAME_CHARS), color=canvas.INK, linestyle="none",
            marker=marker, markersize=7, markerfacecolor="none", markeredgewidth=1.6, zorder=5,
        )  # fmt: skip
    axes.margins(0.04, 0.07)
    axes.set(xlim=axes.get_xlim(), ylim=axes.get_ylim())
    canvas.rule(axes, chart.x, chart.y, chart.log)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=8.5, handlelength=1.6)
    return drawing
