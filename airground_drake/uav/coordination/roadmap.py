"""The graph on which robots move: a lattice between obstacles, with the robots' starts, presets and shortest paths."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.compiling import njit
from airground_drake.model.geometry import convex, outline
from airground_drake.model.geometry.paths import NoPath, Path, shortest_path
from airground_drake.uav.coordination.intervals import Grid, Indices, cells_between, nodes_near

PITCH = 0.2  # spacing of the lattice as a share of the distance that robots keep
REACH = 1.75  # nodes outside the lattice are connected to all nodes within this many spacings
FAR = 0.95  # edges from starts and to targets are no longer than this share of the length that `single.find` allows
# Rings of extra nodes round a start, and nodes per ring: robots that block each other have little room.
RINGS, RAYS = 3, 16
MOST_NODES = 30_000  # largest number of nodes of the lattice; a larger area gets a wider spacing
# Largest number of nodes of a preset or shortest path; a longer path gets wider gaps, which the lattice connects.
MOST_PATH_NODES = 2_000
# Share of the clearance that edges keep. Chords of the arcs of shortest paths come nearer to discs than the arcs.
CHORDS = 0.5
ARCS = 0.75  # share of the clearance that shortest paths keep
ROUNDING_M = 1e-9  # distances may fall short by this, m


@dataclass(frozen=True, eq=False)
class Space:
    """Obstacles and distances that a robot has to keep. `Space.of` makes the space of a robot with a body."""

    rows: Array  # outlines of the obstacles, (m, W), see `model.geometry.outline`
    keep: Array  # distances to keep from their cores, (m,), m
    clearance: float  # extra distance from obstacles, m. Nodes of the lattice keep all of it, edges half of it.
    apart: float  # distance between the robot's centre and the surfaces of other robots, m
    spacing: float  # extra distance from other robots where possible, m; not 0
    height: float = 0.0  # of the robot's plane, m

    def of(self, body: float) -> Space:
        """This space for the centre of a robot whose body has this radius, m, with obstacles cut by its plane."""
        rows, keep = outline.sections(self.rows, self.keep + body, self.height)
        return Space(rows, keep, self.clearance, self.apart + body, self.spacing)

    def wide(self, longest: float, body: float = 0.0) -> float:
        """Distance from both ends of an edge that keeps `apart + spacing` from the whole edge, m."""
        # Let s be the share of the edge up to a point, and L its length. The squared distance to that point is the
        # weighted mean of the squared distances to the ends, less s (1 - s) L^2.
        return math.sqrt((self.apart + body + self.spacing) ** 2 + longest**2 / 4.0)

    @property
    def along(self) -> Array:
        """Distances that edges keep from the cores, (m,), m."""
        return np.asarray(self.keep + CHORDS * self.clearance)

    def segments_are_free(self, begin: Array, end: Array) -> Flags:
        """Which segments, from begin (K, 2), m, to end (K, 2), m, keep the distance from every obstacle."""
        # A segment that begins or ends too near to an obstacle is free if it comes no nearer in between.
        return convex.segments_are_free(begin, end, self.rows, self.along, ROUNDING_M)

    def points_are_free(self, points: Array, clearance: float) -> Flags:
        """Which points (K, 2), m, keep every distance and this clearance, m."""
        return convex.points_are_free(points, self.rows, self.keep + (clearance - ROUNDING_M))


@dataclass(frozen=True, eq=False)
class RobotNodes:
    """The nodes of one robot."""

    start: int  # node of its start
    target: int  # node of its target
    preset: Indices  # nodes along the rest of its preset, (K,); the last is the target
    preset_times: Array  # times at these nodes, (K,), s
    usable: Flags  # which of these nodes keep every distance, (K,); no edge leads to the others


@dataclass(frozen=True, eq=False)
class Roadmap:
    """A graph in the plane, with a grid to find nodes by place. It has every edge in both directions."""

    grid: Grid  # of the nodes
    first_edge: Indices  # first edge of each node, (N + 1,)
    heads: Indices  # node at the end of each edge, (E,)
    lengths: Array  # of the edges, (E,), m
    longest: float  # upper bound of the lengths, except those of edges at starts and targets, m
    robots: tuple[RobotNodes, ...]  # one entry per robot

    @property
    def nodes(self) -> Array:
        """Places of the nodes, (N, 2), m."""
        return self.grid.nodes

    def distances_to(self, targets: Indices) -> Array:
        """Length of the shortest way from every node to the nearest target node, (N,), m; infinite without a way."""
        return np.asarray(dijkstra(self._graph, indices=targets, min_only=True))

    @cached_property
    def _graph(self) -> csr_array:
        rows = self.first_edge.astype(np.int32), self.heads.astype(np.int32)
        return csr_array((self.lengths, rows[1], rows[0]), shape=(len(self.nodes),) * 2)

    def within(self, space: Space, own: RobotNodes) -> Roadmap:
        """This roadmap with only those edges that a larger robot can use."""
        tails = np.repeat(np.arange(len(self.nodes)), np.diff(self.first_edge))
        free = space.points_are_free(self.nodes, CHORDS * space.clearance)
        free[np.append(own.preset[own.usable], own.start)] = True
        kept = free[tails] & free[self.heads] & space.segments_are_free(self.nodes[tails], self.nodes[self.heads])
        first = np.append(0, np.cumsum(kept))[self.first_edge].astype(np.int64)
        return replace(self, first_edge=first, heads=self.heads[kept], lengths=self.lengths[kept])


@dataclass(frozen=True, eq=False)
class RobotTask:
    """A robot's start and target."""

    start: Array  # its place, (2,), m
    preset: Array  # the rest of its preset, a timed motion (M, 3) from t = 0 on, which ends at its target
    body: float = 0.0  # radius of the robot, m


def build_roadmap(spaces: Sequence[Space], tasks: Sequence[RobotTask], others: Sequence[Array] = ()) -> Roadmap:
    """The roadmap of robots. Its edges are free for the smallest robot; `Roadmap.within` removes some for others."""
    # others: places of other robots, (2,) each, m; the lattice reaches beyond them.
    by_size = sorted(spaces, key=lambda space: space.apart)
    space = by_size[0]
    paths = [_shortest(own, task) for own, task in zip(spaces, tasks, strict=True)]
    low, high = _area(by_size[-1], tasks, others, paths)
    pitch = max(PITCH * space.apart, math.sqrt(float(np.prod(high - low)) / MOST_NODES))
    reach = REACH * pitch
    far = FAR * math.sqrt(space.wide(reach) ** 2 - space.apart**2)
    lattice, number = _lattice(space, low, high, pitch)
    nodes, robots = [lattice], []
    for own, task, path in zip(spaces, tasks, paths, strict=True):
        places, robot = _robot_nodes(own, task, path, sum(map(len, nodes)), pitch, far)
        nodes.append(places)
        robots.append(robot)
    points = np.concatenate(nodes)
    radii, shut = np.full(len(points) - len(lattice), reach), np.zeros(len(points), dtype=bool)
    partner = np.full(len(points), -1)  # of starts and targets; other robots may be too near at both ends
    for robot in robots:
        ends = [robot.start, robot.target]
        radii[np.array(ends) - len(lattice)] = max(far, reach)
        shut[robot.preset[~robot.usable]] = True
        if np.hypot(*(points[robot.start] - points[robot.target])) > ROUNDING_M:
            partner[ends] = ends[::-1]
    grid = _grid(points, reach)
    pairs = _pairs(grid, number, radii, partner, shut)
    free = space.segments_are_free(points[pairs[:, 0]], points[pairs[:, 1]])
    first, heads, lengths = _in_rows(points, pairs, free)
    return Roadmap(grid, first, heads, lengths, reach, tuple(robots))


def _lattice(space: Space, low: Array, high: Array, pitch: float) -> tuple[Array, Indices]:
    """Free nodes of a square lattice in a box, (N, 2), m, and their numbers by column and row; -1: no node."""
    columns, rows = (math.ceil(length / pitch) + 1 for length in high - low)
    x, y = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    points = low + pitch * np.column_stack([x.ravel(), y.ravel()])
    free = space.points_are_free(points, space.clearance)
    return points[free], np.where(free, np.cumsum(free) - 1, -1).reshape(columns, rows)


def _robot_nodes(
    space: Space, task: RobotTask, path: Path | None, first: int, pitch: float, far: float
) -> tuple[Array, RobotNodes]:
    """Places and numbers of a robot's nodes: start, preset, shortest path to the target, and a fan round the start."""
    # pitch, far: m
    preset, times = _preset_nodes(task.preset, pitch)
    along_path = np.zeros((0, 2)) if path is None else _path_nodes(space, path, pitch)
    points = np.concatenate([task.start[None], preset, along_path, _fan(space, task.start, far)])
    along = np.arange(first + 1, first + 1 + len(preset))
    return points, RobotNodes(first, int(along[-1]), along, times, space.points_are_free(preset, 0.0))


def _shortest(space: Space, task: RobotTask) -> Path | None:
    """The shortest path of a robot to its target; None without one."""
    try:
        return shortest_path(task.start, task.preset[-1, 1:], space.rows, space.keep + ARCS * space.clearance)
    except NoPath:
        return None


def _area(
    space: Space, tasks: Sequence[RobotTask], others: Sequence[Array], paths: Sequence[Path | None]
) -> tuple[Array, Array]:
    """Corners of a box round all robots, presets and nearby discs, with room to go round these."""
    # Walls may be long. So among walls it is shortest paths that say how far the box reaches, and a wall or polygon
    # makes it larger by `room` at most.
    points = np.concatenate(
        [*(task.start[None] for task in tasks), *(task.preset[:, 1:] for task in tasks),
         np.array(others).reshape(-1, 2)]
    )  # fmt: skip
    widest = float(max(space.apart, *space.keep, 0.0)) if len(space.keep) else space.apart
    room = 3.0 * (widest + space.spacing)
    low, high = points.min(axis=0) - room, points.max(axis=0) + room
    middles, extent = space.rows[:, outline.MIDDLE : outline.EXTENT], space.rows[:, outline.EXTENT, None]
    walls = space.rows[:, outline.COUNT] > 1.0
    if walls.any():
        ends = [path.pieces[:, :2] for path in paths if path is not None]
        low = np.concatenate([low[None], *(end - room for end in ends)]).min(axis=0)
        high = np.concatenate([high[None], *(end + room for end in ends)]).max(axis=0)
    near = ~walls & ((middles > low - extent) & (middles < high + extent)).all(axis=1)
    beyond = (space.keep[near] + space.clearance + space.apart + space.spacing)[:, None] + extent[near]
    boxes = [(low, high), *((middle - far, middle + far) for middle, far in zip(middles[near], beyond, strict=True))]
    for row, keep in zip(space.rows[walls], space.keep[walls].tolist(), strict=True):
        corners, far = outline.corners_of(row), keep + space.clearance + space.apart + space.spacing
        lowest, highest = corners.min(axis=0), corners.max(axis=0)
        if (lowest < high).all() and (highest > low).all():
            boxes.append((np.maximum(lowest - far, low - room), np.minimum(highest + far, high + room)))
    lows, highs = zip(*boxes, strict=True)
    return np.min(lows, axis=0), np.max(highs, axis=0)


def _preset_nodes(preset: Array, pitch: float) -> tuple[Array, Array]:
    """Places along a timed motion, (K, 2), m, about `pitch`, m, apart, and the times there, (K,), s."""
    legs = np.hypot(*np.diff(preset[:, 1:], axis=0).T)
    gap = max(pitch, float(legs.sum()) / MOST_PATH_NODES)
    pieces = np.maximum(1, np.ceil(legs / gap)).astype(int)
    times = _spread(preset[:, 0], pieces)
    places = np.column_stack([np.interp(times, preset[:, 0], axis) for axis in preset[:, 1:].T])
    return places, times


def _spread(times: Array, pieces: Indices) -> Array:
    """Times (K,) with each gap between neighbours divided into equal pieces, `pieces` (K - 1,)."""
    parts = [np.linspace(times[k], times[k + 1], int(n), endpoint=False) for k, n in enumerate(pieces)]
    return np.concatenate([*parts, times[-1:]])


def _path_nodes(space: Space, path: Path, pitch: float) -> Array:
    """Places along a robot's shortest path, (K, 2), m, among them the ends of its pieces."""
    sagitta = (ARCS - CHORDS) * space.clearance
    flat = 0.9 * math.sqrt(8.0 * sagitta * float(space.keep.min(initial=1.0)))
    gap = max(min(pitch, flat), path.length_m / MOST_PATH_NODES)
    ends = np.concatenate([[0.0], np.cumsum(path.pieces[:, 5])])
    along = _spread(ends, np.maximum(1, np.ceil(np.diff(ends) / gap)).astype(np.int64))
    return path.points(along[1:].tolist())


@njit(cache=True)
def _pairs(grid: Grid, number: Indices, radii: Array, partner: Indices, shut: Flags) -> Indices:
    """Pairs of nodes that may have an edge, each once, (E, 2)."""
    # number: of the nodes of the lattice by column and row, or -1; they have edges to their neighbours
    # radii: within which all other nodes have edges, (R,), m, but none to a `partner` or a node that is `shut`
    nodes, columns, rows = grid.nodes, number.shape[0], number.shape[1]
    pairs, count = np.empty((5 * len(nodes), 2), np.int64), 0
    for column in range(columns):
        for row in range(rows):
            for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
                x, y = column + dx, row + dy
                if x < columns and 0 <= y < rows and number[column, row] >= 0 and number[x, y] >= 0:
                    pairs[count, 0], pairs[count, 1] = number[column, row], number[x, y]
                    count += 1
    others = len(nodes) - len(radii)
    for node in range(others, len(nodes)):
        x, y, radius = nodes[node, 0], nodes[node, 1], radii[node - others]
        left, right = cells_between(x - radius, x + radius, grid.corner[0], grid.size, grid.shape[0])
        for column in range(left, right):
            for near in nodes_near(grid, column, y - radius, y + radius):
                dx, dy = nodes[near, 0] - x, nodes[near, 1] - y
                squared = dx * dx + dy * dy
                if squared > radius * radius or near == node or shut[near] or shut[node] or partner[near] == node:
                    continue
                if others <= near < node and squared <= radii[near - others] ** 2:
                    continue  # it is there already
                if count == len(pairs):
                    pairs = np.concatenate((pairs, pairs))
                pairs[count, 0], pairs[count, 1] = near, node
                count += 1
    return pairs[:count]


def _fan(space: Space, start: Array, far: float) -> Array:
    """Free places on rings round a start, (K, 2), m; the largest ring has the radius `far`, m."""
    angles = 2.0 * np.pi * np.arange(RAYS) / RAYS
    rays = np.column_stack([np.cos(angles), np.sin(angles)])
    places = np.concatenate([start + far * (ring + 1.0) / RINGS * rays for ring in range(RINGS)])
    return np.asarray(places[space.points_are_free(places, CHORDS * space.clearance)])


@njit(cache=True)
def _in_rows(points: Array, pairs: Indices, free: Flags) -> tuple[Indices, Indices, Array]:
    """The free edges in both directions, sorted by tail and head: first edge of each node, heads, lengths."""
    first = np.zeros(len(points) + 1, np.int64)
    for k in range(len(pairs)):
        if free[k]:
            first[pairs[k, 0] + 1] += 1
            first[pairs[k, 1] + 1] += 1
    for n in range(len(points)):
        first[n + 1] += first[n]
    by_tail, heads, lengths = np.empty(first[-1], np.int64), np.empty(first[-1], np.int64), np.empty(first[-1])
    end = first[:-1].copy()
    for k in range(len(pairs)):
        if free[k]:
            one, other = pairs[k]
            by_tail[end[one]], by_tail[end[other]] = other, one
            end[one] += 1
            end[other] += 1
    end = first[:-1].copy()
    for tail in range(len(points)):  # in this order, the heads of each node are sorted: every edge has both directions
        for node in by_tail[first[tail] : first[tail + 1]]:
            dx, dy = points[node, 0] - points[tail, 0], points[node, 1] - points[tail, 1]
            heads[end[node]], lengths[end[node]] = tail, max(np.sqrt(dx * dx + dy * dy), ROUNDING_M)
            end[node] += 1
    return first, heads, lengths


def _grid(points: Array, size: float) -> Grid:
    """A grid over the nodes (N, 2), m, with cells of a size, m."""
    low = points.min(axis=0)
    at = np.floor((points - low) / size).astype(np.int64)
    shape = at.max(axis=0) + 1
    cell = at[:, 0] * shape[1] + at[:, 1]
    members = np.argsort(cell, kind="stable").astype(np.int64)
    first = np.searchsorted(cell[members], np.arange(int(np.prod(shape)) + 1)).astype(np.int64)
    return Grid(points, first, members, low, size, shape)
