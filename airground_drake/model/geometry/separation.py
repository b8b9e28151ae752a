"""Whether convex obstacles that overlap separate two places in the plane: pure maths, compiled.

Obstacles keep two places apart if a closed way inside their union goes round one of the places only, that is, crosses
the segment between them an odd number of times. Take a point in each obstacle and in the intersection of each two that
overlap: every closed way can be drawn along straight legs between these points, which stay inside because obstacles are
convex. So it is enough to walk through the overlapping obstacles and count crossings, odd or even.
"""

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.compiling import njit
from airground_drake.model.geometry.convex import nearest, reached
from airground_drake.model.geometry.outline import CORNERS, COUNT, EXTENT, MIDDLE


@njit(cache=True)
def are_separated(p: Array, q: Array, rows: Array, keep: Array) -> bool:
    """Whether every way in the plane z = 0 between two free places comes too near to a core."""
    # p, q: (2,), m; rows: (m, W); keep: (m,), m
    parent, odd = np.arange(len(rows)), np.zeros(len(rows), np.bool_)
    inner = _inner_points(rows)
    boxes = np.empty((len(rows), 4))
    for k in range(len(rows)):
        boxes[k] = reached(rows[k], keep[k])
    order = np.argsort(boxes[:, 0])
    for first in range(len(rows)):
        for second in range(first + 1, len(rows)):
            i, j = max(order[first], order[second]), min(order[first], order[second])
            if boxes[order[second], 0] > boxes[order[first], 1]:  # so are all that follow
                break
            if boxes[i, 2] > boxes[j, 3] or boxes[j, 2] > boxes[i, 3]:
                continue
            dx, dy = rows[i, MIDDLE] - rows[j, MIDDLE], rows[i, MIDDLE + 1] - rows[j, MIDDLE + 1]
            reach = rows[i, EXTENT] + rows[j, EXTENT] + keep[i] + keep[j]
            if dx * dx + dy * dy >= reach * reach:
                continue
            apart, x, y = _between(rows[i], rows[j], keep[i] / max(keep[i] + keep[j], 1e-300))
            if apart >= keep[i] + keep[j]:
                continue
            across = _crosses(inner[i, 0], inner[i, 1], x, y, p, q) != _crosses(inner[j, 0], inner[j, 1], x, y, p, q)
            a, with_a = _root(parent, odd, i)
            b, with_b = _root(parent, odd, j)
            around = (with_a != with_b) != across
            if a == b and around:
                return True
            if a != b:
                parent[a], odd[a] = b, around
    return False


@njit(cache=True)
def _inner_points(rows: Array) -> Array:
    """A point of each core, (m, 2), m."""
    points = np.zeros((len(rows), 2))
    for k in range(len(rows)):
        count = int(rows[k, COUNT])
        for c in range(count):
            points[k, 0] += rows[k, CORNERS + 2 * c] / count
            points[k, 1] += rows[k, CORNERS + 2 * c + 1] / count
    return points


@njit(cache=True)
def _root(parent: npt.NDArray[np.int64], odd: Flags, k: int) -> tuple[int, bool]:
    """First obstacle of the cluster of obstacle k, and whether the way there crosses an odd number of times."""
    root, crossings = k, False
    while parent[root] != root:
        crossings = crossings != odd[root]
        root = parent[root]
    here, left = k, crossings
    while parent[here] != here:  # from now on straight to the root
        after, own = parent[here], odd[here]
        parent[here], odd[here] = root, left
        here, left = after, left != own
    return root, crossings


@njit(cache=True)
def _crosses(x: float, y: float, u: float, v: float, p: Array, q: Array) -> bool:
    """Whether a leg from (x, y) to (u, v) crosses the segment from p to q; an end on its line counts as on the left."""
    sx, sy = q[0] - p[0], q[1] - p[1]
    first, last = (x - p[0]) * sy - (y - p[1]) * sx, (u - p[0]) * sy - (v - p[1]) * sx
    if (first > 0.0) == (last > 0.0):
        return False
    lx, ly = u - x, v - y
    return ((p[0] - x) * ly - (p[1] - y) * lx > 0.0) != ((q[0] - x) * ly - (q[1] - y) * lx > 0.0)


@njit(cache=True)
def _between(one: Array, other: Array, share: float) -> tuple[float, float, float]:
    """Distance of two cores, m, 0 if they meet, and a point at a share of the shortest connection."""
    best, x, y = np.inf, 0.0, 0.0
    away = np.empty(3)
    for turn in range(2):
        from_, to = (one, other) if turn == 0 else (other, one)
        for k in range(int(from_[COUNT])):
            cx, cy = from_[CORNERS + 2 * k], from_[CORNERS + 2 * k + 1]
            apart = max(nearest(to, cx, cy, 0.0, True, away, np.inf), 0.0)
            if apart < best:
                part = apart * (share if turn == 0 else 1.0 - share)
                best, x, y = apart, cx - part * away[0], cy - part * away[1]
    if best == 0.0:
        return best, x, y
    for i in range(int(one[COUNT])):
        ax, ay, bx, by = _edge(one, i)
        for j in range(int(other[COUNT])):
            cx, cy, dx, dy = _edge(other, j)
            first, last = (cx - ax) * (by - ay) - (cy - ay) * (bx - ax), (dx - ax) * (by - ay) - (dy - ay) * (bx - ax)
            begin, end = (ax - cx) * (dy - cy) - (ay - cy) * (dx - cx), (bx - cx) * (dy - cy) - (by - cy) * (dx - cx)
            if first * last < 0.0 and begin * end < 0.0:
                s = first / (first - last)
                return 0.0, cx + s * (dx - cx), cy + s * (dy - cy)
    return best, x, y


@njit(cache=True)
def _edge(row: Array, k: int) -> tuple[float, float, float, float]:
    """Both ends of an edge of a core, m."""
    i, j = CORNERS + 2 * k, CORNERS + 2 * ((k + 1) % int(row[COUNT]))
    return row[i], row[i + 1], row[j], row[j + 1]
