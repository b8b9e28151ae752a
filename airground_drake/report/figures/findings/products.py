"""A picture of products of matrices, cell by cell: which are defined."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing
from matplotlib.patches import Rectangle

from airground_drake.base.arrays import Array
from airground_drake.report.figures import canvas
from airground_drake.report.figures.panels import Figure, Table, panel

CELL_IN = 0.36


class Factor(NamedTuple):
    """A matrix, (rows, columns), and how it is called."""

    name: str
    values: Array

    @property
    def size(self) -> str:
        """Rows and columns, as written."""
        return " x ".join(map(str, self.values.shape))


class Products(NamedTuple):
    """Products of two factors by name."""

    title: str
    products: Mapping[str, tuple[Factor, Factor]]

    def figure(self, number: int) -> Figure:
        """The figure beside finding `number`; call it inside `canvas.style`."""
        name = f"audit-{number}"
        rows = tuple(
            (each, left.name, left.size, right.name, right.size, _says(left, right))
            for each, (left, right) in self.products.items()
        )
        text = "; ".join(
            f"{each}: {left} ({size}) times {right} ({of}) is {says}" for each, left, size, right, of, says in rows
        )
        columns = ("formula", "first factor", "rows x columns", "second factor", "rows x columns", "product")
        table = Table(f"{self.title}, sizes", columns, rows)
        drawn = panel(_drawing(self), name, self.title, text, f"Finding {number}", table)
        return Figure(name, self.title, f"{text}.", (drawn,), beside=name)


def _says(left: Factor, right: Factor) -> str:
    (rows, inner), (other, columns) = left.values.shape, right.values.shape
    return f"defined, {rows} x {columns}" if inner == other else "not defined"


def _drawing(shown: Products) -> Drawing:
    width, height = canvas.WIDE_IN / CELL_IN, 5.2 * len(shown.products)
    drawing = Drawing(figsize=(canvas.WIDE_IN, height * CELL_IN))
    axes = drawing.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(0.0, width)
    axes.set_ylim(-height, 0.0)
    for position, (name, (left, right)) in enumerate(shown.products.items()):
        middle = -5.2 * position - 2.0
        _cells(axes, left, 3.8, middle)
        _cells(axes, right, 6.8, middle)
        for at, text, weight in ((0.1, name, "normal"), (5.2, "·", "bold"), (8.4, _says(left, right), "bold")):
            axes.text(at, middle, text, va="center", fontweight=weight)
    return drawing


def _cells(axes: Axes, factor: Factor, centre: float, middle: float) -> None:
    """Draw a factor with its name and size below."""
    rows, columns = factor.values.shape
    for (row, column), value in np.ndenumerate(factor.values):
        corner = centre - columns / 2.0 + column, middle + rows / 2.0 - row - 1.0
        axes.add_patch(Rectangle(corner, 1.0, 1.0, facecolor="#f3f3f3", edgecolor=canvas.INK, linewidth=1.0))
        axes.text(corner[0] + 0.5, corner[1] + 0.5, f"{value:.2g}", ha="center", va="center", fontsize=8)
    axes.text(centre, middle - rows / 2.0 - 0.15, f"{factor.name}\n{factor.size}", ha="center", va="top")
