"""Vectors in binary64: random ones, radial speeds, least distances."""

from __future__ import annotations

import numpy as np

from airground_drake.arrays import ROUNDOFF as ROUNDOFF
from airground_drake.arrays import Array

SEED = 20211209


def unit(rng: np.random.Generator, count: int) -> Array:
    """Random unit vectors, (count, 3)."""
    found = rng.normal(size=(count, 3))
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    return found


def rates(normal: Array, velocity: Array) -> Array:
    """n.v in the kernels' order of operations, (n, K), m/s: comparisons with bounds are then exact."""
    v = velocity[:, None]
    found: Array = normal[..., 0] * v[..., 0] + normal[..., 1] * v[..., 1] + normal[..., 2] * v[..., 2]
    return found


def nearest(x: Array, velocity: Array, period: float) -> Array:
    """Least distance from x + s v to the origin over s in [0, period], exact but for rounding; (...,), m."""
    step = period * velocity
    squared = (step**2).sum(axis=-1)
    along = -(x * step).sum(axis=-1)
    s = np.clip(np.divide(along, squared, out=np.zeros_like(along), where=squared > 0.0), 0.0, 1.0)
    found: Array = np.linalg.norm(x + s[..., None] * step, axis=-1)
    return found
