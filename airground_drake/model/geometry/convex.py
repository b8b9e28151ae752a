"""Signed distances from convex obstacles, and tests for free points and segments: pure maths, compiled by numba.

Obstacles are rows of numbers, see `model.geometry.outline`. Results are those of IEEE arithmetic in the order written.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.compiling import njit
from airground_drake.model.geometry.outline import BASE, CORNERS, COUNT, EXTENT, MIDDLE, TOP

FAR = 1.0 + 1e-12  # squared distances above a limit by this factor exceed it despite rounding
PER_CELL = 4.0  # average number of points per cell of a search grid
WIDEST_PIECE = 1.0  # widest piece of an arc that may be covered at once, rad
FINER = 6  # such pieces are halved at most so often


@njit(cache=True)
def nearest(row: Array, x: float, y: float, z: float, planar: bool, away: Array, beyond: float) -> float:
    """Signed distance of a point from a core, m; writes the unit vector away from the core into `away`, (3,)."""
    # planar: whether the point stays in its plane: then no way leads out of a core through its top.
    # away: the result; 0 in the only corner of a core, where no direction leads away.
    # beyond: if the distance exceeds this, m, a lower bound of it that exceeds it, too, may be returned, and `away`
    # means nothing.
    count = int(row[COUNT])
    dz = z - min(max(z, row[BASE]), row[TOP])
    if count == 1:
        return _from_corner(x - row[CORNERS], y - row[CORNERS + 1], dz, away)
    mx, my = x - row[MIDDLE], y - row[MIDDLE + 1]
    limit = beyond + row[EXTENT]
    if mx * mx + my * my > limit * limit:
        return np.sqrt(mx * mx + my * my) - row[EXTENT]
    depth, best, ux, uy = -np.inf, np.inf, 0.0, 0.0
    cx, cy, at_corner = 0.0, 0.0, False
    for k in range(count if count > 2 else 1):
        i, j = CORNERS + 2 * k, CORNERS + 2 * ((k + 1) % count)
        ex, ey = row[j] - row[i], row[j + 1] - row[i + 1]
        px, py = x - row[i], y - row[i + 1]
        length = np.sqrt(ex * ex + ey * ey)
        side = (px * ey - py * ex) / length  # how far outside of the line through the edge
        nx, ny = ey / length, -ex / length
        if count == 2 and side < 0.0:
            side, nx, ny = -side, -nx, -ny
        if side < 0.0 or (side == 0.0 and count > 2):
            if best == np.inf and side > depth:
                depth, ux, uy = side, nx, ny
            continue
        along = px * ex + py * ey
        if along < 0.0 or along > length * length:
            qx, qy = (px, py) if along < 0.0 else (x - row[j], y - row[j + 1])
            squared = qx * qx + qy * qy
            if squared < best:
                best, cx, cy, at_corner = squared, qx, qy, True
        elif side * side <= best:
            best, depth, ux, uy, at_corner = side * side, side, nx, ny, False
            break  # the nearest point of a convex set is unique
    if best == np.inf:  # in the polygon, or over or under it
        rise = max(z - row[TOP], row[BASE] - z)
        if not planar and rise >= depth:
            away[0], away[1], away[2] = 0.0, 0.0, 1.0 if z - row[TOP] >= row[BASE] - z else -1.0
            return rise
        away[0], away[1], away[2] = ux, uy, 0.0
        return depth
    if at_corner:
        return _from_corner(cx, cy, dz, away)
    if dz == 0.0:  # the normal of the edge, which does not depend on the point
        away[0], away[1], away[2] = ux, uy, 0.0
        return depth
    return _from_corner(ux * depth, uy * depth, dz, away)


@njit(cache=True)
def _from_corner(dx: float, dy: float, dz: float, away: Array) -> float:
    """Length of an offset, m, and its direction, in `away`."""
    away[0], away[1], away[2] = dx, dy, dz
    squared = 0.0
    for a in range(3):
        squared += away[a] ** 2
    reach = np.sqrt(squared)
    for a in range(3):
        away[a] = away[a] / reach if reach > 0.0 else 0.0
    return float(reach)


@njit(cache=True)
def distances(rows: Array, position: Array, planar: bool) -> Array:
    """Signed distances of a position (3,), m, from the cores of outlines (m, W): (m,), m."""
    apart, away = np.empty(len(rows)), np.empty(3)
    for k in range(len(rows)):
        apart[k] = nearest(rows[k], position[0], position[1], position[2], planar, away, np.inf)
    return apart


@njit(cache=True)
def nearest_points(rows: Array, positions: Array) -> Array:
    """The points of cores (m, W) that are nearest to positions (N, 3) in the plane z = 0, m: (N, m, 3), m."""
    # Inside a core it is the nearest point of its boundary.
    points, away = np.empty((len(positions), len(rows), 3)), np.empty(3)
    for k in range(len(rows)):
        row = rows[k]
        for i in range(len(positions)):
            if row[COUNT] == 1.0:
                z = min(max(positions[i, 2], row[BASE]), row[TOP])
                points[i, k, 0], points[i, k, 1], points[i, k, 2] = row[CORNERS], row[CORNERS + 1], z
                continue
            apart = nearest(row, positions[i, 0], positions[i, 1], positions[i, 2], True, away, np.inf)
            for a in range(3):
                points[i, k, a] = positions[i, a] - apart * away[a]
    return points


@njit(cache=True)
def beside(rows: Array, start: Array, end: Array) -> Array:
    """Least distances of cores (m, W) from the segment between two places (3,), m, of one height: (m,), m."""
    clearance = np.empty(len(rows))
    for k in range(len(rows)):
        clearance[k] = approach(rows[k], start, end, True)[0]
    return clearance


@njit(cache=True)
def may_be_within(rows: Array, k: int, x: float, y: float, reach: float) -> bool:
    """Whether the circle round a core comes within reach: a quick test."""
    dx, dy, limit = x - rows[k, MIDDLE], y - rows[k, MIDDLE + 1], reach + rows[k, EXTENT]
    return bool(dx * dx + dy * dy <= FAR * limit * limit)


@njit(cache=True)
def within(rows: Array, positions: Array, reach: float, planar: bool) -> Flags:
    """Which outlines (m, W) have a core within `reach`, m, of each of n positions (n, 3), m: (n, m)."""
    near, away = np.empty((len(positions), len(rows)), dtype=np.bool_), np.empty(3)
    for i in range(len(positions)):
        x, y, z = positions[i, 0], positions[i, 1], positions[i, 2]
        for k in range(len(rows)):
            near[i, k] = may_be_within(rows, k, x, y, reach) and nearest(rows[k], x, y, z, planar, away, reach) <= reach
    return near


@njit(cache=True)
def news_within(rows: Array, positions: Array, reach: float, planar: bool, known: Flags) -> bool:
    """Whether an outline that is not yet `known`, (n, m), is within reach."""
    away = np.empty(3)
    for i in range(len(positions)):
        x, y, z = positions[i, 0], positions[i, 1], positions[i, 2]
        for k in range(len(rows)):
            if known[i, k] or not may_be_within(rows, k, x, y, reach):
                continue
            if nearest(rows[k], x, y, z, planar, away, reach) <= reach:
                return True
    return False


@njit(cache=True)
def approach(row: Array, start: Array, end: Array, planar: bool) -> tuple[float, float]:
    """Least signed distance of a point in straight motion from a core, m, and its share of the motion."""
    # Outside of the core the squared distance is a parabola between two of `_breaks`: three values give its least one.
    # Inside, the signed distance is convex, and the least one is found by thirds.
    # start, end: (3,), m
    vx, vy, vz = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    shares = _breaks(row, start, vx, vy, vz)
    least, at, before, first = np.inf, 0.0, 0.0, 0.0
    away = np.empty(3)
    for k in range(len(shares)):
        here = shares[k]
        last = nearest(row, start[0] + here * vx, start[1] + here * vy, start[2] + here * vz, planar, away, np.inf)
        if last < least:
            least, at = last, here
        if k > 0 and here > before:
            half = 0.5 * (before + here)
            middle = nearest(
                row, start[0] + half * vx, start[1] + half * vy, start[2] + half * vz, planar, away, np.inf
            )
            if middle < least:
                least, at = middle, half
            curve = first * first - 2.0 * middle * middle + last * last
            if curve > 0.0:
                s = half - (last * last - first * first) / (2.0 * curve) * (here - half)
                if before < s < here:
                    d = nearest(row, start[0] + s * vx, start[1] + s * vy, start[2] + s * vz, planar, away, np.inf)
                    if d < least:
                        least, at = d, s
        first, before = last, here
    if least >= 0.0:
        return least, at
    low, high = 0.0, 1.0
    for _ in range(90):
        early, late = (2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0
        d1 = nearest(row, start[0] + early * vx, start[1] + early * vy, start[2] + early * vz, planar, away, np.inf)
        d2 = nearest(row, start[0] + late * vx, start[1] + late * vy, start[2] + late * vz, planar, away, np.inf)
        if min(d1, d2) < least:
            least, at = (d1, early) if d1 < d2 else (d2, late)
        low, high = (low, late) if d1 < d2 else (early, high)
    return least, at


@njit(cache=True)
def _breaks(row: Array, start: Array, vx: float, vy: float, vz: float) -> Array:
    """Shares of a straight motion, from 0 to 1, at which the nearest feature (edge, corner, face) may change."""
    count = int(row[COUNT])
    breaks, n = np.empty(3 * count + 3), 1
    breaks[0] = 0.0
    if vz != 0.0:
        breaks[1], breaks[2] = (row[BASE] - start[2]) / vz, (row[TOP] - start[2]) / vz
        n = 3
    for k in range(count if count > 1 else 0):
        i, j = CORNERS + 2 * k, CORNERS + 2 * ((k + 1) % count)
        ex, ey = row[j] - row[i], row[j + 1] - row[i + 1]
        px, py = row[i] - start[0], row[i + 1] - start[1]
        along, across = vx * ex + vy * ey, vx * ey - vy * ex
        if along != 0.0:  # where it passes the ends of the edge
            breaks[n] = (px * ex + py * ey) / along
            breaks[n + 1] = breaks[n] + (ex * ex + ey * ey) / along
            n += 2
        if across != 0.0:  # where it crosses the line of the edge
            breaks[n] = (px * ey - py * ex) / across
            n += 1
    inner, size = np.empty(n + 1), 0
    for k in range(n):
        if 0.0 <= breaks[k] < 1.0:
            at = size
            while at > 0 and inner[at - 1] > breaks[k]:
                inner[at] = inner[at - 1]
                at -= 1
            inner[at] = breaks[k]
            size += 1
    inner[size] = 1.0
    return inner[: size + 1]


@njit(cache=True)
def approaches(row: Array, starts: Array, ends: Array, planar: bool) -> tuple[Array, Array]:
    """`approach` for straight motions from (T, 3) to (T, 3), m: distances, m, and shares, (T,)."""
    apart, shares = np.empty(len(starts)), np.empty(len(starts))
    for k in range(len(apart)):
        apart[k], shares[k] = approach(row, starts[k], ends[k], planar)
    return apart, shares


@njit(cache=True)
def points_are_free(points: Array, rows: Array, keep: Array) -> Flags:
    """Which points (K, 2), m, in the plane z = 0 are `keep` (m,), m, from all cores (m, W): (K,)."""
    free, away = np.ones(len(points), np.bool_), np.empty(3)
    cells = _cells_of(points)
    for m in range(len(rows)):
        low_x, high_x, low_y, high_y = reached(rows[m], keep[m])
        first, last, bottom, top = _cells_between(cells, low_x, high_x, low_y, high_y)
        for column in range(first, last):
            for i in range(cells.first[column, bottom], cells.first[column, top]):
                k = cells.members[i]
                x, y = points[k, 0], points[k, 1]
                if not free[k] or x < low_x or x > high_x or y < low_y or y > high_y:
                    continue
                free[k] = nearest(rows[m], x, y, 0.0, True, away, keep[m]) >= keep[m]
    return free


@njit(cache=True)
def segments_are_free(begin: Array, end: Array, rows: Array, keep: Array, slack: float) -> Flags:
    """Which segments in the plane z = 0 keep `keep`, m, from all cores."""
    # One with an end too near to a core must come no nearer than that end.
    # begin, end: (K, 2), m; rows: (m, W); keep: (m,), m; slack: m
    free = np.ones(len(begin), np.bool_)
    middle, half = np.empty((len(begin), 2)), 0.0
    for k in range(len(begin)):
        middle[k, 0], middle[k, 1] = 0.5 * (begin[k, 0] + end[k, 0]), 0.5 * (begin[k, 1] + end[k, 1])
        half = max(half, 0.5 * abs(end[k, 0] - begin[k, 0]), 0.5 * abs(end[k, 1] - begin[k, 1]))
    cells = _cells_of(middle)
    for m in range(len(rows)):
        low_x, high_x, low_y, high_y = reached(rows[m], keep[m])
        first, last, bottom, top = _cells_between(cells, low_x - half, high_x + half, low_y - half, high_y + half)
        for column in range(first, last):
            for i in range(cells.first[column, bottom], cells.first[column, top]):
                k = cells.members[i]
                ax, ay, bx, by = begin[k, 0], begin[k, 1], end[k, 0], end[k, 1]
                if not free[k] or max(ax, bx) < low_x or min(ax, bx) > high_x or max(ay, by) < low_y:
                    continue
                if min(ay, by) <= high_y:
                    free[k] = passes(rows[m], keep[m], ax, ay, bx, by, slack)
    return free


class _Cells(NamedTuple):
    """A grid of points, to find those near an outline."""

    # Index of the first member of each cell of each column, and the index after the last, (columns, rows + 1).
    first: npt.NDArray[np.int64]
    members: npt.NDArray[np.int64]  # numbers of the points, sorted by cell, (K,)
    corner: Array  # lowest corner, (2,), m
    size: float  # of a cell, m


@njit(cache=True)
def _cells_of(points: Array) -> _Cells:
    """Points (K, 2), m, in cells of about `PER_CELL`."""
    low, high = np.zeros(2), np.zeros(2)
    for k in range(len(points)):
        for a in range(2):
            low[a] = points[k, a] if k == 0 else min(low[a], points[k, a])
            high[a] = points[k, a] if k == 0 else max(high[a], points[k, a])
    wide, tall = high[0] - low[0], high[1] - low[1]
    size = max(np.sqrt(wide * tall * PER_CELL / max(len(points), 1)), max(wide, tall) / 1000.0, 1e-9)
    columns, rows = int(wide / size) + 1, int(tall / size) + 1
    number, count = np.empty(len(points), np.int64), np.zeros(columns * rows + 1, np.int64)
    for k in range(len(points)):
        column = min(int((points[k, 0] - low[0]) / size), columns - 1)
        number[k] = column * rows + min(int((points[k, 1] - low[1]) / size), rows - 1)
        count[number[k] + 1] += 1
    for cell in range(columns * rows):
        count[cell + 1] += count[cell]
    first, members = np.empty((columns, rows + 1), np.int64), np.empty(len(points), np.int64)
    for column in range(columns):
        for row in range(rows + 1):
            first[column, row] = count[column * rows + row]
    for k in range(len(points)):
        members[count[number[k]]] = k
        count[number[k]] += 1
    return _Cells(first, members, low, size)


@njit(cache=True)
def reached(row: Array, keep: float) -> tuple[float, float, float, float]:
    """Bounding box (x, then y) of all points within a distance, m, of a core, slightly enlarged."""
    low_x, high_x, low_y, high_y = np.inf, -np.inf, np.inf, -np.inf
    for k in range(int(row[COUNT])):
        x, y = row[CORNERS + 2 * k], row[CORNERS + 2 * k + 1]
        low_x, high_x, low_y, high_y = min(low_x, x), max(high_x, x), min(low_y, y), max(high_y, y)
    far = keep + 1e-6 * (1.0 + abs(keep))
    return low_x - far, high_x + far, low_y - far, high_y + far


@njit(cache=True)
def _cells_between(
    cells: _Cells, low_x: float, high_x: float, low_y: float, high_y: float
) -> tuple[int, int, int, int]:
    """First column and the one after the last, then row, of the cells that a box meets."""
    columns, rows = cells.first.shape[0], cells.first.shape[1] - 1
    first = min(max(np.floor((low_x - cells.corner[0]) / cells.size), 0.0), columns)
    last = max(min(np.floor((high_x - cells.corner[0]) / cells.size) + 1.0, columns), first)
    bottom = min(max(np.floor((low_y - cells.corner[1]) / cells.size), 0.0), rows)
    top = max(min(np.floor((high_y - cells.corner[1]) / cells.size) + 1.0, rows), bottom)
    return int(first), int(last), int(bottom), int(top)


@njit(cache=True)
def passes(row: Array, keep: float, ax: float, ay: float, bx: float, by: float, slack: float) -> bool:
    """`segments_are_free` for one segment, from (ax, ay) to (bx, by), m, and one outline."""
    sx, sy = bx - ax, by - ay
    squared = max(sx * sx + sy * sy, 1e-300)
    length = 1.001 * np.sqrt(squared)
    px, py = ax - row[MIDDLE], ay - row[MIDDLE + 1]
    to_begin = np.sqrt(px * px + py * py)
    if to_begin > keep + row[EXTENT] + length:
        return True
    if row[COUNT] == 1.0:
        qx, qy = bx - row[MIDDLE], by - row[MIDDLE + 1]
        share = min(max(-(px * sx + py * sy) / squared, 0.0), 1.0)
        x, y = px + share * sx, py + share * sy
        return bool(np.sqrt(x * x + y * y) >= min(keep, to_begin, np.sqrt(qx * qx + qy * qy)) - slack)
    if clears(row, keep - slack, ax, ay, bx, by):
        return True
    away = np.empty(3)
    first = nearest(row, ax, ay, 0.0, True, away, np.inf)
    last = nearest(row, bx, by, 0.0, True, away, np.inf)
    if min(first, last) >= keep:
        return False
    start, stop = np.array((ax, ay, 0.0)), np.array((bx, by, 0.0))
    return bool(approach(row, start, stop, True)[0] >= min(first, last) - slack)


@njit(cache=True)
def clears(row: Array, reach: float, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether a segment from (ax, ay) to (bx, by), m, in the plane z = 0 is everywhere `reach`, m, from a core."""
    # Of a segment and a core that do not meet, either an end of the segment or a corner of the core is nearest.
    sx, sy, count = bx - ax, by - ay, int(row[COUNT])
    far = reach + row[EXTENT]
    mx, my = row[MIDDLE], row[MIDDLE + 1]
    if min(ax, bx) > mx + far or max(ax, bx) < mx - far or min(ay, by) > my + far or max(ay, by) < my - far:
        return True
    length = np.sqrt(sx * sx + sy * sy)
    if abs((mx - ax) * sy - (my - ay) * sx) > far * length:
        return True
    squared = max(sx * sx + sy * sy, 1e-300)
    for k in range(count):
        i, j = CORNERS + 2 * k, CORNERS + 2 * ((k + 1) % count)
        cx, cy = row[i] - ax, row[i + 1] - ay
        share = min(max((cx * sx + cy * sy) / squared, 0.0), 1.0)
        x, y = cx - share * sx, cy - share * sy
        if x * x + y * y < reach * reach:
            return False
        here, there = cx * sy - cy * sx, (row[j] - ax) * sy - (row[j + 1] - ay) * sx
        if here * there < 0.0:  # the edge crosses the line of the segment, and perhaps the segment
            ex, ey = row[j] - row[i], row[j + 1] - row[i + 1]
            if (cx * ey - cy * ex) * ((row[i] - bx) * ey - (row[i + 1] - by) * ex) <= 0.0:
                return False
    away = np.empty(3)
    return bool(
        nearest(row, ax, ay, 0.0, True, away, reach) >= reach and nearest(row, bx, by, 0.0, True, away, reach) >= reach
    )


@njit(cache=True)
def blocker(ax: float, ay: float, bx: float, by: float, rows: Array, reach: Array, first: int) -> int:
    """Which core (m, W) a segment in the plane z = 0 comes nearer to than `reach` (m,), m: one of them; -1 if none."""
    # first: the core that is tried first, such as the one that blocked the segment before; < 0 for any.
    if first >= 0 and not clears(rows[first], reach[first], ax, ay, bx, by):
        return first
    for m in range(len(rows)):
        if not clears(rows[m], reach[m], ax, ay, bx, by):
            return m
    return -1


@njit(cache=True)
def in_the_way(begin: Array, end: Array, more: Array, rows: Array, reach: Array) -> Flags:
    """Which cores (m, W) are nearer than `reach` (m,), m, and `more` (K,), m, to one of K segments: (m,)."""
    blocking = np.zeros(len(rows), np.bool_)
    for m in range(len(rows)):
        for k in range(len(begin)):
            if not clears(rows[m], reach[m] + more[k], begin[k, 0], begin[k, 1], end[k, 0], end[k, 1]):
                blocking[m] = True
                break
    return blocking


@njit(cache=True)
def arcs_are_covered(centres: Array, radii: Array, begin: Array, sweep: Array, rows: Array, reach: Array) -> Flags:
    """Which arcs have every point nearer than `reach` (m,), m, to one of the cores (m, W): (K,)."""
    # An arc is divided into pieces. A piece is covered if its ends and the point where the tangents at its ends meet
    # are near to the same core: all that is near to a core is convex. So an arc may be covered and not found to be.
    # centres: (K, 2), m; radii: (K,), m; begin: (K,), rad
    # sweep: angle of each arc, counter-clockwise, (K,), rad.
    count, widest = np.zeros(len(centres) + 1, np.int64), 0.0
    for k in range(len(radii)):
        widest = max(widest, radii[k])
    cells = _cells_of(centres)
    near = np.empty(0, np.int64)
    for fill in (False, True):  # the outlines near each circle: first their number, then the outlines
        for m in range(len(rows)):
            low_x, high_x, low_y, high_y = reached(rows[m], reach[m] + widest)
            first, last, bottom, top = _cells_between(cells, low_x, high_x, low_y, high_y)
            for column in range(first, last):
                for i in range(cells.first[column, bottom], cells.first[column, top]):
                    k = cells.members[i]
                    if may_be_within(rows, m, centres[k, 0], centres[k, 1], reach[m] + radii[k]):
                        if fill:
                            near[count[k]] = m
                            count[k] += 1
                        else:
                            count[k + 1] += 1
        if not fill:
            count = np.cumsum(count)
            near = np.empty(count[-1], np.int64)
    covered = np.empty(len(centres), np.bool_)
    for k in range(len(centres)):  # by now, `count` has the index after the last outline near each circle
        some = near[count[k - 1] if k > 0 else 0 : count[k]]
        covered[k] = _is_covered(centres[k], radii[k], begin[k], sweep[k], rows, reach, some)
    return covered


@njit(cache=True)
def _is_covered(
    centre: Array, radius: float, begin: float, sweep: float, rows: Array, reach: Array, near: npt.NDArray[np.int64]
) -> bool:
    """`arcs_are_covered` for one arc, and the outlines near its circle, (n,)."""
    pieces = max(int(np.ceil(sweep / WIDEST_PIECE)), 1)
    angles, widths = np.empty(pieces + FINER), np.empty(pieces + FINER)
    for piece in range(pieces):
        angles[piece], widths[piece] = begin + piece * sweep / pieces, sweep / pieces
    left, least, away = pieces, 1.01 * sweep / pieces / 2**FINER, np.empty(3)
    while left > 0:
        left -= 1
        angle, width = angles[left], widths[left]
        at, out = angle + 0.5 * width, radius / np.cos(0.5 * width)
        ends = (
            (centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)),
            (centre[0] + radius * np.cos(angle + width), centre[1] + radius * np.sin(angle + width)),
            (centre[0] + out * np.cos(at), centre[1] + out * np.sin(at)),
        )
        x, y = centre[0] + radius * np.cos(at), centre[1] + radius * np.sin(at)
        meets, covers = False, False
        for m in near:
            if nearest(rows[m], x, y, 0.0, True, away, reach[m]) < reach[m]:
                meets = covers = True
                for px, py in ends:
                    covers = covers and nearest(rows[m], px, py, 0.0, True, away, reach[m]) < reach[m]
                if covers:
                    break
        if not meets or (not covers and width < least):
            return False
        if not covers:
            angles[left], angles[left + 1] = angle, at
            widths[left] = widths[left + 1] = 0.5 * width
            left += 2
    return True
