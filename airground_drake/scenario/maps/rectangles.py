"""Occupied cells as few rectangles, which may overlap."""

import numpy as np
from numpy.typing import NDArray

from airground_drake.base.arrays import Flags

MOST_CELLS = 16_000_000  # most cells of a map

Cells = Flags  # a value for each cell, (rows, columns)
# First row, last row + 1, first column, last column + 1 of each rectangle of cells, (n, 4).
Rectangles = NDArray[np.int64]


def covering(occupied: Cells) -> Rectangles:
    """Rectangles whose union is the set of occupied cells; `occupied` (rows, columns)."""
    # Equal runs of occupied cells in consecutive rows are merged. Each rectangle is then extended up and down as far as
    # all its cells are occupied, and those whose cells lie in others are left out. On maps of buildings that gives
    # about 85 % of the merged runs.
    sums = _sums(occupied)
    rectangles = np.unique(_extended(_merged_runs(occupied), sums), axis=0)
    return _needed(rectangles, occupied.shape)


def _merged_runs(occupied: Cells) -> Rectangles:
    """The occupied cells, each in one rectangle: runs of a row, merged with equal runs of the next rows."""
    steps = np.diff(np.pad(occupied.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    row, left = np.nonzero(steps == 1)
    right = np.nonzero(steps == -1)[1]
    order = np.lexsort((row, right, left))
    runs = np.stack([row, left, right], axis=1)[order]
    first = np.any(np.diff(runs, axis=0, prepend=-2) != (1, 0, 0), axis=1)  # not the run of the row before, continued
    begin = np.flatnonzero(first)
    end = np.append(begin[1:], len(runs))[: len(begin)]
    return np.stack([runs[begin, 0], runs[begin, 0] + end - begin, runs[begin, 1], runs[begin, 2]], axis=1)


def _sums(of: Cells) -> NDArray[np.int32]:
    """Numbers of true cells in the rows before i and the columns before j, (rows + 1, columns + 1)."""
    sums = np.zeros((of.shape[0] + 1, of.shape[1] + 1), np.int32)
    np.cumsum(of, axis=0, out=sums[1:, 1:])
    return np.cumsum(sums, axis=1, out=sums)


def _counts(sums: NDArray[np.int32], rectangles: Rectangles) -> NDArray[np.int32]:
    """Number of true cells in each rectangle, (n,)."""
    top, bottom, left, right = rectangles.T
    return sums[bottom, right] - sums[top, right] - sums[bottom, left] + sums[top, left]


def _extended(rectangles: Rectangles, sums: NDArray[np.int32]) -> Rectangles:
    """Each rectangle of occupied cells, with all rows above and below it through which it can be extended."""
    for side, farthest in ((0, 0), (1, len(sums) - 1)):
        good, bad = rectangles.copy(), rectangles.copy()
        bad[:, side] = farthest + (1 if side else -1)
        while len(unsure := np.flatnonzero(np.abs(bad[:, side] - good[:, side]) > 1)):
            tried = good[unsure]
            tried[:, side] = (good[unsure, side] + bad[unsure, side]) // 2
            full = _counts(sums, tried) == _areas(tried)
            good[unsure[full]] = tried[full]
            bad[unsure[~full]] = tried[~full]
        rectangles = good
    return rectangles


def _areas(rectangles: Rectangles) -> NDArray[np.int64]:
    top, bottom, left, right = rectangles.T
    return (bottom - top) * (right - left)


def _needed(rectangles: Rectangles, shape: tuple[int, ...]) -> Rectangles:
    """The rectangles without those whose cells lie in others; small ones are left out first."""
    top, bottom, left, right = rectangles.T
    depth = np.zeros((shape[0] + 1, shape[1] + 1), np.int32)
    for rows, columns, by in ((top, left, 1), (bottom, right, 1), (top, right, -1), (bottom, left, -1)):
        np.add.at(depth, (rows, columns), by)
    depth = depth.cumsum(axis=0).cumsum(axis=1)[:-1, :-1]  # number of rectangles on each cell
    needed = _counts(_sums(depth == 1), rectangles) > 0
    others = np.flatnonzero(~needed)
    for index in others[np.argsort(_areas(rectangles[others]), kind="stable")]:
        part = depth[top[index] : bottom[index], left[index] : right[index]]
        needed[index] = part.min() == 1
        part -= not needed[index]
    return rectangles[needed]
