"""Drawn convex cores as outlines, and places near them."""

from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.model.geometry import outline

Draw = np.random.Generator


def drawn(rng: Draw, **more: Any) -> Array:
    """A point, a post, a wall, a polygon or a prism within 3 m or so of the origin; `more` as for `outline.prism`."""
    kind, middle = rng.integers(6), rng.uniform(-3.0, 3.0, 2)
    top = float(rng.choice([0.0, rng.uniform(0.5, 3.0)]))
    if kind == 0:
        return outline.balls([*middle, rng.choice([0.0, rng.uniform(0.0, 2.0)])], **more)[0]
    if kind == 1:
        return outline.prism([middle], top=top + 0.5, **more)
    if kind == 2:
        return outline.prism([middle, middle + rng.normal(size=2)], top=top, **more)
    angle = np.cumsum(rng.dirichlet(np.full(rng.integers(3, 8), 3.0)))
    round_it = np.column_stack([np.cos(2.0 * np.pi * angle), np.sin(2.0 * np.pi * angle)])
    return outline.prism(middle + rng.uniform(0.3, 2.0) * round_it * [1.0, rng.uniform(0.2, 1.0)], top=top, **more)


def places(rng: Draw, count: int, *, planar: bool) -> Array:
    """Places (count, 3), m, near drawn cores, in the plane or not."""
    found = rng.uniform(-4.0, 4.0, (count, 3))
    found[:, 2] = 0.0 if planar else rng.uniform(-1.0, 4.0, count)
    return found
