"""The least distance of a way from a convex core, over continuous time; compiled."""

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit
from airground_drake.model.geometry.convex import approach, nearest
from airground_drake.model.geometry.outline import BASE, CORNERS, COUNT, TOP

COARSE = 16  # stride of the first pass, whose least distance lets most other points be skipped


@njit(cache=True)
def least_apart(row: Array, way: Array, planar: bool) -> float:
    """Least signed distance, m, from a core of a point that goes straight from place to place, (T, 3), m."""
    # A distance changes by no more than the way that is travelled. So from a place that is farther by some length than
    # the least distance known, that length of the way can be passed over; and between two places the distance is at
    # least half of what theirs add up to beyond the length between them.
    last, away, best = len(way) - 1, np.empty(3), np.inf
    gone = np.zeros(last + 1)
    for k in range(last):
        x, y, z = way[k + 1, 0] - way[k, 0], way[k + 1, 1] - way[k, 1], way[k + 1, 2] - way[k, 2]
        gone[k + 1] = gone[k] + np.sqrt(x * x + y * y + z * z)
    for k in range(0, last + 1, COARSE):
        best = min(best, nearest(row, way[k, 0], way[k, 1], way[k, 2], planar, away, np.inf))
    k, here = 0, nearest(row, way[0, 0], way[0, 1], way[0, 2], planar, away, np.inf)
    while k < last:
        following = k + 1
        while following < last and gone[following + 1] - gone[k] < here - best:
            following += 1
        there = nearest(row, way[following, 0], way[following, 1], way[following, 2], planar, away, np.inf)
        best = min(best, there)
        if following == k + 1 and here + there - (gone[following] - gone[k]) < 2.0 * best:
            if row[COUNT] == 1.0 and way[k, 2] == way[following, 2]:
                best = min(best, _beside_corner(row, way, k))
            elif gone[following] > gone[k]:
                best = min(best, approach(row, way[k], way[following], planar)[0])
        k, here = following, there
    return best


@njit(cache=True)
def _beside_corner(row: Array, way: Array, k: int) -> float:
    """Least distance, m, of the level motion from the k-th place to the next from a core of one corner."""
    x, y, height = way[k, 0] - row[CORNERS], way[k, 1] - row[CORNERS + 1], way[k, 2]
    z = height - min(max(height, row[BASE]), row[TOP])
    vx, vy = way[k + 1, 0] - way[k, 0], way[k + 1, 1] - way[k, 1]
    squared = vx * vx + vy * vy
    share = min(max(-(x * vx + y * vy) / squared, 0.0), 1.0) if squared > 0.0 else 0.0
    x, y = x + share * vx, y + share * vy
    return float(np.sqrt(x * x + y * y + z * z))
