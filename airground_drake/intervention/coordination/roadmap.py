"""Where robots can be: a lattice between the discs, with starts, targets, presets and shortest paths woven in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from airground_drake.arrays import Array
from airground_drake.geometry.paths import NoPath, shortest_path

Indices = npt.NDArray[np.int64]

PITCH = 0.2
"""Spacing of the lattice as a share of the distance that robots keep."""
REACH = 1.75
"""Nodes that are no part of the lattice are connected to all nodes within this many spacings."""
FAR = 0.95
"""Share of the longest edges from starts and to targets that are used, see `single.find`."""
RINGS, RAYS = 3, 16
"""Nodes round a start: robots that block each other leave little room between what they must keep away from."""
MOST_NODES = 30_000
"""Of the lattice: a larger area gets a wider spacing."""
MOST_WOVEN = 2_000
"""Of a path woven in: a longer one gets wider gaps (and is connected through the lattice)."""
CHORDS = 0.5
"""Share of the clearance that edges keep: chords of the arcs of shortest paths, which keep more, dip into it."""
ARCS = 0.75
"""Share of the clearance that shortest paths keep."""
ROUNDING_M = 1e-9


@dataclass(frozen=True, eq=False)
class Space:
    """What a robot has to keep away from: one without a body, until it is made for a radius (`of`).

    Attributes:
        centres: of the obstacles, (m, 2), m.
        radii: distance to keep from them, (m,), m.
        clearance: wished for beyond that, m; nodes keep it all (where they can), edges half of it.
        apart: distance that the robot's centre has to keep from the surfaces of others, m.
        spacing: wished for beyond that, m; not 0.
        above: how far the obstacles are from the robot's plane, (m,), m; `radii` are those of balls then.
    """

    centres: Array
    radii: Array
    clearance: float
    apart: float
    spacing: float
    above: Array | float = 0.0

    def of(self, body: float) -> Space:
        """The same in the plane, for the centre of a robot of such a radius, m."""
        squared = np.square(self.radii + body) - np.square(self.above)
        near = squared > 0.0
        return Space(self.centres[near], np.sqrt(squared[near]), self.clearance, self.apart + body, self.spacing)

    def wide(self, longest: float, body: float = 0.0) -> float:
        """Distance of a robot from both ends of an edge, m, that keeps it as far from the edge as is wished.

        The squared distance to a point of an edge of length L is a mean of those to the ends less s (1 - s) L^2.

        Args:
            longest: edge, m.
            body: radius of that robot, m.
        """
        return math.sqrt((self.apart + body + self.spacing) ** 2 + longest**2 / 4.0)

    @property
    def discs(self) -> Array:
        """Centres, and the distances that motions keep but near their ends, (m, 3), m."""
        return np.column_stack([self.centres, self.radii + CHORDS * self.clearance])

    def segments_are_free(self, begin: Array, end: Array) -> npt.NDArray[np.bool_]:
        """Which of the segments (K, 2)-(K, 2), m, come no nearer to a disc than they have to or than their ends are.

        So a segment that begins too near to a disc is free if it only leads away.
        """
        free = np.ones(len(begin), dtype=bool)
        step = end - begin
        squared = np.maximum(np.square(step).sum(axis=1), 1e-300)
        for centre, radius in zip(self.centres, self.radii, strict=True):
            offset = begin - centre
            share = np.clip(-(offset * step).sum(axis=1) / squared, 0.0, 1.0)
            nearest = np.linalg.norm(offset + share[:, None] * step, axis=1)
            ends = np.minimum(np.linalg.norm(offset, axis=1), np.linalg.norm(end - centre, axis=1))
            free &= nearest >= np.minimum(radius + CHORDS * self.clearance, ends) - ROUNDING_M
        return free

    def points_are_free(self, points: Array, clearance: float) -> npt.NDArray[np.bool_]:
        """Which of the points (K, 2), m, keep every distance, and so much more, m."""
        if not len(self.centres):
            return np.ones(len(points), dtype=bool)
        gaps = np.linalg.norm(points[:, None] - self.centres, axis=2) - self.radii
        return np.asarray((gaps >= clearance - ROUNDING_M).all(axis=1))


@dataclass(frozen=True, eq=False)
class Woven:
    """The nodes of one robot.

    Attributes:
        start: node.
        target: node.
        preset: nodes along the rest of its preset, (K,); the last is the target.
        preset_times: when it is there, (K,), s.
        usable: which of them keep every distance, (K,); no edge leads to the others.
    """

    start: int
    target: int
    preset: Indices
    preset_times: Array
    usable: npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Roadmap:
    """A graph in the plane with a grid over it to find nodes by place; every edge is in it in both directions.

    Attributes:
        nodes: (N, 2), m.
        first_edge: of each node, (N + 1,).
        heads: where edges lead, (E,).
        lengths: of edges, (E,), m.
        longest: edge between nodes that are no start and no target, m.
        woven: one entry per robot.
        cells, members, corner, size, shape: see `kernels.blocked_times`.
    """

    nodes: Array
    first_edge: Indices
    heads: Indices
    lengths: Array
    longest: float
    woven: tuple[Woven, ...]
    cells: Indices
    members: Indices
    corner: Array
    size: float
    shape: Indices

    def distances_to(self, targets: Indices) -> Array:
        """Length of the shortest way from every node to the nearest of some nodes, (N,), m; infinite without any."""
        graph = csr_array((self.lengths, self.heads, self.first_edge), shape=(len(self.nodes),) * 2)
        found: Array = dijkstra(graph, indices=targets, min_only=True)
        return found

    def within(self, space: Space, own: Woven) -> Roadmap:
        """The same with the edges alone that a larger robot can use: one that has to keep away from more."""
        tails = np.repeat(np.arange(len(self.nodes)), np.diff(self.first_edge))
        free = space.points_are_free(self.nodes, CHORDS * space.clearance)
        free[np.append(own.preset[own.usable], own.start)] = True
        kept = free[tails] & free[self.heads] & space.segments_are_free(self.nodes[tails], self.nodes[self.heads])
        first = np.append(0, np.cumsum(kept))[self.first_edge].astype(np.int64)
        return replace(self, first_edge=first, heads=self.heads[kept], lengths=self.lengths[kept])


@dataclass(frozen=True, eq=False)
class Errand:
    """Where a robot is and where it is to go.

    Attributes:
        start: (2,), m.
        preset: rest of its preset, a timed motion (M, 3) from t = 0 on, which ends at its target.
        body: its radius, m.
    """

    start: Array
    preset: Array
    body: float = 0.0


def weave(spaces: Sequence[Space], errands: Sequence[Errand], others: Sequence[Array] = ()) -> Roadmap:
    """The roadmap of some robots. Its lattice and edges are those of the smallest: see `Roadmap.within`.

    Args:
        spaces: what each has to keep away from.
        errands: where they are and where they are to go.
        others: places of robots that are to be gone round, (2,) each, m: they only widen the area.
    """
    by_size = sorted(spaces, key=lambda each: each.apart)
    space = by_size[0]
    pitch = PITCH * space.apart
    low, high = _area(by_size[-1], errands, others)
    extent = high - low
    pitch = max(pitch, math.sqrt(float(np.prod(extent)) / MOST_NODES))
    columns, rows = (math.ceil(length / pitch) + 1 for length in extent)
    x, y = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    lattice = low + pitch * np.column_stack([x.ravel(), y.ravel()])
    free = space.points_are_free(lattice, space.clearance)
    number = np.where(free, np.cumsum(free) - 1, -1).reshape(columns, rows)
    nodes: list[Array] = [lattice[free]]
    reach = REACH * pitch
    far = FAR * math.sqrt(space.wide(reach) ** 2 - space.apart**2)
    count, woven = int(free.sum()), []
    for own, errand in zip(spaces, errands, strict=True):
        preset, times = _preset_nodes(errand.preset, pitch)
        path = np.concatenate([_path_nodes(own, errand.start, preset[-1], pitch), _fan(own, errand.start, far)])
        nodes += [errand.start[None], preset, path]
        along = np.arange(count + 1, count + 1 + len(preset))
        woven.append(Woven(count, int(along[-1]), along, times, own.points_are_free(preset, 0.0)))
        count += 1 + len(preset) + len(path)
    points = np.concatenate(nodes)
    radii = np.full(len(points) - int(free.sum()), reach)
    for each in woven:
        radii[np.array([each.start, each.target]) - int(free.sum())] = max(far, reach)
    pairs = np.concatenate([_lattice_edges(number), _other_edges(points, radii)])
    pairs = pairs[~_is_short_cut(points, pairs, woven)]
    shut = np.concatenate([each.preset[~each.usable] for each in woven])
    pairs = pairs[~np.isin(pairs, shut).any(axis=1)]
    pairs = pairs[space.segments_are_free(points[pairs[:, 0]], points[pairs[:, 1]])]
    first, heads, lengths = _in_rows(points, pairs)
    cells, members, shape = _buckets(points, low, reach)
    return Roadmap(points, first, heads, lengths, reach, tuple(woven), cells, members, low, reach, shape)


def _area(space: Space, errands: Sequence[Errand], others: Sequence[Array]) -> tuple[Array, Array]:
    """Corners of a box round everything near, with room to go round it."""
    points = np.concatenate(
        [*(errand.start[None] for errand in errands), *(errand.preset[:, 1:] for errand in errands),
         np.array(others).reshape(-1, 2)]
    )  # fmt: skip
    widest = float(max(space.apart, *space.radii, 0.0)) if len(space.radii) else space.apart
    room = 3.0 * (widest + space.spacing)
    low, high = points.min(axis=0) - room, points.max(axis=0) + room
    near = ((space.centres > low) & (space.centres < high)).all(axis=1)
    beyond = (space.radii[near] + space.clearance + space.apart + space.spacing)[:, None]
    low = np.concatenate([low[None], space.centres[near] - beyond]).min(axis=0)
    high = np.concatenate([high[None], space.centres[near] + beyond]).max(axis=0)
    return low, high


def _preset_nodes(preset: Array, pitch: float) -> tuple[Array, Array]:
    """Places along a timed motion, (K, 2), m, at most so far from each other, and times, (K,), s."""
    legs = np.hypot(*np.diff(preset[:, 1:], axis=0).T)
    gap = max(pitch, float(legs.sum()) / MOST_WOVEN)
    pieces = np.maximum(1, np.ceil(legs / gap)).astype(int)
    times = _spread(preset[:, 0], pieces)
    places = np.column_stack([np.interp(times, preset[:, 0], axis) for axis in preset[:, 1:].T])
    return places, times


def _spread(times: Array, pieces: Indices) -> Array:
    """Times with every gap cut into so many pieces of equal length."""
    parts = [np.linspace(times[k], times[k + 1], int(n), endpoint=False) for k, n in enumerate(pieces)]
    return np.concatenate([*parts, times[-1:]])


def _path_nodes(space: Space, start: Array, target: Array, pitch: float) -> Array:
    """Places along the shortest path to the target, (K, 2), m, the ends of its pieces among them; none without any."""
    try:
        path = shortest_path(start, target, space.centres, space.radii + ARCS * space.clearance)
    except NoPath:
        return np.zeros((0, 2))
    sagitta = (ARCS - CHORDS) * space.clearance
    flat = 0.9 * math.sqrt(8.0 * sagitta * float(space.radii.min(initial=1.0)))
    gap = max(min(pitch, flat), path.length_m / MOST_WOVEN)
    ends = np.concatenate([[0.0], np.cumsum(path.pieces[:, 5])])
    along = _spread(ends, np.maximum(1, np.ceil(np.diff(ends) / gap)).astype(np.int64))
    return np.array([path.at(s)[0] for s in along[1:]]).reshape(-1, 2)


def _lattice_edges(number: npt.NDArray[np.intp]) -> Indices:
    """Pairs of neighbouring nodes, (E, 2), of a lattice whose nodes have these numbers; -1: there is none."""
    found = []
    for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
        tail = number[: len(number) - dx, max(0, -dy) : number.shape[1] - max(0, dy)]
        head = number[dx:, max(0, dy) : number.shape[1] - max(0, -dy)]
        both = (tail >= 0) & (head >= 0)
        found.append(np.column_stack([tail[both], head[both]]))
    return np.concatenate(found).astype(np.int64)


def _other_edges(points: Array, radii: Array) -> Indices:
    """Pairs of nodes, (E, 2), of which the second is one of the last ones and has the first within its radius, m."""
    others = np.arange(len(points) - len(radii), len(points))
    near = cKDTree(points).query_ball_point(points[others], radii, return_sorted=True)
    tails = np.concatenate([np.zeros(0, dtype=np.int64), *(np.array(found, dtype=np.int64) for found in near)])
    heads = np.repeat(others, [len(found) for found in near])
    pairs = np.column_stack([np.minimum(tails, heads), np.maximum(tails, heads)])[tails != heads]
    return np.unique(pairs, axis=0)


def _is_short_cut(points: Array, pairs: Indices, woven: Sequence[Woven]) -> npt.NDArray[np.bool_]:
    """Which edges lead from a robot's start to its target: others may be nearer to both than to any other node."""
    found = np.zeros(len(pairs), dtype=bool)
    for own in woven:
        if np.hypot(*(points[own.start] - points[own.target])) > ROUNDING_M:
            found |= np.isin(pairs, [own.start, own.target]).all(axis=1)
    return found


def _fan(space: Space, start: Array, far: float) -> Array:
    """Places round a start, (K, 2), m, up to a distance, m, in rings."""
    angles = 2.0 * np.pi * np.arange(RAYS) / RAYS
    rays = np.column_stack([np.cos(angles), np.sin(angles)])
    places = np.concatenate([start + far * (ring + 1.0) / RINGS * rays for ring in range(RINGS)])
    return np.asarray(places[space.points_are_free(places, CHORDS * space.clearance)])


def _in_rows(points: Array, pairs: Indices) -> tuple[Indices, Indices, Array]:
    """Edges in both directions, sorted by tail and head: first edge of each node, heads, lengths."""
    tails, heads = np.concatenate([pairs, pairs[:, ::-1]]).T
    order = np.lexsort((heads, tails))
    tails, heads = tails[order], heads[order]
    first = np.searchsorted(tails, np.arange(len(points) + 1)).astype(np.int64)
    lengths = np.maximum(np.linalg.norm(points[heads] - points[tails], axis=1), ROUNDING_M)
    return first, np.ascontiguousarray(heads), lengths


def _buckets(points: Array, low: Array, size: float) -> tuple[Indices, Indices, Indices]:
    """A grid of cells over the nodes: first member of each cell, members, shape."""
    at = np.maximum(np.floor((points - low) / size).astype(np.int64), 0)
    shape = at.max(axis=0) + 1
    cell = at[:, 0] * shape[1] + at[:, 1]
    members = np.argsort(cell, kind="stable").astype(np.int64)
    cells = np.searchsorted(cell[members], np.arange(int(np.prod(shape)) + 1)).astype(np.int64)
    return cells, members, shape
