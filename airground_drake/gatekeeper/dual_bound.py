"""A lower bound of (25) by weak duality, for the relaxation (27) with half-planes."""

from __future__ import annotations

import numpy as np
from numba import njit

from airground_drake.base.arrays import Array
from airground_drake.gatekeeper.cost import Terms
from airground_drake.gatekeeper.problem import Problem


def dual_bound(problem: Problem, normals: Array, omega: Array, multipliers: Array) -> float:
    """Lower bound of (25), with distances along half-planes, by weak duality; valid for any arguments.

    For multipliers l >= 0 of the half-planes, (25) is at least the Lagrangian, whose minimum over u >= 0 is
    closed, and whose task error is convex in omega, so that it is at least its linearisation at any omega,
    whose minimum over the box [0, 1]^N is closed, too. At an optimum of the relaxation, with its multipliers,
    the bound is the optimum. A solver's tolerances cost tightness only, never validity.

    Args:
        problem: data of (26).
        normals: unit vectors, (N, m, 3).
        omega: where to linearise, (N,).
        multipliers: of the half-planes, (N, m), 1/m; negative ones count as 0.
    """
    at = problem.positions(omega)
    return float(_dual_bound(problem.terms, normals, omega, at, multipliers))


@njit(cache=True)
def _dual_bound(terms: Terms, normals: Array, omega: Array, positions: Array, multipliers: Array) -> float:
    total, gradient = 0.0, np.zeros(3)  # of what comes from stage k on, in the position at its end
    for k in range(len(omega) - 1, -1, -1):
        pressure = 0.0
        for m in range(len(terms.distances)):
            if multipliers[k, m] <= 0.0 or terms.slack_weight <= 0.0:
                continue
            reach = 0.0
            for a in range(3):
                reach += normals[k, m, a] * (positions[k, a] - terms.centres[k, m, a])
                gradient[a] -= multipliers[k, m] * normals[k, m, a]
            total += multipliers[k, m] * (terms.distances[m] - reach)
            pressure += multipliers[k, m]
        if pressure > 0.0:
            total -= pressure * pressure / (4.0 * terms.dt * terms.slack_weight)
        slope = 0.0
        for a in range(3):
            error = positions[k, a] - terms.reference[k, a]
            total += terms.dt * terms.error_weights[k] * error * error
            gradient[a] += 2.0 * terms.dt * terms.error_weights[k] * error
            slope += terms.dt * (terms.velocities[1, k, a] - terms.velocities[0, k, a]) * gradient[a]
        total += min(-omega[k] * slope, (1.0 - omega[k]) * slope)
    return total


def multipliers_at(problem: Problem, normals: Array, positions: Array) -> Array:
    """Multipliers of the half-planes, (N, m), 1/m, at an optimum with these positions and no ties.

    The derivative of b u^2 dt on the half-plane that is violated most at each stage. Where two are violated
    equally, an optimum may share it between them: ask the solver there.
    """
    multipliers: Array = _multipliers_at(problem.terms, normals, positions)
    return multipliers


@njit(cache=True)
def _multipliers_at(terms: Terms, normals: Array, positions: Array) -> Array:
    result = np.zeros(normals.shape[:2])
    for k in range(len(positions)):
        most, which = 0.0, -1
        for m in range(len(terms.distances)):
            slack = terms.distances[m]
            for a in range(3):
                slack -= normals[k, m, a] * (positions[k, a] - terms.centres[k, m, a])
            if slack > most:
                most, which = slack, m
        if which >= 0:
            result[k, which] = 2.0 * terms.dt * terms.slack_weight * most
    return result
