"""A figure of a report: panels of inline SVG, each with a table of its data."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from matplotlib.figure import Figure as Drawing

from airground_drake.base.arrays import Array, Indices
from airground_drake.report.view import canvas, svg
from airground_drake.sim.trace import Trace

MAX_TABLE_ROWS = 31  # maximum number of rows of a data table; the trace has all rows


@dataclass(frozen=True)
class Table:
    """Data of a panel as text; the first column is the heading of the row."""

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Panel:
    """One drawing: inline SVG with an accessible name and description, and its data."""

    heading: str
    svg: str
    table: Table
    drawing: Drawing = field(compare=False, repr=False)  # source of the SVG, for files of other formats

    def __getstate__(self) -> dict[str, object]:
        """Omit the drawing, which pages do not need and which is slow to pickle."""
        return {**vars(self), "drawing": None}


@dataclass(frozen=True)
class Figure:
    """A figure."""

    id: str  # unique in the page
    title: str  # its heading
    caption: str  # what to see
    panels: tuple[Panel, ...]  # its drawings
    beside: str = ""  # place in the page: a section, a claim's identifier or `audit-<item>`; '': `html.PLACES`
    look: str = ""  # "wide" for a panel on the whole width


def panel(drawing: Drawing, name: str, title: str, says: str, heading: str, table: Table) -> Panel:
    # `name` is unique in the page; `title` and `says` are for readers who cannot see it.
    return Panel(heading, svg.inline(canvas.svg(drawing), name, title, says), table, drawing)


def spread(count: int, most: int = MAX_TABLE_ROWS) -> Indices:
    """At most `most` of `count` rows, evenly spread, including the ends."""
    return np.unique(np.linspace(0, count - 1, most).round().astype(np.intp))


def series(trace: Trace, caption: str, columns: Mapping[str, Array]) -> Table:
    """A few dozen rows of columns (T,), evenly spread over the run; a cell is empty where there is no value."""
    rows = spread(len(trace.t))
    cells = tuple(
        (f"{trace.t[k]:.2f}", *("" if np.isnan(values[k]) else f"{values[k]:.3f}" for values in columns.values()))
        for k in rows
    )
    return Table(f"Run {trace.run}: {caption}", ("t, s", *columns), cells)
