"""The distance budget as a picture: a bar for each kind of pair, a piece for each term."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from typing import TYPE_CHECKING

import pandas as pd
from matplotlib.figure import Figure

from airground_drake.report.view import canvas

if TYPE_CHECKING:
    from airground_drake.scenario.budget import PairBudget

WIDTH_IN, BAR_IN, HEAD_IN = 7.5, 0.5, 1.0
PROMISED = "#c4ccd4"  # colour of the distance promised
NAMES = {"ugv": "two UGVs", "air_ground": "UGV and UAV", "obstacle": "at rest", "moving": "may move"}
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


def drawn_by_value(rows: pd.DataFrame, key: str) -> str:
    """An SVG document of distances in the law, and of arrivals, by the values of a key."""
    # rows: from `study.campaign.vary`, whose columns of a kind of pair end with "promised_m" and "law_m"
    rows = rows[rows["run"] != ""]  # without values that the scenario cannot have
    values = rows.drop_duplicates("index")
    all_there = rows["arrival_s"].where(rows["arrived"] == rows["ugvs"])
    with canvas.style():
        figure = Figure(figsize=(WIDTH_IN, 3.2))
        costs, arrivals = (figure.add_axes((left, 0.32, 0.4, 0.58)) for left in (0.08, 0.57))
        for position, law in enumerate(rows.columns[rows.columns.str.endswith("law_m")]):
            kind = law.split()[0]
            look = canvas.look(position)
            costs.plot(values[key], values[law], color=look.color, marker=look.marker, label=NAMES[kind])
            costs.plot(values[key], values[f"{kind} promised_m"], color=look.color, linestyle=(0, (2, 2)))
        for position, (run, of_run) in enumerate(rows.groupby("run")):
            look = canvas.look(position)
            times = all_there[of_run.index]
            arrivals.plot(of_run[key], times, color=look.color, marker=look.marker, label=f"run {run}")
        costs.set_title("distance in the law (dashed: promised), m")
        arrivals.set_title("last arrival, where all arrive, s")
        for axes in (costs, arrivals):
            axes.set_xlabel(key)
            axes.set_ylim(0.0, 1.1 * max(axes.dataLim.y1, 0.1))
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.24), ncols=3, frameon=False, fontsize=8.5)
        return canvas.svg(figure)
