"""A first plan for robots that block each other: LaCAM on several coarse roadmaps, with growing effort.

Wide nodes make few configurations, in which the swap rule sees the corridors. Narrow nodes let robots pass where wide
ones do not. So every width is tried with a small effort before any gets a large one. When a roadmap yields a plan, some
more plans are made on it with shuffled moves, and the one with the least sum of times is taken.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.compiling import njit
from airground_drake.uav.coordination import lacam, network
from airground_drake.uav.coordination.coarse import Coarse, CoarseGraph, coarsened
from airground_drake.uav.coordination.intervals import Indices
from airground_drake.uav.coordination.pibt import Team
from airground_drake.uav.coordination.roadmap import ROUNDING_M
from airground_drake.uav.coordination.single import Mover, OtherRobot, Way, sum_of_times
from airground_drake.uav.coordination.timed import closest, distance, without_repeats

# Distances of coarse nodes, as shares of the distance that robots keep. With the first, a robot can follow another one
# round a right angle; with the second it stands on the next node.
WIDTHS = (1.45, 1.02, 0.7, 0.5)
# The swap rule is used on roadmaps of at least this width: on narrower ones robots cover several nodes.
SWAPS_FROM = 1.0
FIRST = 400  # candidates for each robot in the first round; every further round gets twice as many on each roadmap
# How much moves are shuffled in each round, in widths, in turn. Some orders of moves lead into a long search, others of
# the same robots straight to a plan: a new start is better than a longer search.
NOISES = (0.05, 0.3, 1.0)
# Number of further plans with shuffled moves, once one is found: on the roadmap that has it, and on the widest two.
AGAIN = 96
# A further plan may cost this many times as much as the first one; all of them, a third of the candidates.
AGAIN_AT_MOST, AGAIN_SHARE = 2.0, 3
WAITING = 0.5  # what it costs to wait for a step while others with known motions are under way, in widths
# Known motions are followed for so many steps, and for fewer if the ways to the targets in all steps would be more
# values than this. In the last step, all that is left of a known motion counts as being in the way.
MOST_LAYERS, MOST_VALUES = 400, 10_000_000


@dataclass(frozen=True, eq=False)
class FirstPlan:
    """The result of `first_plan`."""

    outcome: lacam.Status  # whether a plan was found; if not, whether every coarse roadmap was searched to the end
    ways: tuple[Way, ...]  # one per robot; empty without a plan
    candidates: int  # the effort


def first_plan(movers: Sequence[Mover], fixed: Sequence[OtherRobot], candidates: int) -> FirstPlan:
    """Paths of all robots to their targets, where they wait for the end of their presets."""
    least = min(mover.space.apart for mover in movers)
    searches = [_Search(movers, fixed, share, share * least) for share in WIDTHS]
    spent, budget, turn = 0, FIRST * len(movers), 0
    while spent < candidates and not all(search.exhausted for search in searches):
        for tried in searches:
            if tried.exhausted:
                continue
            result = tried.run(min(budget, candidates - spent), turn)
            spent += result.candidates
            if result.status == "found":
                ways, more = _best(tried, result, searches[:2], candidates // AGAIN_SHARE)
                return FirstPlan("found", ways, spent + more)
            if spent >= candidates:
                break
        budget, turn = 2 * budget, turn + 1
    done = all(search.exhausted for search in searches)
    return FirstPlan("exhausted" if done else "effort spent", (), spent)


def _best(
    found_on: _Search, first: lacam.Steps, others: Sequence[_Search], candidates: int
) -> tuple[tuple[Way, ...], int]:
    """The best of some plans with shuffled moves, on several roadmaps, and the effort spent."""
    best, spent = found_on.timed(first.moves), 0
    again = list(dict.fromkeys([found_on, *others]))
    for turn in range(AGAIN // len(again)):
        for search in again:
            if spent >= candidates:
                break
            result = search.run(int(min(AGAIN_AT_MOST * first.candidates, candidates - spent)), AGAIN + turn)
            spent += result.candidates
            if result.status == "found":
                best = min(best, search.timed(result.moves), key=sum_of_times)
    return tuple(best), spent


class _Search:
    """One coarse roadmap, made when it is first needed."""

    def __init__(self, movers: Sequence[Mover], fixed: Sequence[OtherRobot], share: float, width: float) -> None:
        self._movers, self._fixed, self._share, self._width = movers, fixed, share, width
        self.exhausted = False

    @cached_property
    def _made(self) -> tuple[Coarse, Team, float]:
        """The roadmap, the robots on it, and the duration of a step, s."""
        coarse = coarsened(self._movers, self._width)
        longest = [float(coarse.graph.lengths[can].max()) for can in coarse.usable]
        # every robot can travel every edge that it can use in a step
        step = max(length / mover.speed for length, mover in zip(longest, self._movers, strict=True))
        shut = _shut(coarse, self._movers, self._fixed, step)
        apart = np.array([[own.space.apart + other.task.body for other in self._movers] for own in self._movers])
        to_go = _to_go(coarse, shut, WAITING * self._width)
        swaps = self._share >= SWAPS_FROM
        return coarse, Team(coarse.targets, coarse.usable, coarse.sizes, shut, apart, to_go, swaps, 0.0), step

    def run(self, candidates: int, turn: int) -> lacam.Steps:
        """Search within this effort; `turn` selects the shuffling of moves."""
        coarse, team, _ = self._made
        shuffled = team._replace(noise=NOISES[turn % len(NOISES)] * self._width)
        result = lacam.search(coarse.graph, shuffled, coarse.starts, candidates, turn)
        self.exhausted = result.status == "exhausted"
        return result

    def timed(self, moves: Indices) -> list[Way]:
        coarse, team, step = self._made
        short = network.without_loops(coarse.graph, team, moves)
        motions = network.motions(coarse.graph, team, short, [mover.speed for mover in self._movers])
        if not self._keeps_from_fixed(motions):
            motions = network.in_step(coarse.graph, moves, step)
        return [_way(mover, motion) for mover, motion in zip(self._movers, motions, strict=True)]

    def _keeps_from_fixed(self, motions: Sequence[Array]) -> bool:
        """Whether the robots keep their distances from the known motions."""
        for mover, motion in zip(self._movers, motions, strict=True):
            for other in self._fixed:
                first = float(np.hypot(*(motion[0, 1:] - other.motion[0, 1:])))
                least = min(mover.space.apart + other.radius, first)
                if distance(motion, other.motion) < least - ROUNDING_M:
                    return False
        return True


def _way(mover: Mover, motion: Array) -> Way:
    """A motion to the target, and the wait there for the end of the preset."""
    end = float(mover.task.preset[-1, 0])
    if motion[-1, 0] >= end:
        return Way(motion, float(motion[-1, 0]), len(motion))
    motion = without_repeats(np.concatenate([motion, [[end, *motion[-1, 1:]]]]))
    return Way(motion, end, len(motion))


def _shut(coarse: Coarse, movers: Sequence[Mover], fixed: Sequence[OtherRobot], step: float) -> Flags:
    """Edges that are shut because known motions are near, see `Team.shut`."""
    last = max((float(other.motion[-1, 0]) for other in fixed), default=0.0)
    most = min(MOST_LAYERS, MOST_VALUES // (len(movers) * len(coarse.graph.places)))
    layers = 1 + min(most, math.ceil(last / step))
    sizes = int(coarse.sizes.max()) + 1
    shut = np.zeros((sizes, layers, len(coarse.graph.heads)), dtype=np.bool_)
    for size in range(sizes):
        mover = next(mover for mover, own in zip(movers, coarse.sizes, strict=True) if own == size)
        for other in fixed:
            _shut_by(coarse.graph, other.motion, mover.space.apart + other.radius, step, shut[size])
    return shut


@njit(cache=True)
def _shut_by(graph: CoarseGraph, motion: Array, apart: float, step: float, shut: Flags) -> None:
    """Mark the edges that bring a robot too near to a known motion in each step."""
    # motion: (M, 3); step: s
    # shut: the result, (L, E).
    circles, rows, begins = graph.circles, graph.rows, graph.begins
    layers, edges = shut.shape
    for k in range(layers):
        begin = k * step
        end = begin + step if k + 1 < layers else np.inf
        low_x, high_x, low_y, high_y = np.inf, -np.inf, np.inf, -np.inf
        for m in range(len(motion)):
            # rows within the step, and the rows before and after it
            if (m + 1 < len(motion) and motion[m + 1, 0] < begin) or (m > 0 and motion[m - 1, 0] > end):
                continue
            low_x, high_x = min(low_x, motion[m, 1]), max(high_x, motion[m, 1])
            low_y, high_y = min(low_y, motion[m, 2]), max(high_y, motion[m, 2])
        for e in range(edges):
            if shut[k, e]:
                continue
            reach = apart + circles[e, 2]
            x, y = circles[e, 0], circles[e, 1]
            if x < low_x - reach or x > high_x + reach or y < low_y - reach or y > high_y + reach:
                continue
            line = rows[begins[e] : begins[e + 1]].copy()
            line[:, 0] = begin + step * line[:, 0]
            first = closest(line[:1], motion, begin, begin)
            shut[k, e] = closest(line, motion, begin, end) < min(apart, first) - ROUNDING_M


def _to_go(coarse: Coarse, shut: Flags, waiting: float) -> Array:
    """Ways to the targets, see `Team.to_go`; in all steps but the last ones, waiting counts as a way, too."""
    # waiting: m
    graph = coarse.graph
    count, layers = len(graph.places), shut.shape[1]
    tails = np.repeat(np.arange(count), np.diff(graph.first))
    to_go = np.empty((layers, len(coarse.targets), count))
    for i, target in enumerate(coarse.targets.tolist()):
        blocked = shut[coarse.sizes[i]]
        can = coarse.usable[i] & ~blocked[-1] & (tails != graph.heads)
        to_go[-1, i] = _ways_to(target, count, tails[can], graph.heads[can], graph.lengths[can])
        stays = ~blocked[-1][graph.first[:-1]]
        to_go[-1, i, ~stays & (np.arange(count) == target)] = np.inf
        for k in range(layers - 2, -1, -1):
            _step_back(graph, coarse.usable[i], blocked[k], target, waiting, to_go[k + 1, i], to_go[k, i])
    return to_go


def _ways_to(target: int, count: int, tails: Indices, heads: Indices, lengths: Array) -> Array:
    """Length of the shortest way to a node from every node, (N,), m. Two edges may join the same nodes."""
    order = np.lexsort((lengths, tails, heads))
    tails, heads, lengths = tails[order], heads[order], np.maximum(lengths[order], ROUNDING_M)
    new = np.append(True, (np.diff(tails) != 0) | (np.diff(heads) != 0))[: len(tails)]
    back = csr_array((lengths[new], (heads[new], tails[new])), shape=(count, count))
    to_target: Array = dijkstra(back, indices=target)
    return to_target


@njit(cache=True)
def _step_back(
    graph: CoarseGraph,
    usable: Flags,
    shut: Flags,
    target: int,
    waiting: float,
    later: Array,
    to_go: Array,
) -> None:
    """Ways from each node in one step, (N,), m, from those one step later."""
    first, heads, lengths = graph.first, graph.heads, graph.lengths
    for node in range(len(to_go)):
        best = np.inf
        for e in range(first[node], first[node + 1]):
            if shut[e] or not usable[e]:
                continue
            cost = lengths[e]
            if heads[e] == node:
                cost = 0.0 if node == target and later[node] == 0.0 else waiting
            best = min(best, cost + later[heads[e]])
        to_go[node] = best
