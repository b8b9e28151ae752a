"""Whether a team can reach its targets at all: planners that share no code with the package.

One UGV: the shortest path among discs, exact (tangents and arcs), so that its absence proves that start and target are
separated. A team: prioritised search in time on a grid, in many orders. A plan that it finds is checked in continuous
time; a search without a plan proves nothing.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

CELL_M = 0.4
"""Spacing of the grid, m; a step goes to one of the four neighbours, or waits."""

BEYOND_OBSTACLE_M, BEYOND_UGV_M = 0.1, 0.35
"""Margins of a plan's nodes beyond the safe distances, m. Between two nodes a robot may come nearer: two robots whose
distance is 2.35 m before and after a step of 0.4 m each are never nearer than sqrt(2.35^2 - 0.4^2) = 2.31 m."""

ORDERS = 30
"""Orders of priority that are tried."""

ROOM_M = 6.0
"""How far the grid reaches beyond starts, targets and obstacles, m."""


def shortest_length(start: Array, target: Array, centres: Array, radius: float) -> float:
    """Length of the shortest path that keeps a distance of at least `radius` from all centres.

    Shortest paths among discs consist of common tangents and arcs; Dijkstra's algorithm on all of those that are free.

    Args:
        start: (2,), m.
        target: (2,), m.
        centres: (m, 2), m.
        radius: of all discs, m.

    Returns:
        Length, m; inf if start and target are separated, or one of them is inside a disc.
    """
    centres = _distinct(centres)
    ends = np.array([start, target], dtype=np.float64)
    if len(centres) and _nearest(ends, centres).min() < radius - 1e-9:
        return float("inf")
    segments, touched = _tangents(ends, centres, radius)
    free = _free(segments, centres, radius)
    segments, touched = segments[free], touched[free]
    count = 2 + 2 * len(segments)  # nodes: start, target, both ends of every segment
    first, second, lengths = [], [], []

    def join(one: int, other: int, length: float) -> None:
        first.append(one)
        second.append(other)
        lengths.append(max(length, 1e-12))

    on_disc: dict[int, list[tuple[float, int]]] = {}
    for k, (segment, discs) in enumerate(zip(segments, touched, strict=True)):
        join(2 + 2 * k, 3 + 2 * k, float(np.linalg.norm(segment[1] - segment[0])))
        for end in range(2):
            node, disc = 2 + 2 * k + end, int(discs[end])
            if disc < 0:  # the segment ends at the start (-1) or the target (-2)
                join(node, -1 - disc, 0.0)
            else:
                ray = segment[end] - centres[disc]
                on_disc.setdefault(disc, []).append((float(np.arctan2(ray[1], ray[0])), node))
    for disc, nodes in on_disc.items():
        others = np.delete(centres, disc, axis=0) - centres[disc]
        nodes.sort()
        for (angle, node), (following, other) in zip(nodes, nodes[1:] + nodes[:1], strict=True):
            turn = (following - angle) % (2.0 * np.pi) if len(nodes) > 1 else 2.0 * np.pi
            if not _covered(others, angle, turn, radius):
                join(node, other, radius * turn)
    graph = coo_array((lengths, (first, second)), shape=(count, count)).tocsr()
    return float(dijkstra(graph, directed=False, indices=0)[1])


def _distinct(centres: Array) -> Array:
    return np.unique(np.asarray(centres, dtype=np.float64).reshape(-1, 2), axis=0)


def _nearest(points: Array, centres: Array) -> Array:
    """Distance of each point, (k, 2), to the nearest centre, (k,), m."""
    return np.linalg.norm(points[:, None] - centres[None], axis=2).min(axis=1)


def _tangents(ends: Array, centres: Array, radius: float) -> tuple[Array, NDArray[np.int64]]:
    """All straight parts that a shortest path may have, (k, 2, 2), m, and the disc that each end touches, (k, 2).

    Instead of a disc -1 stands for the start and -2 for the target.
    """
    segments, touched = [ends], [[-1, -2]]
    for (e, end), (i, centre) in itertools.product(enumerate(ends), enumerate(centres)):
        offset = end - centre
        distance = max(float(np.linalg.norm(offset)), radius)
        half = np.arccos(radius / distance)
        heading = np.arctan2(offset[1], offset[0])
        for angle in (heading + half, heading - half):
            segments.append(np.array([end, centre + radius * _unit(angle)]))
            touched.append([-1 - e, i])
    for (i, one), (j, other) in itertools.combinations(enumerate(centres), 2):
        offset = other - one
        distance = float(np.linalg.norm(offset))
        heading = np.arctan2(offset[1], offset[0])
        for side in (-1.0, 1.0):
            normal = radius * _unit(heading + side * np.pi / 2.0)
            segments.append(np.array([one + normal, other + normal]))
            touched.append([i, j])
            if distance > 2.0 * radius:
                normal = radius * _unit(heading + side * np.arccos(2.0 * radius / distance))
                segments.append(np.array([one + normal, other - normal]))
                touched.append([i, j])
    return np.array(segments), np.array(touched)


def _unit(angle: float) -> Array:
    return np.array([np.cos(angle), np.sin(angle)])


def _free(segments: Array, centres: Array, radius: float) -> Bools:
    """Which segments, (k, 2, 2), are at least the radius from all centres."""
    if not len(centres):
        return np.ones(len(segments), dtype=np.bool_)
    begin, step = segments[:, 0], segments[:, 1] - segments[:, 0]
    squared = np.maximum((step**2).sum(axis=1), 1e-18)
    offset = centres[None] - begin[:, None]
    share = np.clip((offset * step[:, None]).sum(axis=2) / squared[:, None], 0.0, 1.0)
    distance = np.linalg.norm(offset - share[:, :, None] * step[:, None], axis=2)
    free: Bools = distance.min(axis=1) >= radius - 1e-9
    return free


def _covered(others: Array, angle: float, turn: float, radius: float) -> bool:
    """Whether another disc covers a part of the arc that begins at an angle and turns by `turn`.

    The ends of the arc are free, so that a disc covers a part of it if and only if it covers one around the direction
    in which that disc is.
    """
    near = others[np.linalg.norm(others, axis=1) < 2.0 * radius - 1e-9]
    directions = np.arctan2(near[:, 1], near[:, 0])
    return bool((((directions - angle) % (2.0 * np.pi)) < turn).any())


@dataclass(frozen=True)
class JointPlan:
    """Timed motions of a team: positions, (n, K, 2), m, at times, (K,), s; straight in between, then at rest."""

    times: Array
    positions: Array

    def least_between(self) -> float:
        """Least distance between two robots over continuous time, m; inf for one robot."""
        pairs = itertools.combinations(self.positions, 2)
        return min((_closest(one - other) for one, other in pairs), default=float("inf"))

    def least_to(self, centres: Array) -> float:
        """Least distance of a robot to a centre, (m, 2), over continuous time, m; inf without any."""
        pairs = itertools.product(self.positions, np.asarray(centres, dtype=np.float64).reshape(-1, 2))
        return min((_closest(path - centre) for path, centre in pairs), default=float("inf"))

    def top_speed(self) -> float:
        """Largest speed, m/s."""
        lengths = np.linalg.norm(np.diff(self.positions, axis=1), axis=2)
        return float((lengths / np.diff(self.times)).max())


def _closest(relative: Array) -> float:
    """Least distance from the origin of a polyline, (K, 2), m."""
    begin, step = relative[:-1], np.diff(relative, axis=0)
    squared = np.maximum((step**2).sum(axis=1), 1e-18)
    share = np.clip(-(begin * step).sum(axis=1) / squared, 0.0, 1.0)
    return float(np.linalg.norm(begin + share[:, None] * step, axis=1).min())


class Grid:
    """Cells of the plane around a course, and which of them keep enough distance from obstacles."""

    def __init__(self, points: Array, centres: Array, radius: float) -> None:
        """Lay the grid.

        Args:
            points: starts and targets, (k, 2), m.
            centres: of obstacles, (m, 2), m.
            radius: distance that nodes keep from the centres, m.
        """
        around = np.concatenate([points, centres])
        self.origin = around.min(axis=0) - ROOM_M
        self.shape = tuple(np.ceil((around.max(axis=0) + ROOM_M - self.origin) / CELL_M).astype(int) + 1)
        x, y = (self.origin[a] + CELL_M * np.arange(self.shape[a]) for a in range(2))
        self.places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=2)
        self.free: Bools = np.ones(self.shape, dtype=np.bool_)
        for centre in centres:
            self.free &= np.linalg.norm(self.places - centre, axis=2) >= radius

    def nearest_free(self, point: Array) -> tuple[int, int] | None:
        """The free cell nearest to a point, if it is within one step of it."""
        distance = np.where(self.free, np.linalg.norm(self.places - point, axis=2), np.inf)
        i, j = np.unravel_index(int(distance.argmin()), distance.shape)
        return (int(i), int(j)) if distance[i, j] <= CELL_M else None


def joint_plan(
    starts: Array,
    targets: Array,
    centres: Array,
    *,
    obstacle_m: float,
    ugv_m: float,
    speed_m_s: float,
    duration_s: float,
    seed: int = 0,
) -> JointPlan | None:
    """Motions that bring every robot to its target in time, at the safe distances all the way.

    Prioritised search: in each order the robots are planned one after the other, each by breadth-first search over
    cells and time steps, around those before it. Robots stay at their targets.

    Args:
        starts: (n, 2), m.
        targets: (n, 2), m.
        centres: of obstacles, (m, 2), m.
        obstacle_m: safe distance to obstacles, m.
        ugv_m: safe distance between robots, m.
        speed_m_s: of every step.
        duration_s: within which all must have arrived.
        seed: of the orders after the first.

    Returns:
        A plan that keeps the safe distances (checked in continuous time), or None if none was found.
    """
    starts, targets = np.asarray(starts, dtype=np.float64), np.asarray(targets, dtype=np.float64)
    centres = np.asarray(centres, dtype=np.float64).reshape(-1, 2)
    grid = Grid(np.concatenate([starts, targets]), centres, obstacle_m + BEYOND_OBSTACLE_M)
    begins, ends = [grid.nearest_free(p) for p in starts], [grid.nearest_free(p) for p in targets]
    if any(cell is None for cell in (*begins, *ends)):
        return None
    steps = int(duration_s * speed_m_s / CELL_M) - 2  # the first and the last lead onto the grid and off it
    rng = np.random.default_rng(seed)
    order = np.arange(len(starts))
    for _ in range(ORDERS):
        cells = _in_order(grid, begins, ends, order, ugv_m + BEYOND_UGV_M, steps)
        if cells is not None:
            plan = _timed(grid, cells, starts, targets, CELL_M / speed_m_s)
            if plan.least_between() >= ugv_m and plan.least_to(centres) >= obstacle_m:
                return plan
        order = rng.permutation(len(starts))
    return None


def _in_order(
    grid: Grid, begins: list, ends: list, order: NDArray[np.int64], apart: float, steps: int
) -> NDArray[np.int64] | None:
    """Cells of all robots at all steps, (n, steps + 1, 2), planned in an order; None if one finds no way."""
    reach = int(np.ceil(apart / CELL_M))
    offsets = CELL_M * np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2, indexing="ij"), axis=2)
    stamp = np.linalg.norm(offsets, axis=2) < apart
    taken = np.zeros((steps + 1, grid.shape[0] + 2 * reach, grid.shape[1] + 2 * reach), dtype=np.bool_)
    cells = np.zeros((len(order), steps + 1, 2), dtype=np.int64)
    inner = slice(reach, -reach)
    for robot in order:
        way = _way(grid.free, taken[:, inner, inner], begins[robot], ends[robot])
        if way is None:
            return None
        cells[robot] = way
        for k, (i, j) in enumerate(way):
            taken[k, i : i + 2 * reach + 1, j : j + 2 * reach + 1] |= stamp
    return cells


_MOVES = ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1))


def _way(free: Bools, taken: Bools, begin: tuple[int, int], end: tuple[int, int]) -> NDArray[np.int64] | None:
    """Cells of one robot at all steps, (K, 2), that reaches its end as early as it can stay there."""
    steps = len(taken)
    blocked_at_end = np.flatnonzero(taken[:, end[0], end[1]])
    earliest = int(blocked_at_end[-1]) + 1 if len(blocked_at_end) else 0
    reached = np.zeros((steps, *free.shape), dtype=np.bool_)
    reached[0, begin[0], begin[1]] = not taken[0, begin[0], begin[1]]
    arrival = None
    for k in range(steps):
        if k > 0:
            before, now = reached[k - 1], reached[k]
            now |= before
            now[1:] |= before[:-1]
            now[:-1] |= before[1:]
            now[:, 1:] |= before[:, :-1]
            now[:, :-1] |= before[:, 1:]
            now &= free & ~taken[k]
        if k >= earliest and reached[k, end[0], end[1]]:
            arrival = k
            break
    if arrival is None:
        return None
    way = np.empty((steps, 2), dtype=np.int64)
    way[arrival:] = end
    for k in range(arrival - 1, -1, -1):
        i, j = way[k + 1]
        for di, dj in _MOVES:
            if 0 <= i + di < free.shape[0] and 0 <= j + dj < free.shape[1] and reached[k, i + di, j + dj]:
                way[k] = i + di, j + dj
                break
    return way


def _timed(grid: Grid, cells: NDArray[np.int64], starts: Array, targets: Array, step_s: float) -> JointPlan:
    """The plan: from the start onto the grid, along the cells, and to the target."""
    along = grid.origin + CELL_M * cells
    positions = np.concatenate([starts[:, None], along, targets[:, None]], axis=1)
    return JointPlan(step_s * np.arange(positions.shape[1]), positions)
