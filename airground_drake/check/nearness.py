"""Lower bounds of distances in a run, so that only pairs that come near each other are looked at closely."""

from __future__ import annotations

import numpy as np

from .rules import Array
from .scenario import Pair

ROWS = 50
"""Rows of a slice of a run."""
ROUNDING_M = 1e-6
"""Bounds are lowered by this, because of rounding."""


def least_apart_m(position_m: dict[str, Array], pairs: list[Pair]) -> Array:
    """Lower bounds of the distances of pairs over a whole run, (P,).

    On a slice of the run each body stays in a ball around its positions. Two bodies are at least as far apart as their
    balls.
    """
    number = {name: k for k, name in enumerate(position_m)}
    one = np.array([number[pair.robot] for pair in pairs], dtype=np.intp)
    other = np.array([number[pair.other] for pair in pairs], dtype=np.intp)
    found, places = np.full(len(pairs), np.inf), list(position_m.values())
    for begin in range(0, max(len(places[0]) - 1, 1), ROWS):
        parts = [place[begin : begin + ROWS + 1] for place in places]
        middle = np.array([0.5 * (part.min(axis=0) + part.max(axis=0)) for part in parts])
        reach = np.array([np.linalg.norm(part - at, axis=1).max() for part, at in zip(parts, middle, strict=True)])
        apart = np.linalg.norm(middle[one] - middle[other], axis=1) - reach[one] - reach[other]
        found = np.minimum(found, apart)
    return found - ROUNDING_M
