"""Places labels beside their points, clear of each other and of lines and points."""

import contextlib
import io
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import textalloc
from matplotlib.axes import Axes

from airground_drake.base.arrays import Array
from airground_drake.report.view.canvas import INK, MUTED, size_in, thin

MAX_LINE_POINTS = 80  # number of points of a line that labels avoid
# Places that are tried for a label, and their greatest distance from its point, as a share of the axes.
CANDIDATES, FARTHEST = 1200, 0.3
MARK_PT = 4.0  # half the size of the marks that labels leave free, points
BOX = {"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.5}


class Label(NamedTuple):
    """A text beside a point of the plane."""

    at: Array
    text: str
    color: str = INK
    size_pt: float = 8.0
    weight: str = "normal"


def place(axes: Axes, labels: Sequence[Label], lines: Sequence[Array]) -> None:
    """Write the labels, the first ones nearest to their points; a thin line leads to a label that had to move."""
    # lines: (T, 2)
    # labels: labels of points outside the axes are left out.
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    labels = [label for label in labels if left < label.at[0] < right and bottom < label.at[1] < top]
    if not labels:
        return
    at = np.array([label.at[:2] for label in labels])
    figure, (width_in, _) = axes.get_figure(root=True), size_in(axes)
    mark = MARK_PT * (figure.dpi if figure else 72.0) / 72.0
    kept = [line[thin(line, MAX_LINE_POINTS), :2] for line in lines]
    with contextlib.redirect_stdout(io.StringIO()):  # it prints where it finds no free place
        textalloc.allocate(
            axes, at[:, 0], at[:, 1], [label.text for label in labels], x_scatter=at[:, 0], y_scatter=at[:, 1],
            x_lines=[line[:, 0] for line in kept], y_lines=[line[:, 1] for line in kept],
            scatter_sizes=[np.array(mark)] * len(at),
            min_distance=1.5 * MARK_PT / (72.0 * width_in), max_distance=FARTHEST, nbr_candidates=CANDIDATES,
            textsize=[label.size_pt for label in labels], textcolor=[label.color for label in labels],
            fontweight=[label.weight for label in labels], linecolor=MUTED, linewidth=0.6, zorder=5, bbox=BOX,
        )  # fmt: skip
