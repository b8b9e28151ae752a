"""Shapes of obstacles: convex parts, their signed distances, and the least of these along straight motion.

A part is the convex hull of corners in the plane, from one height to another. One corner of one height is a point: the
centre of a ball, or a robot. Distances are from parts; radii are included in the distance to keep. Inside a part the
distance is minus the depth. With several parts the least counts.

The signed distance is a convex function of the place, and changes by no more than the place moves.
"""

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np

from .files import Json
from .rules import Array, Flags, NotEstablished

T = TypeVar("T")
Corner = tuple[float, float]
DIGITS = 12  # corners that are turned or moved are rounded to so many digits after the point, m
ROWS = 50  # steps of a slice of a run; a slice is left out as a whole if it is far away
ROUNDING_M = 1e-6  # bounds of distances are lowered by this, because of rounding
THIRDS = 64  # how often a third of a step is left out in the search for the least distance: 5e-12 of it is left


# Faces whose distances differ by less than this count as equally near: a robot takes one of them by rounding.
TIE_M = 1e-12


class Away(NamedTuple):
    """A vector away from the nearest point or face of a part; the signed distance is `beyond` / |`vector`|."""

    vector: list[Fraction]
    beyond: Fraction


class Part:
    """A convex part of a shape. Its methods take places (K, 3), m."""

    def __init__(self, corners: Sequence[Corner], base_m: float, top_m: float) -> None:
        """Make a part from its corners, counter-clockwise, and the heights of its base and its top."""
        self.corners, self.base_m, self.top_m = corners, base_m, top_m
        self.begin = np.array(corners, dtype=np.float64)
        self.edge = np.roll(self.begin, -1, axis=0) - self.begin
        self.square = np.where((square := (self.edge**2).sum(axis=1)) > 0.0, square, 1.0)
        self.outward = np.column_stack([self.edge[:, 1], -self.edge[:, 0]]) / np.sqrt(self.square)[:, None]

    def signed_m(self, places: Array) -> Array:
        """Signed distances, (K,), m."""
        rise = np.maximum(places[:, 2] - self.top_m, self.base_m - places[:, 2])
        to = places[:, None, :2] - self.begin
        share = np.clip((to * self.edge).sum(axis=2) / self.square, 0.0, 1.0)
        flat = np.linalg.norm(to - share[..., None] * self.edge, axis=2).min(axis=1)
        side = (to * self.outward).sum(axis=2).max(axis=1)
        inside = (side <= 0.0) & (len(self.corners) > 2)
        return np.where(inside, np.maximum(side, rise), np.hypot(flat, np.maximum(rise, 0.0)))

    def between_m(self, start: Array, end: Array, at_m: tuple[Array, Array], reach_m: float) -> Array:
        """Least signed distances on straight steps from `start` to `end`, (K, 3), where below `reach_m`: (K,), m."""
        # reach_m: of a step that stays beyond it, the result may be too large.
        step, least_m = end - start, np.minimum(*at_m)
        bound = 0.5 * (at_m[0] + at_m[1] - np.linalg.norm(step, axis=1)) - ROUNDING_M
        steps = np.flatnonzero(~(bound >= reach_m))
        if len(self.corners) == 1 and self.base_m == self.top_m:  # nearest to a point where the way is across
            to, way = np.array([*self.corners[0], self.base_m]) - start[steps], step[steps]
            square = (way**2).sum(axis=1)
            share = np.clip((to * way).sum(axis=1) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
            least_m[steps] = np.minimum(least_m[steps], self.signed_m(start[steps] + share[:, None] * way))
            return least_m
        low, high = np.zeros(len(steps)), np.ones(len(steps))
        for _ in range(THIRDS if len(steps) else 0):  # a convex function has its least value beside the lower of two
            left, right = (2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0
            first, second = (self.signed_m(start[steps] + s[:, None] * step[steps]) for s in (left, right))
            least_m[steps] = np.minimum(least_m[steps], np.minimum(first, second))
            low, high = np.where(first < second, low, left), np.where(first < second, right, high)
        return least_m

    def along_m(self, places: Array, at_m: Array, reach_m: float) -> Array:
        """Least signed distances on the steps from place to place, (K - 1,); `at_m` has those of all places, (K,)."""
        return self.between_m(places[:-1], places[1:], (at_m[:-1], at_m[1:]), reach_m)

    def away(self, place: Sequence[Fraction]) -> list[Away]:
        """Exact vectors away from the nearest point, or from inside, the nearest faces; all of them on a tie."""
        x, y, z = place
        height = Fraction()
        offsets = []
        faces = []
        if math.isfinite(self.top_m):
            over, under = z - Fraction(self.top_m), Fraction(self.base_m) - z
            height = max(over, Fraction()) - max(under, Fraction())
            faces = [Away([Fraction(), Fraction(), Fraction(up)], h) for up, h in ((1, over), (-1, under))]
        for (ax, ay), (bx, by) in edges_of([(Fraction(a), Fraction(b)) for a, b in self.corners]):
            px, py, ex, ey = x - ax, y - ay, bx - ax, by - ay
            share = min(max((px * ex + py * ey) / (ex * ex + ey * ey), Fraction()), Fraction(1)) if (ex or ey) else 0
            offset = [px - share * ex, py - share * ey, height]
            offsets.append(Away(offset, sum((c * c for c in offset), Fraction())))
            faces.append(Away([ey, -ex, Fraction()], px * ey - py * ex))
        if len(offsets) < 3 or any(face.beyond > 0 for face in faces[-len(offsets) :]):
            return [min(offsets, key=lambda offset: offset.beyond)]
        depths = [float(face.beyond) / math.hypot(*map(float, face.vector)) for face in faces]
        return [face for face, depth in zip(faces, depths, strict=True) if depth >= max(depths) - TIE_M]


class Shape:
    """One or more convex parts; places as in `Part`."""

    def __init__(self, parts: Sequence[Part]) -> None:
        self.parts = parts  # m of them
        # A corner of a box round each, (m, 3), m.
        self.low = np.array([[*part.begin.min(axis=0), part.base_m] for part in parts])
        self.high = np.array([[*part.begin.max(axis=0), part.top_m] for part in parts])  # the opposite corner

    def bounds_m(self, low: Array, high: Array) -> Array:
        """Lower bounds of the distances between S boxes and each part, (S, m); -inf where they may meet."""
        # low: (S, 3), m
        gap = np.maximum(low[:, None] - self.high, self.low - high[:, None])
        apart = np.linalg.norm(np.maximum(gap, 0.0), axis=2) - ROUNDING_M
        return np.where(apart > 0.0, apart, -np.inf)

    def near(self, places: Array, steps: int = ROWS) -> Iterator[tuple[float, Part, slice]]:
        """Each part with each slice of places, the nearest first, and a lower bound of its distance, m."""
        bounds = self.bounds_m(*boxes_of(places, steps))
        for k in np.argsort(bounds, axis=None):
            begin, part = divmod(int(k), len(self.parts))
            yield float(bounds.flat[k]), self.parts[part], slice(steps * begin, steps * (begin + 1) + 1)

    def least_m(self, places: Array, reach_m: float = np.inf, steps: int = ROWS) -> float:
        """Least signed distance along the straight steps from place to place, m, at most `reach_m`."""
        for bound, part, rows in self.near(places, steps):
            if bound >= reach_m:
                break
            at_m = part.signed_m(places[rows])
            reach_m = min(reach_m, float(at_m.min()))
            reach_m = min(reach_m, float(part.along_m(places[rows], at_m, reach_m).min(initial=np.inf)))
        return reach_m

    def held_m(self, places: Array, start: Array, end: Array, reach_m: float) -> tuple[Array, Array]:
        """Signed distances of places, and the least on straight steps from `start` to `end`, (K, 3): (K,) each, m."""
        # Parts farther than `reach_m` from a step are ignored.
        at_m, least_m = np.full((2, len(start)), np.inf)
        longest = float(np.linalg.norm(end - start, axis=1).max(initial=0.0))
        for bound, part, rows in self.near(start):
            if bound > reach_m + longest:
                break
            here, there = part.signed_m(start[rows]), part.signed_m(end[rows])
            at_m[rows] = np.minimum(at_m[rows], part.signed_m(places[rows]))
            least = part.between_m(start[rows], end[rows], (here, there), reach_m)
            least_m[rows] = np.minimum(least_m[rows], least)
        return at_m, least_m

    def within(self, places: Array, reach_m: float) -> tuple[Flags, Flags]:
        """Which places, (K,), and which straight steps between them, (K - 1,), come nearer than `reach_m`."""
        there, passes = np.zeros(len(places), dtype=bool), np.zeros(len(places) - 1, dtype=bool)
        for bound, part, rows in self.near(places):
            if bound >= reach_m:
                break
            at_m = part.signed_m(places[rows])
            there[rows] |= at_m < reach_m
            passes[rows.start : rows.stop - 1] |= part.along_m(places[rows], at_m, reach_m) < reach_m
        return there, passes


POINT = Shape([Part([(0.0, 0.0)], 0.0, 0.0)])


def boxes_of(places: Array, steps: int = ROWS) -> tuple[Array, Array]:
    """Two opposite corners of a box round each slice of places (K, 3), m: (S, 3) each. A row joins two slices."""
    begin = np.arange(0, max(len(places) - 1, 1), steps)
    low, high = np.minimum.reduceat(places, begin), np.maximum.reduceat(places, begin)
    low[:-1], high[:-1] = np.minimum(low[:-1], places[begin[1:]]), np.maximum(high[:-1], places[begin[1:]])
    return low, high


def shape_of(body: Json, *, endless: bool) -> Shape:
    # endless: in height, as walls are for UGVs; balls are not.
    parts: Sequence[Sequence[Corner]]
    if "cells" in body:
        parts = _of_map(body["cells"])
    elif body["segment_m"]:
        parts = list(pairwise(_placed(body, body["segment_m"])))
    elif body["polygon_m"]:
        parts = split(_placed(body, body["polygon_m"]))
    elif body["size_m"]:
        x, y = (0.5 * side for side in body["size_m"])
        parts = [_placed(body, [(-x, -y), (x, -y), (x, y), (-x, y)])]
    else:
        x, y, z = body["position_m"] or (0.0, 0.0, 0.0)
        if not body["height_m"]:
            return Shape([Part([(x, y)], z, z)])
        parts = [[(x, y)]]
    heights = (-math.inf, math.inf) if endless else (0.0, float(body["height_m"]))
    return Shape([Part(corners, *heights) for corners in parts])


def _of_map(cells: Json) -> list[list[Corner]]:
    """The rectangles of a map: first row, row after the last, first column, column after the last."""
    frame = {"position_m": cells["origin"][:2], "heading_rad": cells["origin"][2]}
    scaled = (np.array(cells["rectangles"]) * cells["cell_m"]).tolist()
    return [_placed(frame, [(x, y), (far_x, y), (far_x, far_y), (x, far_y)]) for y, far_y, x, far_x in scaled]


def _placed(body: Json, corners: Sequence[Sequence[float]]) -> list[Corner]:
    x0, y0 = (body["position_m"] or (0.0, 0.0))[:2]
    cos, sin = math.cos(body["heading_rad"]), math.sin(body["heading_rad"])
    if x0 == y0 == body["heading_rad"] == 0.0:
        return [(x, y) for x, y in corners]
    return [(round(x0 + cos * x - sin * y, DIGITS), round(y0 + sin * x + cos * y, DIGITS)) for x, y in corners]


def split(corners: Sequence[Corner]) -> list[list[Corner]]:
    """Convex parts of a polygon: ears are cut off, the first one each time, and parts joined while they stay convex."""
    # The law has an inequality for each part, so the parts must be those of the controllers. They cover the polygon:
    # all ears are counter-clockwise, and their edges are those of the polygon and pairs of opposite ones, so their
    # winding numbers add up to its own.
    around = [*corners] if sum(a[0] * b[1] - a[1] * b[0] for a, b in edges_of(corners)) > 0.0 else [*corners][::-1]
    parts = [around] if _is_convex(around) else _ears(around)
    k = 0
    while k < len(parts):
        back = {(b, a) for a, b in edges_of(parts[k])}
        beside = (m for m in range(k + 1, len(parts)) if not back.isdisjoint(edges_of(parts[m])))
        both = next(((m, union) for m in beside if (union := _union(parts[k], parts[m]))), None)
        if both is None:
            k += 1  # where a union turns right, it does so whatever is joined to it
        else:
            del parts[both[0]]
            parts[k] = both[1]
    return [[corner for corner, turn in zip(part, _turns(part), strict=True) if turn > 0.0] for part in parts]


def edges_of(corners: Sequence[T]) -> list[tuple[T, T]]:
    """The edges of a polygon; the first one leads to the first corner."""
    return list(zip([corners[-1], *corners[:-1]], corners, strict=True))


def _turn(a: Corner, b: Corner, c: Corner) -> float:
    """Positive if the path a, b, c turns left."""
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])


def _turns(corners: Sequence[Corner]) -> list[float]:
    return [_turn(a, b, c) for (a, b), c in zip(edges_of(corners), [*corners[1:], corners[0]], strict=True)]


def _is_convex(corners: Sequence[Corner]) -> bool:
    return min(_turns(corners)) >= 0.0


def _ears(corners: Sequence[Corner]) -> list[list[Corner]]:
    """Triangles that turn left, with no other corner in them."""
    left, ears = [*corners], []
    while len(left) > 2:
        points = np.array(left)
        for k in range(len(left)):
            a, b, c = ear = [left[k - 2], left[k - 1], left[k]]
            if _turn(a, b, c) > 0.0 and not _surrounds(ear, points):
                break
        else:
            raise NotEstablished("a polygon has convex parts", f"{left} has no ear", f"{corners}")
        ears.append(ear)
        del left[k - 1]
    return ears


def _surrounds(ear: list[Corner], points: Array) -> bool:
    """Whether any of the points, (K, 2), is in a triangle, other than its corners."""
    sides = [(b[0] - a[0]) * (points[:, 1] - b[1]) - (b[1] - a[1]) * (points[:, 0] - b[0]) for a, b in edges_of(ear)]
    inside = np.flatnonzero(np.min(sides, axis=0) >= 0.0)
    return any((x, y) not in ear for x, y in points[inside].tolist())


def _union(part: list[Corner], other: list[Corner]) -> list[Corner] | None:
    """The union of two parts that share an edge, if it is convex."""
    for a, b in edges_of(part):
        if (b, a) in edges_of(other):
            k, m = part.index(b), other.index(a)
            both = [*part[k:], *part[:k], *[*other[m:], *other[:m]][1:-1]]
            return both if _is_convex(both) else None
    return None
