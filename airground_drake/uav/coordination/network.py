"""From joint steps to continuous times: a temporal network of the robots' moves.

Two moves of different robots conflict if the places that they pass come nearer than the robots' distance. Moves that
conflict keep their order: the later step begins when the earlier one is over. If they are of the same step, they go in
lockstep, as the search has checked them. All other moves begin as early as they can.

Why no distance falls below what the steps had: consider two robots at one instant. If both move and their moves
conflict, they are in lockstep; else their moves are nowhere too near. If one waits where a move of the other passes too
near, its moves to and from there conflict with that move; so the order says that it waited there in that step, too.
"""

from collections.abc import Sequence

import numpy as np

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.compiling import njit
from airground_drake.uav.coordination.coarse import CoarseGraph
from airground_drake.uav.coordination.intervals import Indices
from airground_drake.uav.coordination.pibt import Team, conflicts
from airground_drake.uav.coordination.roadmap import ROUNDING_M
from airground_drake.uav.coordination.timed import without_repeats

SHORTEST_S = 1e-6  # shortest duration of a move, s


def without_loops(graph: CoarseGraph, team: Team, moves: Indices) -> Indices:
    """The moves (T, n), where robots that come back to a node stay there instead if nobody is in the way."""
    shortened = moves.copy()
    _cut_loops(graph, team.targets, team.apart, team.shut, team.sizes, shortened)
    return shortened


@njit(cache=True)
def _cut_loops(graph: CoarseGraph, targets: Indices, apart: Array, shut: Flags, sizes: Indices, moves: Indices) -> None:
    first, heads = graph.first, graph.heads
    steps, count = moves.shape
    for i in range(count):
        tail = np.empty(steps, np.int64)
        for k in range(steps):
            tail[k] = heads[moves[k - 1, i]] if k > 0 else -1
        k = 1
        while k < steps:
            node = tail[k]
            end = -1  # the last step that ends where this one begins
            for m in range(k, steps):
                stay = first[node]
                free = not shut[sizes[i], min(m, shut.shape[1] - 1), stay]
                for j in range(count):
                    both = node == targets[i] and heads[moves[m, j]] == targets[j]
                    if free and j != i and conflicts(graph, stay, moves[m, j], apart[i, j], both):
                        free = False
                if not free:
                    break
                if heads[moves[m, i]] == node:
                    end = m
            if end > k:
                for m in range(k, end + 1):
                    moves[m, i] = first[node]
                    tail[m] = node
                k = end
            k += 1


def motions(graph: CoarseGraph, team: Team, moves: Indices, speeds: Sequence[float]) -> list[Array]:
    """The robots' timed motions, as early as the order of their moves allows; each ends when its robot arrives."""
    pace = np.asarray(speeds, dtype=np.float64)
    begin, duration = _times(graph, team.apart, moves, pace)
    return [_motion(graph, moves[:, i], begin[:, i], duration[:, i]) for i in range(len(pace))]


def in_step(graph: CoarseGraph, moves: Indices, duration: float) -> list[Array]:
    """The robots' timed motions in steps of one duration, s."""
    begin: Array = duration * np.arange(len(moves), dtype=np.float64)
    return [_motion(graph, moves[:, i], begin, np.full(len(moves), duration)) for i in range(moves.shape[1])]


def _motion(graph: CoarseGraph, edges: Indices, begin: Array, duration: Array) -> Array:
    rows = [np.append(0.0, graph.rows[graph.begins[edges[0]], 1:])[None]]
    for edge, t, lasts in zip(edges.tolist(), begin.tolist(), duration.tolist(), strict=True):
        line = graph.rows[graph.begins[edge] : graph.begins[edge + 1]]
        if len(line) > 1:
            rows.append(np.column_stack([t + lasts * line[:, 0], line[:, 1:]]))
    return without_repeats(np.concatenate(rows))


@njit(cache=True)
def _times(graph: CoarseGraph, apart: Array, moves: Indices, speeds: Array) -> tuple[Array, Array]:
    """Begin and duration of every move, (T, n), s."""
    lengths, begins = graph.lengths, graph.begins
    steps, count = moves.shape
    begin, duration = np.zeros((steps, count)), np.zeros((steps, count))
    ready = np.zeros(count)
    group = np.empty(count, np.int64)
    for k in range(steps):
        earliest = ready.copy()
        for i in range(count):
            group[i] = i
            edge = moves[k, i]
            if begins[edge + 1] - begins[edge] < 2:
                continue
            for j in range(count):
                if j == i:
                    continue
                for m in range(k - 1, -1, -1):
                    other = moves[m, j]
                    if begin[m, j] + duration[m, j] <= earliest[i]:
                        break  # so are all moves before
                    if begins[other + 1] - begins[other] > 1 and pass_too_near(graph, edge, other, apart[i, j]):
                        earliest[i] = begin[m, j] + duration[m, j]
                        break
        for i in range(count):
            for j in range(i):
                one, other = moves[k, i], moves[k, j]
                both_move = begins[one + 1] - begins[one] > 1 and begins[other + 1] - begins[other] > 1
                if both_move and group[i] != group[j] and pass_too_near(graph, one, other, apart[i, j]):
                    old, new = max(group[i], group[j]), min(group[i], group[j])
                    for m in range(count):
                        if group[m] == old:
                            group[m] = new
        for i in range(count):
            edge = moves[k, i]
            begin[k, i], duration[k, i] = ready[i], 0.0
            if begins[edge + 1] - begins[edge] < 2:
                continue
            begin[k, i] = earliest[i]
            for j in range(count):
                if group[j] == group[i] and begins[moves[k, j] + 1] - begins[moves[k, j]] > 1:
                    begin[k, i] = max(begin[k, i], earliest[j])
                    duration[k, i] = max(duration[k, i], lengths[moves[k, j]] / speeds[j], SHORTEST_S)
        for i in range(count):
            ready[i] = begin[k, i] + duration[k, i]
    return begin, duration


@njit(cache=True)
def pass_too_near(graph: CoarseGraph, one: int, other: int, apart: float) -> bool:
    """Whether the polylines of two edges come nearer to each other than `apart`, m."""
    circles, rows, begins = graph.circles, graph.rows, graph.begins
    dx, dy = circles[one, 0] - circles[other, 0], circles[one, 1] - circles[other, 1]
    reach = apart + circles[one, 2] + circles[other, 2]
    if dx * dx + dy * dy > reach * reach:
        return False
    allowed = (apart - ROUNDING_M) ** 2
    for i in range(begins[one], max(begins[one] + 1, begins[one + 1] - 1)):
        p = min(i + 1, begins[one + 1] - 1)
        for j in range(begins[other], max(begins[other] + 1, begins[other + 1] - 1)):
            q = min(j + 1, begins[other + 1] - 1)
            if segments_apart(rows[i, 1:], rows[p, 1:], rows[j, 1:], rows[q, 1:]) < allowed:
                return True
    return False


@njit(cache=True)
def segments_apart(a: Array, b: Array, c: Array, d: Array) -> float:
    """Squared distance of the segments from a to b and from c to d, each (2,), m; m^2."""
    ux, uy, vx, vy = b[0] - a[0], b[1] - a[1], d[0] - c[0], d[1] - c[1]
    cross = ux * vy - uy * vx
    if cross != 0.0:
        wx, wy = c[0] - a[0], c[1] - a[1]
        s, t = (wx * vy - wy * vx) / cross, (wx * uy - wy * ux) / cross
        if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
            return 0.0
    return min(
        _from_segment(a, c, vx, vy),
        _from_segment(b, c, vx, vy),
        _from_segment(c, a, ux, uy),
        _from_segment(d, a, ux, uy),
    )


@njit(cache=True)
def _from_segment(p: Array, a: Array, ux: float, uy: float) -> float:
    """Squared distance of a point from the segment from a to a + u, m^2."""
    x, y = p[0] - a[0], p[1] - a[1]
    squared = ux * ux + uy * uy
    s = min(max((x * ux + y * uy) / squared, 0.0), 1.0) if squared > 0.0 else 0.0
    dx, dy = x - s * ux, y - s * uy
    return float(dx * dx + dy * dy)
