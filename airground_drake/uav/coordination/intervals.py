"""Safe intervals: when the nodes of a roadmap are free, and the search for the earliest way among the free times.

The functions are compiled by numba without fast-math: results are those of IEEE arithmetic in the order written.
"""

from heapq import heappop, heappush
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit

Indices = npt.NDArray[np.int64]


class Grid(NamedTuple):
    """Nodes of a roadmap in square cells, to find the nodes near a place."""

    nodes: Array  # (N, 2), m
    first: Indices  # index of the first member of each cell, column by column, (cells + 1,)
    members: Indices  # nodes sorted by cell, (N,)
    corner: Array  # lowest corner of the grid, (2,), m
    size: float  # of a cell, m
    shape: Indices  # number of columns and rows, (2,)


class Edges(NamedTuple):
    """Edges of a roadmap for one robot, each in both directions."""

    first: Indices  # first edge of each node, (N + 1,)
    heads: Indices  # node at the end of each edge, (E,)
    durations: Array  # travel times, (E,), s


class Intervals(NamedTuple):
    """Safe intervals: times at which no other robot is too near to a node."""

    first: Indices  # first interval of each node, (N + 1,)
    times: Array  # begin and end of each interval, (K, 2), s; the end may be infinite


@njit(cache=True)
def time_within(x: float, y: float, vx: float, vy: float, radius: float, duration: float) -> tuple[float, float]:
    """When a point that moves straight is nearer to the origin than a radius; `x`, `y` in m; `vx`, `vy` in m/s."""
    # radius: m.
    # duration: of the motion, s; may be infinite.
    # Returns begin and end of that time, s. The end is not after the begin if the point is never so near.
    c = x * x + y * y - radius * radius
    squared = vx * vx + vy * vy
    if squared == 0.0:
        return (0.0, duration) if c < 0.0 else (0.0, 0.0)
    b = x * vx + y * vy
    root = b * b - squared * c
    if root <= 0.0:
        return 0.0, 0.0
    root = np.sqrt(root)
    return max((-b - root) / squared, 0.0), min((-b + root) / squared, duration)


@njit(cache=True)
def cells_between(low: float, high: float, corner: float, size: float, count: int) -> tuple[int, int]:
    """First cell in a row that an interval meets, and the cell after the last one."""
    # low, high, corner, size: m
    first = min(max(int(np.floor((low - corner) / size)), 0), count)
    return first, max(min(int(np.floor((high - corner) / size)) + 1, count), first)


@njit(cache=True)
def nodes_near(grid: Grid, column: int, low: float, high: float) -> Indices:
    """The nodes of a column of cells between two coordinates, m, and of the cells that these lie in."""
    begin, end = cells_between(low, high, grid.corner[1], grid.size, grid.shape[1])
    return grid.members[grid.first[column * grid.shape[1] + begin] : grid.first[column * grid.shape[1] + end]]


@njit(cache=True)
def blocked_times(motion: Array, grid: Grid, radii: Array) -> tuple[Indices, Array]:
    """When a timed motion is nearer to nodes than their radii; `motion` (M, 3); `radii` (N,), m."""
    # Returns nodes (B,), sorted, and begin and end of each blocked time, (B, 2), s; those of a node do not overlap.
    nodes, times, count = np.empty(1024, np.int64), np.empty((1024, 2)), 0
    reach = radii.max()
    for k in range(len(motion)):
        begin, px, py = motion[k, 0], motion[k, 1], motion[k, 2]
        duration, qx, qy, vx, vy = np.inf, px, py, 0.0, 0.0
        if k + 1 < len(motion):
            duration, qx, qy = motion[k + 1, 0] - begin, motion[k + 1, 1], motion[k + 1, 2]
            vx, vy = (qx - px) / duration, (qy - py) / duration
        left, right = cells_between(min(px, qx) - reach, max(px, qx) + reach, grid.corner[0], grid.size, grid.shape[0])
        for column in range(left, right):
            for n in nodes_near(grid, column, min(py, qy) - reach, max(py, qy) + reach):
                entry, leave = time_within(px - grid.nodes[n, 0], py - grid.nodes[n, 1], vx, vy, radii[n], duration)
                if entry >= leave:
                    continue
                if count == len(nodes):
                    nodes, times = np.append(nodes, nodes), np.concatenate((times, times))
                nodes[count], times[count, 0], times[count, 1] = n, begin + entry, begin + leave
                count += 1
    return _joined(len(radii), nodes[:count], times[:count])


@njit(cache=True)
def _joined(count: int, nodes: Indices, times: Array) -> tuple[Indices, Array]:
    """Times blocked by one motion, sorted by node; those of a node that touch are one."""
    first, by_node = times_by_node(count, nodes, times)
    total = 0
    for n in range(count):
        for k in range(first[n], first[n + 1]):
            if k > first[n] and by_node[k, 0] <= times[total - 1, 1]:
                times[total - 1, 1] = by_node[k, 1]
                continue
            nodes[total], times[total, 0], times[total, 1] = n, by_node[k, 0], by_node[k, 1]
            total += 1
    return nodes[:total].copy(), times[:total].copy()


@njit(cache=True)
def times_by_node(count: int, nodes: Indices, times: Array) -> tuple[Indices, Array]:
    """Sort blocked times by node, and the times of each node by their begin; `nodes` (B,); `times` (B, 2), s."""
    # Returns index of the first time of each node, (N + 1,), and the sorted times, (B, 2), s.
    first = np.zeros(count + 1, np.int64)
    for n in nodes:
        first[n + 1] += 1
    for n in range(count):
        first[n + 1] += first[n]
    end, by_node = first[:-1].copy(), np.empty_like(times)
    for k in range(len(nodes)):
        i = end[nodes[k]]
        end[nodes[k]] += 1
        while i > first[nodes[k]] and by_node[i - 1, 0] > times[k, 0]:
            by_node[i] = by_node[i - 1]
            i -= 1
        by_node[i] = times[k]
    return first, by_node


@njit(cache=True)
def safe_intervals(count: int, nodes: Indices, times: Array) -> Intervals:
    """Times at which nodes are free, from t = 0 on; `nodes` (B,); `times` (B, 2), s."""
    first_blocked, blocked = times_by_node(count, nodes, times)
    first = np.zeros(count + 1, np.int64)
    intervals = np.empty((count + len(blocked), 2))
    total = 0
    for n in range(count):
        first[n] = total
        free = 0.0
        for k in range(first_blocked[n], first_blocked[n + 1]):
            if blocked[k, 0] > free:
                intervals[total, 0], intervals[total, 1] = free, blocked[k, 0]
                total += 1
            free = max(free, blocked[k, 1])
        if free < np.inf:
            intervals[total, 0], intervals[total, 1] = free, np.inf
            total += 1
    first[count] = total
    return Intervals(first, intervals[:total])


@njit(cache=True)
def join_time(arrival: float, end: float, first: float, last: float) -> float:
    """Earliest time at which a robot that waits at a node can join its preset there, s; infinite: never."""
    # last: latest such time, s. Infinite: the robot then stays at the node, so the interval must have no end.
    joined = max(arrival, first)
    if joined > min(last, end) or (last == np.inf and end < np.inf):
        return np.inf
    return joined


@njit(cache=True)
def search(
    edges: Edges, intervals: Intervals, start: int, joins: Array, to_go: Array, budget: int, latest: float
) -> tuple[Indices, Array, float, int]:
    """Safe-interval search (A*): the way from a node to the earliest join before `latest`, s; `to_go` (N,), s."""
    # The robot may wait at a node during a safe interval of the node. It travels an edge only while both ends are safe.
    # joins: first and last time at which the preset can be joined at each node, (N, 2), s; see `join_time`.
    # Returns nodes (L,) in order, arrival at each (L,), s, time of the join, s, and number of expanded intervals. If no
    # join is found, L = 0 and its time is `latest`.
    first, times = intervals
    arrival, before = np.full(len(times), np.inf), np.full(len(times), -1, np.int64)
    closed, node_of = np.zeros(len(times), np.bool_), np.empty(len(times), np.int64)
    for n in range(len(first) - 1):
        node_of[first[n] : first[n + 1]] = n
    heap: list[tuple[float, int]] = [(np.inf, -1)]
    heap.pop()
    if first[start] < first[start + 1] and times[first[start], 0] == 0.0 and to_go[start] < np.inf:
        arrival[first[start]] = 0.0
        heappush(heap, (to_go[start], int(first[start])))
    best, last, expanded = latest, -1, 0
    while len(heap) > 0 and expanded < budget:
        bound, i = heappop(heap)
        if bound >= best:
            break
        if closed[i]:
            continue
        closed[i] = True
        expanded += 1
        n = int(node_of[i])
        joined = join_time(arrival[i], times[i, 1], joins[n, 0], joins[n, 1])
        if joined < best:
            best, last = joined, i
        reach_neighbours(edges, intervals, n, i, to_go, arrival, before, heap)
    nodes, arrivals = traced_back(last, before, node_of, arrival)
    return nodes, arrivals, best, expanded


@njit(cache=True)
def reach_neighbours(
    edges: Edges,
    intervals: Intervals,
    node: int,
    i: int,
    to_go: Array,
    arrival: Array,
    before: Indices,
    heap: list[tuple[float, int]],
) -> None:
    """Record earlier arrivals at the neighbours of a node, and push their intervals onto the heap."""
    # i: safe interval of the node in which the robot may wait.
    # arrival: earliest arrival found in each interval, (K,), s; written to.
    # before: interval from which each is reached, (K,); written to.
    # heap: pairs of a lower bound of the join time, s, and an interval; written to.
    first, times = intervals
    end = times[i, 1]
    for e in range(edges.first[node], edges.first[node + 1]):
        head, duration = edges.heads[e], edges.durations[e]
        if to_go[head] == np.inf or arrival[i] + duration > end:
            continue
        for j in range(first[head], first[head + 1]):
            if times[j, 0] + duration > end:
                break
            there = max(arrival[i], times[j, 0]) + duration
            if there <= min(times[j, 1], end) and there < arrival[j]:
                arrival[j], before[j] = there, i
                heappush(heap, (there + to_go[head], j))


@njit(cache=True)
def traced_back(last: int, before: Indices, node_of: Indices, arrival: Array) -> tuple[Indices, Array]:
    """Nodes and arrivals, (L,), on the way to an interval; L = 0 for the interval -1."""
    length, i = 0, last
    while i >= 0:
        length += 1
        i = before[i]
    nodes, arrivals = np.empty(length, np.int64), np.empty(length)
    i = last
    for k in range(length - 1, -1, -1):
        nodes[k], arrivals[k] = node_of[i], arrival[i]
        i = before[i]
    return nodes, arrivals
