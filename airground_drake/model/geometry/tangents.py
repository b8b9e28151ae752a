"""Shortest way of a point round circles and along straight edges: pure maths, compiled by numba.

It is made of straight segments that touch circles and of arcs of these circles (see `model.geometry.paths`). The nodes
of a graph are start and goal, the ends of all free common tangents, and the points where boundaries meet; so an arc
between neighbouring nodes of a circle is free or blocked as a whole. Points are complex numbers x + iy, m.
"""

import math
from cmath import phase
from heapq import heappop, heappush
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array, Indices
from airground_drake.base.compiling import njit
from airground_drake.model.geometry import convex

Points = npt.NDArray[np.complex128]
Edge = tuple[int, int, float, int, float]  # tail, head, length in m, circle or -1 if straight, turn: 1.0 if to the left
Mark = tuple[int, float, int]  # a node on a circle: the circle, the direction from its centre in rad, the node

# Room for rounding, m: legs may dip so far into an obstacle, a disc that sticks out of another by less is dropped,
# shorter pieces are left out of a path.
EPS = 1e-10


class Around(NamedTuple):
    """What a way keeps out of, and the circles and straight edges that its boundary is made of."""

    c: Points  # centres of the circles, (n,)
    r: Array  # their radii, (n,), m
    ways: Points  # from the centre of a corner's circle to the corners before and after, (2, n); 0 for a disc
    begin: Points  # first points of the straight edges, (k,)
    end: Points  # their last points, (k,)
    rows: Array  # outlines at height 0, (m, W), see `model.geometry.outline`
    reach: Array  # distances to keep from their cores, (m,), m


@njit(cache=True)
def shortest(p: complex, q: complex, around: Around) -> Array:
    """The shortest way between two different free points: its pieces, (k, 6), see `Path`; k = 0 without a way."""
    at, marks, edges = [p, q], [(0, 0.0, 0)], [(0, 0, 0.0, 0, 0.0)]
    marks.pop()
    edges.pop()
    _join_tangents(around, at, marks, edges)
    points, circles = meetings(around.c, around.r, around.begin, around.end)
    for k in range(len(points)):
        for i in circles[k]:
            if i >= 0:
                heappush(marks, (i, phase(points[k] - around.c[i]), len(at)))
        at.append(points[k])
    _join_arcs(around, marks, edges)
    last = _searched(len(at), edges)
    count, node = 0, 1
    while node != 0 and last[node] >= 0:
        count, node = count + 1, edges[last[node]][0]
    pieces = np.empty((count if node == 0 else 0, 6))
    node = 1
    for k in range(len(pieces) - 1, -1, -1):
        tail, head, length, i, turn = edges[last[node]]
        heading = at[head] - at[tail] if i < 0 else complex(0.0, turn) * (at[tail] - around.c[i])
        heading = heading / max(abs(heading), 1e-300)
        bend = turn / around.r[i] if i >= 0 else 0.0
        row = (at[tail].real, at[tail].imag, heading.real, heading.imag, bend, length)
        for column in range(6):
            pieces[k, column] = row[column]
        node = tail
    return pieces


@njit(cache=True)
def _join_tangents(around: Around, at: list[complex], marks: list[Mark], edges: list[Edge]) -> None:
    """Add the free common tangents of all circles, and of start and goal, which are circles of radius 0."""
    # A tangent that cuts the polygon of its own corner would be blocked by it; leaving it out first is much faster.
    c, r = np.concatenate((np.array(at), around.c)), np.concatenate((np.zeros(2), around.r))
    blocker = -1
    for f in range(len(r)):
        for g in range(f + 1, len(r)):
            apart = abs(c[g] - c[f])
            if apart == 0.0:
                continue
            u = (c[g] - c[f]) / apart
            for kind in range(4 if f > 1 else 2 if g > 1 else 1):
                side, turn = 1.0 if kind < 2 else -1.0, 1.0 if kind % 2 == 0 else -1.0  # side: -1 for an inner tangent
                k = r[f] - side * r[g]
                if apart < abs(k) - EPS:
                    continue
                d = abs(k) if apart - abs(k) <= EPS else apart  # touching
                normal = complex(k, turn * math.sqrt((d - k) * (d + k))) / d * u
                if _cuts(normal, around.ways, f - 2) or _cuts(side * normal, around.ways, g - 2):
                    continue
                a, b = c[f] + r[f] * normal, c[g] + side * r[g] * normal
                by = convex.blocker(a.real, a.imag, b.real, b.imag, around.rows, around.reach, blocker)
                if by >= 0:
                    blocker = by
                    continue
                tail, head = _added(a, f, c, at, marks), _added(b, g, c, at, marks)
                edges.append((tail, head, abs(b - a), -1, 0.0))
                edges.append((head, tail, abs(b - a), -1, 0.0))


@njit(cache=True)
def _cuts(normal: complex, ways: Points, i: int) -> bool:
    """Whether the tangent of circle i with this normal leads inside its polygon."""
    for side in range(2):
        if i >= 0 and normal.real * ways[side, i].real + normal.imag * ways[side, i].imag > EPS:
            return True
    return False


@njit(cache=True)
def _added(point: complex, circle: int, c: Points, at: list[complex], marks: list[Mark]) -> int:
    """The node of a tangent's end; `circle` counts start and goal, which are nodes already."""
    if circle < 2:
        return circle
    heappush(marks, (circle - 2, phase(point - c[circle]), len(at)))
    at.append(point)
    return len(at) - 1


@njit(cache=True)
def meetings(c: Points, r: Array, begin: Points, end: Points) -> tuple[list[complex], list[tuple[int, int]]]:
    """Points where circles cross or meet straight edges, and the indices of both circles, or of one and -1."""
    points, circles = [0j], [(0, 0)]
    points.pop()
    circles.pop()
    for i in range(len(r)):
        for j in range(i + 1, len(r)):
            d = abs(c[j] - c[i])
            if d <= abs(r[i] - r[j]) or d > r[i] + r[j]:
                continue
            u = (c[j] - c[i]) / d
            along = 0.5 * (d + (r[i] - r[j]) * (r[i] + r[j]) / d)
            half = math.sqrt(max((r[i] - along) * (r[i] + along), 0.0))
            for side in (1.0, -1.0):
                points.append(c[i] + complex(along, side * half) * u)
                circles.append((i, j))
    for k in range(len(begin)):
        length = abs(end[k] - begin[k])
        u = (end[k] - begin[k]) / length
        for i in range(len(r)):
            z = (c[i] - begin[k]) * u.conjugate()  # along and beside the edge
            if abs(z.imag) > r[i] + EPS:
                continue
            half = math.sqrt(max((r[i] - z.imag) * (r[i] + z.imag), 0.0))
            for side in (-1.0, 1.0):
                along = z.real + side * half
                if -EPS <= along <= length + EPS:
                    points.append(begin[k] + along * u)
                    circles.append((i, -1))
    return points, circles


@njit(cache=True)
def _join_arcs(around: Around, marks: list[Mark], edges: list[Edge]) -> None:
    """Add the free arcs between neighbouring nodes of each circle."""
    arcs, middle = np.empty((len(marks), 3), np.int64), np.empty((len(marks), 2))  # arcs: first and last node, circle
    sweep = np.empty(len(marks))
    for k in range(len(arcs)):
        i, angle, node = heappop(marks)
        if k == 0 or arcs[k - 1, 2] != i:
            first = (i, angle + 2.0 * math.pi, node)
        after = marks[0] if len(marks) > 0 and marks[0][0] == i else first
        arcs[k, 0], arcs[k, 1], arcs[k, 2], sweep[k] = node, after[2], i, after[1] - angle
        half = angle + 0.5 * sweep[k]
        middle[k, 0] = around.c[i].real + around.r[i] * math.cos(half)
        middle[k, 1] = around.c[i].imag + around.r[i] * math.sin(half)
    free = convex.points_are_free(middle, around.rows, around.reach)
    for k in range(len(arcs)):
        if free[k]:
            here, there, i = arcs[k]
            edges.append((here, there, around.r[i] * sweep[k], i, 1.0))
            edges.append((there, here, around.r[i] * sweep[k], i, -1.0))


@njit(cache=True)
def _searched(count: int, edges: list[Edge]) -> Indices:
    """The edge by which the shortest way from node 0 comes to each node, (count,); -1 if not yet found (Dijkstra)."""
    first = np.zeros(count + 1, np.int64)
    for edge in edges:
        first[edge[0] + 1] += 1
    for node in range(count):
        first[node + 1] += first[node]
    leaving, free = np.empty(len(edges), np.int64), first.copy()
    for k in range(len(edges)):
        leaving[free[edges[k][0]]] = k
        free[edges[k][0]] += 1
    least, last = np.empty(count), np.empty(count, np.int64)
    least[:], last[:] = np.inf, -1
    least[0] = 0.0
    heap = [(0.0, 0)]
    while len(heap) > 0:
        length, node = heappop(heap)
        if node == 1:
            break
        if length > least[node]:
            continue
        for k in leaving[first[node] : first[node + 1]]:
            head, over = edges[k][1], length + edges[k][2]
            if over < least[head]:
                least[head], last[head] = over, k
                heappush(heap, (over, head))
    return last
