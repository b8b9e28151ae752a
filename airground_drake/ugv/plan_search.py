"""Good plans for (26) by its own cost (25), with exact distances: beam search and local search, no solver."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit
from airground_drake.ugv.cost import Terms, add_stage, slack_at

Blocks = npt.NDArray[np.int64]

# Partial plans that the beam search keeps. On random ten-stage problems with 64 the best of all 1,024 plans is found;
# with 16 it is missed in one of 25. With 60 stages, 256 find hardly more.
BEAM = 64


def cheap_plan(terms: Terms, block: Blocks, known: Sequence[Array]) -> Array:
    """The cheapest plan (N,) found: that of the beam and known ones, improved by changes of one block, then of two."""
    starts = distinct([beam_search(terms, block), *known])
    improved = [improve(terms, block, plan, False) for plan in starts]
    return improve(terms, block, min(improved, key=lambda plan_and_cost: plan_and_cost[1])[0], True)[0]


def distinct(plans: Sequence[Array]) -> list[Array]:
    """The plans (N,) without those that came before."""
    return [plan for i, plan in enumerate(plans) if not any(np.array_equal(plan, other) for other in plans[:i])]


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
    """A plan (N,), constant on blocks, that no change of one block makes cheaper, nor of two (`pairs`); its cost."""
    plan, blocks = start.copy(), block[-1] + 1
    before = _Beginnings(np.empty((len(plan) + 1, 3)), np.empty(len(plan) + 1))
    _begin(terms, plan, before)
    changed = True
    while changed:
        changed = False
        for i in range(blocks):
            for j in range(i, blocks if pairs else i + 1):
                if _cost_changed(terms, block, plan, before, i, j) < before.cost[-1] * (1.0 - 1e-12):
                    for k in range(len(plan)):
                        if block[k] == i or block[k] == j:
                            plan[k] = 1.0 - plan[k]
                    _begin(terms, plan, before)
                    changed = True
    return plan, terms.dt * before.cost[-1]


class _Beginnings(NamedTuple):
    """Ends of a plan's first stages, (N + 1, 3), m, and their cost so far, (N + 1,), without the factor dt."""

    end: Array
    cost: Array


@njit(cache=True)
def _begin(terms: Terms, plan: Array, before: _Beginnings) -> None:
    """Write the beginnings of a plan."""
    for a in range(3):
        before.end[0, a] = terms.initial[a]
    before.cost[0] = 0.0
    for k in range(len(plan)):
        for a in range(3):
            before.end[k + 1, a] = before.end[k, a] + terms.dt * terms.velocities[int(plan[k]), k, a]
        x, y, z = before.end[k + 1, 0], before.end[k + 1, 1], before.end[k + 1, 2]
        before.cost[k + 1] = _cost_to(before.cost[k], terms, k, x, y, z)


@njit(cache=True)
def _cost_changed(terms: Terms, block: Blocks, plan: Array, before: _Beginnings, i: int, j: int) -> float:
    """Cost of a plan with the opposite choice in blocks i <= j, without the factor dt; of a part that costs more."""
    dt, velocities, centres, distances = terms.dt, terms.velocities, terms.centres, terms.distances
    weights, slack_weight, reference = terms.error_weights, terms.slack_weight, terms.reference
    first, most = np.searchsorted(block, i), before.cost[-1]
    x, y, z, total = before.end[first, 0], before.end[first, 1], before.end[first, 2], before.cost[first]
    for k in range(first, len(plan)):
        mode = 1 - int(plan[k]) if block[k] == i or block[k] == j else int(plan[k])
        x += dt * velocities[mode, k, 0]
        y += dt * velocities[mode, k, 1]
        z += dt * velocities[mode, k, 2]
        slack = slack_at(centres, distances, k, x, y, z)
        total = add_stage(total, weights, slack_weight, reference, k, x, y, z, slack)
        if total > most:
            break
    return total


@njit(cache=True)
def _cost_to(total: float, terms: Terms, k: int, x: float, y: float, z: float) -> float:
    """`total` and the cost of stage k that ends in (x, y, z), m, without the factor dt."""
    slack = slack_at(terms.centres, terms.distances, k, x, y, z)
    return add_stage(total, terms.error_weights, terms.slack_weight, terms.reference, k, x, y, z, slack)
