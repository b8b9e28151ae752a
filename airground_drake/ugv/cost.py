"""Cost (25) of one UGV with the soft constraint (26d)-(26e): the one place where its form is written.

All code that evaluates a plan, a stage or a branch of a search calls `add_stage`. Some code assumes the form of (25)
without evaluating it, and must change with it: the quadratic costs of `binary_program` and `routes.nonlinear`, and in
`relaxation` the weak duality of `dual_bound` and the unavoidable task error of `unavoidable_cost`.
"""

from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit


class Terms(NamedTuple):
    """The data of a `Problem` as numba takes them."""

    dt: float
    initial: Array
    velocities: Array  # of the modes, (2, N, 3), m/s, in the order of `rollout.REFUSED` and `ACCEPTED`
    reference: Array
    centres: Array
    distances: Array
    # a_i of (25) at the ends of the stages, (N,), 1/(m^2 s); the last one includes the terminal cost
    error_weights: Array
    slack_weight: float


@njit(cache=True)
def add_stage(
    total: float, error_weights: Array, slack_weight: float, reference: Array, k: int,
    x: float, y: float, z: float, slack: float,
) -> float:  # fmt: skip
    """`total` plus the integrand of (25), 1/s, at the end of stage k in (x, y, z), m, with slack u of (26e), m."""
    # It takes the arrays of `Terms` one by one, as `slack_at` does: in a loop that is five times as fast.
    total += slack_weight * slack * slack
    total += error_weights[k] * (reference[k, 0] - x) ** 2
    total += error_weights[k] * (reference[k, 1] - y) ** 2
    total += error_weights[k] * (reference[k, 2] - z) ** 2
    return total


@njit(cache=True)
def slack_at(centres: Array, distances: Array, k: int, x: float, y: float, z: float) -> float:
    """Slack u of (26e) that (26d) needs at the end of stage k in (x, y, z), m."""
    slack = 0.0
    for m in range(len(distances)):
        squared = (x - centres[k, m, 0]) ** 2 + (y - centres[k, m, 1]) ** 2 + (z - centres[k, m, 2]) ** 2
        if squared < distances[m] ** 2:
            slack = max(slack, distances[m] - np.sqrt(squared))
    return slack


@njit(cache=True)
def positions_of(terms: Terms, omega: Array) -> Array:
    """Positions at the ends of the stages, (23): omega (N,) in [0, 1] to (N, 3), m."""
    positions, (refuse, accept) = np.empty((len(omega), 3)), terms.velocities
    for a in range(3):
        total = 0.0
        for k in range(len(omega)):
            total += refuse[k, a] + omega[k] * (accept[k, a] - refuse[k, a])
            positions[k, a] = terms.initial[a] + terms.dt * total
    return positions


@njit(cache=True)
def plan_cost(terms: Terms, positions: Array) -> tuple[float, float]:
    """(25) by the right-hand rectangle rule through positions (N, 3), m, and the least distance minus d, m.

    The latter is inf without points.
    """
    total, least = 0.0, np.inf
    weights, slack_weight, reference = terms.error_weights, terms.slack_weight, terms.reference
    for k in range(len(positions)):
        x, y, z = positions[k, 0], positions[k, 1], positions[k, 2]
        clearance = np.inf
        for m in range(len(terms.distances)):
            ox, oy, oz = terms.centres[k, m, 0], terms.centres[k, m, 1], terms.centres[k, m, 2]
            distance = np.sqrt((x - ox) ** 2 + (y - oy) ** 2 + (z - oz) ** 2)
            clearance = min(clearance, distance - terms.distances[m])
        total = add_stage(total, weights, slack_weight, reference, k, x, y, z, max(0.0, -clearance))
        least = min(least, clearance)
    return terms.dt * total, least


@njit(cache=True)
def half_plane_cost(terms: Terms, positions: Array, normals: Array) -> float:
    """(25) as `plan_cost`, with distances measured along unit normals (N, m, 3): never less than with the true ones."""
    total = 0.0
    weights, slack_weight, reference = terms.error_weights, terms.slack_weight, terms.reference
    for k in range(len(positions)):
        clearance = np.inf
        for m in range(len(terms.distances)):
            reach = 0.0
            for a in range(3):
                reach += normals[k, m, a] * (positions[k, a] - terms.centres[k, m, a])
            clearance = min(clearance, reach - terms.distances[m])
        x, y, z = positions[k, 0], positions[k, 1], positions[k, 2]
        total = add_stage(total, weights, slack_weight, reference, k, x, y, z, max(0.0, -clearance))
    return terms.dt * total
