"""Shortest planar path of a point robot among discs that may overlap.

The discs are open sets: running along a circle is allowed, crossing its inside is not. A shortest path is made of
straight segments tangent to circles and of arcs of those circles, so it is found exactly: the common tangents that no
disc blocks and the uncovered arcs between their ends form a graph, searched with Dijkstra. Start and goal are circles
of radius zero in it.

All points are in one planar frame, in m; angles are in rad. The private functions write a point (x, y) as the complex
number x + iy.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass, field
from itertools import accumulate

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from airground_drake.base.arrays import Array, read_only
from airground_drake.geometry.convex import CORNERS

Points = NDArray[np.complex128]

TOL = 1e-9
"""Tolerance, m. A start or goal up to TOL inside a circle counts as on it; a disc of radius up to TOL is ignored. It is
meant for coordinates and radii up to 1e4 m, where rounding (2e-12 m) stays well below."""
_EPS = TOL / 10
"""Room for rounding, m: legs may dip so far into a disc, a disc that sticks out of another by less is dropped, shorter
pieces are left out of the path."""

FEW = 64
"""Up to this number all discs enter the graph; beyond it only the discs that a path runs into."""

AT_ONCE = 1_000_000
"""Largest number of pairs of a segment and a disc that are tested together, to limit memory."""


class NoPath(ValueError):  # noqa: N818
    """No free path exists; the message says which point is at fault and why."""


@dataclass(frozen=True, eq=False)
class Path:
    """A planar curve of joined straight segments and circular arcs, parameterised by arc length; immutable.

    Attributes:
        pieces: (n, 6), n >= 1, a row per piece in order of travel: x, y of its first point, m, its unit tangent there,
            signed curvature, 1/m (0 straight, > 0 turning left), length, m. A path of zero length has tangent 0.
        length_m: total length, m.
    """

    pieces: Array
    length_m: float = field(init=False)
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
        """Point, (2,), m, and unit tangent in the direction of travel, (2,), at an arc length, m.

        The arc length is clipped to the path; the tangent of a path of zero length is 0.
        """
        s = min(max(s, 0.0), self.length_m)
        k = bisect_right(self._begins, s) - 1
        x, y, tx, ty, curvature, _ = self._rows[k]
        u = s - self._begins[k]
        if curvature == 0.0:
            return np.array((x + u * tx, y + u * ty)), np.array((tx, ty))
        sin, cos = math.sin(0.5 * curvature * u), math.cos(0.5 * curvature * u)
        chord, sin2, cos2 = 2.0 * sin / curvature, 2.0 * sin * cos, 1.0 - 2.0 * sin * sin
        position = np.array((x + chord * (cos * tx - sin * ty), y + chord * (cos * ty + sin * tx)))
        return position, np.array((cos2 * tx - sin2 * ty, cos2 * ty + sin2 * tx))


def shortest_path(start: ArrayLike, goal: ArrayLike, rows: Array, keep: ArrayLike) -> Path:
    """Shortest path of a point from start to goal outside all the discs.

    If the start is strictly inside a disc, the path first goes straight to the nearest point of the boundary
    of the union of the discs (the only leg that crosses discs) and is the shortest from there on. The result
    depends on the arguments only, also where two paths are equally short.

    Args:
        start: first point, (2,), m.
        goal: last point, (2,), m.
        rows: outlines of balls, (m, W), see `geometry.convex`; m = 0 gives the straight line.
        keep: distances from their cores, (m,), m: the radii of the discs.

    Raises:
        NoPath: if the goal is strictly inside a disc, or if the start (or the point where it leaves the
            discs) and the goal are in different components of the free space.
        ValueError: if a number is not finite.
    """
    given = start, goal, rows, keep
    if not all(np.isfinite(numbers).all() for numbers in given):
        raise ValueError(f"a path needs finite numbers, got {given}")
    p, q = complex(*np.asarray(start)), complex(*np.asarray(goal))
    c, r = rows[:, CORNERS : CORNERS + 2] @ np.array((1.0, 1.0j)), np.asarray(keep, dtype=np.float64)
    c, r = _outermost(c, r)
    inside = abs(c - q) < r - TOL
    if inside.any():
        raise NoPath(f"goal {_show(q)} is inside the disc at {_show(c[inside][0])}, radius {r[inside][0]}")
    free = _escape(p, c, r) if (abs(c - p) < r - TOL).any() else p
    for point in (free, q):  # up to TOL inside a circle: shrink the disc to put the point on the circle
        r = np.minimum(r, abs(c - point))
    route = _route_among(free, q, c, r)
    if route is None:
        beyond = p + 1.0 + np.max(abs(c - p) + r)
        shut = [n for n, z in (("start", free), ("goal", q)) if _route_among(z, beyond, c, r) is None]
        raise NoPath(f"no way from start {_show(p)} to goal {_show(q)}: discs enclose {' and '.join(shut)}")
    leg = np.array([free - p])
    pieces = np.concatenate((_rows(np.array([p]), leg, np.zeros(1), abs(leg)), route))
    kept = pieces[:, 5] > _EPS
    return Path(pieces[kept] if kept.any() else np.array([[p.real, p.imag, 0.0, 0.0, 0.0, 0.0]]))


def _show(z: complex) -> str:
    return f"({z.real:.6g}, {z.imag:.6g})"


def _outermost(c: Points, r: Array) -> tuple[Points, Array]:
    """Drop the discs that are inside another one; of equal discs keep the first."""
    c, r = c[r > TOL], r[r > TOL]
    if not len(r):
        return c, r
    near = cKDTree(np.column_stack([c.real, c.imag])).query_pairs(np.ptp(r) + TOL, output_type="ndarray")
    i, j = np.concatenate([near, near[:, ::-1]]).T
    apart = abs(c[i] - c[j])
    within, around = apart + r[i] <= r[j] + _EPS, apart + r[j] <= r[i] + _EPS
    keep = np.ones(len(r), dtype=bool)
    keep[i[within & (~around | (j < i))]] = False
    return c[keep], r[keep]


def _clear(points: Points, c: Points, r: Array) -> NDArray[np.bool_]:
    """Which points, shape (n, 1) or one per disc (n, m), are outside all discs; shape (n,)."""
    return np.asarray((abs(points - c) >= r - _EPS).all(axis=1))


def _passable(a: Points, b: Points, c: Points, r: Array) -> NDArray[np.bool_]:
    """Which segments, from (n,) to (n,), no disc blocks; shape (n,)."""
    u = (b - a) / np.maximum(abs(b - a), 1e-300)
    free = np.ones(len(a), dtype=bool)
    for some in np.array_split(np.arange(len(a)), len(a) * len(r) // AT_ONCE + 1):
        along = np.clip(((c - a[some, None]) * u[some, None].conj()).real, 0.0, abs(b - a)[some, None])
        free[some] = _clear(a[some, None] + along * u[some, None], c, r)
    return free


def _crossings(c: Points, r: Array) -> tuple[Points, NDArray[np.intp]]:
    """The points where two circles cross, (n,), and the indices of the two circles, (2, n)."""
    i, j = np.triu_indices(len(r), 1)
    d = abs(c[j] - c[i])
    real = (d > abs(r[i] - r[j])) & (d <= r[i] + r[j])
    i, j, d = i[real], j[real], d[real]
    a = 0.5 * (d + (r[i] - r[j]) * (r[i] + r[j]) / d)
    h = np.sqrt(np.maximum((r[i] - a) * (r[i] + a), 0.0))
    u = (c[j] - c[i]) / d
    return np.concatenate((c[i] + (a + 1j * h) * u, c[i] + (a - 1j * h) * u)), np.tile((i, j), 2)


def _escape(p: complex, c: Points, r: Array) -> complex:
    """The nearest point to p, which is inside a disc, of the boundary of the union of the discs."""
    reach = 2.0 * float(r.max())
    while True:  # as far as it reaches, the discs that do, too, are the union
        near = abs(c - p) - r <= reach
        found = _exit(p, c[near], r[near])
        if abs(found - p) <= reach or near.all():
            return found
        reach *= 2.0


def _exit(p: complex, c: Points, r: Array) -> complex:
    """As `_escape`, with all crossings of the circles."""
    e = np.where(abs(p - c) > _EPS, p - c, 1.0)  # along +x from a centre
    candidates = np.concatenate(((c + r / abs(e) * e)[abs(p - c) < r], _crossings(c, r)[0]))
    return complex(min(candidates[_clear(candidates[:, None], c, r)], key=lambda z: float(abs(z - p))))


def _tangents(c: Points, r: Array) -> tuple[Points, Points, NDArray[np.intp]]:
    """Both ends of all common tangents, (n,), and the circles they touch, (2, n); 0, 1 are points."""
    i, j = np.tile(np.triu_indices(len(r), 1), 4)
    side, turn = np.repeat([[1.0, 1.0, -1.0, -1.0], [1.0, -1.0, 1.0, -1.0]], len(i) // 4, axis=1)
    d, k = abs(c[j] - c[i]), r[i] - side * r[j]  # side: 1 outer tangent, -1 inner
    real = (d >= abs(k) - _EPS) & ((i > 1) | (side > 0.0))  # a point has two tangents to a circle, not four
    i, j, side, turn, d, k = (v[real] for v in (i, j, side, turn, d, k))
    u = (c[j] - c[i]) / d
    d = np.where(d - abs(k) <= _EPS, abs(k), d)  # touching
    normal = (k + 1j * turn * np.sqrt((d - k) * (d + k))) / d * u
    return c[i] + r[i] * normal, c[j] + side * r[j] * normal, np.array((i, j))


def _rows(begin: Points, heading: Points, curvature: Array, length: Array) -> Array:
    """Rows of ``Path.pieces``; the headings may have any length, also zero."""
    unit = heading / np.maximum(abs(heading), 1e-300)
    return np.stack((begin.real, begin.imag, unit.real, unit.imag, curvature, length), axis=1)


def _route_among(p: complex, q: complex, c: Points, r: Array) -> Array | None:
    """As `_route`, also among many discs: a shortest path among some that runs into none of the others is shortest."""
    if len(r) <= FEW:
        return _route(p, q, c, r)
    some = _entered(_rows(np.array([p]), np.array([q - p]), np.zeros(1), np.array([abs(q - p)])), c, r)
    while True:
        route = _route(p, q, c[some], r[some])
        more = some if route is None else some | _entered(route, c, r)
        if (more == some).all():
            return route
        some = more


def _entered(pieces: Array, c: Points, r: Array) -> NDArray[np.bool_]:
    """Which discs pieces of a path (see ``Path``) run into; shape (m,)."""
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
    return np.asarray((abs(nearest - c) < r - _EPS).any(axis=0))


def _route(p: complex, q: complex, c: Points, r: Array) -> Array | None:
    """The pieces (see ``Path``) of the shortest path between free points; None if no path exists."""
    if abs(q - p) <= _EPS:
        return np.empty((0, 6))
    a, b, on = _tangents(np.concatenate(([p, q], c)), np.concatenate(([0.0, 0.0], r)))
    free = _passable(a, b, c, r)
    a, b, on = a[free], b[free], on[:, free] - 2  # on -2, -1: start and goal, which are the nodes 0 and 1
    cross, pair = _crossings(c, r)
    at = np.concatenate(([p, q], a, b, cross))
    n, k = len(at), len(a)
    ends = np.where(on < 0, on + 2, 2 + np.arange(2 * k).reshape(2, k))

    # Arcs between neighbouring nodes of a circle: free or blocked as a whole, as the crossings are nodes too.
    node = np.concatenate((ends.ravel(), np.tile(np.arange(2 + 2 * k, n), 2)))
    disc = np.concatenate((on.ravel(), pair.ravel()))
    node, disc = node[disc >= 0], disc[disc >= 0]
    angle = np.angle(at[node] - c[disc])
    order = np.lexsort((angle, disc))
    node, disc, angle = node[order], disc[order], angle[order]
    last = np.arange(1, len(node) + 1) == np.searchsorted(disc, disc, side="right")
    after = np.where(last, np.searchsorted(disc, disc), np.arange(1, len(node) + 1))
    sweep = angle[after] - angle + np.where(last, 2.0 * np.pi, 0.0)
    free = _clear((c[disc] + r[disc] * np.exp(1j * (angle + 0.5 * sweep)))[:, None], c, r)
    node, after, disc, sweep = node[free], node[after][free], disc[free], sweep[free]

    # Every edge in both directions; of parallel edges the shortest, as a sparse matrix would add them up.
    tail = np.concatenate((ends[0], ends[1], node, after))
    head = np.concatenate((ends[1], ends[0], after, node))
    bend = np.concatenate((np.zeros(2 * k), 1.0 / r[disc], -1.0 / r[disc]))
    heading = np.concatenate((b - a, a - b, 1j * (at[node] - c[disc]), 1j * (c[disc] - at[after])))
    length = np.concatenate((np.tile(abs(b - a), 2), np.tile(r[disc] * sweep, 2)))
    order = np.argsort(length, kind="stable")
    key, first = np.unique((tail * n + head)[order], return_index=True)
    edge = order[first]
    graph = csr_array((length[edge], (tail[edge], head[edge])), shape=(n, n))
    before = dijkstra(graph, indices=0, return_predecessors=True)[1]
    if before[1] < 0:
        return None
    chain = [1]
    while chain[0] != 0:
        chain.insert(0, int(before[chain[0]]))
    edge = edge[np.searchsorted(key, np.array(chain[:-1]) * n + chain[1:])]
    return _rows(at[tail[edge]], heading[edge], bend[edge], length[edge])
