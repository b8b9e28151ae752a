"""Good plans for (26) by its own cost (25), with exact distances: beam search and local search, no solver."""

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
    dt, velocities, centres, distances = terms.dt, terms.velocities, terms.centres, terms.distances
    weights, slack_weight, reference = terms.error_weights, terms.slack_weight, terms.reference
    stages = len(block)
    modes, parents = np.zeros((stages, width), np.int64), np.zeros((stages, width), np.int64)
    ends, costs, many = np.empty((width, 3)), np.zeros(width), 1
    for a in range(3):
        ends[0, a] = terms.initial[a]
    reached, total = np.empty((2 * width, 3)), np.empty(width)
    for k in range(stages):
        goes_on = k > 0 and block[k] == block[k - 1]
        ways, count = 1 if goes_on else 2, 0
        for i in range(ways * many):
            parent, mode = i // ways, modes[k - 1, i] if goes_on else i % 2
            x = ends[parent, 0] + dt * velocities[mode, k, 0]
            y = ends[parent, 1] + dt * velocities[mode, k, 1]
            z = ends[parent, 2] + dt * velocities[mode, k, 2]
            reached[i, 0], reached[i, 1], reached[i, 2] = x, y, z
            slack = slack_at(centres, distances, k, x, y, z)
            cost = add_stage(costs[parent], weights, slack_weight, reference, k, x, y, z, slack)
            # the cheapest in order, the earlier first where costs are equal
            place = min(count, width - 1)
            if count == width and not cost < total[place]:
                continue
            while place > 0 and cost < total[place - 1]:
                total[place], parents[k, place] = total[place - 1], parents[k, place - 1]
                modes[k, place] = modes[k, place - 1]
                place -= 1
            total[place], parents[k, place], modes[k, place] = cost, i, mode
            count = min(count + 1, width)
        many = count
        for i in range(many):
            costs[i] = total[i]
            for a in range(3):
                ends[i, a] = reached[parents[k, i], a]
            parents[k, i] //= ways
    plan, i = np.empty(stages), 0
    for k in range(stages - 1, -1, -1):
        plan[k], i = modes[k, i], parents[k, i]
    return plan


@njit(cache=True)
def improve(terms: Terms, block: Blocks, start: Array, pairs: bool) -> tuple[Array, float]:
    """A plan (N,), constant on blocks, that is locally optimal for changes of one or (`pairs`) two blocks; its cost."""
    plan, blocks = start.copy(), block[-1] + 1
    count = len(plan) + 1
    before = _Beginnings(np.empty((count, 3)), np.empty(count), np.zeros((count, 5)), np.empty((blocks, 3)))
    _begin(terms, block, plan, before)
    changed = True
    while changed:
        changed = False
        for i in range(blocks):
            for j in range(i, blocks if pairs else i + 1):
                if _cost_changed(terms, block, plan, before, i, j) < before.cost[-1] * (1.0 - 1e-12):
                    for k in range(len(plan)):
                        if block[k] == i or block[k] == j:
                            plan[k] = 1.0 - plan[k]
                    _begin(terms, block, plan, before)
                    changed = True
    return plan, terms.dt * before.cost[-1]


class _Beginnings(NamedTuple):
    """A plan's stages in sums, costs without the factor dt."""

    end: Array  # of the first stages, (N + 1, 3), m
    cost: Array  # of the first stages, (N + 1,)
    # of the task errors e of the other stages, with weights a: sums of a, a e and a e^2, (N + 1, 5)
    errors: Array
    shift: Array  # what the opposite choice in a block adds to all later positions, (B, 3), m


@njit(cache=True)
def _begin(terms: Terms, block: Blocks, plan: Array, before: _Beginnings) -> None:
    before.shift[:] = 0.0
    for a in range(3):
        before.end[0, a] = terms.initial[a]
    before.cost[0] = 0.0
    for k in range(len(plan)):
        for a in range(3):
            before.end[k + 1, a] = before.end[k, a] + terms.dt * terms.velocities[int(plan[k]), k, a]
            change = terms.velocities[1 - int(plan[k]), k, a] - terms.velocities[int(plan[k]), k, a]
            before.shift[block[k], a] += terms.dt * change
        x, y, z = before.end[k + 1, 0], before.end[k + 1, 1], before.end[k + 1, 2]
        before.cost[k + 1] = _cost_to(before.cost[k], terms, k, x, y, z)
    for k in range(len(plan) - 1, -1, -1):
        weight = terms.error_weights[k]
        before.errors[k, 0] = before.errors[k + 1, 0] + weight
        before.errors[k, 4] = before.errors[k + 1, 4]
        for a in range(3):
            error = before.end[k + 1, a] - terms.reference[k, a]
            before.errors[k, 1 + a] = before.errors[k + 1, 1 + a] + weight * error
            before.errors[k, 4] += weight * error**2


@njit(cache=True)
def _errors(sums: Array, begin: int, end: int, x: float, y: float, z: float) -> float:
    """Weighted squares of the task errors of stages from `begin` to before `end`, shifted by (x, y, z), m."""
    total = sums[begin, 4] - sums[end, 4] + (sums[begin, 0] - sums[end, 0]) * (x * x + y * y + z * z)
    along = x * (sums[begin, 1] - sums[end, 1]) + y * (sums[begin, 2] - sums[end, 2])
    return total + 2.0 * (along + z * (sums[begin, 3] - sums[end, 3]))


@njit(cache=True)
def _cost_changed(terms: Terms, block: Blocks, plan: Array, before: _Beginnings, i: int, j: int) -> float:
    """Cost of a plan with the opposite choice in blocks i <= j, without the factor dt; inf if it surely costs more."""
    # The changes shift all positions after a block by the same: so the task errors to come are a lower bound.
    dt, velocities, centres, distances = terms.dt, terms.velocities, terms.centres, terms.distances
    weights, slack_weight, reference = terms.error_weights, terms.slack_weight, terms.reference
    sums, most, count = before.errors, before.cost[-1] * (1.0 + 1e-9), len(plan)
    first, second = np.searchsorted(block, i), np.searchsorted(block, j)
    between, after = np.searchsorted(block, i, side="right") - 1, np.searchsorted(block, j, side="right") - 1
    dx, dy, dz = before.shift[i, 0], before.shift[i, 1], before.shift[i, 2]
    ex, ey, ez = dx, dy, dz
    if i < j:
        ex, ey, ez = dx + before.shift[j, 0], dy + before.shift[j, 1], dz + before.shift[j, 2]
    beyond = _errors(sums, after, count, ex, ey, ez)
    x, y, z, total = before.end[first, 0], before.end[first, 1], before.end[first, 2], before.cost[first]
    for k in range(first, count):
        if k > after:
            beyond = _errors(sums, k, count, ex, ey, ez)
        ahead = _errors(sums, max(k, between), second, dx, dy, dz) if between < second and k < second else 0.0
        if total + ahead + beyond > most:
            return np.inf
        mode = 1 - int(plan[k]) if block[k] == i or block[k] == j else int(plan[k])
        x += dt * velocities[mode, k, 0]
        y += dt * velocities[mode, k, 1]
        z += dt * velocities[mode, k, 2]
        slack = slack_at(centres, distances, k, x, y, z)
        total = add_stage(total, weights, slack_weight, reference, k, x, y, z, slack)
    return total


@njit(cache=True)
def _cost_to(total: float, terms: Terms, k: int, x: float, y: float, z: float) -> float:
    """`total` and the cost of stage k that ends in (x, y, z), m, without the factor dt."""
    slack = slack_at(terms.centres, terms.distances, k, x, y, z)
    return add_stage(total, terms.error_weights, terms.slack_weight, terms.reference, k, x, y, z, slack)
