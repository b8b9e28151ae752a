"""Shapes and views of a replay: pure geometry."""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array, Flags

MOST_DASHES = 1000  # most dashes of a line
MOST_LINES = 30  # about the most lines of a grid, per side


class Mesh(NamedTuple):
    """Triangles: vertices (3, N), m, and faces (3, M), indices of vertices."""

    vertices: Array
    faces: npt.NDArray[np.int32]


def ribbon(path: Array, width_m: float, dash_m: float | None = None) -> Mesh:
    """A flat band along a path (M, 3), m, seen from above; dashes have the period `dash_m` if it is given."""
    steps = np.linalg.norm(np.diff(path[:, :2], axis=0), axis=1)
    kept = np.append(True, steps > 1e-9)
    corners, along = path[kept], np.append(0.0, np.cumsum(steps))[kept]
    if dash_m is not None:
        half = max(dash_m, along[-1] / MOST_DASHES) / 2.0
        marks = np.union1d(along, np.arange(0.0, along[-1], half))
        corners = np.column_stack([np.interp(marks, along, axis) for axis in corners.T])
        drawn = np.floor((marks[1:] + marks[:-1]) / 2.0 / half) % 2 == 0
    else:
        drawn = np.ones(len(corners) - 1, dtype=bool)
    start, end = corners[:-1][drawn], corners[1:][drawn]
    ahead = (end - start) * [1.0, 1.0, 0.0]
    ahead *= width_m / 2.0 / np.linalg.norm(ahead, axis=1, keepdims=True)
    aside = ahead[:, [1, 0, 2]] * [-1.0, 1.0, 1.0]
    joint = ahead if dash_m is None else 0.0 * ahead
    vertices = np.stack(
        [start - joint - aside, start - joint + aside, end + joint + aside, end + joint - aside], axis=1
    )
    corner = np.array([[0, 1, 2], [0, 2, 3]])[:, :, None] + 4 * np.arange(len(start))
    faces = np.concatenate(corner, axis=1)
    return Mesh(vertices.reshape(-1, 3).T, faces.astype(np.int32))


def prisms(outlines: Sequence[Array], height: float, *, lower: float = 0.0) -> Mesh:
    """Prisms of a height, m, over convex polygons (K, 2), m, counter-clockwise; without their bottoms."""
    # Their tops come first, each lower than the one before it by `lower`, m. So what is transparent is drawn once where
    # several overlap, seen from above.
    vertices, tops, walls = list[Array](), list[Array](), list[Array]()
    first = 0
    for k, outline in enumerate(outlines):
        n = len(outline)
        vertices += [np.column_stack([outline, np.full(n, z)]) for z in (height - k * lower, 0.0)]
        here, after = first + np.arange(n), first + np.roll(np.arange(n), -1)
        tops.append(np.stack([np.full(n - 2, first), here[1:-1], here[2:]]))
        walls += [np.stack([here, here + n, after]), np.stack([after, here + n, after + n])]
        first += 2 * n
    return Mesh(np.concatenate(vertices).T, np.concatenate([*tops, *walls], axis=1).astype(np.int32))


def outer_edges(outlines: Sequence[Array], inside: Callable[[Array], Flags], piece: float) -> Array:
    """The edges of polygons (K, 2), m, that are not inside of another one: ends of short segments, (2, S, 2), m."""
    # inside: (S, 2), m
    edges = list[Array]()
    for outline in outlines:
        closed = np.concatenate([outline, outline[:1]])
        for begin, end in pairwise(closed):
            count = max(1, math.ceil(float(np.linalg.norm(end - begin)) / piece))
            points = begin + np.linspace(0.0, 1.0, count + 1)[:, None] * (end - begin)
            edges.append(np.stack([points[:-1], points[1:]]))
    pieces = np.concatenate(edges, axis=1)
    return np.asarray(pieces[:, ~inside(pieces.mean(axis=0))])


def grid(low: Array, high: Array) -> tuple[Array, Array]:
    """Ends of the lines of a grid on the ground, (3, N) each, m, which covers a rectangle with corners (2,), m."""
    spacing = next(
        step * 10.0**power for power in range(300) for step in (1, 2, 5)
        if (high - low).max() <= MOST_LINES * step * 10.0**power
    )  # fmt: skip
    (left, bottom), (right, top) = np.floor(low / spacing) * spacing, np.ceil(high / spacing) * spacing
    x, y = np.arange(left, right + spacing / 2, spacing), np.arange(bottom, top + spacing / 2, spacing)
    start = [*((at, bottom, 0.0) for at in x), *((left, at, 0.0) for at in y)]
    end = [*((at, top, 0.0) for at in x), *((right, at, 0.0) for at in y)]
    return np.array(start).T, np.array(end).T


def camera(low: Array, high: Array, elevation: float, opening: float) -> tuple[Array, Array]:
    """Place of a camera, and the point that it looks at, (3,) each, m, so that it sees a box with corners (3,), m."""
    # elevation, opening: rad
    centre = (low + high) / 2.0
    back = np.array([0.0, -np.cos(elevation), np.sin(elevation)])
    up = np.array([0.0, np.sin(elevation), np.cos(elevation)])
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    away = corners - centre
    aside = np.maximum(np.abs(away[:, 0]), np.abs(away @ up))
    return centre + back * float((away @ back + aside / np.tan(opening / 2.0)).max()), centre
