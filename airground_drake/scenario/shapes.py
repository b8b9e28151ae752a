"""The convex parts of an obstacle: their corners in the world frame."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.scenario.maps.grid import Frame
from airground_drake.scenario.schema import MapCells, MapObstacle, Obstacle

# Corners that are turned or moved are rounded to this many digits after the point, m: they are then the same on every
# machine, and short as decimals.
DIGITS = 12

Corner = tuple[float, float]


def convex_parts(obstacle: Obstacle) -> list[list[Corner]] | None:
    """Corners of the convex parts of an obstacle's core in the world frame, m; None: it is a ball."""
    # A wall has a part per segment, a map one per rectangle. A post has one corner. A polygon that is not convex is
    # split.
    if isinstance(obstacle, MapObstacle):
        return [[(x, y) for x, y in corners] for corners in corners_of_map(obstacle.cells).tolist()]
    if obstacle.segment_m:
        corners = _placed(obstacle, obstacle.segment_m)
        return [[a, b] for a, b in pairwise(corners)]
    if obstacle.polygon_m:
        return split(_placed(obstacle, obstacle.polygon_m))
    if obstacle.size_m:
        x, y = (0.5 * side for side in obstacle.size_m)
        return [_placed(obstacle, [[-x, -y], [x, -y], [x, y], [-x, y]])]
    if obstacle.height_m:
        x, y = obstacle.position_m[:2] or (0.0, 0.0)
        return [[(x, y)]]
    return None


def corners_of_map(cells: MapCells) -> Array:
    """Corners of the rectangles of a map in the world frame, (n, 4, 2), m."""
    x, y, heading = cells.origin
    return Frame(cells.cell_m, (x, y, heading)).corners(np.array(cells.rectangles))


def _placed(obstacle: Obstacle, corners: Sequence[Sequence[float]]) -> list[Corner]:
    x0, y0 = obstacle.position_m[:2] or (0.0, 0.0)
    if not (x0 or y0 or obstacle.heading_rad):
        return [(x, y) for x, y in corners]
    cos, sin = math.cos(obstacle.heading_rad), math.sin(obstacle.heading_rad)
    return [(round(x0 + cos * x - sin * y, DIGITS), round(y0 + sin * x + cos * y, DIGITS)) for x, y in corners]


def area(corners: Sequence[Corner]) -> float:
    """Area of a polygon, m^2; negative if its corners are clockwise."""
    x0, y0 = corners[0]
    pairs = zip(corners, [*corners[1:], corners[0]], strict=True)
    return 0.5 * sum((ax - x0) * (by - y0) - (ay - y0) * (bx - x0) for (ax, ay), (bx, by) in pairs)


def turn(a: Corner, b: Corner, c: Corner) -> float:
    """Positive if the way from a over b to c turns left, negative if it turns right; m^2."""
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])


def crossing(corners: Sequence[Corner]) -> tuple[int, int] | None:
    """Two edges of a polygon that have another point in common than a corner that joins them; by their last corners."""
    n = len(corners)
    for k in range(n):
        a, b, c = corners[k - 1], corners[k], corners[(k + 1) % n]
        back = (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]) < 0.0
        if back and turn(a, b, c) == 0.0:
            return k, (k + 1) % n
        for m in range(k + 2, n - (k == 0)):
            if _meet(a, b, corners[m - 1], corners[m]):
                return k, m
    return None


def _meet(a: Corner, b: Corner, c: Corner, d: Corner) -> bool:
    """Whether two segments have a point in common."""
    apart = any(max(a[i], b[i]) < min(c[i], d[i]) or max(c[i], d[i]) < min(a[i], b[i]) for i in (0, 1))
    return not apart and turn(a, b, c) * turn(a, b, d) <= 0.0 and turn(c, d, a) * turn(c, d, b) <= 0.0


def near_edge(corners: Sequence[Corner], least: float) -> int | None:
    """A corner of a polygon that is at most as far as `least`, m, from an edge that does not end there; its number."""
    points = np.array(corners)
    begin, n = np.roll(points, 1, axis=0), len(points)
    edge = points - begin
    to = points[:, None] - begin
    share = np.clip((to * edge).sum(axis=2) / (edge**2).sum(axis=1), 0.0, 1.0)
    apart = np.linalg.norm(to - share[..., None] * edge, axis=2)
    k = np.arange(n)
    apart[k, k] = apart[k, (k + 1) % n] = math.inf
    return int(apart.min(axis=1).argmin()) if apart.min() <= least else None


def split(corners: Sequence[Corner]) -> list[list[Corner]]:
    """Convex polygons that together are a polygon without crossings; corners counter-clockwise."""
    # Ears are cut off until only triangles are left, and triangles are joined again while the result is convex (Hertel
    # and Mehlhorn 1983): at most four times as many parts as possible.
    around = list(corners) if area(corners) > 0.0 else list(corners)[::-1]
    parts = [list(triangle) for triangle in _triangles(around)] if not _is_convex(around) else [around]
    return [_without_straight_corners(part) for part in _joined(parts)]


def _joined(parts: list[list[Corner]]) -> list[list[Corner]]:
    """Convex polygons that cover the same. Each takes in later ones, the first first, while it stays convex."""
    # All corners are on the outline: at a corner where a union turns too far, it does so whatever joins it later.
    there = dict(enumerate(parts))
    at = {edge: i for i, part in there.items() for edge in _edges(part)}
    for i in range(len(parts)):
        refused = set(range(i + 1))
        while i in there:
            beside = {at[b, a] for a, b in _edges(there[i]) if (b, a) in at} - refused
            if not beside:
                break
            j = min(beside)
            refused.add(j)
            if both := _united(there[i], there[j]):
                del there[j]
                there[i] = both
                at |= dict.fromkeys(_edges(both), i)
    return list(there.values())


def _edges(part: Sequence[Corner]) -> list[tuple[Corner, Corner]]:
    return list(zip(part, [*part[1:], part[0]], strict=True))


def _is_convex(corners: Sequence[Corner]) -> bool:
    """Whether a polygon without crossings, counter-clockwise, never turns right."""
    return all(turn(corners[k - 2], corners[k - 1], corners[k]) >= 0.0 for k in range(len(corners)))


def _triangles(corners: list[Corner]) -> list[tuple[Corner, Corner, Corner]]:
    left, triangles = list(corners), []
    while len(left) > 3:
        points = np.array(left)
        for k in range(len(left)):
            a, b, c = left[k - 2], left[k - 1], left[k]
            if turn(a, b, c) > 0.0 and not _any_in_triangle(points, a, b, c):
                triangles.append((a, b, c))
                del left[k - 1]
                break
        else:  # only straight corners are left
            straight = min(range(len(left)), key=lambda k: abs(turn(left[k - 2], left[k - 1], left[k])))
            del left[straight - 1]
    if turn(left[0], left[1], left[2]) > 0.0:
        triangles.append((left[0], left[1], left[2]))
    return triangles


def _any_in_triangle(points: Array, a: Corner, b: Corner, c: Corner) -> bool:
    """Whether one of some points (n, 2), other than the corners, is in a triangle."""
    x, y = points.T
    inside = np.ones(len(points), dtype=bool)
    for (px, py), (qx, qy) in ((a, b), (b, c), (c, a)):
        inside &= (qx - px) * (y - qy) - (qy - py) * (x - qx) >= 0.0
    for corner in (a, b, c):
        inside &= (x != corner[0]) | (y != corner[1])
    return bool(inside.any())


def _united(polygon: list[Corner], other: list[Corner]) -> list[Corner] | None:
    """The union of two convex polygons that share an edge, if it is convex."""
    at = {edge: m for m, edge in enumerate(_edges(other), start=1)}
    for k in range(len(polygon)):
        if m := at.get((polygon[k], polygon[k - 1])):  # the other polygon goes the other way
            m %= len(other)
            both = [*polygon[k:], *polygon[:k], *[*other[m:], *other[:m]][1:-1]]
            return both if _is_convex(both) else None
    return None


def _without_straight_corners(corners: list[Corner]) -> list[Corner]:
    return [b for a, b, c in zip(corners[-1:] + corners[:-1], corners, corners[1:] + corners[:1], strict=True)
            if turn(a, b, c) > 0.0]  # fmt: skip
