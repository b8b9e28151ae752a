"""Shapes and views of a replay: pure geometry."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array

MOST_DASHES = 1000
"""Most dashes of a line."""
MOST_LINES = 30
"""About the most lines of a grid, per side."""


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


def grid(low: Array, high: Array) -> tuple[Array, Array]:
    """Ends of the lines of a grid on the ground, (3, N) each, m, which covers a rectangle with corners (2,), m.

    The spacing is 1, 2 or 5 times a power of ten: the smallest, from 1 m on, with at most MOST_LINES per side.
    """
    spacing = next(
        step * 10.0**power for power in range(300) for step in (1, 2, 5)
        if (high - low).max() <= MOST_LINES * step * 10.0**power
    )  # fmt: skip
    (left, bottom), (right, top) = np.floor(low / spacing) * spacing, np.ceil(high / spacing) * spacing
    x, y = np.arange(left, right + spacing / 2, spacing), np.arange(bottom, top + spacing / 2, spacing)
    start = [*((each, bottom, 0.0) for each in x), *((left, each, 0.0) for each in y)]
    end = [*((each, top, 0.0) for each in x), *((right, each, 0.0) for each in y)]
    return np.array(start).T, np.array(end).T


def camera(low: Array, high: Array, elevation: float, opening: float) -> tuple[Array, Array]:
    """Place of a camera, and the point that it looks at, (3,) each, m, so that it sees a box with corners (3,), m.

    Args:
        low: the corner with the least coordinates.
        high: the opposite one.
        elevation: angle above the ground under which it looks along +y, rad.
        opening: angle between the left and the right, the upper and the lower edge of the picture, rad.
    """
    centre = (low + high) / 2.0
    back = np.array([0.0, -np.cos(elevation), np.sin(elevation)])
    up = np.array([0.0, np.sin(elevation), np.cos(elevation)])
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    away = corners - centre
    aside = np.maximum(np.abs(away[:, 0]), np.abs(away @ up))
    return centre + back * float((away @ back + aside / np.tan(opening / 2.0)).max()), centre
