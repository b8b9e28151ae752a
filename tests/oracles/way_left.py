"""Bounds of the shortest way left to a UGV among safe circles, on another graph than the gatekeeper's.

The nodes are points around the circles; a way over them is longer than the shortest one by less than a thousandth.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse.csgraph import dijkstra

from airground_drake.base.arrays import Array

AROUND = 48
"""Points around each safe circle."""


def bounds_of_way_left(place: Array, goal: Array, discs: Array, distances: Array | float) -> tuple[float, float]:
    """Bounds of the length of the shortest way among safe circles, m: straight, and over points around the circles.

    The latter is infinite where no way between those points is found.
    """
    squared = np.square(distances) - np.square(discs[:, 2] - place[2])
    centres, radii = discs[squared > 0.0, :2], np.sqrt(squared[squared > 0.0])
    direct = float(np.linalg.norm(goal[:2] - place[:2]))
    legs = np.array([place[:2], goal[:2]])
    some = _crossed(legs, centres, radii)
    while True:  # a way round some circles that crosses no other circle is a way round all
        legs = _round(legs[0], legs[-1], centres[some], radii[some])
        if not len(legs):
            return direct, np.inf
        more = some | _crossed(legs, centres, radii)
        if (more == some).all():
            return direct, float(np.linalg.norm(np.diff(legs, axis=0), axis=1).sum())
        some = more


def _crossed(way: Array, centres: Array, radii: Array) -> npt.NDArray[np.bool_]:
    """Which circles (m,) a polyline (M, 2) cuts."""
    legs = np.diff(way, axis=0)
    away = centres - way[:-1, None]
    along = np.clip(np.einsum("lmd,ld->lm", away, legs) / np.maximum((legs**2).sum(axis=1), 1e-300)[:, None], 0.0, 1.0)
    nearest = np.linalg.norm(away - along[..., None] * legs[:, None], axis=2)
    return np.asarray((nearest < radii * (1.0 - 1e-6)).any(axis=0))


def _round(place: Array, goal: Array, centres: Array, radii: Array) -> Array:
    """A short way round circles, over points around them, (M, 2), m; (0, 2) if no such way exists."""
    ends = np.stack([place, goal])
    if not len(centres):
        return ends
    angle = 2.0 * np.pi * np.arange(AROUND) / AROUND
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) / np.cos(np.pi / AROUND)
    rings = (centres[:, None] + radii[:, None, None] * (1.0 + 1e-9) * ring).reshape(-1, 2)
    free = (np.linalg.norm(rings[:, None] - centres, axis=2) >= radii).all(axis=1)
    nodes = np.concatenate([ends, rings[free]])
    x, y = nodes.T[:, :, None]
    over, up = x.T - x, y.T - y  # from the first node to the second
    squared = over**2 + up**2
    clear = np.ones(squared.shape, dtype=bool)
    for (right, above), radius in zip(centres, radii, strict=True):
        along = np.clip(((right - x) * over + (above - y) * up) / np.maximum(squared, 1e-300), 0.0, 1.0)
        nearest = np.square(x + along * over - right) + np.square(y + along * up - above)
        clear &= nearest >= (radius * (1.0 - 1e-6)) ** 2
    lengths = np.sqrt(squared)
    before = dijkstra(np.where(clear, lengths, 0.0), indices=0, return_predecessors=True)[1]
    if before[1] < 0:
        return np.empty((0, 2))
    chain = [1]
    while chain[-1] != 0:
        chain.append(int(before[chain[-1]]))
    return np.asarray(nodes[chain[::-1]])
