"""Walls, polygons and balls for tests of ways among them, and distances by formulas of their own."""

import numpy as np
import numpy.typing as npt
from hypothesis import strategies as st
from scipy.sparse.csgraph import dijkstra

from airground_drake.model.geometry import outline

Array = npt.NDArray[np.float64]


def from_core(begin: Array, end: Array, core: Array) -> Array:
    """Least distances of segments, from (K, 2) to (K, 2), m, from a core with given corners (n, 2), m: (K,), m.

    0 if they meet: then the segment crosses an edge or begins inside.
    """
    found = np.min([_from_segment(corner, begin, end) for corner in core], axis=0)
    inside = np.full(len(begin), len(core) > 2)
    for a, b in zip(core, np.roll(core, -1, axis=0), strict=True):
        found = np.minimum(found, np.minimum(_from_segment(begin, a, b), _from_segment(end, a, b)))
        along, leg = b - a, end - begin
        first, last = _cross(along, begin - a), _cross(along, end - a)
        found[(first * last < 0.0) & (_cross(leg, a - begin) * _cross(leg, b - begin) < 0.0)] = 0.0
        inside &= first > 0.0
    return np.where(inside, 0.0, found)


def _from_segment(point: Array, a: Array, b: Array) -> Array:
    leg = b - a
    share = ((point - a) * leg).sum(axis=-1) / np.maximum(np.square(leg).sum(axis=-1), 1e-300)
    return np.linalg.norm(point - a - np.clip(share, 0.0, 1.0)[..., None] * leg, axis=-1)


def _cross(u: Array, v: Array) -> Array:
    found: Array = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    return found


def shortest_around(start: Array, goal: Array, rows: Array, keep: Array, sides: int = 14) -> float:
    """Length of the shortest way that turns at points around corners only, m; infinite without one.

    The points are on circles a little wider than what is to be kept, so the way is a little longer than need be.
    """
    angle = 2.0 * np.pi * np.arange(sides) / sides
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) / np.cos(np.pi / sides) * (1.0 + 1e-9)
    cores = [outline.corners_of(row) for row in rows]
    rings = [corner + far * ring for core, far in zip(cores, keep.tolist(), strict=True) for corner in core]
    nodes = np.concatenate([[start, goal], *rings])
    free = np.ones(len(nodes), dtype=bool)
    for core, far in zip(cores, keep.tolist(), strict=True):
        free &= from_core(nodes, nodes, core) >= far - 1e-9
    free[:2] = True
    nodes = nodes[free]
    i, j = np.triu_indices(len(nodes), 1)
    for core, far in zip(cores, keep.tolist(), strict=True):
        clear = from_core(nodes[i], nodes[j], core) >= far - 1e-9
        i, j = i[clear], j[clear]
    graph = np.zeros((len(nodes), len(nodes)))
    graph[i, j] = np.linalg.norm(nodes[i] - nodes[j], axis=1)
    return float(dijkstra(graph, directed=False, indices=0)[1])


def rectangle(x: float, y: float, length: float, width: float, heading: float = 0.0) -> Array:
    """The outline of a rectangle about (x, y), m, turned by `heading`, rad."""
    corners = 0.5 * np.array([[-length, -width], [length, -width], [length, width], [-length, width]])
    cos, sin = np.cos(heading), np.sin(heading)
    return outline.prism(corners @ np.array([[cos, sin], [-sin, cos]]) + [x, y])


def wall(a: tuple[float, float], b: tuple[float, float]) -> Array:
    return outline.prism([a, b])


_PLACES = st.integers(0, 40).map(lambda n: n / 4.0)
_SIZES = st.integers(1, 12).map(lambda n: n / 4.0)
TRIANGLE = np.array([[1.0, 0.0], [-0.5, 0.8], [-0.5, -0.8]])
_POINTS = st.tuples(_PLACES, _PLACES)
OUTLINES = st.one_of(
    st.builds(lambda at: outline.balls([*at, 0.0])[0], _POINTS),
    st.builds(rectangle, _PLACES, _PLACES, _SIZES, _SIZES, st.sampled_from([0.0, 0.3, 1.0])),
    st.tuples(_POINTS, _POINTS).filter(lambda ends: ends[0] != ends[1]).map(lambda ends: wall(*ends)),
    st.builds(lambda at, r: outline.prism(np.array(at) + r * TRIANGLE), _POINTS, _SIZES),
)  # fmt: skip
"""Balls, rectangles, walls and triangles in a square of 10 m; corners coincide and edges touch now and then."""


def fields(most: int) -> st.SearchStrategy[tuple[Array, Array]]:
    """Outlines, up to so many, and the distances to keep from them, m."""
    one = st.tuples(OUTLINES, st.sampled_from([0.2, 0.25, 0.5]))
    return st.lists(one, min_size=1, max_size=most).map(
        lambda drawn: (outline.stacked([row for row, _ in drawn]), np.array([far for _, far in drawn]))
    )
