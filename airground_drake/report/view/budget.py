"""The distance budget as a picture: a bar for each kind of pair, a piece for each term."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from airground_drake.report.view import canvas

if TYPE_CHECKING:
    from airground_drake.scenario.budget import PairBudget

WIDTH_IN, BAR_IN, HEAD_IN = 7.5, 0.5, 1.0
PROMISED = "#c4ccd4"  # colour of the distance promised
CHARACTERS = 34  # characters in a line beside a bar


def drawn(rows: Sequence[tuple[str, PairBudget]]) -> str:
    """An SVG document of budgets with their names."""
    keys = [*dict.fromkeys(term.key for _, row in rows for term in row.terms)]
    with canvas.style():
        bars_in = BAR_IN * len(rows)
        height_in = HEAD_IN + bars_in
        figure = Figure(figsize=(WIDTH_IN, height_in))
        axes = figure.add_axes((0.34, 0.62 / height_in, 0.63, bars_in / height_in))
        at = range(len(rows))
        axes.barh(at, [row.promised_m for _, row in rows], height=0.55, color=PROMISED, label="promised")
        left = [row.promised_m for _, row in rows]
        for k, key in enumerate(keys):
            parts = [sum(term.metres for term in row.terms if term.key == key) for _, row in rows]
            axes.barh(at, parts, left=left, height=0.55, color=canvas.look(k).color, label=key)
            left = [before + part for before, part in zip(left, parts, strict=True)]
        for y, (_, budget) in zip(at, rows, strict=True):
            axes.annotate(f"{budget.gap_m:.3f} m", (budget.gap_m, y), (4, 0), textcoords="offset points", va="center")
        axes.set_yticks([*at], [fill(name, CHARACTERS) for name, _ in rows])
        axes.set_xlim(0.0, 1.2 * max(left))
        axes.invert_yaxis()
        axes.set_xlabel("distance between surfaces, m")
        figure.legend(loc="upper right", ncols=len(keys) + 1, frameon=False)
        return canvas.svg(figure)
