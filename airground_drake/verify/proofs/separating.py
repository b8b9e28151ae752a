"""Integer vectors that separate a moving point from a convex set: proofs for DistanceChecker.v."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import chain, product
from math import gcd, isqrt
from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array

Vector = tuple[int, int, int]
Stretch = tuple[int, Vector]  # a number of periods, and the vector that separates during all of them

# Lengths of rounded vectors. They lose about the distance / length^2, and Coq multiplies short numbers faster.
SCALES = (2**4, 2**12, 2**30)
TRIES = 8  # number of searches for a longer stretch


class Prism(NamedTuple):
    """A prism over a convex outline between two heights, in parts of a metre."""

    outline: tuple[tuple[int, int], ...]  # its corners, counter-clockwise; two of a wall, one of a post
    base: int = 0  # lowest z
    top: int = 0  # highest z; the base if the set is flat

    @property
    def levels(self) -> list[int]:
        return [*dict.fromkeys((self.base, self.top))]

    @property
    def corners(self) -> list[Vector]:
        return [(x, y, z) for z in self.levels for x, y in self.outline]

    @property
    def edges(self) -> list[tuple[Vector, Vector]]:
        """A corner and the vector along the edge to another one."""
        sides = [*zip(self.outline, (*self.outline[1:], self.outline[0]), strict=True)]
        flat = [((*a, z), (b[0] - a[0], b[1] - a[1], 0)) for z in self.levels for a, b in sides if a != b]
        upright = [((*a, self.base), (0, 0, self.top - self.base)) for a in self.outline if self.top > self.base]
        return flat + upright

    @property
    def normals(self) -> list[Vector]:
        """Outward normals of its faces and of its outline."""
        sides = [_reduced((y, -x, 0)) for _, (x, y, _) in self.edges if x or y]
        return [*dict.fromkeys(sides), (0, 0, 1), (0, 0, -1)]

    def nearest(self, points: Array) -> Array:
        """The nearest points of the set to given points, in floating point; both (k, 3)."""
        outline = np.array(self.outline, dtype=np.float64)
        nearest = points.copy()
        best = np.full(len(points), np.inf)
        outside = np.full(len(points), len(outline) < 3)
        for begin, end in zip(outline, np.roll(outline, -1, axis=0), strict=True):
            side, to = end - begin, points[:, :2] - begin
            along = np.clip(to @ side / max(side @ side, np.finfo(float).tiny), 0.0, 1.0)
            place = begin + along[:, None] * side
            apart = np.linalg.norm(points[:, :2] - place, axis=1)
            nearest[apart < best, :2] = place[apart < best]
            best = np.minimum(best, apart)
            outside |= side[0] * to[:, 1] - side[1] * to[:, 0] < 0.0
        nearest[~outside, :2] = points[~outside, :2]
        nearest[:, 2] = np.clip(points[:, 2], self.base, self.top)
        return nearest


def separating(prisms: Sequence[Prism], way: Sequence[Vector], safe: int) -> list[list[Stretch]]:
    """Vectors that prove a point's distance on its path, each for as many periods as possible."""
    # way: places of the point at the rows, two or more; straight in between. Parts.
    # Returns for each set stretches that make up the way. If the distance is not kept, the last one serves the rest of
    # it, and is wrong.
    rows = np.array(way, dtype=np.float64)
    return [_stretches(prism, way, _Search(prism, way, rows, safe)) for prism in prisms]


def _stretches(prism: Prism, way: Sequence[Vector], search: _Search) -> list[Stretch]:
    stretches = list[Stretch]()
    row, last = 0, len(way) - 1
    while row < last:
        end, vector = search.longest(row)
        if end == row:
            _, vector = apart(prism, way[row], way[row + 1])
            end = search.end(vector, row)
        if end == row:
            return [*stretches, (last - row, vector)]
        stretches.append((end - row, vector))
        row = end
    return stretches


class _Search:
    """Search for the periods of a path that a vector covers."""

    def __init__(self, prism: Prism, way: Sequence[Vector], rows: Array, safe: int) -> None:
        self._corners = prism.corners
        self._way = way
        self._rows = rows
        self._safe = safe
        offsets = self._rows - prism.nearest(self._rows)
        self._apart = np.linalg.norm(offsets, axis=1)
        self._away = offsets / np.maximum(self._apart, np.finfo(float).tiny)[:, None]
        self._normals = prism.normals
        self._doubt = 1e-12 * max(np.abs(self._rows).max(), np.abs(np.array(self._corners, dtype=float)).max(), safe)

    def longest(self, row: int) -> tuple[int, Vector]:
        """The last row of the longest covered stretch from a row, and its vector."""
        last = len(self._way) - 1
        nearest = row + int(np.argmin(self._apart[row:]))
        best, before = (row, (0, 0, 0)), -1
        short = [normal for normal in self._normals if max(map(abs, normal)) <= SCALES[0]]
        tried: Iterator[Vector] = chain(short, self._rounded(self._away[[nearest, row]]), self._normals)
        for _ in range(TRIES):
            for vector in tried:
                if best[0] < last and (end := self.end(vector, row)) > best[0]:
                    best = end, vector
            if best[0] in (before, last):
                break
            before = end = best[0]
            nearest = row + int(np.argmin(self._apart[row : end + 2]))
            first, middle, near, after = self._away[[row, (row + end) // 2, nearest, end + 1]]
            tried = self._rounded(np.array([first, middle, near, after, first + after, near + after]))
        return best

    def end(self, vector: Vector, row: int) -> int:
        """The last row of the consecutive periods from a row that a vector covers; the row itself if none."""
        if not any(vector):
            return row
        along = max(dot(vector, corner) for corner in self._corners)
        least = along + max(1, root_up(self._safe**2 * dot(vector, vector)))
        direction = np.array(vector, dtype=np.float64)
        beyond = self._rows[row:] @ direction - float(least)
        doubt = self._doubt * np.linalg.norm(direction)
        for k in np.flatnonzero(beyond <= doubt).tolist():
            if beyond[k] < -doubt or dot(vector, self._way[row + k]) < least:
                return row + max(k - 1, 0)
        return len(self._way) - 1

    def _rounded(self, directions: Array) -> Iterator[Vector]:
        """Directions (k, 3) as integer vectors, short ones first."""
        for length in SCALES:
            for x, y, z in np.rint(directions * length).astype(int).tolist():
                yield _reduced((x, y, z))


def apart(prism: Prism, begin: Vector, end: Vector) -> tuple[Fraction, Vector]:
    """The least distance of a set from a point that moves straight from one place to another, squared, in parts."""
    # Returns the square, 0 if they meet, and the vector that separates them: the direction of the distance.
    best = (Fraction(0), (0, 0, 0))
    corners = prism.corners
    for vector in _directions(prism, begin, end):
        reach = min(dot(vector, begin), dot(vector, end)) - max(dot(vector, corner) for corner in corners)
        if reach > 0:
            best = max(best, (Fraction(reach * reach, dot(vector, vector)), vector))
    return best


def _directions(prism: Prism, begin: Vector, end: Vector) -> Iterator[Vector]:
    """Candidate directions of the least distance: from corners, edges or faces to an end of the path, or all of it."""
    way = _minus(end, begin)
    for corner in prism.corners:
        to = _minus(begin, corner)
        yield from (to, _minus(end, corner))
        yield _minus(_times(dot(way, way), to), _times(dot(to, way), way))
    for (corner, edge), place in product(prism.edges, (begin, end)):
        to = _minus(place, corner)
        yield _minus(_times(dot(edge, edge), to), _times(dot(to, edge), edge))
        across = _cross(way, edge)
        yield from (across, _times(-1, across))
    yield from prism.normals


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _times(s: int, a: Vector) -> Vector:
    return s * a[0], s * a[1], s * a[2]


def dot(a: Vector, b: Vector) -> int:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _reduced(a: Vector) -> Vector:
    common = gcd(*a) or 1
    return a[0] // common, a[1] // common, a[2] // common


def root_up(square: int) -> int:
    root = isqrt(square)
    return root + (root * root < square)
