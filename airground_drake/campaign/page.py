"""campaign.html: one offline page that renders the evidence of a campaign; no JavaScript."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from jinja2 import Environment
from markupsafe import Markup
from matplotlib.figure import Figure

from airground_drake.arrays import Array
from airground_drake.campaign.rows import JUDGED
from airground_drake.report.figures import canvas, svg
from airground_drake.report.html import number
from airground_drake.report.templating import environment_of

BARS = 40
SHOWN = ("SAFE-TRACE", "SAFE-HYP", "LIVE-GOAL")
"""Claims whose margins are drawn."""


def page(found: dict[str, Any], table: pd.DataFrame) -> str:
    """The page.

    Args:
        found: of `evidence.evidence`, with name, title, spec and stopped (the last draw that counts, or None).
        table: the rows that it is of.
    """
    return _environment().get_template("campaign.html.j2").render(found=found, figures=_figures(found, table))


class Drawing(NamedTuple):
    """A figure and what it shows."""

    title: str
    svg: Markup


def _figures(found: dict[str, Any], table: pd.DataFrame) -> list[Drawing]:
    judged = table[table["ended"] == JUDGED]
    drawn = []
    for (run, claim), rows in judged[judged["claim"].isin(SHOWN)].groupby(["run", "claim"]):
        values = rows["margin"].dropna().to_numpy()
        if len(values):
            drawn.append(
                _histogram(values, f"{claim} in run {run}: margin", "margin, " + str(rows["unit"].iloc[0]), 0.0)
            )
    runs = judged.drop_duplicates(["index", "run"])
    marks = {each["run"]: each["first_trigger_s"].get("mark") for each in found["times"]}
    for run, rows in runs.groupby("run"):
        values = rows["first_trigger_s"].dropna().to_numpy()
        if len(values):
            drawn.append(_histogram(values, "Run " + str(run) + ": first trigger", "time, s", marks.get(str(run))))
    return [
        Drawing(title, Markup(svg.inline(text, f"figure{i}", title, title))) for i, (title, text) in enumerate(drawn)
    ]


def _histogram(values: Array, title: str, label: str, mark: float | None) -> tuple[str, str]:
    """How often what was measured; a dashed line at the mark, if there is one."""
    with canvas.style():
        figure = Figure(figsize=(canvas.WIDE_IN, 2.2))
        axes = figure.add_axes((0.16, 0.26, 0.8, 0.6))
        low, high = float(values.min()), float(values.max())
        span = max(high - low, 1e-9 * max(1.0, abs(high)))
        counts, edges = np.histogram(values, bins=BARS, range=(low - 0.01 * span, high + 0.01 * span))
        axes.stairs(counts, edges, fill=True, color="#9db8d2", edgecolor=canvas.INK, linewidth=0.6)
        ends = [edges[0], edges[-1], *([] if mark is None else [mark])]
        reach = 0.03 * (max(ends) - min(ends))
        axes.set_xlim(min(ends) - reach, max(ends) + reach)
        axes.set_ylim(0.0, 1.08 * max(1, counts.max()))
        if mark is not None:
            axes.axvline(mark, color=canvas.ALARM, linestyle=(0, (4, 2)), linewidth=1.2)
            axes.text(
                mark,
                1.0,
                f" {mark:g}",
                color=canvas.ALARM,
                transform=axes.get_xaxis_transform(),
                va="bottom",
                ha="center",
            )
        canvas.rule(axes, label, "runs")
        return title, canvas.svg(figure)


@cache
def _environment() -> Environment:
    environment = environment_of("airground_drake.campaign", "airground_drake.report")
    environment.filters["num"] = number
    return environment
