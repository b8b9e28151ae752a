"""Straighter ways: what a roadmap makes a robot go round for nothing is left out, and every distance is kept."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from airground_drake.arrays import Array
from airground_drake.intervention.coordination import kernels
from airground_drake.intervention.coordination.roadmap import Space
from airground_drake.intervention.coordination.single import Way

ROUNDS = 2
"""How often every way is straightened among the others."""


def smooth(
    space: Space, ways: Sequence[Way | None], rests: Sequence[Array], fixed: Sequence[Array]
) -> list[Way | None]:
    """The same ways with straight pieces where they are free; times at which presets are joined stay what they are.

    Args:
        space: what is to be kept away from.
        ways: one per robot; None: it stays where it is.
        rests: motions of the robots if they stay, (1, 3) each.
        fixed: motions (M, 3) of others.
    """
    found = list(ways)
    for _ in range(ROUNDS):
        for i, way in enumerate(found):
            if way is None:
                continue
            others = [*fixed, *(_motion(other, rests[j]) for j, other in enumerate(found) if j != i)]
            found[i] = _straightened(space, way, others)
    return found


def _motion(way: Way | None, rest: Array) -> Array:
    return rest if way is None else way.motion


def _straightened(space: Space, way: Way, others: Sequence[Array]) -> Way:
    stacked = np.concatenate([np.zeros((0, 3)), *others])
    begins = np.concatenate([[0], np.cumsum([len(other) for other in others])]).astype(np.int64)
    motion = kernels.straightened(way.motion, way.rows, space.discs, stacked, begins, space.apart + space.spacing)
    return Way(motion, way.joined, way.rows - (len(way.motion) - len(motion)))
