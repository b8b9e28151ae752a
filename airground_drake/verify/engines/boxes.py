"""Lower bounds of the distances of a run, so that exact computations are needed for near pairs only.

Rows are cut into blocks. Between rows a robot moves straight, so on a block it stays in the box around its rows. Two
bodies are at least as far apart as their boxes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array

ROWS = 32
"""Of a block."""
AT_ONCE = 300_000
"""Pairs of boxes that are compared together, so that they fit into the memory."""
ROUNDING_M = 1e-9
"""What a bound allows for rounding, m: distances up to 1e4 m err by 1e-12 m."""

Indices = npt.NDArray[np.intp]


class Boxes(NamedTuple):
    """Around K things on B blocks: corners (K, B, 3), m."""

    low: Array
    high: Array


def boxes_of(positions: Array) -> Boxes:
    """Boxes around K things that are at places (K, T, 3), m, at the rows and on straight lines between them."""
    starts = np.arange(0, max(positions.shape[1] - 1, 1), ROWS)
    ends = positions[:, np.append(starts[1:], positions.shape[1] - 1)]  # the row at which the next block begins
    low, high = (side.reduceat(positions, starts, axis=1) for side in (np.minimum, np.maximum))
    return Boxes(np.minimum(low, ends), np.maximum(high, ends))


def apart_at_least(boxes: Boxes, first: Indices, second: Indices) -> Array:
    """Bounds from below of the distances of P pairs of things, given by their numbers (P,): (P,), m."""
    found = np.empty(len(first))
    for some in np.array_split(np.arange(len(first)), len(first) * boxes.low.shape[1] // AT_ONCE + 1):
        one, other = first[some], second[some]
        gap = np.maximum(boxes.low[one] - boxes.high[other], boxes.low[other] - boxes.high[one])
        found[some] = np.sqrt(np.square(np.maximum(gap, 0.0)).sum(axis=2)).min(axis=1)
    return found - ROUNDING_M
