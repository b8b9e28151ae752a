"""Shortest planar path of a point robot among convex obstacles that may overlap.

The robot keeps a distance from the core of each obstacle (`convex`). The set that it keeps out of is a disc for a ball
and a rounded polygon for a wall or a polygon. These are open sets: running along a boundary is allowed, crossing the
inside is not. The boundary of a rounded polygon is made of circles round its corners and of their common outer
tangents. So a shortest path is made of straight segments tangent to circles and of arcs of those circles, and is found
exactly: the common tangents that no obstacle blocks and the free arcs between their ends form a graph, searched with
Dijkstra. Start and goal are circles of radius zero in it.

All points are in one planar frame, in m; angles are in rad. The private functions write a point (x, y) as the complex
number x + iy.
"""

import math
from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import accumulate
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from airground_drake.base.arrays import Array, Flags, Indices, read_only
from airground_drake.model.geometry import convex, tangents
from airground_drake.model.geometry.outline import BASE, CORNERS, COUNT, EXTENT, MIDDLE, TOP
from airground_drake.model.geometry.separation import are_separated
from airground_drake.model.geometry.tangents import EPS, Points

# Tolerance, m. A start or goal up to TOL inside an obstacle counts as on its boundary; a disc of radius up to TOL is
# ignored, and from walls and polygons at least twice as much is kept. It is meant for coordinates and radii up to
# 1e4 m, where rounding (2e-12 m) stays well below.
TOL = 1e-9

FEW = 64  # up to this number of circles all obstacles enter the graph; beyond it only those that a path runs into

SEARCHES = 12  # after this many searches, a quarter more obstacles enter the graph than the path runs into

SLACK = 1e-3  # additional angle at both ends of a corner's arc that must be covered, rad

# Largest angle of the chords that stand for an arc where obstacles are looked for that a path runs into, rad.
CHORD = 0.1


class NoPath(ValueError):  # noqa: N818
    """No free path exists; the message says why."""


@dataclass(frozen=True, eq=False)
class Path:
    """A planar curve of joined straight segments and circular arcs, parameterised by arc length; immutable."""

    # A row per piece in order of travel, (n, 6), n >= 1: x, y of its first point, m, its unit tangent there, signed
    # curvature, 1/m (0 straight, > 0 turning left), length, m. A path of zero length has tangent 0.
    pieces: Array
    length_m: float = field(init=False)  # in all, m
    _rows: tuple[tuple[float, ...], ...] = field(init=False, repr=False)
    _begins: tuple[float, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        pieces = read_only(self.pieces)
        ends = tuple(accumulate(pieces[:, 5].tolist(), initial=0.0))
        object.__setattr__(self, "pieces", pieces)
        object.__setattr__(self, "length_m", ends[-1])
        object.__setattr__(self, "_rows", tuple(map(tuple, pieces.tolist())))
        object.__setattr__(self, "_begins", ends[:-1])

    def at(self, s: float) -> tuple[Array, Array]:
        """Point, (2,), m, and unit tangent in the direction of travel, (2,), at an arc length, m, which is clipped."""
        x, y, tx, ty = self._at(s)
        return np.array((x, y)), np.array((tx, ty))

    def points(self, lengths: Iterable[float]) -> Array:
        """Points at arc lengths, m, as `at`; (n, 2), m."""
        return np.array([self._at(s)[:2] for s in lengths]).reshape(-1, 2)

    def _at(self, s: float) -> tuple[float, float, float, float]:
        s = min(max(s, 0.0), self.length_m)
        k = bisect_right(self._begins, s) - 1
        x, y, tx, ty, curvature, _ = self._rows[k]
        u = s - self._begins[k]
        if curvature == 0.0:
            return x + u * tx, y + u * ty, tx, ty
        sin, cos = math.sin(0.5 * curvature * u), math.cos(0.5 * curvature * u)
        chord, sin2, cos2 = 2.0 * sin / curvature, 2.0 * sin * cos, 1.0 - 2.0 * sin * sin
        x, y = x + chord * (cos * tx - sin * ty), y + chord * (cos * ty + sin * tx)
        return x, y, cos2 * tx - sin2 * ty, cos2 * ty + sin2 * tx


def shortest_path(start: ArrayLike, goal: ArrayLike, rows: Array, keep: ArrayLike) -> Path:
    """Shortest path of a point from start to goal that keeps its distance from all obstacles.

    If the start is too near to an obstacle, the path first goes straight to the nearest point of the boundary of the
    union of all that it has to keep out of (the only leg that crosses obstacles) and is the shortest from there on. The
    result depends on the arguments only, also where two paths are equally short.

    Only obstacles that a path runs into enter the graph, and its time grows with the square of their corners: a path
    past 1,000 rectangles at random takes about 0.2 s.

    Args:
        start: first point, (2,), m.
        goal: last point, (2,), m.
        rows: outlines of obstacles, (m, W), see `model.geometry.outline`; m = 0 gives the straight line. Heights do not
            count.
        keep: distances from their cores, (m,), m.

    Raises:
        NoPath: if the goal is too near to an obstacle, or if the start (or the point where it leaves the obstacles) and
            the goal are in different components of the free space.
        ValueError: if a number is not finite.
    """
    return PathsFrom(start, rows, keep).to(goal)


class PathsFrom:
    """Shortest paths from one start to any goal, each as `shortest_path`, among the same obstacles."""

    def __init__(self, start: ArrayLike, rows: Array, keep: ArrayLike) -> None:
        _need_finite(start, rows, keep)
        self._start, self._flat_rows = complex(*np.asarray(start)), _flat(rows)
        self._reach = np.asarray(keep, dtype=np.float64)
        self._around = _Obstacles.of(self._flat_rows, self._reach)

    @cached_property
    def _left(self) -> tuple[complex, "_Obstacles"]:
        """The start, or where it leaves the obstacles; and the obstacles, with that point on their boundary at most."""
        inside = self._around.lack(self._start) is not None
        free = _escape(self._start, self._around) if inside else self._start
        return free, self._around.shrunk(free)

    def to(self, goal: ArrayLike) -> Path:
        """The path to a goal, (2,), m; NoPath as for `shortest_path`."""
        _need_finite(goal)
        p, q = self._start, complex(*np.asarray(goal))
        if (lacking := self._around.lack(q)) is not None:
            raise NoPath(f"goal {_show(q)} is inside {lacking}")
        free, around = self._left
        around = around.shrunk(q)
        route = _straight(free, q)
        if convex.blocker(free.real, free.imag, q.real, q.imag, around.rows, around.keep - EPS, -1) >= 0:
            many = len(around.circles[1]) > FEW  # without a way the search would take long to come to an end
            begin, end = _places(np.array([free, q]))
            apart = many and are_separated(begin, end, self._flat_rows, self._reach - EPS)
            route = np.empty((0, 6)) if apart else _route_among(free, q, around)
        if not len(route):
            raise NoPath(f"no way from start {_show(p)} to goal {_show(q)}: obstacles enclose one of them")
        pieces = np.concatenate((_straight(p, free), route))
        kept = pieces[:, 5] > EPS
        return Path(pieces[kept] if kept.any() else np.array([[p.real, p.imag, 0.0, 0.0, 0.0, 0.0]]))


def _need_finite(*given: ArrayLike) -> None:
    if not all(np.isfinite(numbers).all() for numbers in given):
        raise ValueError(f"a path needs finite numbers, got {given}")


@dataclass(frozen=True, eq=False)
class _Obstacles:
    """The sets that a path must not enter."""

    rows: Array  # outlines at height 0, (m, W): discs, then walls and polygons
    keep: Array  # distances from their cores, (m,), m

    @classmethod
    def of(cls, rows: Array, keep: Array) -> Self:
        """Of outlines (m, W) at height 0, and distances from their cores, (m,), m: no points, no discs inside discs."""
        is_disc = rows[:, COUNT] == 1.0
        discs = np.flatnonzero(is_disc & (keep > TOL))
        discs = discs[_are_outermost(_middles(rows[discs]), keep[discs])]
        order = np.concatenate((discs, np.flatnonzero(~is_disc)))
        return cls(rows[order], np.where(is_disc, keep, np.maximum(keep, 2.0 * TOL))[order])

    @cached_property
    def first(self) -> int:
        return int((self.rows[:, COUNT] == 1.0).sum())

    @cached_property
    def cells(self) -> Indices:
        """The square cell that has the middle of each, as wide as the longest distance to keep."""
        middles = self.rows[:, MIDDLE:EXTENT] / self.keep.max(initial=0.0)
        return np.unique(np.floor(middles), axis=0, return_inverse=True)[1].ravel()

    @property
    def corners(self) -> tuple[Points, Points, Points]:
        """All corners, (n,), polygon by polygon, and the corners before and after each."""
        rows = self.rows[self.first :]
        count, width = rows[:, COUNT, None].astype(np.intp), int(rows[:, COUNT].max(initial=0.0))
        places = rows[:, CORNERS : CORNERS + 2 * width].reshape(len(rows), width, 2) @ np.array((1.0, 1.0j))
        at = np.arange(width)
        there = at < count
        before, after = (np.take_along_axis(places, (at + turn) % count, axis=1) for turn in (-1, 1))
        return places[there], before[there], after[there]

    @property
    def edges(self) -> tuple[Points, Points]:
        """First and last points of the straight parts of the boundaries, (n,)."""
        here, _, after = self.corners
        out = -1j * (after - here) / abs(after - here) * self.of_corners
        return here + out, after + out

    @property
    def of_corners(self) -> Array:
        """Distances to keep from the polygons of all corners, (n,), m."""
        return np.repeat(self.keep[self.first :], self.rows[self.first :, COUNT].astype(np.intp))

    @cached_property
    def circles(self) -> tuple[Points, Array, Points]:
        """Centres and radii of discs and of circles round corners, (n,), and the ways to the next corners, (2, n)."""
        here, before, after = self.corners
        kept = _are_outermost(here, self.of_corners)
        ways = np.stack((before - here, after - here))[:, kept]
        return (
            np.concatenate((_middles(self.rows[: self.first]), here[kept])),
            np.concatenate((self.keep[: self.first], self.of_corners[kept])),
            np.concatenate((np.zeros((2, self.first)), ways), axis=1),
        )

    @cached_property
    def touchable(self) -> Flags:
        """Which circles have a point that no obstacle covers, (n,); no free path touches another one."""
        # On a map that is one in eight: obstacles overlap. Of a corner's circle, only the arc between its two edges is
        # on the boundary of its own polygon. Of that arc a little more is looked at, for rounding.
        c, r, (before, after) = self.circles
        of_corner = before != 0.0
        begin = np.where(of_corner, np.angle(1j * before) - SLACK, 0.0)
        sweep = np.where(of_corner, np.angle(-after / np.where(of_corner, before, 1.0)) % (2.0 * np.pi), 2.0 * np.pi)
        sweep = np.minimum(sweep + 2.0 * SLACK, 2.0 * np.pi)
        return ~convex.arcs_are_covered(_places(c), r, begin, sweep, self.rows, self.keep - 2.0 * TOL)

    @cached_property
    def limits(self) -> tangents.Around:
        """What a path is made of."""
        c, r, ways = self.circles
        some = self.touchable
        return tangents.Around(c[some], r[some], ways[:, some], *self.edges, self.rows, self.keep - EPS)

    def lack(self, point: complex) -> str | None:
        """A description of the first obstacle that is too near to a point by more than TOL; or None."""
        inside = np.flatnonzero(self.distances(point) < self.keep - TOL)
        if not len(inside):
            return None
        k = int(inside[0])
        middle, keep = _show(complex(*self.rows[k, MIDDLE:EXTENT])), self.keep[k]
        if k < self.first:
            return f"the disc at {middle}, radius {keep}"
        return f"the obstacle about {middle}, with {keep} m round it"

    def distances(self, point: complex) -> Array:
        """Signed distances of a point from the cores, (m,), m."""
        return convex.distances(self.rows, np.array((point.real, point.imag, 0.0)), True)

    def shrunk(self, point: complex) -> Self:
        """These obstacles, shrunk so that a point up to TOL inside is on the boundary."""
        far = self.distances(point)
        return self if (self.keep <= far).all() else replace(self, keep=np.minimum(self.keep, far))

    def some(self, which: Flags) -> Self:
        """The obstacles selected by a mask, (m,)."""
        return replace(self, rows=self.rows[which], keep=self.keep[which])

    def clear(self, points: Points) -> Flags:
        """Which points, (n,), are outside all obstacles; (n,)."""
        return convex.points_are_free(_places(points), self.rows, self.keep - EPS)

    def entered(self, pieces: Array) -> Flags:
        """Which obstacles the pieces of a path (see ``Path``) enter, or for polygons nearly enter; (m,)."""
        discs = _entered(pieces, _middles(self.rows[: self.first]), self.keep[: self.first])
        begin, end, sagitta = _chords(pieces)
        rows, keep = self.rows[self.first :], self.keep[self.first :]
        return np.concatenate((discs, convex.in_the_way(_places(begin), _places(end), sagitta, rows, keep - EPS)))


def _flat(rows: Array) -> Array:
    """Outlines (m, W) at height 0."""
    flat_rows = rows.copy()
    flat_rows[:, BASE] = flat_rows[:, TOP] = 0.0
    return flat_rows


def _middles(rows: Array) -> Points:
    return rows[:, MIDDLE:EXTENT] @ np.array((1.0, 1.0j))


def _places(points: Points) -> Array:
    return np.column_stack([points.real, points.imag])


def _chords(pieces: Array) -> tuple[Points, Points, Array]:
    """Chords of pieces of a path (see ``Path``): both ends, and how far the path is from them at most, m, each (n,)."""
    count = np.maximum(1, np.ceil(abs(pieces[:, 4]) * pieces[:, 5] / CHORD)).astype(np.intp)
    x, y, tx, ty, curvature, length = np.repeat(pieces, count, axis=0).T
    step = length / np.repeat(count, count)
    along = step * (np.arange(len(step)) - np.repeat(np.cumsum(count) - count, count))
    half = 0.5 * curvature * step
    turn = np.exp(1j * curvature * along)
    chord = along * np.sinc(0.5 * curvature * along / np.pi) * np.exp(0.5j * curvature * along)
    begin = x + 1j * y + chord * (tx + 1j * ty)
    end = begin + step * np.sinc(half / np.pi) * np.exp(1j * half) * turn * (tx + 1j * ty)
    return begin, end, abs(0.25 * half * step)


def _show(z: complex) -> str:
    return f"({z.real:.6g}, {z.imag:.6g})"


def _are_outermost(c: Points, r: Array) -> Flags:
    """Which discs are not inside another one, of equal discs the first; (m,)."""
    if not len(r):
        return np.ones(0, dtype=bool)
    near = cKDTree(np.column_stack([c.real, c.imag])).query_pairs(np.ptp(r) + TOL, output_type="ndarray")
    i, j = np.concatenate([near, near[:, ::-1]]).T
    apart = abs(c[i] - c[j])
    within, around = apart + r[i] <= r[j] + EPS, apart + r[j] <= r[i] + EPS
    keep = np.ones(len(r), dtype=bool)
    keep[i[within & (~around | (j < i))]] = False
    return keep


def _escape(p: complex, around: _Obstacles) -> complex:
    """The nearest point to p, which is inside, of the boundary of the union of all obstacles."""
    depth = around.distances(p) - around.keep
    reach = 2.0 * float(around.keep.max(initial=0.0))
    while True:  # as far as it reaches, the obstacles that do, too, are the union
        near = depth <= reach
        free = _exit(p, around.some(near))
        if abs(free - p) <= reach or near.all():
            return free
        reach *= 2.0


def _exit(p: complex, around: _Obstacles) -> complex:
    """The nearest point to p of the boundary of the union, tried at all places where boundaries cross."""
    c, r, _ = around.circles
    begin, end = around.edges
    e = np.where(abs(p - c) > EPS, p - c, 1.0)  # along +x from a centre
    u, length = (end - begin) / abs(end - begin), abs(end - begin)
    feet = begin + np.clip(((p - begin) * u.conj()).real, 0.0, length) * u
    i, j = np.triu_indices(len(begin), 1)
    with np.errstate(divide="ignore", invalid="ignore"):  # of parallel edges
        share = ((begin[j] - begin[i]) * u[j].conj()).imag / (u[i] * u[j].conj()).imag
    met = (share >= 0.0) & (share <= length[i])
    candidates = np.concatenate((
        (c + r / abs(e) * e)[abs(p - c) < r], np.array(tangents.meetings(c, r, begin, end)[0], dtype=complex),
        feet, begin[i[met]] + share[met] * u[i[met]],
    ))  # fmt: skip
    return complex(min(candidates[around.clear(candidates)], key=lambda z: float(abs(z - p))))


def _straight(begin: complex, end: complex) -> Array:
    """The straight piece (see ``Path``) between two points, (1, 6)."""
    way = end - begin
    unit = way / max(abs(way), 1e-300)
    return np.array([[begin.real, begin.imag, unit.real, unit.imag, 0.0, abs(way)]])


def _route_among(p: complex, q: complex, around: _Obstacles) -> Array:
    """The pieces of the shortest path: one among some obstacles is shortest if it enters none of the others."""
    if len(around.circles[1]) <= FEW:
        return tangents.shortest(p, q, around.limits)
    some = around.entered(_straight(p, q))
    searches = 0
    while True:
        route = tangents.shortest(p, q, around.some(some).limits)
        new = around.entered(route) & ~some
        if not new.any():
            return route
        some, searches = some | new, searches + 1
        if searches >= SEARCHES:  # along a wall of many parts: add several at once, one per cell
            middles = around.rows[:, MIDDLE:EXTENT]
            apart, _ = cKDTree(middles[new]).query(middles)
            apart[np.isin(around.cells, around.cells[some])] = np.inf
            order = np.argsort(apart, kind="stable")
            nearest = order[np.sort(np.unique(around.cells[order], return_index=True)[1])]
            some[nearest[np.isfinite(apart[nearest])][: int(some.sum()) // 4]] = True


def _entered(pieces: Array, c: Points, r: Array) -> Flags:
    """Which discs the pieces of a path (see ``Path``) enter, (m,)."""
    x, y, tx, ty, curvature, length = pieces.T[:, :, None]
    begin, heading, bent = x + 1j * y, tx + 1j * ty, curvature != 0.0
    along = np.clip(((c - begin) * heading.conj()).real, 0.0, length)
    hub = begin + np.where(bent, 1j * heading / np.where(bent, curvature, 1.0), 0.0)
    turned = np.angle((c - hub) / np.where(bent, begin - hub, 1.0)) * np.sign(curvature) % (2.0 * np.pi)
    sweep = length * abs(curvature)
    # the point of an arc that is nearest to a centre is in its direction or, beyond the ends, the nearer end
    turn = np.where(turned <= sweep, turned, np.where(turned - sweep < 2.0 * np.pi - turned, sweep, 0.0))
    on_arc = hub + (begin - hub) * np.exp(1j * np.sign(curvature) * turn)
    nearest = np.where(bent, on_arc, begin + along * heading)
    return np.asarray((abs(nearest - c) < r - EPS).any(axis=0))
