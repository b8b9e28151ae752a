"""The box that every plan stays in, per stage and axis, and what follows: idle half-planes, unavoidable cost.

At the end of a stage any plan, relaxed or not, is between the running sums of the smaller and of the larger mode
velocity.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from airground_drake.base.arrays import Array
from airground_drake.gatekeeper.cost import Terms
from airground_drake.gatekeeper.problem import Problem


def nearest_in_reach(problem: Problem) -> Array:
    """Where in the box of each stage a plan could be nearest to each point, (N, m, 3), m."""
    nearest: Array = _nearest(problem.terms)
    return nearest


def within_reach(problem: Problem) -> npt.NDArray[np.bool_]:
    """(N, m): False where no relaxed plan can come within the safe distance, so that (26d) costs nothing there."""
    squared = np.square(nearest_in_reach(problem) - problem.centres).sum(axis=2)
    within: npt.NDArray[np.bool_] = squared < np.square(problem.distances)
    return within


def remaining_cost(problem: Problem) -> Array:
    """Lower bound of (25) over the stages from k on, for k = 0..N, (N + 1,): task error from the box."""
    tail: Array = _remaining_cost(problem.terms)
    return tail


@njit(cache=True)
def _grow(terms: Terms, k: int, low: Array, high: Array) -> None:
    """From the box (low, high), (3,) each, m, at the beginning of stage k to that at its end, in place."""
    for a in range(3):
        low[a] += terms.dt * min(terms.velocities[1, k, a], terms.velocities[0, k, a])
        high[a] += terms.dt * max(terms.velocities[1, k, a], terms.velocities[0, k, a])


@njit(cache=True)
def _nearest(terms: Terms) -> Array:
    nearest = np.empty_like(terms.centres)
    low, high = terms.initial.copy(), terms.initial.copy()
    for k in range(len(terms.reference)):
        _grow(terms, k, low, high)
        for m in range(len(terms.distances)):
            for a in range(3):
                nearest[k, m, a] = min(max(terms.centres[k, m, a], low[a]), high[a])
    return nearest


@njit(cache=True)
def _remaining_cost(terms: Terms) -> Array:
    stages = len(terms.reference)
    tail = np.zeros(stages + 1)
    low, high = terms.initial.copy(), terms.initial.copy()
    for k in range(stages):
        _grow(terms, k, low, high)
        squared = 0.0
        for a in range(3):
            squared += max(0.0, low[a] - terms.reference[k, a], terms.reference[k, a] - high[a]) ** 2
        tail[k] = terms.dt * terms.error_weights[k] * squared
    for k in range(stages - 1, -1, -1):
        tail[k] += tail[k + 1]
    return (1.0 - 1e-9) * tail  # the last digits of the running sums must not cut an optimum
