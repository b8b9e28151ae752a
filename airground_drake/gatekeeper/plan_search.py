"""Good plans for (26) by its own cost (25), with exact distances: beam search and local search, no solver."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from numba import njit

from airground_drake.base.arrays import Array
from airground_drake.gatekeeper.cost import Terms, add_stage, slack_at

Blocks = npt.NDArray[np.int64]

BEAM = 64
"""Partial plans that the beam search keeps. On random ten-stage problems 64 find the best of all 1,024 plans; 16 miss
it in one of 25. Among 60 stages, 256 find hardly more."""


def cheap_plan(terms: Terms, block: Blocks, known: Sequence[Array]) -> Array:
    """The cheapest plan (N,) found: that of the beam and known ones, improved by changes of one block, then of two.

    Args:
        terms: of the problem.
        block: that each stage belongs to, (N,).
        known: plans (N,), constant on each block.
    """
    starts = [beam_search(terms, block), *known]
    improved = [improve(terms, block, plan, pairs=False) for plan in starts]
    return improve(terms, block, min(improved, key=lambda one: one[1])[0], pairs=True)[0]


@njit(cache=True)
def beam_search(terms: Terms, block: Blocks, width: int = BEAM) -> Array:
    """The cheapest of the plans (N,) whose beginnings are, at the end of each stage, among the `width` cheapest."""
    stages = len(block)
    plans, costs, ends = np.zeros((1, stages)), np.zeros(1), terms.initial.copy().reshape(1, 3)
    for k in range(stages):
        goes_on = k > 0 and block[k] == block[k - 1]
        ways = 1 if goes_on else 2
        count = ways * len(costs)
        reached, total = np.empty((count, 3)), np.empty(count)
        for i in range(count):
            mode = int(plans[i, k - 1]) if goes_on else i % 2
            for a in range(3):
                reached[i, a] = ends[i // ways, a] + terms.dt * terms.velocities[mode, k, a]
            total[i] = _cost_to(costs[i // ways], terms, k, reached[i, 0], reached[i, 1], reached[i, 2])
        kept = np.argsort(total, kind="mergesort")[:width]
        longer = plans[kept // ways].copy()
        for i in range(len(kept)):
            longer[i, k] = longer[i, k - 1] if goes_on else float(kept[i] % 2)
        plans, costs, ends = longer, total[kept], reached[kept]
    return plans[0]


@njit(cache=True)
def improve(terms: Terms, block: Blocks, start: Array, pairs: bool) -> tuple[Array, float]:
    """A plan (N,), constant on each block, that neither a change of one block nor of two (`pairs`) makes cheaper."""
    plan, blocks = start.copy(), block[-1] + 1
    best, changed = _cost_changed(terms, block, plan, -1, -1, np.inf), True
    while changed:
        changed = False
        for i in range(blocks):
            for j in range(i, blocks if pairs else i + 1):
                cost = _cost_changed(terms, block, plan, i, j, best)
                if cost < best * (1.0 - 1e-12):
                    plan, best, changed = np.where((block == i) | (block == j), 1.0 - plan, plan), cost, True
    return plan, best


@njit(cache=True)
def _cost_changed(terms: Terms, block: Blocks, plan: Array, i: int, j: int, most: float) -> float:
    """Cost of a plan with the opposite choice in blocks i and j (-1: in none); at least `most` if it is above that."""
    x, y, z = terms.initial[0], terms.initial[1], terms.initial[2]
    total = 0.0
    for k in range(len(plan)):
        mode = 1 - int(plan[k]) if block[k] == i or block[k] == j else int(plan[k])
        x += terms.dt * terms.velocities[mode, k, 0]
        y += terms.dt * terms.velocities[mode, k, 1]
        z += terms.dt * terms.velocities[mode, k, 2]
        total = _cost_to(total, terms, k, x, y, z)
        if terms.dt * total > most:
            break
    return terms.dt * total


@njit(cache=True)
def _cost_to(total: float, terms: Terms, k: int, x: float, y: float, z: float) -> float:
    """`total` and the cost of stage k that ends in (x, y, z), m."""
    return add_stage(total, terms, k, x, y, z, slack_at(terms, k, x, y, z))
