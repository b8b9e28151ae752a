"""One joint step of all robots on a coarse roadmap: priority inheritance with backtracking (PIBT), and the swap rule.

Robots get their moves in order of priority (Okumura et al., Priority inheritance with backtracking, Artificial
Intelligence 2022). Each takes the move that brings it nearest to its target. Robots that could not stay beside that
move get theirs next, before all others. If one of them finds none, the next best move is tried, and this one is not
asked to make way again in the same step: in a jam, trying all ways to push each other costs more than all steps.

Swap rule (Okumura, Engineering LaCAM*, AAMAS 2024): in a corridor, a robot that has to change places with the robot
ahead must lead it back to a junction. It then takes the move that leads farthest from its target, and the other one
follows.

Robots are discs that go along polylines in the same step, each at constant speed. Two moves conflict if their exact
distance falls below the distance that the robots keep, or below the distance at the beginning of the step if that is
less. Functions are compiled by numba.
"""

from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.compiling import njit
from airground_drake.uav.coordination.coarse import CoarseGraph
from airground_drake.uav.coordination.intervals import Indices
from airground_drake.uav.coordination.roadmap import ROUNDING_M

LONGEST_CHAIN = 1000  # largest number of nodes of a corridor that the swap rule follows


class Team(NamedTuple):
    """Robots on a coarse roadmap with N nodes and E edges."""

    targets: Indices  # node of each robot's target, (n,)
    usable: Flags  # which edges each robot can use, (n, E)
    sizes: Indices  # index of each robot's size, (n,)
    # Edges that robots of each size cannot use in each layer, as robots with known motions are near, (S, L, E). Layer k
    # is the step with this number; the last layer is of all later steps.
    shut: Flags
    apart: Array  # distances to keep between robots, (n, n), m
    to_go: Array  # way from each node to the target, (L, n, N), m; infinite: none
    swaps: bool  # whether the swap rule is used
    noise: float  # how much moves are shuffled, m


class Step(NamedTuple):
    """A joint step that is being put together."""

    at: Indices  # node of each robot, (n,)
    moves: Indices  # edge of each robot, (n,); -1: not chosen yet
    given: Indices  # robots in the order in which they got their moves, (n,)
    # Candidates so far, largest number of candidates, robots with moves, layer, number of the step, (5,).
    counts: Indices
    frames: Indices  # see `give`, (n, 6)
    lists: Indices  # moves of the robots in the frames, best first, (n, largest number of edges at a node)
    # Robots that could not make way for another one, (n,); they are not asked again in this step.
    failed: Flags


@njit(cache=True)
def mixed(a: int, b: int, c: int) -> float:
    """A number in [0, 1) that three integers determine, and that looks random."""
    h = 12345
    for x in (a, b, c):
        h = ((h ^ (x & 0x7FFFFFFF)) * 0x9E3779B1) & 0x7FFFFFFF
        h = (h ^ (h >> 15)) * 0x85EBCA6B & 0x7FFFFFFF
        h ^= h >> 13
    return h / 2147483648.0


@njit(cache=True)
def conflicts(graph: CoarseGraph, one: int, other: int, apart: float, both_arrive: bool) -> bool:
    """Whether two robots that travel two edges in the same step come too near to each other; `apart` in m."""
    # both_arrive: whether both reach their targets, which may be nearer, too.
    circles = graph.circles
    dx, dy = circles[one, 0] - circles[other, 0], circles[one, 1] - circles[other, 1]
    reach = apart + circles[one, 2] + circles[other, 2]
    if dx * dx + dy * dy > reach * reach:
        return False
    rows, begins = graph.rows, graph.begins
    i, last_i, j, last_j = begins[one], begins[one + 1] - 1, begins[other], begins[other + 1] - 1
    x, y = rows[i, 1] - rows[j, 1], rows[i, 2] - rows[j, 2]
    end_x, end_y = rows[last_i, 1] - rows[last_j, 1], rows[last_i, 2] - rows[last_j, 2]
    allowed = min(apart * apart, x * x + y * y)
    if both_arrive:
        allowed = min(allowed, end_x * end_x + end_y * end_y)
    allowed = max(0.0, np.sqrt(allowed) - ROUNDING_M) ** 2
    if end_x * end_x + end_y * end_y < allowed:
        return True
    t = 0.0
    while t < 1.0:
        until = 1.0
        if i < last_i:
            until = min(until, rows[i + 1, 0])
        if j < last_j:
            until = min(until, rows[j + 1, 0])
        ax, ay = rows[i, 1], rows[i, 2]
        if i < last_i:
            share = (until - rows[i, 0]) / (rows[i + 1, 0] - rows[i, 0])
            ax, ay = ax + share * (rows[i + 1, 1] - ax), ay + share * (rows[i + 1, 2] - ay)
        bx, by = rows[j, 1], rows[j, 2]
        if j < last_j:
            share = (until - rows[j, 0]) / (rows[j + 1, 0] - rows[j, 0])
            bx, by = bx + share * (rows[j + 1, 1] - bx), by + share * (rows[j + 1, 2] - by)
        u, v = ax - bx, ay - by
        vx, vy = u - x, v - y
        squared = vx * vx + vy * vy
        s = min(max(-(x * vx + y * vy) / squared, 0.0), 1.0) if squared > 0.0 else 0.0
        px, py = x + s * vx, y + s * vy
        if px * px + py * py < allowed:
            return True
        x, y, t = u, v, until
        if i < last_i and rows[i + 1, 0] <= until:
            i += 1
        if j < last_j and rows[j + 1, 0] <= until:
            j += 1
    return False


@njit(cache=True)
def fits(graph: CoarseGraph, team: Team, step: Step, i: int, edge: int) -> bool:
    """Whether a move of robot i is compatible with all assigned moves."""
    moves, targets, heads, apart, circles = step.moves, team.targets, graph.heads, team.apart, graph.circles
    x, y, radius = circles[edge, 0], circles[edge, 1], circles[edge, 2]
    arrives = heads[edge] == targets[i]
    for j in range(len(moves)):
        other = moves[j]
        if other < 0 or j == i:
            continue
        dx, dy, reach = x - circles[other, 0], y - circles[other, 1], apart[i, j] + radius + circles[other, 2]
        if dx * dx + dy * dy <= reach * reach:
            both = arrives and heads[other] == targets[j]
            if conflicts(graph, edge, other, apart[i, j], both):
                return False
    return True


@njit(cache=True)
def give(graph: CoarseGraph, team: Team, step: Step, root: int) -> bool:
    """Assign a move to a robot and to all robots in its way; False, without changes, if that fails."""
    # The robots that are being given moves are a stack of frames: robot, number of its moves, index of the move tried,
    # robot to change places with, number of robots with moves before it, and next robot to look at.
    at, moves, counts, frames, lists = step.at, step.moves, step.counts, step.frames, step.lists
    depth, entered = 0, root
    while True:
        if entered >= 0:  # a robot that needs a move
            many = sort_moves(graph, team, step, entered, lists[depth])
            partner = -1
            if team.swaps and many > 0:
                partner = swap_partner(graph, team, step, entered, lists[depth, 0])
                if partner >= 0:
                    many = turn_back(graph, team, step, entered, partner, lists[depth, :many])
            frames[depth, 0], frames[depth, 1], frames[depth, 2] = entered, many, -1
            frames[depth, 3], frames[depth, 4] = partner, counts[2]
            chosen = not (depth > 0 and step.failed[entered]) and next_move(graph, team, step, depth)
        else:  # the robot looks for the next one in the way of its move
            chosen = True
        while not chosen:  # without a move left, the robot before takes its next best one
            step.failed[frames[depth, 0]] = True
            depth -= 1
            if depth < 0:
                return False
            chosen = next_move(graph, team, step, depth)
        i = frames[depth, 0]
        entered = next_in_the_way(graph, team, step, depth)
        if entered >= 0:
            depth += 1
            continue
        partner = frames[depth, 3]
        if partner >= 0 and frames[depth, 2] == 0 and moves[partner] < 0:
            follow(graph, team, step, partner, at[i])
        depth -= 1
        if depth < 0:
            return True


@njit(cache=True)
def next_move(graph: CoarseGraph, team: Team, step: Step, depth: int) -> bool:
    """Undo the assignments of a frame's robot, and assign its next best move, if any."""
    moves, given, counts, frames, lists = step.moves, step.given, step.counts, step.frames, step.lists
    i = frames[depth, 0]
    while counts[2] > frames[depth, 4]:
        counts[2] -= 1
        moves[given[counts[2]]] = -1
    for k in range(frames[depth, 2] + 1, frames[depth, 1]):
        counts[0] += 1
        if counts[0] > counts[1]:
            return False
        if fits(graph, team, step, i, lists[depth, k]):
            moves[i] = lists[depth, k]
            given[counts[2]] = i
            counts[2] += 1
            frames[depth, 2], frames[depth, 5] = k, 0
            return True
    return False


@njit(cache=True)
def next_in_the_way(graph: CoarseGraph, team: Team, step: Step, depth: int) -> int:
    """The next robot without a move that cannot stay beside the move of a frame's robot; -1: none."""
    moves, at, frames, apart, circles, places = (
        step.moves, step.at, step.frames, team.apart, graph.circles, graph.places
    )  # fmt: skip
    i = frames[depth, 0]
    x, y, radius = circles[moves[i], 0], circles[moves[i], 1], circles[moves[i], 2]
    for j in range(frames[depth, 5], len(moves)):
        if moves[j] >= 0:
            continue
        dx, dy, reach = x - places[at[j], 0], y - places[at[j], 1], apart[i, j] + radius
        if dx * dx + dy * dy <= reach * reach and must_go(graph, team, step, i, j):
            frames[depth, 5] = j + 1
            return j
    return -1


@njit(cache=True)
def must_go(graph: CoarseGraph, team: Team, step: Step, i: int, j: int) -> bool:
    """Whether robot j cannot stay beside the move of robot i."""
    edge, node = step.moves[i], step.at[j]
    both = graph.heads[edge] == team.targets[i] and node == team.targets[j]
    return conflicts(graph, edge, graph.first[node], team.apart[i, j], both)


@njit(cache=True)
def turn_back(graph: CoarseGraph, team: Team, step: Step, i: int, partner: int, moves: Indices) -> int:
    """Sort the moves of robot i: first those that its partner can follow, and that lead farthest away."""
    # Moves that lead nearer to the target come last. If the partner already pushes robot i, they are left out: the
    # partner has to wait.
    first, heads, at, apart, to_go = graph.first, graph.heads, step.at, team.apart, team.to_go[-1]
    behind = -1
    for edge in range(first[at[partner]], first[at[partner] + 1]):
        if heads[edge] == at[i] and team.usable[partner, edge] and behind < 0:
            behind = edge
    pushed = step.moves[partner] >= 0 and heads[step.moves[partner]] == at[i]
    reverse = moves[::-1].copy()
    many = 0
    for rank in range(2 if pushed else 3):
        for edge in reverse:
            own = 2
            if to_go[i, heads[edge]] >= to_go[i, at[i]]:
                own = 1 if behind >= 0 and conflicts(graph, edge, behind, apart[i, partner], False) else 0
            if own == rank:
                moves[many] = edge
                many += 1
    return many


@njit(cache=True)
def follow(graph: CoarseGraph, team: Team, step: Step, j: int, there: int) -> None:
    """Let robot j go to the node `there` if that pushes no other robot."""
    at, moves, given, counts = step.at, step.moves, step.given, step.counts
    first, heads, layer = graph.first, graph.heads, step.counts[3]
    for edge in range(first[at[j]], first[at[j] + 1]):
        if heads[edge] != there or not team.usable[j, edge] or team.shut[team.sizes[j], layer, edge]:
            continue
        if not fits(graph, team, step, j, edge):
            continue
        free = True
        for k in range(len(moves)):
            if moves[k] < 0 and k != j and conflicts(graph, edge, first[at[k]], team.apart[j, k], False):
                free = False
                break
        if free:
            moves[j] = edge
            given[counts[2]] = j
            counts[2] += 1
            return


@njit(cache=True)
def sort_moves(graph: CoarseGraph, team: Team, step: Step, i: int, moves: Indices) -> int:
    """Write the possible moves of robot i into `moves`, the nearest to its target first; returns their number."""
    first, heads, to_go = graph.first, graph.heads, team.to_go
    here, layer, number = step.at[i], step.counts[3], step.counts[4]
    later = min(layer + 1, len(to_go) - 1)
    keys = np.empty(len(moves))
    many = 0
    for edge in range(first[here], first[here + 1]):
        if not team.usable[i, edge] or team.shut[team.sizes[i], layer, edge]:
            continue
        key = to_go[later, i, heads[edge]]
        if key == np.inf:
            continue
        if key > 0.0:
            key += team.noise * mixed(number, i, edge)
        k = many
        while k > 0 and keys[k - 1] > key:
            keys[k], moves[k] = keys[k - 1], moves[k - 1]
            k -= 1
        keys[k], moves[k] = key, edge
        many += 1
    return many


@njit(cache=True)
def swap_partner(graph: CoarseGraph, team: Team, step: Step, i: int, best: int) -> int:
    """The robot with which robot i has to change places, and can if it goes back; else -1."""
    # Either it stands where robot i wants to go. Or it stands behind: robot i is at or near its target in a corridor,
    # and must come out again to let the other one in.
    places, first, heads = graph.places, graph.first, graph.heads
    at, apart = step.at, team.apart
    here, there = at[i], heads[best]
    if there != here:
        j = standing_at(graph, team, step, i, there)
        if j >= 0 and must_swap(graph, team, i, j, here, there):
            return j if can_swap(graph, team, i, at[j], here, apart[i, j]) else -1
    for edge in range(first[here] + 1, first[here + 1]):
        behind = heads[edge]
        if behind in (there, here):
            continue
        j = standing_at(graph, team, step, i, behind)
        if j < 0:
            continue
        if np.hypot(places[at[j], 0] - places[there, 0], places[at[j], 1] - places[there, 1]) < apart[i, j]:
            continue
        if (
            there != here
            and must_swap(graph, team, j, i, here, there)
            and can_swap(graph, team, i, there, here, apart[i, j])
        ):
            return j
    return -1


@njit(cache=True)
def standing_at(graph: CoarseGraph, team: Team, step: Step, i: int, node: int) -> int:
    """The robot nearest to a node that keeps robot i from it; else -1."""
    places, at, apart = graph.places, step.at, team.apart
    nearest, least = -1, np.inf
    for j in range(len(at)):
        if j == i:
            continue
        far = np.hypot(places[at[j], 0] - places[node, 0], places[at[j], 1] - places[node, 1])
        if far < apart[i, j] and far < least:
            nearest, least = j, far
    return nearest


@njit(cache=True)
def onward(graph: CoarseGraph, team: Team, i: int, before: int, here: int, apart: float) -> tuple[int, int]:
    """Where a corridor leads on from a node for a robot that came from the node `before`."""
    # Returns 0, 1 or 2: it ends, goes on, or has a junction, from which two robots that are `apart`, m, can go on; and
    # the next node.
    places, first, heads = graph.places, graph.first, graph.heads
    chosen, most, other = -1, 0.0, -1
    for edge in range(first[here] + 1, first[here + 1]):
        there = heads[edge]
        if there in (before, here) or not team.usable[i, edge]:
            continue
        far = np.hypot(places[there, 0] - places[before, 0], places[there, 1] - places[before, 1])
        if far < apart:
            continue
        if far > most:
            chosen, most = there, far
    if chosen < 0:
        return 0, -1
    for edge in range(first[here] + 1, first[here + 1]):
        there = heads[edge]
        if there in (before, here, chosen) or not team.usable[i, edge]:
            continue
        aside = np.hypot(places[there, 0] - places[chosen, 0], places[there, 1] - places[chosen, 1])
        far = np.hypot(places[there, 0] - places[before, 0], places[there, 1] - places[before, 1])
        if aside >= apart and far >= apart:
            other = there
    return (1 if other < 0 else 2), chosen


@njit(cache=True)
def must_swap(graph: CoarseGraph, team: Team, i: int, j: int, here: int, there: int) -> bool:
    """Whether robot i, at the node `here`, must change places with robot j, at `there`, to come to its target."""
    # Robot i is taken to push robot j ahead along the corridor. They must swap if j finds no junction on the way and
    # has to come back.
    to_go, apart = team.to_go[-1], team.apart[i, j]
    behind, ahead = here, there
    for _ in range(LONGEST_CHAIN):
        if not to_go[i, ahead] < to_go[i, behind]:
            break
        ways, further = onward(graph, team, j, behind, ahead, apart)
        if ways == 2:
            return False
        if ways == 0:
            break
        behind, ahead = ahead, further
    wants = to_go[i, behind] == 0.0 or to_go[i, ahead] < to_go[i, behind]
    return wants and to_go[j, behind] < to_go[j, ahead]


@njit(cache=True)
def can_swap(graph: CoarseGraph, team: Team, i: int, behind: int, here: int, apart: float) -> bool:
    """Whether robot i, which goes away from the node `behind`, comes to a junction where both can pass."""
    begin = here
    for _ in range(LONGEST_CHAIN):
        ways, further = onward(graph, team, i, behind, here, apart)
        if ways != 1:
            return bool(ways == 2)
        behind, here = here, further
        if here == begin:
            return False
    return False
