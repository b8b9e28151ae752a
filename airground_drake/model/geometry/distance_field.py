"""Path lengths from everywhere to one goal among very many obstacles, on the nodes of a square lattice.

Each node stores the next visible corner of its path, and the length from there. So paths turn at nodes but do not
follow the lattice, and lengths are exact where the goal is visible. Nodes are settled in the order of their distance;
whether a node sees its corner is tested when it is settled (lazy any-angle search).

On maps of two real buildings lengths exceed the exact ones by 0.04 m on average and by 2 % at most; between a thousand
rectangles with gaps hardly wider than the nodes are apart, by 3 % on average and 10 % at most. A field takes 50 ms, a
length 3 ms.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from heapq import heappop, heappush

import numpy as np

from airground_drake.base.arrays import Array, Flags, Indices
from airground_drake.base.compiling import njit
from airground_drake.model.geometry import convex, outline

MOST_NODES = 60_000  # number of nodes of a lattice; a larger area gets a wider spacing
FINEST = 0.1  # least spacing as a share of the least distance to keep
MOST_SQUARES = 6  # number of search squares, so that distant obstacles do not slow the search
MOST_FIELDS = 8  # fields that are remembered; each takes 3 MB at most
ROUNDING_M = 1e-9


@dataclass(frozen=True, eq=False)
class DistanceField:
    """Paths to one goal that keep distances from obstacles in the plane z = 0."""

    # The nodes keep at least 0.71 of their spacing from all cores, so no path crosses a thin wall, but gaps narrower
    # than that may be closed.

    rows: Array  # outlines of the obstacles, (m, W), see `convex`
    keep: Array  # distances from their cores, (m,), m
    nodes: Array  # places of the free nodes, (N, 2), m
    corners: Array  # the corner of its way that each sees next, (N, 2), m
    beyond: Array  # length of the way from there to the goal, (N,), m; infinite at a node without a way

    @classmethod
    def to(cls, goal: Array, rows: Array, keep: Array, half: float) -> DistanceField:
        """The field of a goal in a square about it; `goal` (2,), m; `rows` (m, W); `keep` (m,), m; `half` in m."""
        # If the goal is too near to an obstacle, the nearest free nodes still see it.
        low, high = outline.box(rows)
        room = float(keep.max())
        low = np.maximum(np.minimum(low[:2], goal) - room, goal - half)
        high = np.minimum(np.maximum(high[:2], goal) + room, goal + half)
        finest = max(FINEST * float(keep.min()), ROUNDING_M)
        pitch = max(float(np.sqrt(np.prod(high - low) / MOST_NODES)), finest)
        columns, lines = (int(np.ceil(length / pitch)) + 3 for length in (high - low))
        low = low - pitch
        x, y = np.meshgrid(np.arange(columns), np.arange(lines), indexing="ij")
        places = low + pitch * np.column_stack([x.ravel(), y.ravel()])
        free = convex.points_are_free(places, rows, np.maximum(keep, np.sqrt(0.5) * pitch)).reshape(columns, lines)
        there = (goal - low) / pitch
        length, corner = _settled(free, there[0], there[1])
        known = np.flatnonzero(free)
        own = corner[known]
        corners = np.where(own[:, None] < 0, goal, places[own])
        beyond = np.where(np.isinf(length[known]), np.inf, np.where(own < 0, 0.0, pitch * length[own]))
        return cls(rows, keep, places[known], corners, beyond)

    def length(self, place: Array) -> float:
        """Length of the way from a place (2,), m; infinite without a way."""
        # A place too near to an obstacle may be left by any straight way that comes no nearer.
        apart = np.hypot(*(self.nodes - place).T)
        nearest = int(np.argmin(apart))
        if np.isinf(self.beyond[nearest]):
            return float("inf")
        corners, index = np.unique(self.corners[apart <= 2.0 * apart[nearest]], axis=0, return_index=True)
        beyond = self.beyond[apart <= 2.0 * apart[nearest]][index]
        seen = convex.segments_are_free(np.tile(place, (len(corners), 1)), corners, self.rows, self.keep, ROUNDING_M)
        over = apart[nearest] + np.hypot(*(self.nodes[nearest] - self.corners[nearest])) + self.beyond[nearest]
        return float((beyond + np.hypot(*(corners - place).T))[seen].min(initial=over))


@lru_cache(maxsize=MOST_FIELDS)
def _remembered(goal: tuple[float, ...], half: float, width: int, rows: bytes, keep: bytes) -> DistanceField:
    return DistanceField.to(np.array(goal), np.frombuffer(rows).reshape(-1, width), np.frombuffer(keep), half)


def length_among(place: Array, goal: Array, rows: Array, keep: Array) -> float:
    """Length of a short way from a place (2,) to a goal (2,), m, among very many obstacles; infinite without a way."""
    # It is looked for in a square about the goal, and in one of twice the size as long as a shorter way might lead out
    # of the square. The fields are remembered.
    # rows: (m, W); keep: (m,), m
    straight = float(np.hypot(*(place - goal)))
    half = 2.0 ** (1.0 + np.ceil(np.log2(max(straight, float(keep.max()), ROUNDING_M))))
    best = float("inf")
    aside, around = np.abs(rows[:, outline.MIDDLE : outline.EXTENT] - goal).max(axis=1), rows[:, outline.EXTENT] + keep
    for _ in range(MOST_SQUARES):
        near = aside - around < half
        if not near.any():
            return min(best, straight)
        field = _remembered(tuple(goal.tolist()), half, rows.shape[1], rows[near].tobytes(), keep[near].tobytes())
        best = min(best, field.length(place))
        if best <= 2.0 * half - straight or (aside + around < half).all():
            break
        half *= 2.0
    return best


@njit(cache=True)
def _settled(free: Flags, gx: float, gy: float) -> tuple[Array, Indices]:
    """Lengths from all nodes to a goal in units of the spacing, (N,), infinite without a way; next corners."""
    # free: (columns, lines)
    lines, count = free.shape[1], free.size
    length, corner = np.full(count, np.inf), np.full(count, -1, np.int64)
    settled, seen = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
    heap: list[tuple[float, int]] = [(0.0, -1)]
    heap.pop()
    apart = np.full(count, np.inf)
    for m in range(count):
        if free[m // lines, m % lines]:
            apart[m] = np.hypot(m // lines - gx, m % lines - gy)
    nearest = apart.min()
    for m in range(count):
        if apart[m] <= max(nearest, 1.0) + 0.5:
            length[m], seen[m] = apart[m], True
            heappush(heap, (float(apart[m]), m))
    while len(heap) > 0:
        _, n = heappop(heap)
        if settled[n]:
            continue
        x, y = n // lines, n % lines
        if not seen[n]:
            seen[n] = True
            px, py = (gx, gy) if corner[n] < 0 else (float(corner[n] // lines), float(corner[n] % lines))
            if not _sees(free, px, py, float(x), float(y)):
                length[n] = np.inf
                for k in range(9):
                    u, v = x + k // 3 - 1, y + k % 3 - 1
                    if 0 <= u < free.shape[0] and 0 <= v < lines and settled[u * lines + v]:
                        over = length[u * lines + v] + np.hypot(float(u - x), float(v - y))
                        if over < length[n]:
                            length[n], corner[n] = over, u * lines + v
                heappush(heap, (float(length[n]), n))
                continue
        settled[n] = True
        px, py, beyond = gx, gy, 0.0
        if corner[n] >= 0:
            px, py, beyond = float(corner[n] // lines), float(corner[n] % lines), length[corner[n]]
        for k in range(9):
            u, v = x + k // 3 - 1, y + k % 3 - 1
            if not (0 <= u < free.shape[0] and 0 <= v < lines) or not free[u, v] or settled[u * lines + v]:
                continue
            over = beyond + np.hypot(u - px, v - py)
            if over < length[u * lines + v] - 1e-9:
                length[u * lines + v], corner[u * lines + v], seen[u * lines + v] = over, corner[n], False
                heappush(heap, (float(over), u * lines + v))
    return length, corner


@njit(cache=True)
def _sees(free: Flags, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether all nodes on both sides of a segment are free, in units of the spacing."""
    steep = abs(by - ay) > abs(bx - ax)
    if steep:
        ax, ay, bx, by = ay, ax, by, bx
    if ax > bx:
        ax, ay, bx, by = bx, by, ax, ay
    slope = (by - ay) / max(bx - ax, 1e-12)
    for x in range(int(np.ceil(ax)), int(np.floor(bx)) + 1):
        y = ay + slope * (x - ax)
        below, above = int(np.floor(y + 1e-9)), int(np.ceil(y - 1e-9))
        for v in (below, above):
            if not (free[v, x] if steep else free[x, v]):
                return False
    return True
