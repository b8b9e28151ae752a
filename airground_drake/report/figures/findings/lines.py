"""A picture of lines, each by its name, and of marked points; what is what stands beside it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from airground_drake.base.arrays import Array
from airground_drake.report.figures import canvas
from airground_drake.report.figures.panels import MAX_TABLE_ROWS, Figure, Table, panel

NAME_CHARS = 24
"""What fits beside the lines."""
MARKERS = "os^Dv"


class Lines(NamedTuple):
    """What is drawn.

    Attributes:
        title: of the picture.
        x, y: what is on the axes, with units.
        lines: (T,) across and (T,) up by name.
        marks: points by name.
        log: the axes that are logarithmic, among "xy".
    """

    title: str
    x: str
    y: str
    lines: Mapping[str, tuple[Array, Array]]
    marks: Mapping[str, tuple[float, float]] = {}
    log: str = ""

    def figure(self, number: int) -> Figure:
        """The figure beside finding `number`; call it inside `canvas.style`."""
        name = f"audit-{number}"
        return self.plate(name, f"Finding {number}", self._marked() and f"{self._marked()}.", beside=name)

    def plate(self, name: str, heading: str, caption: str, beside: str = "") -> Figure:
        """The figure with this identifier, heading and caption, beside a finding; inside `canvas.style`."""
        text = f"Up: {self.y}. Across: {self.x}. {self._marked()}".rstrip()
        rows = []
        for line, (x, y) in self.lines.items():
            chosen = np.unique(np.linspace(0, len(x) - 1, MAX_TABLE_ROWS // len(self.lines)).round().astype(int))
            rows += [(line, f"{x[k]:.4g}", f"{y[k]:.4g}") for k in chosen]
        rows += [(mark, f"{x:.4g}", f"{y:.4g}") for mark, (x, y) in self.marks.items()]
        table = Table(f"{self.title}, some of its points", ("line", self.x, self.y), tuple(rows))
        drawn = panel(_drawing(self), name, self.title, text, heading, table)
        return Figure(name, self.title, caption, (drawn,), beside=beside)

    def _marked(self) -> str:
        return "; ".join(f"{mark}: ({x:.3g}, {y:.3g})" for mark, (x, y) in self.marks.items())


def _drawing(shown: Lines) -> Drawing:
    drawing = Drawing(figsize=(canvas.WIDE_IN, 2.3))
    axes = drawing.add_axes((0.14, 0.19, 0.47, 0.78))
    lines = {name: _scaled(shown.log, *line) for name, line in shown.lines.items()}
    marks = {name: _scaled(shown.log, *at) for name, at in shown.marks.items()}
    for position, (x, y) in enumerate(lines.values()):
        look = canvas.look(position)
        axes.plot(x, y, color=look.color, linestyle=look.dash)
    for at, marker in zip(marks.values(), MARKERS, strict=False):
        axes.plot(*at, **_mark(marker))
    across, up = (
        np.concatenate([np.atleast_1d(each[k]) for each in (*lines.values(), *marks.values())]) for k in (0, 1)
    )
    for limit, values, share in ((axes.set_xlim, across, 0.03), (axes.set_ylim, up, 0.07)):
        pad = share * float(np.ptp(values) or 1.0)
        limit(float(values.min()) - pad, float(values.max()) + pad)
    canvas.rule(axes, shown.x, shown.y, shown.log)
    _key(axes, lines, marks)
    return drawing


def _scaled(log: str, x: Array | float, y: Array | float) -> tuple[Array, Array]:
    return np.log10(x) if "x" in log else np.asarray(x), np.log10(y) if "y" in log else np.asarray(y)


def _mark(marker: str) -> dict[str, Any]:
    return {
        "marker": marker, "markersize": 7, "markerfacecolor": "none", "markeredgewidth": 1.6,
        "linestyle": "none", "color": canvas.INK, "zorder": 5, "clip_on": False,
    }  # fmt: skip


def _key(axes: Axes, lines: Mapping[str, tuple[Array, Array]], marks: Mapping[str, tuple[Array, Array]]) -> None:
    """A sample of each line and mark with its name, right of the axes, near where the line ends or the mark is."""
    bottom, top = axes.get_ylim()
    entries: list[tuple[float, str, canvas.Look | str]] = [
        *((float(y[-1]), name, canvas.look(k)) for k, (name, (_, y)) in enumerate(lines.items())),
        *((float(y), name, marker) for (name, (_, y)), marker in zip(marks.items(), MARKERS, strict=False)),
    ]
    entries.sort(key=lambda entry: entry[0])
    places = canvas.spread([(up - bottom) / (top - bottom) for up, _, _ in entries], canvas.line_gap(axes))
    for (_, name, look), at in zip(entries, places, strict=True):
        sample: dict[str, Any] = {"transform": axes.transAxes, "clip_on": False}
        if isinstance(look, canvas.Look):
            axes.plot((1.03, 1.15), (at, at), color=look.color, linestyle=look.dash, **sample)
        else:
            axes.plot(1.09, at, **_mark(look) | sample)
        color = look.color if isinstance(look, canvas.Look) else canvas.INK
        axes.text(1.18, at, canvas.short(name, NAME_CHARS), color=color, va="center", ha="left", fontsize=8.5, **sample)
