"""A figure of a report: panels of inline SVG, each with a table of its data."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure as Drawing

from airground_drake.arrays import Array
from airground_drake.registry import METHODS
from airground_drake.report.figures import canvas, svg
from airground_drake.trace import Trace

MAX_TABLE_ROWS = 31
"""Rows of a data table at most; all of them are in the trace."""


@dataclass(frozen=True)
class Table:
    """Data of a panel: cells are text, the first column heads its row."""

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Panel:
    """One drawing: inline SVG with an accessible name and description, and its data."""

    heading: str
    svg: str
    table: Table
    tracks: Mapping[str, Any] | None = None
    """Of a drawing of the ground plane: where the robots are in it, see `report.scrubber`."""


@dataclass(frozen=True)
class Figure:
    """A figure.

    Attributes:
        id: unique in the page.
        title: its heading.
        caption: what to see.
        panels: its drawings.
        beside: what it is shown beside, a claim's identifier, `audit-<item>` or `attention-<item>`; '' for the
            section of figures.
        wide: whether each panel takes the whole width.
    """

    id: str
    title: str
    caption: str
    panels: tuple[Panel, ...]
    beside: str = ""
    wide: bool = False


def per_run(
    kind: str,
    runs: Mapping[str, Trace],
    drawing: Callable[[Trace], Drawing],
    describe: Callable[[Trace], str],
    table: Callable[[Trace], Table],
    scale: float = 0.0,
    tracks: Callable[[Drawing, Trace], Mapping[str, Any]] | None = None,
) -> tuple[Panel, ...]:
    """One panel per run; `scale` as of `svg.inline`."""
    panels = []
    for position, (name, trace) in enumerate(runs.items()):
        method = str(trace.meta["method"])
        heading = f"Run {name}: method ({method}), {METHODS[method].says}"
        title = f"{kind} of run {name}"
        picture = drawing(trace)
        text = svg.inline(canvas.svg(picture), f"{kind}-{position}", title, describe(trace), scale=scale)
        panels.append(Panel(heading, text, table(trace), tracks(picture, trace) if tracks else None))
    return tuple(panels)


def series(trace: Trace, caption: str, columns: Mapping[str, Array]) -> Table:
    """A few dozen rows of columns (T,), evenly spread over the run."""
    rows = np.unique(np.linspace(0, len(trace.t) - 1, MAX_TABLE_ROWS).round().astype(int))
    cells = tuple((f"{trace.t[k]:.2f}", *(f"{values[k]:.3f}" for values in columns.values())) for k in rows)
    return Table(f"Run {trace.run}: {caption}", ("t, s", *columns), cells)
