"""Bounds of the shortest way left to a UGV round cores and safe distances, on another graph than the gatekeeper's.

The nodes are points around the corners of cores; a way over them is longer than the shortest one by less than a
thousandth.
"""

import numpy as np
import numpy.typing as npt
from scipy.sparse.csgraph import dijkstra

from airground_drake.base.arrays import Array
from airground_drake.verify.engines.outlines import Cores, away_from, least_distances

AROUND = 48
"""Points around each corner."""
MOST_CORNERS = 64
"""Among more corners than these the gatekeeper takes a way on a lattice, which may be longer by the share `LONGER`."""
LONGER = 0.1
Flags = npt.NDArray[np.bool_]


def bounds_of_way_left(place: Array, goal: Array, cores: Cores, distances: Array) -> tuple[float, float]:
    """Bounds of the length of the shortest way that keeps distances (m,), m, from cores: straight, and over the nodes.

    The latter is infinite where no way between the nodes is found.
    """
    above = place[2] - np.clip(place[2], cores.base, cores.top)
    squared = np.square(distances) - np.square(above)
    flat, radii = cores.take(squared > 0.0), np.sqrt(squared[squared > 0.0])
    flat = Cores(flat.corners, np.zeros(len(radii)), np.zeros(len(radii)))
    direct = float(np.linalg.norm(goal[:2] - place[:2]))
    legs = np.array([[*place[:2], 0.0], [*goal[:2], 0.0]])
    some = _crossed(legs, flat, radii)
    while True:  # a way round some cores that comes too near to no other core is a way round all
        legs = _round(legs[0], legs[-1], flat.take(some), radii[some])
        if not len(legs):
            return direct, np.inf
        more = some | _crossed(legs, flat, radii)
        if (more == some).all():
            longest = float(np.linalg.norm(np.diff(legs, axis=0), axis=1).sum())
            corners = sum(len({*map(tuple, each)}) for each in flat.corners.tolist())
            return direct, longest * (1.0 + LONGER * (corners > MOST_CORNERS))
        some = more


def _crossed(way: Array, cores: Cores, radii: Array) -> Flags:
    """To which cores (m,) a polyline (M, 3) comes too near."""
    many = cores.take((slice(None), None))
    nearest = least_distances(many, way[:-1], way[1:], planar=True)[0]
    return np.asarray((nearest < (radii * (1.0 - 1e-6))[:, None]).any(axis=1))


def _round(place: Array, goal: Array, cores: Cores, radii: Array) -> Array:
    """A short way round cores, over points around their corners, (M, 3), m; (0, 3) if no such way exists."""
    ends = np.stack([place, goal])
    if not len(radii):
        return ends
    angle = 2.0 * np.pi * np.arange(AROUND) / AROUND
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(AROUND)]) / np.cos(np.pi / AROUND)
    corners = np.append(cores.corners, np.zeros((*cores.corners.shape[:2], 1)), axis=2)
    rings = (corners[:, :, None] + radii[:, None, None, None] * (1.0 + 1e-9) * ring).reshape(-1, 3)
    rings = np.unique(rings, axis=0)  # corners that are there twice
    apart = away_from(cores, rings[:, None], planar=True).distance
    nodes = np.concatenate([ends, rings[(apart >= radii).all(axis=1)]])
    i, j = np.triu_indices(len(nodes), 1)
    clear = np.ones(len(i), dtype=np.bool_)
    for k, radius in enumerate(radii):
        clear[clear] = _passes(nodes[i[clear]], nodes[j[clear]], cores.take(k), radius * (1.0 - 1e-6))
    lengths = np.zeros((len(nodes), len(nodes)))
    lengths[i[clear], j[clear]] = np.linalg.norm(nodes[i[clear]] - nodes[j[clear]], axis=1)
    before = dijkstra(lengths, directed=False, indices=0, return_predecessors=True)[1]
    if before[1] < 0:
        return np.empty((0, 3))
    chain = [1]
    while chain[-1] != 0:
        chain.append(int(before[chain[-1]]))
    return np.asarray(nodes[chain[::-1]])


def _passes(start: Array, end: Array, core: Cores, radius: float) -> Flags:
    """Which segments from (P, 3) to (P, 3), with ends far enough from a core, keep a distance from it, m."""
    free, legs = np.ones(len(start), dtype=np.bool_), end - start
    squared = np.maximum(np.square(legs).sum(axis=1), 1e-300)
    corners = core.corners
    for corner in corners:
        to = np.append(corner, 0.0) - start
        along = np.clip((to * legs).sum(axis=1) / squared, 0.0, 1.0)
        free &= np.square(to - along[:, None] * legs).sum(axis=1) >= radius**2
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):  # nearer than all corners: across an edge
        sides = [_side(start, end, a), _side(start, end, b), _side(a, b, start), _side(a, b, end)]
        free &= ~((sides[0] * sides[1] < 0.0) & (sides[2] * sides[3] < 0.0))
    return free


def _side(a: Array, b: Array, c: Array) -> Array:
    (ax, ay), (bx, by), (cx, cy) = ((each[..., 0], each[..., 1]) for each in (a, b, c))
    return np.asarray((bx - ax) * (cy - ay) - (by - ay) * (cx - ax))
