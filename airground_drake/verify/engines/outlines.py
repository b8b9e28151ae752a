"""Signed distances from walls, polygons and prisms, in numpy for many places at once.

A *core* is the convex hull of some corners in the plane, from one height to another: a point, a wall, a polygon or a
prism. Inside a core a distance is minus the depth. The distance is a convex function of position, and the normal of
`Away` is a subgradient: the theorem of set-based avoidance needs nothing else. The controllers' code is not used.

Leading dimensions (...) are broadcast: one core and many places, many cores and one place, or a core for each place.
Places are (..., 3), m. `planar` says that a robot stays in its plane, so that it cannot leave a core through its top.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array, Flags, Indices
from airground_drake.model.bodies.motion import PeriodMotion
from airground_drake.verify.engines.geometry import ROUNDING_M, ROWS, boxes_of

# What the numbers of an *outline* in a trace mean: distance to keep, radius of the rounding, speed, heights of the
# core, number of corners, a circle round them, and the corners; `model.geometry.outline` describes it.
GAP, RADIUS, SPEED, BASE, TOP, COUNT, MIDDLE, EXTENT, CORNERS = 0, 1, 2, 3, 4, 5, 6, 8, 9
AT_ONCE = 100_000  # number of places, or pairs of boxes, compared together, to limit memory
BATCH = 32  # blocks of rows whose approaches are computed together
TOUCHING_M = 1e-6  # a motion that comes this near to a polygon may lead through it, m


@dataclass(frozen=True, eq=False)
class Cores:
    """Convex cores."""

    corners: Array  # (..., n, 2), m, counter-clockwise. A core with fewer corners has its first one again at the end.
    base: Array  # height at which each begins, (...), m
    top: Array  # height at which each ends, (...), m

    @classmethod
    def of(cls, rows: Array) -> Cores:
        """The cores of outlines (m, W)."""
        count = rows[:, COUNT].astype(np.intp)
        corner = np.arange(count.max(initial=1))
        column = CORNERS + 2 * np.where(corner < count[:, None], corner, 0)
        corners = np.stack([np.take_along_axis(rows, column + axis, axis=1) for axis in (0, 1)], axis=-1)
        return cls(corners, rows[:, BASE], rows[:, TOP])

    @classmethod
    def prisms(cls, parts: Sequence[Sequence[Sequence[float]]], top: float) -> Cores:
        """Cores from the ground to one height, m; `parts` are their corners [x, y], m."""
        most = max(map(len, parts))
        corners = np.array([[*part, *(part[:1] * (most - len(part)))] for part in map(list, parts)], dtype=np.float64)
        return cls(corners, np.zeros(len(parts)), np.full(len(parts), top))

    @classmethod
    def at(cls, places: Array) -> Cores:
        """Points (m, 3), m."""
        return cls(places[:, None, :2], places[:, 2], places[:, 2])

    @classmethod
    def joined(cls, some: Sequence[Cores]) -> Cores:
        """Several arrays of cores, (m, n, 2) each, one after the other."""
        most = max((part.corners.shape[1] for part in some), default=1)
        padded = [
            np.concatenate([part.corners, np.repeat(part.corners[:, :1], most - part.corners.shape[1], axis=1)], axis=1)
            for part in some
        ]
        none = np.empty(0)
        return cls(
            np.concatenate([np.empty((0, most, 2)), *padded]),
            np.concatenate([none, *(part.base for part in some)]),
            np.concatenate([none, *(part.top for part in some)]),
        )

    def take(self, rows: Any) -> Cores:
        return Cores(self.corners[rows], self.base[rows], self.top[rows])

    @property
    def box(self) -> tuple[Array, Array]:
        """Two opposite corners of a box around each, (..., 3), m."""
        low, high = self.corners.min(axis=-2), self.corners.max(axis=-2)
        return np.append(low, self.base[..., None], axis=-1), np.append(high, self.top[..., None], axis=-1)

    @property
    def are_points(self) -> bool:
        return self.corners.shape[-2] == 1 and bool((self.base == self.top).all())

    @property
    def points(self) -> Array:
        """The first corner of each at its base, (..., 3), m."""
        return np.append(self.corners[..., 0, :], self.base[..., None], axis=-1)


def unpacked(numbers: Sequence[float]) -> Array:
    """Outlines (m, W), padded with zeros, from their numbers one after the other."""
    rows, begin = list[Sequence[float]](), 0
    while begin < len(numbers):
        count = numbers[begin + COUNT] if begin + COUNT < len(numbers) else 0.0
        end = begin + CORNERS + 2 * int(count) if 1.0 <= count <= len(numbers) else begin
        if count != int(count) or not begin < end <= len(numbers):
            raise ValueError(f"the numbers from the {begin + 1}. on are no outline")
        rows.append(numbers[begin:end])
        begin = end
    padded = np.zeros((len(rows), max(map(len, rows), default=CORNERS + 2)))
    for row, outline in zip(padded, rows, strict=True):
        row[: len(outline)] = outline
    return padded


class Away(NamedTuple):
    """Signed distances, (...), m, and unit vectors away from the cores, (..., 3); 0 where none exists."""

    distance: Array
    normal: Array


class _Edges(NamedTuple):
    """Edges of cores: vectors (..., n, 2), m; which are longer than 0, (..., n); outward normals (..., n, 2)."""

    vector: Array
    real: Flags
    outward: Array

    @property
    def solid(self) -> Flags:
        """Which cores are polygons, (...)."""
        return np.asarray(self.real.sum(axis=-1) > 2)


def _edges(corners: Array) -> _Edges:
    vector = np.roll(corners, -1, axis=-2) - corners
    length = np.sqrt(np.square(vector).sum(axis=-1))
    real = length > 0.0
    turned = np.stack([vector[..., 1], -vector[..., 0]], axis=-1)
    return _Edges(vector, real, turned / np.where(real, length, 1.0)[..., None])


def away_from(cores: Cores, place: Array, *, planar: bool) -> Away:
    """Distances of places from cores, and the directions in which they grow."""
    if cores.are_points:
        vector = place - cores.points
        distance = np.sqrt(np.square(vector).sum(axis=-1))
        return Away(distance, vector / np.where(distance > 0.0, distance, 1.0)[..., None])
    edges, to = _edges(cores.corners), place[..., None, :2] - cores.corners
    squared = np.where(edges.real, np.square(edges.vector).sum(axis=-1), 1.0)
    along = (to * edges.vector).sum(axis=-1) / squared
    side = (to * edges.outward).sum(axis=-1)  # how far outside of the line through an edge
    beside = edges.real & (along > 0.0) & (along < 1.0)
    corner = np.where((along >= 1.0)[..., None], np.roll(to, -1, axis=-2), to)
    flat = np.where(beside[..., None], side[..., None] * edges.outward, corner)
    nearest = np.square(flat).sum(axis=-1).argmin(axis=-1)
    height = place[..., 2] - np.clip(place[..., 2], cores.base, cores.top)
    vector = np.append(_chosen(flat, nearest), height[..., None], axis=-1)
    distance = np.sqrt(np.square(vector).sum(axis=-1))
    normal = vector / np.where(distance > 0.0, distance, 1.0)[..., None]
    touching = (distance == 0.0) & edges.real.any(axis=-1)
    depth = np.where(edges.real, side, -np.inf).max(axis=-1)
    inside = edges.solid & (depth <= 0.0)
    if not (touching | inside).any():
        return Away(distance, normal)
    best = np.where(inside, np.where(edges.real, side, -np.inf).argmax(axis=-1), nearest)
    way_out = _chosen(np.broadcast_to(edges.outward, flat.shape), best)
    normal = np.where((touching | inside)[..., None], np.append(way_out, np.zeros((*best.shape, 1)), -1), normal)
    distance = np.where(inside, depth, distance)
    if planar:
        return Away(distance, normal)
    above, below = place[..., 2] - cores.top, cores.base - place[..., 2]
    rise = np.maximum(above, below)
    through = inside & (rise >= depth)
    up = np.zeros_like(normal)
    up[..., 2] = np.where(above >= below, 1.0, -1.0)
    return Away(np.where(through, rise, distance), np.where(through[..., None], up, normal))


def _chosen(vectors: Array, k: Indices) -> Array:
    """The k-th of vectors (..., n, d), (..., d)."""
    return np.take_along_axis(vectors, k[..., None, None], axis=-2)[..., 0, :]


def least_distances(cores: Cores, start: Array, end: Array, *, planar: bool) -> tuple[Array, Array]:
    """Exact least distances of cores from points in straight motion, (...), m, and the shares of the motion."""
    # The distance of a point in straight motion from a convex core is least at one of few places: at an end; where it
    # passes a corner or an edge at right angles; where it crosses the line of an edge or the plane of base or top. In a
    # polygon it is also where two edges are equally near. Each is a closed form, and the distance is evaluated there.
    shape = np.broadcast_shapes(start.shape[:-1], end.shape[:-1], cores.base.shape)
    start, end = (np.broadcast_to(place, (*shape, 3)) for place in (start, end))
    if cores.are_points:
        return PeriodMotion(start - cores.points, end - cores.points).least_distance()
    least, share = _least(cores, start, end, _turning_points(cores, start, end, planar), planar)
    deep = (least <= TOUCHING_M) & _edges(cores.corners).solid
    if deep.any():
        corners = np.broadcast_to(cores.corners, (*least.shape, *cores.corners.shape[-2:]))[deep]
        some = Cores(corners, *(np.broadcast_to(part, least.shape)[deep] for part in (cores.base, cores.top)))
        further = _equally_near(some, start[deep], end[deep], planar)
        deepest, there = _least(some, start[deep], end[deep], further, planar)
        lower = deepest < least[deep]
        least[deep], share[deep] = np.where(lower, deepest, least[deep]), np.where(lower, there, share[deep])
    return least, share


def _least(cores: Cores, start: Array, end: Array, shares: Array, planar: bool) -> tuple[Array, Array]:
    """The least distance at some shares (..., C) of a straight motion, and its first share."""
    shares = np.sort(np.clip(np.where(np.isfinite(shares), shares, 0.0), 0.0, 1.0), axis=-1)
    place = start[..., None, :] + shares[..., None] * (end - start)[..., None, :]
    many = Cores(cores.corners[..., None, :, :], cores.base[..., None], cores.top[..., None])
    distance = away_from(many, place, planar=planar).distance
    k = distance.argmin(axis=-1)[..., None]
    return np.take_along_axis(distance, k, axis=-1)[..., 0], np.take_along_axis(shares, k, axis=-1)[..., 0]


@np.errstate(divide="ignore", invalid="ignore")
def _turning_points(cores: Cores, start: Array, end: Array, planar: bool) -> Array:
    """Candidate shares of a straight motion, (..., C), for the nearest point to a core that it does not enter."""
    step, edges = (end - start)[..., None, :], _edges(cores.corners)
    flat, to = step[..., :2], cores.corners - start[..., None, :2]
    crossed = (to * edges.outward).sum(axis=-1) / (flat * edges.outward).sum(axis=-1)
    passed = (to * flat).sum(axis=-1) / np.square(flat).sum(axis=-1)
    ends = np.broadcast_to([0.0, 1.0], (*passed.shape[:-1], 2))
    if planar:
        return np.concatenate([ends, crossed, passed], axis=-1)
    levels = np.stack([cores.base, cores.top], axis=-1) - start[..., 2:]
    shares = [ends, crossed, passed]
    shares.append(np.broadcast_to(levels / step[..., 0, 2:], (*passed.shape[:-1], 2)))
    whole = np.square(step).sum(axis=-1)
    length = np.square(edges.vector).sum(axis=-1)
    both = (edges.vector * flat).sum(axis=-1)
    for level in (levels[..., :1], levels[..., 1:]):
        ahead = (to * flat).sum(axis=-1) + level * step[..., 2]
        shares.append(ahead / whole)
        aside = (to * edges.vector).sum(axis=-1)
        shares.append((length * ahead - both * aside) / (whole * length - both**2))
    return np.concatenate(shares, axis=-1)


@np.errstate(divide="ignore", invalid="ignore")
def _equally_near(cores: Cores, start: Array, end: Array, planar: bool) -> Array:
    """Candidate shares, (..., C), for the deepest point: where two faces of a core are equally near."""
    outward = _edges(cores.corners).outward
    first, last = (((place[..., None, :2] - cores.corners) * outward).sum(axis=-1) for place in (start, end))
    if not planar:
        first, last = (
            np.append(side, np.stack([place[..., 2] - cores.top, cores.base - place[..., 2]], axis=-1), axis=-1)
            for side, place in ((first, start), (last, end))
        )
    i, j = np.array(list(combinations(range(first.shape[-1]), 2)), dtype=np.intp).T
    rate = last - first
    return np.asarray((first[..., i] - first[..., j]) / (rate[..., j] - rate[..., i]))


def apart_by_blocks(cores: Cores, places: Array) -> Array:
    """Lower bounds of the distances of m cores from a way (T, 3), m, during each block of `ROWS` rows: (m, B), m."""
    # Between rows the way is straight. The bounds are distances of boxes; where boxes overlap, no depth is greater than
    # half the shortest side of the core's.
    (low, high), (inner, outer) = (side[0] for side in boxes_of(places[None])), cores.box
    least = np.empty((len(inner), len(low)))
    for some in np.array_split(np.arange(len(inner)), len(inner) * len(low) // AT_ONCE + 1):
        gap = np.maximum(inner[some, None] - high, low - outer[some, None])
        apart = np.sqrt(np.square(np.maximum(gap, 0.0)).sum(axis=2))
        deepest = 0.5 * (outer[some] - inner[some])[:, :2].min(axis=1)
        least[some] = np.where((gap <= 0.0).all(axis=2), -deepest[:, None], apart)
    return least - ROUNDING_M


class Nearest(NamedTuple):
    """Least distance of a way from some cores, m: the row that ends its segment, and the share of the segment."""

    distance: float
    row: int
    share: float


def closest(cores: Cores, places: Array, *, planar: bool) -> Nearest:
    """The (earliest) nearest point to any of m cores on a path (T, 3), m, straight between rows."""
    if len(places) == 1:
        return Nearest(float(away_from(cores, places, planar=planar).distance.min()), 0, 0.0)
    bounds = apart_by_blocks(cores, places)
    order = np.argsort(bounds, axis=None, kind="stable")
    best = Nearest(np.inf, len(places), 0.0)
    for some in np.split(order, np.arange(BATCH, len(order), BATCH)):
        which, block = np.unravel_index(some[bounds.ravel()[some] <= best.distance], bounds.shape)
        if not len(which):
            break
        segment = np.minimum(block[:, None] * ROWS + np.arange(ROWS), len(places) - 2)
        core = cores.take(which[:, None])
        distance, share = least_distances(core, places[segment], places[segment + 1], planar=planar)
        k = np.lexsort([share.ravel(), segment.ravel(), distance.ravel()])[0]
        nearest = Nearest(float(distance.flat[k]), int(segment.flat[k]) + 1, float(share.flat[k]))
        best = min(best, nearest)
    return best


def over_time(cores: Cores, places: Array, *, planar: bool) -> Array:
    """Distances of places (T, 3), m, from the nearest of m cores, (T,), m."""
    bounds = apart_by_blocks(cores, places)
    least = np.full(len(places), np.inf)
    for block in range(bounds.shape[1]):
        rows = slice(block * ROWS, (block + 1) * ROWS + (block == bounds.shape[1] - 1))
        first = int(bounds[:, block].argmin())
        most = away_from(cores.take(first), places[rows], planar=planar).distance.max()
        near = cores.take(np.flatnonzero(bounds[:, block] <= most)[:, None])
        least[rows] = away_from(near, places[rows], planar=planar).distance.min(axis=0)
    return least


class Contacts(NamedTuple):
    """C pairs of a position and a near core, sorted by both: indices, (C,), and distances with directions."""

    place: Indices
    core: Indices
    away: Away


def within(cores: Cores, places: Array, reach: float, *, planar: bool) -> Contacts:
    """Pairs of a place and a core within a distance, m: K places (K, 3), m, in the order of a way, and m cores."""
    blocks = list(_within(cores, places, reach, planar)) if len(places) else []
    none = np.empty(0, dtype=np.intp)
    place, core = (np.concatenate([none, *(contacts[k] for contacts in blocks)]) for k in (0, 1))
    order = np.lexsort([core, place])
    distance = np.concatenate([np.empty(0), *(contacts[2].distance for contacts in blocks)])
    normal = np.concatenate([np.empty((0, 3)), *(contacts[2].normal for contacts in blocks)])
    return Contacts(place[order], core[order], Away(distance[order], normal[order]))


def _within(cores: Cores, places: Array, reach: float, planar: bool) -> Iterator[Contacts]:
    which, block = np.nonzero(apart_by_blocks(cores, places) <= reach)
    for some in np.array_split(np.arange(len(which)), len(which) * ROWS // AT_ONCE + 1):
        place = block[some, None] * ROWS + np.arange(ROWS + 1)
        last = block[some, None] == (len(places) - 2) // ROWS  # the row at which a block ends belongs to the next one
        there = (place < len(places)) & ((np.arange(ROWS + 1) < ROWS) | last)
        place = place[there]
        core = np.broadcast_to(which[some, None], there.shape)[there]
        away = away_from(cores.take(core), places[place], planar=planar)
        near = away.distance <= reach
        yield Contacts(place[near], core[near], Away(away.distance[near], away.normal[near]))


def nearest_point(cores: Cores, place: Array, *, planar: bool) -> Array:
    """The point of the nearest of m cores that is nearest to a place (3,), m; inside, the nearest of its boundary."""
    away = away_from(cores, place, planar=planar)
    k = int(away.distance.argmin())
    core = cores.take(slice(k, k + 1))
    point: Array = core.points[0] if core.are_points else place - away.distance[k] * away.normal[k]
    return point
