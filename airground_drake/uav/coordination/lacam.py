"""Search for joint steps from all starts to all targets: lazy constraints addition (LaCAM; Okumura, AAAI 2023).

Configurations, the nodes of all robots, are searched depth first. PIBT proposes the next configuration. Each time the
search comes back to a configuration, it asks for another next one, and prescribes the moves of the first robots: first
of none, then of one, and so on. In the end all moves of all robots have been prescribed. So a search that ends without
a plan, and not for lack of effort, proves that no such steps lead to the targets on this coarse roadmap.

Effort is counted in candidates, the moves that are considered for a robot. Nothing depends on a clock.
"""

from typing import Literal, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit
from airground_drake.uav.coordination.coarse import CoarseGraph
from airground_drake.uav.coordination.intervals import Indices
from airground_drake.uav.coordination.pibt import Step, Team, fits, give, mixed, must_go

MOST_CONFIGURATIONS = 60_000  # largest number of configurations in a search
FOR_STEP, FOR_ROBOT = 200, 40  # largest number of candidates of a step: a constant, and a part for each robot

Status = Literal["found", "exhausted", "effort spent"]
_STATUS: tuple[Status, ...] = ("found", "exhausted", "effort spent")


class Steps(NamedTuple):
    """The result of a search."""

    status: Status  # whether steps were found, and if not, whether all configurations were tried
    moves: Indices  # edge of each robot in each step, (T, n); T = 0 without a plan
    candidates: int  # what it cost


def search(graph: CoarseGraph, team: Team, starts: Indices, candidates: int, turn: int = 0) -> Steps:
    """Look for joint steps from the nodes `starts` (n,) to the targets."""
    most = int(min(MOST_CONFIGURATIONS, candidates // len(starts) + 2))
    status, moves, spent = _search(graph, team, starts, candidates, most, turn)
    return Steps(_STATUS[status], moves, int(spent))


@njit(cache=True)
def _hashed(nodes: Indices, layer: int) -> int:
    h = 1469598103 + layer
    for node in nodes:
        h = ((h ^ node) * 0x9E3779B1) & 0x7FFFFFFF
        h ^= h >> 15
    return h


@njit(cache=True)
def _looked_up(table: Indices, nodes: Indices, layers: Indices, wanted: Indices, layer: int) -> tuple[int, int]:
    """The number of a configuration, or -1, and its place in the table."""
    slot = _hashed(wanted, layer) & (len(table) - 1)
    while table[slot] >= 0:
        k = table[slot]
        if layers[k] == layer and (nodes[k] == wanted).all():
            return k, slot
        slot = (slot + 1) & (len(table) - 1)
    return -1, slot


@njit(cache=True)
def _next_constraint(digits: Indices, choices: Indices) -> bool:
    """Increment `digits` (n + 1,): the number of robots with prescribed moves, then their moves."""
    # Returns False when all moves of all robots have been prescribed.
    depth = digits[0]
    for k in range(depth, 0, -1):
        digits[k] += 1
        if digits[k] < choices[k - 1]:
            return True
        digits[k] = 0
    digits[0] += 1
    return bool(digits[0] <= len(choices))


@njit(cache=True)
def _by_priority(priorities: Array) -> Indices:
    return np.argsort(-priorities, kind="mergesort")


@njit(cache=True)
def _have_arrived(team: Team, nodes: Indices, layer: int) -> bool:
    """Whether every robot is at its target, and can stay there."""
    for i in range(len(nodes)):  # noqa: SIM110 - compiled
        if nodes[i] != team.targets[i] or team.to_go[layer, i, nodes[i]] > 0.0:
            return False
    return True


@njit(cache=True)
def _successor(graph: CoarseGraph, team: Team, step: Step, order: Indices, digits: Indices, turn: int) -> bool:
    """Make a joint step with prescribed moves of the first robots in the order."""
    first, moves, counts = graph.first, step.moves, step.counts
    layer = counts[3]
    moves[:] = -1
    step.failed[:] = False
    counts[2] = 0
    for k in range(digits[0]):
        i = order[k]
        begin = first[step.at[i]]
        many = first[step.at[i] + 1] - begin
        edge = begin + (digits[k + 1] + int(many * mixed(step.at[i], i, turn))) % many
        counts[0] += 1
        if not team.usable[i, edge] or team.shut[team.sizes[i], layer, edge] or not fits(graph, team, step, i, edge):
            return False
        moves[i] = edge
        step.given[counts[2]] = i
        counts[2] += 1
    for k in range(digits[0]):
        for j in range(len(moves)):
            if moves[j] < 0 and must_go(graph, team, step, order[k], j) and not give(graph, team, step, j):
                return False
    for i in order:  # noqa: SIM110 - compiled
        if moves[i] < 0 and not give(graph, team, step, i):
            return False
    return True


@njit(cache=True)
def _search(
    graph: CoarseGraph, team: Team, starts: Indices, budget: int, most: int, turn: int
) -> tuple[int, Indices, int]:
    """The compiled part of `search`; returns the index of the status, moves and candidates."""
    count, last_layer = len(starts), len(team.to_go) - 1
    first, heads, targets, to_go = graph.first, graph.heads, team.targets, team.to_go
    nodes, moves = np.empty((most, count), np.int64), np.empty((most, count), np.int64)
    before, layers = np.full(most, -1, np.int64), np.zeros(most, np.int64)
    digits, orders = np.zeros((most, count + 1), np.int16), np.empty((most, count), np.int64)
    priorities, spent_up = np.empty((most, count)), np.zeros(most, np.bool_)
    size = 4
    while size < 2 * most:
        size *= 2
    table = np.full(size, -1, np.int64)
    nodes[0] = starts
    far = 1.0
    for i in range(count):
        if to_go[0, i, starts[i]] == np.inf:
            return 1, moves[:0], 0
        far = max(far, to_go[0, i, starts[i]])
    for i in range(count):
        priorities[0, i] = 0.9 * to_go[0, i, starts[i]] / far
    orders[0] = _by_priority(priorities[0])
    table[_looked_up(table, nodes, layers, starts, 0)[1]] = 0
    goal, many, successors = -1, 1, 0
    stack = [0]
    step = Step(
        np.empty(count, np.int64), np.empty(count, np.int64), np.empty(count, np.int64), np.zeros(5, np.int64),
        np.empty((count, 6), np.int64), np.empty((count, np.diff(first).max()), np.int64),
        np.zeros(count, np.bool_),
    )  # fmt: skip
    choices, wanted = np.empty(count, np.int64), np.empty(count, np.int64)
    spent = 0
    if _have_arrived(team, starts, 0):
        goal = 0
    constraint = np.zeros(count + 1, np.int64)
    while goal < 0 and len(stack) > 0:
        here = stack[-1]
        if spent_up[here]:
            stack.pop()
            continue
        if spent >= budget or many == most:
            break
        step.at[:] = nodes[here]
        step.counts[0], step.counts[1] = 0, FOR_STEP + FOR_ROBOT * count
        step.counts[3], step.counts[4] = layers[here], successors * 1009 + turn
        constraint[:] = digits[here]
        ok = _successor(graph, team, step, orders[here], constraint, turn)
        spent += step.counts[0]
        successors += 1
        for k in range(count):
            node = nodes[here, orders[here, k]]
            choices[k] = first[node + 1] - first[node]
        spent_up[here] = not _next_constraint(constraint, choices)
        digits[here] = constraint
        if not ok:
            continue
        for i in range(count):
            wanted[i] = heads[step.moves[i]]
        layer = min(layers[here] + 1, last_layer)
        known, slot = _looked_up(table, nodes, layers, wanted, layer)
        if known >= 0:
            if not spent_up[known]:
                stack.append(known)
            continue
        table[slot] = many
        nodes[many], moves[many], before[many], layers[many] = wanted, step.moves, here, layer
        for i in range(count):
            old = priorities[here, i]
            priorities[many, i] = old - np.floor(old) if wanted[i] == targets[i] else old + 1.0
        orders[many] = _by_priority(priorities[many])
        if _have_arrived(team, wanted, layer):
            goal = many
        stack.append(many)
        many += 1
    if goal < 0:
        return (1 if len(stack) == 0 else 2), moves[:0], spent
    length, k = 0, goal
    while before[k] >= 0:
        length, k = length + 1, before[k]
    path = np.empty((length, count), np.int64)
    k = goal
    for row in range(length - 1, -1, -1):
        path[row] = moves[k]
        k = before[k]
    return 0, path, spent
