"""A coarse roadmap for joint plans: few nodes, about one robot's width apart, joined by paths of the fine roadmap.

The nodes are drawn from the roadmap so that no two are nearer to each other than a given width, if nothing is in
between. Every node of the roadmap belongs to the nearest of them by way. Two nodes whose regions touch are joined by
the shortest way through the common border. So two nodes are connected in the coarse roadmap exactly where they are in
the roadmap.

Robots of several sizes share the nodes. The regions are drawn for each size, with the ways that this size can go.
"""

from collections.abc import Sequence
from heapq import heappop, heappush
from itertools import chain
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.compiling import njit
from airground_drake.uav.coordination.intervals import Indices
from airground_drake.uav.coordination.roadmap import Space
from airground_drake.uav.coordination.single import Mover
from airground_drake.uav.coordination.timed import without_repeats

# A robot can go from its start to the nodes within this many widths of path length. These are more than the neighbours
# of one region: robots that have met have little room for their first move.
FROM_START = 2.0
# A smaller robot uses the edge of a larger one between the same nodes, unless its own is shorter by this factor.
NO_LONGER = 1.05

AS_LATTICE = 1.09  # ways along the lattice are at most this much longer than straight ones


class CoarseGraph(NamedTuple):
    """A coarse roadmap. Edges are polylines that are travelled at constant speed; the first of each node is to stay."""

    places: Array  # of the nodes, (N, 2), m
    first: Indices  # first edge of each node, (N + 1,)
    heads: Indices  # node at the end of each edge, (E,)
    lengths: Array  # of the edges, (E,), m
    begins: Indices  # first row of each edge in `rows`, (E + 1,)
    rows: Array  # share of the edge and place, m, (P, 3): a timed motion from 0 to 1
    circles: Array  # middle, m, and radius, m, of a circle round each edge, (E, 3)


class Coarse(NamedTuple):
    """A coarse roadmap for some robots."""

    graph: CoarseGraph  # all nodes and edges
    starts: Indices  # node of each robot's start, (n,); no edge leads to it
    targets: Indices  # node of each robot's target, (n,)
    usable: Flags  # which edges each robot can use, (n, E)
    sizes: Indices  # index of each robot's size, (n,); robots of one size keep the same distances


class _Edge(NamedTuple):
    """An edge without a number; `size` is the index of the largest robot size that can use it."""

    tail: int
    head: int
    size: int
    nodes: list[int]  # of the roadmap, in the order in which they are passed


def coarsened(movers: Sequence[Mover], width: float) -> Coarse:
    """The coarse roadmap of robots with nodes at least `width`, m, apart in path length; targets may be nearer."""
    # Starts have edges that lead away only. As ordinary nodes they would make corridors look wider than they are.
    # width: m.
    spaces = sorted({mover.space.apart: mover.space for mover in movers}.values(), key=lambda space: -space.apart)
    index = {space.apart: k for k, space in enumerate(spaces)}
    sizes = np.array([index[mover.space.apart] for mover in movers], dtype=np.int64)
    starts = np.array([mover.own.start for mover in movers], dtype=np.int64)
    targets = np.array([mover.own.target for mover in movers], dtype=np.int64)
    places = movers[0].roadmap.nodes
    graphs = [_ways(movers, sizes, size, space) for size, space in enumerate(spaces)]
    seeds = _nodes(graphs, places, targets, sizes, width)
    number = np.full(len(places), -1, dtype=np.int64)
    number[seeds] = np.arange(len(seeds))
    edges: dict[tuple[int, ...], _Edge] = {}
    leaving: list[_Edge] = []
    for size, (ways, space) in enumerate(zip(graphs, spaces, strict=True)):
        _add_borders(edges, ways, space, places, seeds, size)
        own = np.flatnonzero(sizes == size)
        leaving += _from_starts(ways, space, places, seeds, own, starts, size, width)
    every = [*edges.values(), *(_Edge(edge.head, edge.tail, edge.size, edge.nodes[::-1]) for edge in edges.values())]
    every += [_Edge(len(seeds) + edge.tail, edge.head, edge.size, edge.nodes) for edge in leaving]
    graph, largest = _graph(places, np.concatenate([seeds, starts]), every)
    usable = largest[None, :] <= sizes[:, None]
    return Coarse(graph, len(seeds) + np.arange(len(movers)), number[targets], usable, sizes)


def _ways(movers: Sequence[Mover], sizes: Indices, size: int, space: Space) -> csr_array:
    """The roadmap for robots of one size: free nodes, and edges from their starts, which need not be free."""
    roadmap = min(movers, key=lambda mover: mover.space.apart).roadmap
    nodes, heads, lengths = roadmap.nodes, roadmap.heads, roadmap.lengths
    tails = np.repeat(np.arange(len(nodes)), np.diff(roadmap.first_edge))
    free = space.points_are_free(nodes, 0.0)
    begins = free.copy()
    begins[[mover.own.start for mover, own in zip(movers, sizes, strict=True) if own == size]] = True
    kept = begins[tails] & free[heads]
    if size < int(sizes.max()):
        kept[kept] = space.segments_are_free(nodes[tails[kept]], nodes[heads[kept]])
    return csr_array((lengths[kept], (tails[kept], heads[kept])), shape=(len(nodes), len(nodes)))


def _nodes(graphs: Sequence[csr_array], places: Array, targets: Indices, sizes: Indices, width: float) -> Indices:
    """Nodes of the coarse roadmap: the targets, then every node at least `width`, m, from all previous ones."""
    chosen = np.zeros(0, dtype=np.int64)
    for size, ways in enumerate(graphs):
        wanted = np.unique(targets[sizes == size])
        always = np.concatenate([chosen, wanted[~np.isin(wanted, chosen)]])
        free = np.diff(ways.indptr) > 0
        chosen = _packed(places, ways.indptr, ways.indices, ways.data, always, free, width)
    return chosen


@njit(cache=True)
def _packed(
    places: Array,
    first: npt.NDArray[np.int32],
    heads: npt.NDArray[np.int32],
    lengths: Array,
    always: Indices,
    wanted: Flags,
    width: float,
) -> Indices:
    """The nodes `always`, then the `wanted` nodes, in order, that are at least `width`, m, from all chosen ones."""
    # Nodes behind a wall do not count: the way to a node must be hardly longer than on a free lattice.
    count = len(first) - 1
    covered, way_to = np.zeros(count, np.bool_), np.full(count, np.inf)
    chosen, many = np.empty(count + len(always), np.int64), 0
    for k in range(len(always) + count):
        seed = always[k] if k < len(always) else k - len(always)
        if k >= len(always) and (covered[seed] or not wanted[seed]):
            continue
        chosen[many] = seed
        many += 1
        way_to[seed] = 0.0
        reached, heap = [seed], [(0.0, seed)]
        while len(heap) > 0:
            way, here = heappop(heap)
            if way > way_to[here]:
                continue
            if np.hypot(places[here, 0] - places[seed, 0], places[here, 1] - places[seed, 1]) < width:
                covered[here] = True
            for e in range(first[here], first[here + 1]):
                there, further = np.int64(heads[e]), way + lengths[e]
                if further < AS_LATTICE * width and further < way_to[there]:
                    way_to[there] = further
                    reached.append(there)
                    heappush(heap, (further, there))
        for node in reached:
            way_to[node] = np.inf
    return chosen[:many]


def _add_borders(
    edges: dict[tuple[int, ...], _Edge], ways: csr_array, space: Space, places: Array, seeds: Indices, size: int
) -> None:
    """Join nodes whose regions touch, for one size of robots; adds to `edges`."""
    far, before, nearest = dijkstra(ways, indices=seeds, min_only=True, return_predecessors=True)
    tails = np.repeat(np.arange(len(places)), np.diff(ways.indptr))
    heads = ways.indices.astype(np.int64)
    border = (nearest[tails] != nearest[heads]) & (nearest[tails] >= 0) & (nearest[heads] >= 0)
    tails, heads = tails[border], heads[border]
    length = far[tails] + ways.data[border] + far[heads]
    low, high = np.minimum(nearest[tails], nearest[heads]), np.maximum(nearest[tails], nearest[heads])
    order = np.lexsort((length, high, low))
    low, high, tails, heads, length = low[order], high[order], tails[order], heads[order], length[order]
    new = np.append(True, (np.diff(low) != 0) | (np.diff(high) != 0))[: len(low)]
    number = np.full(len(places), -1, dtype=np.int64)
    number[seeds] = np.arange(len(seeds))
    straight = space.segments_are_free(places[low[new]], places[high[new]])
    for a, b, u, v, is_free in zip(
        low[new].tolist(), high[new].tolist(), tails[new].tolist(), heads[new].tolist(), straight.tolist(), strict=True
    ):
        nodes = [a, b]
        if not is_free:
            u, v = (u, v) if nearest[u] == a else (v, u)
            nodes = [*_back(before, u)[::-1], *_back(before, v)]
        pair = (int(number[a]), int(number[b]))
        before_it = edges.get(pair)
        if before_it is None:
            edges[pair] = _Edge(*pair, size, nodes)
        elif NO_LONGER * _length(places[nodes]) < _length(places[before_it.nodes]):
            edges[*pair, size] = _Edge(*pair, size, nodes)


def _from_starts(
    ways: csr_array, space: Space, places: Array, seeds: Indices, own: Indices, starts: Indices, size: int, width: float
) -> list[_Edge]:
    """Edges from the starts of robots, given by their indices `own`; the tails are these indices."""
    far, before = dijkstra(ways, indices=starts[own], return_predecessors=True, limit=FROM_START * width)
    edges = []
    for k, i in enumerate(own.tolist()):
        near = np.flatnonzero(np.isfinite(far[k, seeds]))
        straight = space.segments_are_free(np.repeat(places[starts[i]][None], len(near), axis=0), places[seeds[near]])
        for s, is_free in zip(near.tolist(), straight.tolist(), strict=True):
            seed = int(seeds[s])
            edges.append(_Edge(i, s, size, [int(starts[i]), seed] if is_free else _back(before[k], seed)[::-1]))
    return edges


def _back(before: npt.NDArray[np.int32], node: int) -> list[int]:
    """The nodes on the way back from a node to where a search began."""
    path = [node]
    while before[path[-1]] >= 0:
        path.append(int(before[path[-1]]))
    return path


def _length(line: Array) -> float:
    return float(np.hypot(*np.diff(line, axis=0).T).sum())


def _graph(places: Array, nodes: Indices, edges: Sequence[_Edge]) -> tuple[CoarseGraph, Indices]:
    """The graph with these nodes of the roadmap and these edges, and the largest size that can use each edge, (E,)."""
    # places: of all nodes of the roadmap, m
    stays = [_Edge(k, k, 0, [node]) for k, node in enumerate(nodes.tolist())]
    *ends, lines = zip(*stays, *edges, strict=True)
    tails, heads, sizes = np.array(ends, dtype=np.int64)
    counts = np.array([len(line) for line in lines])
    order = np.lexsort((sizes, heads, counts > 1, tails))
    first = np.searchsorted(tails[order], np.arange(len(nodes) + 1)).astype(np.int64)
    passed = places[list(chain.from_iterable(lines[k] for k in order.tolist()))]
    begins, rows = _motions(passed, np.append(0, np.cumsum(counts[order])).astype(np.int64))
    lows, highs = (extreme.reduceat(rows[:, 1:], begins[:-1]) for extreme in (np.minimum, np.maximum))
    circles = np.column_stack([0.5 * (lows + highs), 0.5 * np.hypot(*(highs - lows).T)])
    legs = np.append(0.0, np.cumsum(np.hypot(*np.diff(rows[:, 1:], axis=0).T)))
    lengths = legs[begins[1:] - 1] - legs[begins[:-1]]
    return CoarseGraph(places[nodes], first, heads[order], lengths, begins, rows, circles), sizes[order]


@njit(cache=True)
def _motions(lines: Array, ends: Indices) -> tuple[Indices, Array]:
    """Polylines, stacked (K, 2), m, each as a motion from 0 to 1 at constant speed; one row for a single place."""
    # ends: first row of each line, and the end of the last one. Returns the same of the motions, and their rows.
    begins, rows = np.zeros_like(ends), np.empty((len(lines), 3))
    for e in range(len(ends) - 1):
        line = lines[ends[e] : ends[e + 1]]
        motion = np.zeros((len(line), 3))
        motion[:, 1:] = line
        for k in range(1, len(line)):
            motion[k, 0] = motion[k - 1, 0] + np.hypot(line[k, 0] - line[k - 1, 0], line[k, 1] - line[k - 1, 1])
        if motion[-1, 0] == 0.0:
            motion = motion[-1:]
        elif len(motion) > 1:
            motion[:, 0] /= motion[-1, 0]
            motion = without_repeats(motion)
        begins[e + 1] = begins[e] + len(motion)
        rows[begins[e] : begins[e + 1]] = motion
    return begins, rows[: begins[-1]]
