"""Where robots can start and end on a map: far from obstacles, far from one another, with a way between them."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from airground_drake.base.arrays import Array
from airground_drake.scenario.maps.grid import Grid
from airground_drake.scenario.maps.rectangles import Cells

# A site is the cell farthest from obstacles in a square of this side, m, as long as there are such cells.
AROUND_M = 1.0


def ways(grid: Grid, clearance_m: float, count: int) -> tuple[Array, float]:
    # Each next site is the one with the longest way from all sites before it; a start and its target are far apart.
    # Returns start and target of each robot, (count, 2, 2), m, and a length, m, that none of their shortest ways
    # exceeds.
    clear = grid.clearance()
    open_ = (clear > clearance_m) & ~grid.occupied
    regions, number = ndimage.label(open_)
    if number:
        open_ = regions == np.bincount(regions[open_]).argmax()
    side = max(1, round(AROUND_M / grid.frame.cell_m))
    peaks = open_ & (clear == ndimage.maximum_filter(np.where(open_, clear, 0.0), side))
    far = np.where(peaks, np.iinfo(np.int32).max, -1).astype(np.int32)  # steps from the sites so far
    sites = list[tuple[int, int]]()
    beside = np.where(open_ & ~peaks, np.iinfo(np.int32).max, -1).astype(np.int32)  # bare rooms have few peaks
    apart = math.ceil(2.0 * clearance_m / grid.frame.cell_m)
    while len(sites) < 2 * count:
        site = np.unravel_index(np.argmax(far if sites else np.where(peaks, clear, -1.0)), far.shape)
        if far[site] < apart:
            site = np.unravel_index(np.argmax(beside), beside.shape)
            if beside[site] < apart:
                raise ValueError(f"there is room for {len(sites) // 2}, with {clearance_m:g} m around each")
        sites.append((int(site[0]), int(site[1])))
        steps = _steps(open_, sites[-1])
        far, beside = (np.where(distances >= 0, np.minimum(distances, steps), -1) for distances in (far, beside))
    starts, free = sites[:count], sites[count:]
    pairs = []
    longest = 0
    for start in starts:
        steps = _steps(open_, start)
        target = max(free, key=lambda site: int(steps[site]))
        free.remove(target)
        pairs.append((start, target))
        longest = max(longest, int(steps[target]))
    places = np.array(pairs, np.float64)[..., ::-1] + 0.5
    return grid.frame.points(places), longest * grid.frame.cell_m


def _steps(open_: Cells, start: tuple[int, int]) -> NDArray[np.int32]:
    """Number of steps to each cell through open cells, over their sides, (rows, columns); -1: none leads there."""
    columns = open_.shape[1] + 2
    unseen = np.pad(open_, 1).ravel()
    steps = np.full(len(unseen), -1, np.int32)
    front = np.array([(start[0] + 1) * columns + start[1] + 1])
    number = 0
    while len(front):
        steps[front] = number
        unseen[front] = False
        around = (front[:, None] + (1, -1, columns, -columns)).ravel()
        front = np.unique(around[unseen[around]])
        number += 1
    return steps.reshape(-1, columns)[1:-1, 1:-1]
