"""A picture of named lines and marked points."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure as Drawing

from airground_drake.base.arrays import Array
from airground_drake.report.figures.panels import MAX_TABLE_ROWS, Figure, Table, panel
from airground_drake.report.view import canvas

NAME_CHARS = 24  # longest name that fits beside the axes
MARKERS = "os^Dv"


class Lines(NamedTuple):
    """What is drawn."""

    title: str  # of the picture
    # x, y: names of the axes, with units.
    x: str
    y: str
    lines: Mapping[str, tuple[Array, Array]]  # (T,) across and (T,) up by name
    marks: Mapping[str, tuple[float, float]] = {}  # points by name
    log: str = ""  # the axes that are logarithmic, among "xy"

    def figure(self, number: int) -> Figure:
        """The figure beside finding `number`; call it inside `canvas.style`."""
        name = f"audit-{number}"
        return self.plate(name, f"Finding {number}", self._marked() and f"{self._marked()}.", beside=name)

    def plate(self, name: str, heading: str, caption: str, beside: str = "") -> Figure:
        """The figure with this identifier, heading and caption, beside a finding; call it inside `canvas.style`."""
        text = f"Up: {self.y}. Across: {self.x}. {self._marked()}".rstrip()
        rows = []
        for line, (x, y) in self.lines.items():
            chosen = np.unique(np.linspace(0, len(x) - 1, MAX_TABLE_ROWS // len(self.lines)).round().astype(int))
            rows += [(line, f"{x[k]:.4g}", f"{y[k]:.4g}") for k in chosen]
        rows += [(mark, f"{x:.4g}", f"{y:.4g}") for mark, (x, y) in self.marks.items()]
        table = Table(f"{self.title}, some of its points", ("line", self.x, self.y), tuple(rows))
        drawn = panel(self._drawing(), name, self.title, text, heading, table)
        return Figure(name, self.title, caption, (drawn,), beside=beside)

    def _marked(self) -> str:
        return "; ".join(f"{mark}: ({x:.3g}, {y:.3g})" for mark, (x, y) in self.marks.items())

    def _drawing(self) -> Drawing:
        drawing = Drawing(figsize=(canvas.WIDE_IN, 2.3))
        axes = drawing.add_axes((0.14, 0.19, 0.43, 0.78))
        across, up = (np.log10 if axis in self.log else np.asarray for axis in "xy")
        for position, (name, (x, y)) in enumerate(self.lines.items()):
            look, label = canvas.look(position), canvas.short(name, NAME_CHARS)
            axes.plot(across(x), up(y), color=look.color, linestyle=look.dash, label=label)
        for marker, (name, at) in zip(MARKERS, self.marks.items(), strict=False):
            axes.plot(
                across(at[0]), up(at[1]), label=canvas.short(name, NAME_CHARS), color=canvas.INK, linestyle="none",
                marker=marker, markersize=7, markerfacecolor="none", markeredgewidth=1.6, zorder=5,
            )  # fmt: skip
        axes.margins(0.04, 0.07)
        axes.set(xlim=axes.get_xlim(), ylim=axes.get_ylim())
        canvas.rule(axes, self.x, self.y, self.log)
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=8.5, handlelength=1.6)
        return drawing
