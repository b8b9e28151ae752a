"""Compiled inner loops of joint planning (numba): blocked times, safe intervals, search, closest approaches.

A timed motion is an array (M, 3) of times, s, and places, m: straight between its rows, at rest at the last place from
then on. No fast-math: results are those of IEEE arithmetic in the order written.
"""

from __future__ import annotations

from heapq import heappop, heappush

import numpy as np
import numpy.typing as npt
from numba import njit

from airground_drake.arrays import Array

Indices = npt.NDArray[np.int64]


@njit(cache=True)
def approach(x: float, y: float, vx: float, vy: float, duration: float) -> float:
    """Least distance from the origin, m, of a point at (x, y) moving with (vx, vy) for a duration, s."""
    squared = vx * vx + vy * vy
    s = 0.0
    if squared > 0.0 and duration > 0.0:
        s = min(max(-(x * vx + y * vy) / squared, 0.0), duration)
    return float(np.hypot(x + s * vx, y + s * vy))


@njit(cache=True)
def place(motion: Array, t: float, hint: int) -> tuple[float, float, int]:
    """Where a timed motion is at time t, and the row before it, searched from row `hint` on."""
    k = hint
    while k + 1 < len(motion) and motion[k + 1, 0] <= t:
        k += 1
    if k + 1 == len(motion) or t <= motion[k, 0]:
        return motion[k, 1], motion[k, 2], k
    share = (t - motion[k, 0]) / (motion[k + 1, 0] - motion[k, 0])
    x = motion[k, 1] + share * (motion[k + 1, 1] - motion[k, 1])
    return x, motion[k, 2] + share * (motion[k + 1, 2] - motion[k, 2]), k


@njit(cache=True)
def closest(one: Array, other: Array, begin: float, end: float) -> float:
    """Least distance of two timed motions over [begin, end], m; `end` may be infinite."""
    i, j = 0, 0
    ax, ay, i = place(one, begin, 0)
    bx, by, j = place(other, begin, 0)
    least = float(np.hypot(ax - bx, ay - by))
    t = begin
    while t < end:
        until = end
        if i + 1 < len(one):
            until = min(until, one[i + 1, 0])
        if j + 1 < len(other):
            until = min(until, other[j + 1, 0])
        if until == np.inf:
            break
        cx, cy, i = place(one, until, i)
        dx, dy, j = place(other, until, j)
        x, y = ax - bx, ay - by
        least = min(least, approach(x, y, (cx - dx) - x, (cy - dy) - y, 1.0))
        ax, ay, bx, by, t = cx, cy, dx, dy, until
    return least


@njit(cache=True)
def blocked_times(
    motion: Array,
    nodes: Array,
    cells: Indices,
    members: Indices,
    corner: Array,
    size: float,
    shape: Indices,
    radius: float,
    special: Indices,
    radii: Array,
) -> tuple[Indices, Array]:
    """When a timed motion is nearer to nodes than a radius.

    Args:
        motion: (M, 3).
        nodes: (N, 2), m.
        cells: first member of each cell of a grid over the nodes, (cells + 1,).
        members: nodes by cell, (N,).
        corner: lowest corner of the grid, (2,), m.
        size: of a cell, m.
        shape: number of cells along x and y, (2,).
        radius: m.
        special: nodes that have a radius of their own, (S,).
        radii: the same, (S,), m; not above `radius`.

    Returns:
        Nodes (B,) and begin and end of each blocked time, (B, 2), s.
    """
    capacity = 1024
    found, times = np.empty(capacity, np.int64), np.empty((capacity, 2))
    count = 0
    for k in range(len(motion)):
        begin = motion[k, 0]
        last = k + 1 == len(motion)
        duration = np.inf if last else motion[k + 1, 0] - begin
        px, py = motion[k, 1], motion[k, 2]
        qx, qy = (px, py) if last else (motion[k + 1, 1], motion[k + 1, 2])
        vx, vy = (0.0, 0.0) if last else ((qx - px) / duration, (qy - py) / duration)
        squared = vx * vx + vy * vy
        left = max(int(np.floor((min(px, qx) - radius - corner[0]) / size)), 0)
        right = min(int(np.floor((max(px, qx) + radius - corner[0]) / size)), shape[0] - 1)
        low = max(int(np.floor((min(py, qy) - radius - corner[1]) / size)), 0)
        high = min(int(np.floor((max(py, qy) + radius - corner[1]) / size)), shape[1] - 1)
        for column in range(left, right + 1):
            for row in range(low, high + 1):
                cell = column * shape[1] + row
                for n in members[cells[cell] : cells[cell + 1]]:
                    keep = radius
                    for s in range(len(special)):
                        if special[s] == n:
                            keep = min(keep, radii[s])
                    x, y = px - nodes[n, 0], py - nodes[n, 1]
                    c = x * x + y * y - keep * keep
                    b = x * vx + y * vy
                    entry, leave = 0.0, duration
                    if squared > 0.0:
                        root = b * b - squared * c
                        if root <= 0.0:
                            continue
                        root = np.sqrt(root)
                        entry, leave = max((-b - root) / squared, 0.0), min((-b + root) / squared, duration)
                        if entry >= leave:
                            continue
                    elif c >= 0.0:
                        continue
                    if count == capacity:
                        capacity *= 2
                        more, longer = np.empty(capacity, np.int64), np.empty((capacity, 2))
                        more[:count], longer[:count] = found, times
                        found, times = more, longer
                    found[count], times[count, 0], times[count, 1] = n, begin + entry, begin + leave
                    count += 1
    return found[:count], times[:count]


@njit(cache=True)
def safe_intervals(count: int, blocked: Indices, times: Array) -> tuple[Indices, Array]:
    """Times at which nodes are free, from t = 0 on.

    Args:
        count: of nodes, N.
        blocked: nodes, (B,), sorted, and within a node by the begin of the time.
        times: begin and end of each blocked time, (B, 2), s.

    Returns:
        First interval of each node, (N + 1,), and begin and end of the intervals, (K, 2), s.
    """
    first = np.zeros(count + 1, np.int64)
    intervals = np.empty((count + len(blocked), 2))
    total, k = 0, 0
    for n in range(count):
        first[n] = total
        free = 0.0
        while k < len(blocked) and blocked[k] == n:
            if times[k, 0] > free:
                intervals[total, 0], intervals[total, 1] = free, times[k, 0]
                total += 1
            free = max(free, times[k, 1])
            k += 1
        if free < np.inf:
            intervals[total, 0], intervals[total, 1] = free, np.inf
            total += 1
    first[count] = total
    return first, intervals[:total]


@njit(cache=True)
def search(
    first_edge: Indices,
    heads: Indices,
    durations: Array,
    first: Indices,
    intervals: Array,
    start: int,
    joins: Array,
    to_go: Array,
    budget: int,
) -> tuple[Indices, Array, float, int]:
    """Safe-interval search: the way from a node to the earliest join.

    A robot may wait at a node during a safe interval of it, and travels an edge only while both ends are safe.

    Args:
        first_edge: first edge of each node, (N + 1,).
        heads: where edges lead, (E,).
        durations: of edges, (E,), s.
        first: first safe interval of each node, (N + 1,).
        intervals: (K, 2), s.
        start: node at t = 0.
        joins: times at which a robot that waits at a node can leave the roadmap, first and last, (N, 2), s; the last
            before the first: never; infinite: it stays there.
        to_go: lower bound of the time from a node to any join, (N,), s.
        budget: of expanded intervals.

    Returns:
        Nodes (L,) in order, arrival at each (L,), s, the time of the join (infinite: there is none; then L = 0), and
        the number of expanded intervals.
    """
    count = len(intervals)
    arrival, before, owner = np.full(count, np.inf), np.full(count, -1, np.int64), np.zeros(count, np.int64)
    closed = np.zeros(count, np.bool_)
    for n in range(len(first) - 1):
        owner[first[n] : first[n + 1]] = n
    heap = [(np.inf, -1)]
    heap.pop()
    if first[start] < first[start + 1] and intervals[first[start], 0] == 0.0 and to_go[start] < np.inf:
        arrival[first[start]] = 0.0
        heappush(heap, (to_go[start], first[start]))
    best, last, expanded = np.inf, -1, 0
    while len(heap) > 0:
        key, i = heappop(heap)
        if key >= best or expanded >= budget:
            break
        if closed[i]:
            continue
        closed[i] = True
        expanded += 1
        n, t, end = owner[i], arrival[i], intervals[i, 1]
        joined = max(t, joins[n, 0])
        stays = joins[n, 1] == np.inf
        if joined <= joins[n, 1] and joined <= end and not (stays and end < np.inf) and joined < best:
            best, last = joined, i
        for e in range(first_edge[n], first_edge[n + 1]):
            head, duration = heads[e], durations[e]
            if to_go[head] == np.inf or t + duration > end:
                continue
            for j in range(first[head], first[head + 1]):
                if intervals[j, 0] + duration > end:
                    break
                there = max(t, intervals[j, 0]) + duration
                if there > intervals[j, 1] or there > end or there >= arrival[j]:
                    continue
                arrival[j], before[j] = there, i
                heappush(heap, (there + to_go[head], j))
    length, i = 0, last
    while i >= 0:
        length += 1
        i = before[i]
    nodes, times = np.empty(length, np.int64), np.empty(length)
    i = last
    for k in range(length - 1, -1, -1):
        nodes[k], times[k] = owner[i], arrival[i]
        i = before[i]
    return nodes, times, best, expanded


@njit(cache=True)
def free_points(points: Array, discs: Array) -> npt.NDArray[np.bool_]:
    """Which points (K, 2), m, are outside all discs (m, 3) of centre and radius, m."""
    free = np.ones(len(points), np.bool_)
    for k in range(len(points)):
        for m in range(len(discs)):
            x, y = points[k, 0] - discs[m, 0], points[k, 1] - discs[m, 1]
            if np.sqrt(x * x + y * y) < discs[m, 2]:
                free[k] = False
                break
    return free


@njit(cache=True)
def free_segments(begin: Array, end: Array, discs: Array, slack: float) -> npt.NDArray[np.bool_]:
    """Which segments (K, 2)-(K, 2), m, come nearer to no disc than its radius or than one of their ends is.

    Args:
        begin: (K, 2), m.
        end: (K, 2), m.
        discs: (m, 3) of centre and radius, m.
        slack: distances may fall short by this, m.
    """
    free = np.ones(len(begin), np.bool_)
    for k in range(len(begin)):
        sx, sy = end[k, 0] - begin[k, 0], end[k, 1] - begin[k, 1]
        squared = max(sx * sx + sy * sy, 1e-300)
        reach = 1.001 * np.sqrt(squared)
        for m in range(len(discs)):
            ax, ay = begin[k, 0] - discs[m, 0], begin[k, 1] - discs[m, 1]
            to_begin = np.sqrt(ax * ax + ay * ay)
            if to_begin > discs[m, 2] + reach:
                continue
            bx, by = end[k, 0] - discs[m, 0], end[k, 1] - discs[m, 1]
            share = min(max(-(ax * sx + ay * sy) / squared, 0.0), 1.0)
            x, y = ax + share * sx, ay + share * sy
            allowed = min(discs[m, 2], to_begin, np.sqrt(bx * bx + by * by))
            if np.sqrt(x * x + y * y) < allowed - slack:
                free[k] = False
                break
    return free


@njit(cache=True)
def straight_is_free(motion: Array, i: int, j: int, discs: Array, others: Array, begins: Indices, apart: Array) -> bool:
    """Whether a timed motion may go straight from row i to row j.

    Nothing may come nearer than it has to be, or than it is at one of the two rows: discs (m, 3) of centre and radius,
    and other timed motions, stacked, with `begins` their first rows and the number of all, to the distances `apart`.
    """
    t, x, y = motion[i, 0], motion[i, 1], motion[i, 2]
    until, u, v = motion[j, 0], motion[j, 1], motion[j, 2]
    for k in range(len(discs)):
        ax, ay, bx, by = x - discs[k, 0], y - discs[k, 1], u - discs[k, 0], v - discs[k, 1]
        least = min(discs[k, 2], np.hypot(ax, ay), np.hypot(bx, by))
        if approach(ax, ay, bx - ax, by - ay, 1.0) < least - 1e-9:
            return False
    straight = np.empty((2, 3))
    straight[0, 0], straight[0, 1], straight[0, 2] = t, x, y
    straight[1, 0], straight[1, 1], straight[1, 2] = until, u, v
    for k in range(len(begins) - 1):
        other = others[begins[k] : begins[k + 1]]
        ax, ay, h = place(other, t, 0)
        bx, by, h = place(other, until, h)
        least = min(apart[k], np.hypot(x - ax, y - ay), np.hypot(u - bx, v - by))
        if closest(straight, other, t, until) < least - 1e-9:
            return False
    return True


@njit(cache=True)
def straightened(motion: Array, upto: int, discs: Array, others: Array, begins: Indices, apart: Array) -> Array:
    """The same timed motion with every detour between its first `upto` rows left out that is not needed.

    From each row kept it goes straight, at constant speed, to the last row that `straight_is_free` allows, found by
    trying the farthest first and then half of the way again and again. Times of the rows kept stay what they are.
    """
    kept = np.empty(len(motion), np.int64)
    kept[0], count, i = 0, 1, 0
    while i + 1 < upto:
        j = upto - 1
        while j > i + 1 and not straight_is_free(motion, i, j, discs, others, begins, apart):
            j = i + max(1, (j - i) * 3 // 4)
        kept[count] = j
        count += 1
        i = j
    for i in range(upto, len(motion)):
        kept[count] = i
        count += 1
    return motion[kept[:count]]
