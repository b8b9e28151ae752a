"""Convex obstacles as rows of numbers: pure maths, without compiled code.

An *outline* is a row of floats. So m obstacles are an array (m, W), which masks, concatenates, compares and goes to
compiled code as points (m, 3) do. Outlines of one array have the same length; what a row does not need of it is 0:

    GAP                      distance that a robot's surface keeps from this obstacle's surface, m
    RADIUS                   the obstacle is all that is within this distance of its *core*, m
    SPEED                    speed at which the obstacle may move, m/s; 0 for one at rest
    BASE, TOP                heights between which the core stands, m
    COUNT                    number of corners of the core
    MIDDLE (2), EXTENT       a circle round the corners, m, by which far obstacles are left out
    CORNERS (2 each)         x, y of each corner, m, counter-clockwise

The core is the convex hull of the corners, from BASE to TOP: a point (one corner), a wall (two), a polygon or a prism.
A ball is a point with a radius. All distances are computed from cores; `keep` gives the distance that a robot keeps
from a core, including all radii.

Distances are signed: inside a core they are minus the depth. The signed distance is a convex function of the point, and
`convex.nearest` gives a subgradient n of it, a unit vector: dist(x + s v) >= dist(x) + s n.v for all v and s >= 0. The
theorem of set-based avoidance needs nothing else.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from airground_drake.base.arrays import Array, Flags

GAP, RADIUS, SPEED, BASE, TOP, COUNT, MIDDLE, EXTENT, CORNERS = 0, 1, 2, 3, 4, 5, 6, 8, 9
SAME_M = 1e-9  # outlines whose numbers differ by no more than this are one, m
NOWHERE_M = 1e150  # coordinates of an obstacle that is not there: beyond any range, and its square is still finite


def balls(centres: ArrayLike, radii: ArrayLike = 0.0, gap: float = 0.0) -> Array:
    """The outlines of balls about centres (m, 3), m; radii (m,), m, or one for all; with the default, points."""
    places = np.asarray(centres, dtype=np.float64).reshape(-1, 3)
    rows = np.zeros((len(places), CORNERS + 2))
    rows[:, GAP], rows[:, RADIUS], rows[:, COUNT] = gap, radii, 1.0
    rows[:, BASE] = rows[:, TOP] = places[:, 2]
    rows[:, MIDDLE:EXTENT] = rows[:, CORNERS:] = places[:, :2]
    return rows


def prism(corners: ArrayLike, *, base: float = 0.0, top: float = 0.0, radius: float = 0.0, gap: float = 0.0) -> Array:
    """The outline of the convex hull of corners (n, 2), m, from one height to another, m."""
    # corners: of a convex polygon, in order and counter-clockwise; two for a wall, one for a post.
    places = np.asarray(corners, dtype=np.float64).reshape(1, -1, 2)
    return np.asarray(prisms(places, base=base, top=top, radius=radius, gap=gap)[0])


def prisms(corners: Array, *, base: float = 0.0, top: float = 0.0, radius: float = 0.0, gap: float = 0.0) -> Array:
    """The outlines, (m, W), of the convex hulls of corners (m, n, 2), m; see `prism`."""
    number, count, _ = corners.shape
    rows = np.empty((number, CORNERS + 2 * count))
    rows[:, :MIDDLE] = gap, radius, 0.0, base, top, count
    middle = 0.5 * (corners.min(axis=1) + corners.max(axis=1))
    rows[:, MIDDLE:EXTENT] = middle
    apart = corners - middle[:, None]
    rows[:, EXTENT] = np.hypot(apart[..., 0], apart[..., 1]).max(axis=1) * (1.0 + 1e-15)
    rows[:, CORNERS:] = corners.reshape(number, 2 * corners.shape[1])
    return rows


def stacked(rows: Iterable[ArrayLike]) -> Array:
    """Outlines as one array (m, W), padded with zeros; m may be 0."""
    given = [np.asarray(row, dtype=np.float64) for row in rows]
    padded = np.zeros((len(given), max((len(row) for row in given), default=CORNERS + 2)))
    for row, outline in zip(padded, given, strict=True):
        row[: len(outline)] = outline
    return padded


def joined(*parts: Array) -> Array:
    """Arrays of outlines one after the other, padded to the same width."""
    rows = np.zeros((sum(map(len, parts)), max(part.shape[1] for part in parts)))
    begin = 0
    for part in parts:
        rows[begin : begin + len(part), : part.shape[1]] = part
        begin += len(part)
    return rows


def as_tuple(row: Array) -> tuple[float, ...]:
    """An outline without padding, to compare or send it."""
    return tuple(row[: CORNERS + 2 * int(row[COUNT])].tolist())


def is_among(one: Array, other: Array) -> Flags:
    """Whether each outline of one array, (m, W), has the same core as one of another, (k, V): (m,)."""
    among = np.zeros(len(one), dtype=bool)
    if not (len(one) and len(other)):
        return among
    both = joined(one, other)[:, BASE:]
    mine, theirs = both[: len(one)], both[len(one) :]
    theirs = theirs[np.argsort(theirs[:, MIDDLE - BASE])]
    begin, end = np.searchsorted(theirs[:, MIDDLE - BASE], mine[:, MIDDLE - BASE] + [[-2.0 * SAME_M], [2.0 * SAME_M]])
    for index in np.flatnonzero(begin < end):
        some = theirs[begin[index] : end[index]]
        among[index] = np.all(np.abs(some - mine[index]) <= SAME_M, axis=1).any()
    return among


def are_outlines(rows: Array) -> Flags:
    """Which rows (m, W) of untrusted data are outlines of convex cores, (m,)."""
    if rows.ndim != 2 or rows.shape[1] < CORNERS + 2:
        return np.zeros(len(rows), dtype=bool)
    count = rows[:, COUNT]
    sound: Flags = np.logical_and.reduce([
        np.isfinite(rows).all(axis=1), (rows[:, [GAP, RADIUS, SPEED, EXTENT]] >= 0.0).all(axis=1),
        rows[:, BASE] <= rows[:, TOP], count >= 1.0, count == np.floor(count), CORNERS + 2.0 * count <= rows.shape[1],
    ])  # fmt: skip
    for number in np.unique(count[sound]).astype(int):
        some = np.flatnonzero(sound & (count == number))
        corners = rows[some, CORNERS : CORNERS + 2 * number].reshape(len(some), number, 2)
        before, after = corners - np.roll(corners, 1, axis=1), np.roll(corners, -1, axis=1) - corners
        turns = before[..., 0] * after[..., 1] - before[..., 1] * after[..., 0]
        apart = corners - rows[some, None, MIDDLE:EXTENT]
        reach = np.hypot(apart[..., 0], apart[..., 1]).max(axis=1)
        turned = np.arctan2(turns, (before * after).sum(axis=2)).sum(axis=1)
        round_once = (number < 3) | (np.abs(turned - 2.0 * np.pi) < 1.0)
        distinct = (number == 1) | (np.linalg.norm(after, axis=2) > 0.0).all(axis=1)
        sound[some] = (turns >= 0.0).all(axis=1) & round_once & distinct & (reach <= rows[some, EXTENT])
    return sound


def corners_of(row: Array) -> Array:
    """The corners of an outline, (count, 2), m."""
    return row[CORNERS : CORNERS + 2 * int(row[COUNT])].reshape(-1, 2)


def keep(rows: Array, radius: float) -> Array:
    """Distances that the centre of a robot with a radius, m, keeps from the cores of outlines (m, W): (m,), m."""
    return np.asarray(rows[:, GAP] + (radius + rows[:, RADIUS]))


def box(rows: Array) -> tuple[Array, Array]:
    """Two opposite corners, (3,), m, of the bounding box of outlines (m, W)."""
    reach, middle = rows[:, EXTENT] + rows[:, RADIUS], rows[:, MIDDLE:EXTENT]
    low = np.column_stack([middle - reach[:, None], rows[:, BASE] - rows[:, RADIUS]])
    high = np.column_stack([middle + reach[:, None], rows[:, TOP] + rows[:, RADIUS]])
    return low.min(axis=0), high.max(axis=0)


def moved(rows: Array, by: Array) -> Array:
    """Outlines (m, W), each moved by its vector, (m, 3) or one for all, m."""
    shifted, shift = rows.copy(), np.broadcast_to(by, (len(rows), 3))
    shifted[:, BASE] += shift[:, 2]
    shifted[:, TOP] += shift[:, 2]
    shifted[:, MIDDLE:EXTENT] += shift[:, :2]
    for k in range(int(rows[:, COUNT].max(initial=0.0))):
        there = rows[:, COUNT] > k
        shifted[there, CORNERS + 2 * k : CORNERS + 2 * k + 2] += shift[there, :2]
    return shifted


def where(there: Flags, rows: Array) -> Array:
    """Outlines (m, W), with those that do not exist (`there`, (m,)) replaced by a point at NOWHERE_M."""
    nowhere = np.zeros(rows.shape[1])
    nowhere[: CORNERS + 2] = balls(np.full(3, NOWHERE_M))[0]
    return np.where(there[:, None], rows, nowhere)


def sections(rows: Array, distance: Array | float, height: float) -> tuple[Array, Array]:
    """Where a plane at a height, m, cuts the sets within a distance, (m,), m, of the cores of outlines (m, W)."""
    # Returns the outlines that it cuts, in the plane z = 0, (k, W), and the distances from their cores there, (k,), m.
    above = np.maximum(np.maximum(rows[:, BASE] - height, height - rows[:, TOP]), 0.0)
    reach = np.broadcast_to(distance, len(rows))
    squared = np.square(reach) - np.square(above)
    near = squared > 0.0
    flat = rows[near]
    flat[:, BASE] = flat[:, TOP] = 0.0
    return flat, np.sqrt(squared[near])


def rim(row: Array, distance: float, rays: int = 16) -> Array:
    """The outline of all points within a distance, m, of a core in the plane, as a polygon (K, 2), m, for drawing."""
    corners = corners_of(row)
    if len(corners) == 1:
        turn = np.linspace(0.0, 2.0 * np.pi, 4 * rays, endpoint=False)
        return np.asarray(corners[0] + distance * np.column_stack([np.cos(turn), np.sin(turn)]))
    edges = np.roll(corners, -1, axis=0) - corners
    heading = np.arctan2(-edges[:, 0], edges[:, 1])  # of the outward normals
    arcs = []
    for k, corner in enumerate(corners):
        sweep = (heading[k] - heading[k - 1]) % (2.0 * np.pi)
        turn = heading[k - 1] + sweep * np.linspace(0.0, 1.0, max(2, int(rays * sweep / np.pi)))
        arcs.append(corner + distance * np.column_stack([np.cos(turn), np.sin(turn)]))
    return np.concatenate(arcs)
