"""Shapes of obstacles: convex parts, their signed distances, and the least of these along straight motion.

A part is a prism: the convex hull of corners in the plane, from one height to another. One corner of one height is a
point: the centre of a ball, or a robot. Distances are from parts; radii are in the distance to be kept. Inside a part
the distance is minus the depth. From several parts it is the least.

The signed distance is a convex function of the place, and changes by no more than the place moves.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import cached_property
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from .files import Json
from .rules import Array, Flags, NotEstablished

Corner = tuple[float, float]
DIGITS = 12
"""Corners that are turned or moved are rounded to so many digits after the point, m."""
ENDLESS_M = 1e6
"""Height of the walls of an arena, m."""
ROWS = 50
"""Steps of a slice of a run; a slice is left out as a whole if it is far away."""
ROUNDING_M = 1e-6
"""Bounds of distances are lowered by this, because of rounding."""
THIRDS = 64
"""How often a step is shortened by a third: what is left is 5e-12 of it."""


class Normal(NamedTuple):
    """A vector away from a part, of any length; the signed distance is `beyond` / |`vector`|."""

    vector: list[Fraction]
    beyond: Fraction


class Part:
    """A convex part of a shape: corners counter-clockwise, from `base_m` to `top_m`.

    In the methods places are (K, 3), m; `planar`: they stay at their height, so that no way out leads over the top.
    """

    def __init__(self, corners: Sequence[Corner], base_m: float = 0.0, top_m: float = 0.0) -> None:
        """Make a part from its corners and heights."""
        self.corners, self.base_m, self.top_m = corners, base_m, top_m
        self.begin = np.array(corners, dtype=np.float64)
        self.edge = np.roll(self.begin, -1, axis=0) - self.begin
        self.square = np.where((square := (self.edge**2).sum(axis=1)) > 0.0, square, 1.0)
        self.outward = np.column_stack([self.edge[:, 1], -self.edge[:, 0]]) / np.sqrt(self.square)[:, None]

    def signed_m(self, places: Array, planar: bool) -> Array:
        """Signed distances, (K,), m."""
        rise = np.maximum(places[:, 2] - self.top_m, self.base_m - places[:, 2])
        to = places[:, None, :2] - self.begin
        share = np.clip((to * self.edge).sum(axis=2) / self.square, 0.0, 1.0)
        flat = np.linalg.norm(to - share[..., None] * self.edge, axis=2).min(axis=1)
        found = np.hypot(flat, np.maximum(rise, 0.0))
        if len(self.corners) > 2:
            side = (to * self.outward).sum(axis=2).max(axis=1)
            found = np.where(side <= 0.0, side if planar else np.maximum(side, rise), found)
        return np.asarray(found)

    def between_m(self, places: Array, at_m: Array, planar: bool, reach_m: float) -> Array:
        """Least signed distances on the straight steps from place to place, (K - 1,), m, where below `reach_m`.

        Args:
            places: as above.
            at_m: their signed distances, (K,), m.
            planar: as above.
            reach_m: of a step that stays beyond it, the result may be too large.
        """
        start, step = places[:-1], np.diff(places, axis=0)
        found = np.minimum(at_m[:-1], at_m[1:])
        bound = 0.5 * (at_m[:-1] + at_m[1:] - np.linalg.norm(step, axis=1)) - ROUNDING_M
        k = np.flatnonzero(~(bound >= reach_m))
        low, high = np.zeros(len(k)), np.ones(len(k))
        for _ in range(THIRDS if len(k) else 0):  # a convex function has its least value beside the lower of two
            one, two = (2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0
            first, second = (self.signed_m(start[k] + s[:, None] * step[k], planar) for s in (one, two))
            found[k] = np.minimum(found[k], np.minimum(first, second))
            low, high = np.where(first < second, low, one), np.where(first < second, two, high)
        return found

    @cached_property
    def edges(self) -> list[tuple[list[Fraction], list[Fraction]]]:
        """First corner of each edge, and the vector to the next one, exactly."""
        exact = [[Fraction(x), Fraction(y)] for x, y in self.corners]
        return [(a, [b[0] - a[0], b[1] - a[1]]) for a, b in zip(exact, exact[1:] + exact[:1], strict=True)]

    def away(self, place: Sequence[Fraction], planar: bool) -> Normal:
        """Exact direction and distance from the nearest point; from the nearest face inside."""
        x, y, z = place
        base, top = Fraction(self.base_m), Fraction(self.top_m)
        height, sides, offsets = z - min(max(z, base), top), [], []
        for (ax, ay), (ex, ey) in self.edges:
            px, py, square = x - ax, y - ay, ex * ex + ey * ey
            share = min(max((px * ex + py * ey) / square, Fraction()), Fraction(1)) if square else 0
            offset = [px - share * ex, py - share * ey, height]
            offsets.append(Normal(offset, sum((c * c for c in offset), Fraction())))
            sides.append(Normal([ey, -ex, Fraction()], px * ey - py * ex))
        if len(sides) < 3 or any(side.beyond > 0 for side in sides):
            return min(offsets, key=lambda each: each.beyond)
        if not planar:
            up = [Fraction(), Fraction(), Fraction(1)]
            sides += [Normal(up, z - top), Normal([-c for c in up], base - z)]
        return max(sides, key=lambda each: float(each.beyond) / math.hypot(*map(float, each.vector)))


class Shape:
    """One or more convex parts; places and `planar` as in `Part`.

    Attributes:
        parts: m of them.
        low: a corner of a box round each, (m, 3), m.
        high: the opposite corner.
    """

    def __init__(self, parts: Sequence[Part]) -> None:
        """Make a shape from its parts."""
        self.parts = parts
        self.low = np.array([[*part.begin.min(axis=0), part.base_m] for part in parts])
        self.high = np.array([[*part.begin.max(axis=0), part.top_m] for part in parts])

    def bounds_m(self, low: Array, high: Array) -> Array:
        """Lower bounds of the distances of all in S boxes from each part, (S, m); -inf where they may meet.

        Args:
            low: a corner of each box, (S, 3), m.
            high: the opposite corner.
        """
        gap = np.maximum(low[:, None] - self.high, self.low - high[:, None])
        apart = np.linalg.norm(np.maximum(gap, 0.0), axis=2) - ROUNDING_M
        return np.where(apart > 0.0, apart, -np.inf)

    def signed_m(self, places: Array, planar: bool) -> Array:
        """Signed distances, (K,), m."""
        return np.min([part.signed_m(places, planar) for part in self.parts], axis=0)

    def near(self, places: Array) -> Iterator[tuple[float, Part, slice]]:
        """Each part with each slice of places, the nearest first, and a lower bound of its distance, m."""
        bounds = self.bounds_m(*boxes_of(places))
        for k in np.argsort(bounds, axis=None):
            begin, part = divmod(int(k), len(self.parts))
            yield float(bounds.flat[k]), self.parts[part], slice(ROWS * begin, ROWS * (begin + 1) + 1)

    def least_m(self, places: Array, planar: bool, reach_m: float = np.inf) -> float:
        """Least signed distance along the straight steps from place to place, m, at most `reach_m`."""
        for bound, part, rows in self.near(places):
            if bound >= reach_m:
                break
            at_m = part.signed_m(places[rows], planar)
            reach_m = min(reach_m, float(at_m.min()))
            reach_m = min(reach_m, float(part.between_m(places[rows], at_m, planar, reach_m).min(initial=np.inf)))
        return reach_m

    def within(self, places: Array, planar: bool, reach_m: float) -> tuple[Flags, Flags]:
        """Which places, (K,), and which straight steps between them, (K - 1,), come nearer than `reach_m`."""
        there, passes = np.zeros(len(places), dtype=bool), np.zeros(len(places) - 1, dtype=bool)
        for bound, part, rows in self.near(places):
            if bound >= reach_m:
                break
            at_m = part.signed_m(places[rows], planar)
            there[rows] |= at_m < reach_m
            passes[rows.start : rows.stop - 1] |= part.between_m(places[rows], at_m, planar, reach_m) < reach_m
        return there, passes


POINT = Shape([Part([(0.0, 0.0)])])


def boxes_of(places: Array) -> tuple[Array, Array]:
    """Two opposite corners of a box round each slice of places (K, 3), m: (S, 3) each. A row joins two slices."""
    begin = np.arange(0, max(len(places) - 1, 1), ROWS)
    low, high = np.minimum.reduceat(places, begin), np.maximum.reduceat(places, begin)
    low[:-1], high[:-1] = np.minimum(low[:-1], places[begin[1:]]), np.maximum(high[:-1], places[begin[1:]])
    return low, high


def shape_of(body: Json) -> Shape:
    """The shape of an obstacle, by its entry in a scenario.

    Raises:
        NotEstablished: if it is a polygon that cannot be split into convex parts.
    """
    parts: Sequence[Sequence[Corner]]
    if body["segment_m"]:
        parts = list(pairwise(_placed(body, body["segment_m"])))
    elif body["polygon_m"]:
        parts = split(_placed(body, body["polygon_m"]))
    elif body["size_m"]:
        x, y = (0.5 * side for side in body["size_m"])
        parts = [_placed(body, [(-x, -y), (x, -y), (x, y), (-x, y)])]
    else:
        x, y, z = body["position_m"]
        return Shape([Part([(x, y)], *((0.0, body["height_m"]) if body["height_m"] else (z, z)))])
    return Shape([Part(each, 0.0, body["height_m"]) for each in parts])


def _placed(body: Json, corners: Sequence[Sequence[float]]) -> list[Corner]:
    """Corners in the frame of a body, in the world frame."""
    x0, y0 = (body["position_m"] or (0.0, 0.0))[:2]
    cos, sin = math.cos(body["heading_rad"]), math.sin(body["heading_rad"])
    if x0 == y0 == body["heading_rad"] == 0.0:
        return [(x, y) for x, y in corners]
    return [(round(x0 + cos * x - sin * y, DIGITS), round(y0 + sin * x + cos * y, DIGITS)) for x, y in corners]


def split(corners: Sequence[Corner]) -> list[list[Corner]]:
    """Convex parts of a polygon: ears are cut off, the first one each time, and parts joined while they stay convex.

    The law has an inequality for each part, so the parts must be those of the controllers. Their edges must be those of
    the polygon and pairs in opposite directions: then they cover it, because their winding numbers add up to its own.

    Raises:
        NotEstablished: if they are not.
    """
    around = [*corners] if sum(a[0] * b[1] - a[1] * b[0] for a, b in _edges(corners)) > 0.0 else [*corners][::-1]
    parts = [around] if _is_convex(around) else _triangles(around)
    while True:
        pairs = combinations(range(len(parts)), 2)
        both = next(((i, j, union) for i, j in pairs if (union := _union(parts[i], parts[j]))), None)
        if both is None:
            break
        parts[both[0]] = both[2]
        del parts[both[1]]
    edges = [edge for part in parts for edge in _edges(part)]
    if len({*edges}) < len(edges) or {*edges} - {(b, a) for a, b in edges} != {*_edges(around)}:
        raise NotEstablished("convex parts make up a polygon", f"{len(parts)} parts do not", f"{corners}")
    return [
        [b for (a, b), (_, c) in pairwise([*_edges(part), _edges(part)[0]]) if _turn(a, b, c) > 0.0] for part in parts
    ]


def _edges(corners: Sequence[Corner]) -> list[tuple[Corner, Corner]]:
    return list(zip([corners[-1], *corners[:-1]], corners, strict=True))


def _turn(a: Corner, b: Corner, c: Corner) -> float:
    """Above 0 if the way from a over b to c turns left."""
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])


def _is_convex(corners: Sequence[Corner]) -> bool:
    return all(_turn(corners[k - 2], corners[k - 1], corners[k]) >= 0.0 for k in range(len(corners)))


def _triangles(corners: Sequence[Corner]) -> list[list[Corner]]:
    """An ear turns left, and no other corner is in it."""
    left, found = [*corners], []
    while len(left) > 3:
        for k in range(len(left)):
            a, b, c = ear = [left[k - 2], left[k - 1], left[k]]
            sides = ((p, _turn(a, b, p), _turn(b, c, p), _turn(c, a, p)) for p in left if p not in ear)
            if _turn(a, b, c) > 0.0 and not any(min(turns) >= 0.0 for _, *turns in sides):
                break
        else:
            raise NotEstablished("convex parts make up a polygon", f"{left} has no ear", f"{corners}")
        found.append(ear)
        del left[k - 1]
    return [*found, left]


def _union(one: list[Corner], other: list[Corner]) -> list[Corner] | None:
    """The union of two parts that share an edge, if it is convex."""
    for a, b in _edges(one):
        if (b, a) in _edges(other):
            k, m = one.index(b), other.index(a)
            both = [*one[k:], *one[:k], *[*other[m:], *other[:m]][1:-1]]
            return both if _is_convex(both) else None
    return None
