"""Shared by all figures: looks that do not rely on colour, labels beside the data, reproducible SVG."""

import io
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from airground_drake.base.arrays import Array, Flags, Indices

MAX_POINTS = 600  # maximum number of points of a line: two per pixel of a panel

FAR = 1_000.0  # limits of an axis are far from 0 if they are so many times larger than what is between them

# Smallest width of a histogram, relative and absolute: floating point divides it, and numbers on its axis differ.
NARROWEST, LEAST = 1e-4, 1e-3

# Widths of panels on half and on the whole page; maximum height of a map; inches.
WIDE_IN, FULL_IN, TALLEST_IN = 4.4, 11.6, 8.0

INK, MUTED, ALARM, GOOD = "#1a1a1a", "#5a5a5a", "#b00020", "#0b5d1e"
_POINTS_PER_INCH = 72.0
_FONT_PT = 9.0
_GRID: Any = {"color": "#dddddd", "linewidth": 0.6, "zorder": 0.5}
_NUMBERS: Any = {"fontsize": 8.5}
# The look of a band that distances must not enter.
FORBIDDEN: Any = {"facecolor": "#eeeeee", "hatch": "///", "edgecolor": "#d4d4d4", "linewidth": 0.0, "zorder": 0}

# Text stays text (fonttype 'none'): it can be selected, searched and enlarged, it takes a tenth of the bytes of
# outlines, and it does not depend on the glyphs of the matplotlib release. A reader without the first font sees
# another one, so labels get room. Names come from the user: mathtext is off.
_RC: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "airground_drake",
    "text.parse_math": False,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana", "sans-serif"],
    "font.size": _FONT_PT,
    "axes.titlesize": _FONT_PT,
    "axes.titlelocation": "left",
    "axes.titley": 1.0,  # fixed: to find a place takes a sixth of the drawing time
    "axes.edgecolor": MUTED,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "hatch.linewidth": 0.6,
    "lines.linewidth": 1.6,
    "text.color": INK,
}


class Look(NamedTuple):
    """Colour, dash pattern and marker of a line."""

    color: str
    dash: Any
    marker: str


# Six looks, distinct in greyscale and for colour-blind readers by dash and marker; reused in turn.
LOOKS = (
    Look("#0060a8", "-", "o"),
    Look("#b34700", (0, (6, 2)), "s"),
    Look("#00705a", (0, (5, 1.5, 1, 1.5)), "^"),
    Look("#8b3a8b", (0, (1.2, 1.2)), "D"),
    Look("#6b5900", (0, (9, 2, 1, 2, 1, 2)), "v"),
    Look("#303030", (0, (3, 3)), "P"),
)
UAV_LOOK = Look("#666666", (0, (3, 2)), "d")

# Colours of the figures and the block diagram on a dark page.
DARK = {
    INK: "#e8e8e8", MUTED: "#b0b4bb", ALARM: "#ff8a9a", GOOD: "#8fe3a1",
    "#ffffff": "#16181c", "#f3f3f3": "#22252b", "#eeeeee": "#2a2d34", "#dddddd": "#3a3e46", "#d4d4d4": "#4a4e57",
    "#cfe6dc": "#1f4436",
    "#0060a8": "#6db8ff", "#b34700": "#ff9d5c", "#00705a": "#4fd1b0", "#8b3a8b": "#e08ee0", "#6b5900": "#d9c24d",
    "#303030": "#d0d0d0", "#666666": "#a8a8a8",
    "black": "#e8e8e8", "white": "#16181c",
    "#e1ebf6": "#1c2c3e", "#e7f1e1": "#1f3323", "#fbefdc": "#3d3020",
}  # fmt: skip


def look(position: int) -> Look:
    return LOOKS[position % len(LOOKS)]


def short(name: str, limit: int = 18) -> str:
    """A name cut in the middle to fit beside a line; names of a team differ at their ends."""
    head = (limit - 1) // 2
    return name if len(name) <= limit else f"{name[:head]}…{name[head + 1 - limit :]}"


@contextmanager
def style(settings: Mapping[Any, Any] | None = None) -> Iterator[None]:
    """Context with the settings of all figures and `settings`, independent of the user's own."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update({**_RC, **(settings or {})})
        yield


def svg(figure: Figure) -> str:
    """SVG document of a figure, without date and version; call it inside `style`."""
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    return buffer.getvalue()


def stretches(active: Flags) -> Indices:
    """First row and the row after the last one of each stretch in which a signal (T,) is true, (n, 2)."""
    return np.flatnonzero(np.diff(active.astype(np.int8), prepend=0, append=0)).reshape(-1, 2)


def thin(values: Array, limit: int = MAX_POINTS) -> Indices:
    """Indices of at most `limit` rows of (T,) or (T, m), among them the ends and the extremes of each stretch."""
    rows = len(values)
    if rows <= limit:
        return np.arange(rows)
    columns = values.reshape(rows, -1).T
    buckets = np.array_split(np.arange(1, rows - 1), max(1, (limit - 2) // (2 * len(columns))))
    kept = {0, rows - 1}
    for bucket in buckets:
        for column in columns:
            kept.update((int(bucket[column[bucket].argmin()]), int(bucket[column[bucket].argmax()])))
    return np.array(sorted(kept), dtype=np.intp)


def interval(values: Array) -> tuple[float, float]:
    """Least and largest value; around nearly equal ones a wider interval: a 1e-4th of them, 1 mm or 1 ms at least."""
    low, high = float(values.min()), float(values.max())
    missing = max(LEAST, NARROWEST * max(abs(low), abs(high))) - (high - low)
    return low - max(missing, 0.0) / 2.0, high + max(missing, 0.0) / 2.0


def time_line(axes: Axes, t: Array, values: Array, appearance: Look) -> None:
    rows = thin(values)
    axes.plot(
        t[rows], values[rows], color=appearance.color, linestyle=appearance.dash, marker=appearance.marker,
        markevery=max(1, len(rows) // 8), markersize=4.5,
    )  # fmt: skip


def level(axes: Axes, value: float, dash: Any) -> None:
    axes.axhline(value, color=INK, linestyle=dash, linewidth=1.0)


def label_right(axes: Axes, labels: Sequence[tuple[float, str, str]]) -> None:
    """Labels (value, text, colour) right of the axes, at their values if there is room."""
    bottom, top = axes.get_ylim()
    order = sorted(range(len(labels)), key=lambda k: labels[k][0])
    line = 1.25 * _FONT_PT / _POINTS_PER_INCH / size_in(axes)[1]  # between lines of text, as a share of the height
    places = spread([(labels[k][0] - bottom) / (top - bottom) for k in order], line)
    for k, place in zip(order, places, strict=True):
        _, text, color = labels[k]
        axes.text(1.015, place, text, color=color, transform=axes.transAxes, va="center", ha="left", clip_on=False)


def spread(places: Sequence[float], gap: float) -> list[float]:
    """Ascending places moved as little as needed to be `gap` apart and, while there is room, inside [0, 1]."""
    result: list[float] = []
    for place in places:
        result.append(max(place, result[-1] + gap) if result else max(place, 0.0))
    ceiling = 1.0
    for k in range(len(result) - 1, -1, -1):
        result[k] = min(result[k], ceiling)
        ceiling = result[k] - gap
    return result


def rule(axes: Axes, x: str, y: str, log: str = "", numbers: Mapping[float, str] | None = None) -> None:
    """Draw grid lines, numbers and axis labels, once the limits are set; an empty label leaves the numbers out."""
    # Values on the axes named in `log` are logarithms to base 10; the numbers show what they are the logarithms of.
    # `numbers`, by their places, replace those across. Far from 0, numbers count from a round one in the label. These
    # are few artists: matplotlib's own ticks would take nearly half of the drawing time.
    width_in, height_in = size_in(axes)
    axes.set_xticks([])
    axes.set_yticks([])
    from_y, y = _counted_from(axes.get_ylim(), y)
    if numbers is None:
        from_x, x = _counted_from(axes.get_xlim(), x)
        numbers = {at: _number(at - from_x, log="x" in log) for at in ticks_of(axes.get_xlim(), 6, whole="x" in log)}
    across = axes.get_xaxis_transform()
    axes.vlines(list(numbers), 0.0, 1.0, transform=across, **_GRID)
    for at, written in numbers.items() if x else ():
        axes.text(at, -0.05 / height_in, written, transform=across, ha="center", va="top", **_NUMBERS)
    axes.text(0.5, -0.22 / height_in, x, transform=axes.transAxes, ha="center", va="top")
    if not y:
        return
    rows = ticks_of(axes.get_ylim(), max(2, min(7, round(3.5 * height_in))), whole="y" in log)
    up = axes.get_yaxis_transform()
    axes.hlines(rows, 0.0, 1.0, transform=up, **_GRID)
    for at in rows:
        written = _number(at - from_y, log="y" in log)
        axes.text(-0.05 / width_in, at, written, transform=up, ha="right", va="center", **_NUMBERS)
    axes.text(-0.36 / width_in, 0.5, y, transform=axes.transAxes, ha="right", va="center", rotation=90)


def ticks_of(limits: tuple[float, float], count: int, *, whole: bool = False) -> list[float]:
    """Round numbers within limits, about as many as `count`."""
    low, high = limits
    slack = 1e-9 * (high - low)
    ticks = MaxNLocator(count, steps=[1, 2, 5, 10], integer=whole).tick_values(low, high)
    return [float(round(at, 12)) for at in ticks if low - slack <= at <= high + slack]


def _counted_from(limits: tuple[float, float], label: str) -> tuple[float, str]:
    """A round number near both limits, if they are far from 0, else 0; and the label that says so."""
    low, high = limits
    if max(abs(low), abs(high)) < FAR * (high - low):
        return 0.0, label
    step = 10.0 ** (math.ceil(math.log10(high - low)) + 1)
    origin = step * round((low + high) / 2.0 / step)
    what, comma, unit = label.partition(",")
    sign = "+" if origin < 0.0 else "\N{MINUS SIGN}"
    return origin, f"{what} {sign} {abs(origin):.12g}{comma}{unit}" if label else ""


def _number(at: float, *, log: bool) -> str:
    return f"{10.0**at if log else at:g}".replace("-", "\N{MINUS SIGN}")


def size_in(axes: Axes) -> tuple[float, float]:
    figure, box = axes.get_figure(root=True), axes.get_position(original=True)
    width_in, height_in = figure.get_size_inches() if isinstance(figure, Figure) else (1.0, 1.0)
    return box.width * width_in, box.height * height_in
