"""Supporting half-planes n.(p - o) >= d - u in place of (26d): what the convexified routes share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit

from airground_drake.arrays import Array
from airground_drake.gatekeeper.problem import Problem


def normals_along(problem: Problem, positions: Array) -> Array:
    """Unit vectors (N, m, 3) from the points to a guiding trajectory (N, 3)."""
    offset = positions[:, None, :] - problem.centres
    norm = np.sqrt(np.einsum("kmi,kmi->km", offset, offset))[:, :, None]
    if norm.min(initial=np.inf) > 1e-9:
        return offset / norm
    return np.where(norm > 1e-9, offset / np.maximum(norm, 1e-9), [1.0, 0.0, 0.0])


def offsets(problem: Problem, normals: Array) -> Array:
    """d + n.(o - reference): right-hand sides (N, m) of the half-planes for the task error in the plane, m."""
    at = problem.reference[:, None, :].copy()
    at[:, :, 2] = problem.initial[2]
    return problem.distances + np.einsum("kmi,kmi->km", normals, problem.centres - at)


def reachable(problem: Problem) -> npt.NDArray[np.bool_]:
    """(N, m): False where no relaxed plan can come within the safe distance, so that the row cannot bind.

    Any plan stays, per axis, between the running sums of the smaller and of the larger mode velocity.
    """
    within: npt.NDArray[np.bool_] = _reachable(
        problem.dt, problem.initial, problem.accept, problem.refuse, problem.centres, problem.distances
    )
    return within


@njit(cache=True)
def _reachable(
    dt: float, initial: Array, accept: Array, refuse: Array, centres: Array, distances: Array
) -> npt.NDArray[np.bool_]:
    within = np.zeros((len(accept), len(distances)), dtype=np.bool_)
    low, high = initial.copy(), initial.copy()
    for k in range(len(accept)):
        for a in range(3):
            low[a] += dt * min(accept[k, a], refuse[k, a])
            high[a] += dt * max(accept[k, a], refuse[k, a])
        for m in range(len(distances)):
            squared = 0.0
            for a in range(3):
                squared += max(0.0, low[a] - centres[k, m, a], centres[k, m, a] - high[a]) ** 2
            within[k, m] = squared < distances[m] ** 2
    return within


@dataclass(frozen=True, eq=False)
class DualBound:
    """Lower bounds of the cost (25) still to come, with distances along half-planes: affine in the position.

    Whatever a relaxed plan does from the end of stage k - 1 on, where it is in p, its stages k, k + 1, ... cost
    at least constants[k] + slopes[k].(p - at[k - 1]); for k = 0, p is the initial state and the slope is idle.

    Attributes:
        constants: (N + 1,); the first is a lower bound of (25) for the whole problem.
        slopes: (N + 1, 3), 1/m.
        at: positions at the ends of the stages that the bounds are linearised along, (N, 3), m.
        pressed: whether some half-plane has a multiplier; if none has, the bounds hold for (26) itself.
    """

    constants: Array
    slopes: Array
    at: Array
    pressed: bool

    @property
    def bound(self) -> float:
        """Lower bound of (25) over all relaxed plans."""
        return float(self.constants[0])


def outlook(problem: Problem, normals: Array, omega: Array, multipliers: Array) -> DualBound:
    """Lower bounds by weak duality, valid for any arguments.

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
    constants, slopes = _outlook(
        at, omega, multipliers, normals, problem.dt, problem.accept, problem.refuse, problem.reference,
        problem.centres, problem.distances, problem.error_weight, problem.slack_weight,
    )  # fmt: skip
    return DualBound(constants, slopes, at, bool((multipliers > 0.0).any()))


@njit(cache=True)
def _outlook(
    positions: Array,
    omega: Array,
    multipliers: Array,
    normals: Array,
    dt: float,
    accept: Array,
    refuse: Array,
    reference: Array,
    centres: Array,
    distances: Array,
    error_weight: float,
    slack_weight: float,
) -> tuple[Array, Array]:
    stages = len(omega)
    constants, slopes = np.zeros(stages + 1), np.zeros((stages + 1, 3))
    for k in range(stages - 1, -1, -1):
        total, pressure = constants[k + 1], 0.0
        slopes[k] = slopes[k + 1]
        for m in range(len(distances)):
            if multipliers[k, m] <= 0.0 or slack_weight <= 0.0:
                continue
            reach = 0.0
            for a in range(3):
                reach += normals[k, m, a] * (positions[k, a] - centres[k, m, a])
                slopes[k, a] -= multipliers[k, m] * normals[k, m, a]
            total += multipliers[k, m] * (distances[m] - reach)
            pressure += multipliers[k, m]
        if pressure > 0.0:
            total -= pressure * pressure / (4.0 * dt * slack_weight)
        slope = 0.0
        for a in range(3):
            error = positions[k, a] - reference[k, a]
            total += dt * error_weight * error * error
            slopes[k, a] += 2.0 * dt * error_weight * error
            slope += dt * (accept[k, a] - refuse[k, a]) * slopes[k, a]
        constants[k] = total + min(-omega[k] * slope, (1.0 - omega[k]) * slope)
    return constants, slopes


def multipliers_at(problem: Problem, normals: Array, positions: Array) -> Array:
    """Multipliers of the half-planes, (N, m), 1/m, at an optimum with these positions and no ties.

    The derivative of b u^2 dt on the half-plane that is violated most at each stage. Where two are violated
    equally, an optimum may share it between them: ask the solver there.
    """
    multipliers: Array = _multipliers_at(
        positions, normals, problem.centres, problem.distances, 2.0 * problem.dt * problem.slack_weight
    )
    return multipliers


@njit(cache=True)
def _multipliers_at(positions: Array, normals: Array, centres: Array, distances: Array, weight: float) -> Array:
    result = np.zeros(normals.shape[:2])
    for k in range(len(positions)):
        most, which = 0.0, -1
        for m in range(len(distances)):
            slack = distances[m]
            for a in range(3):
                slack -= normals[k, m, a] * (positions[k, a] - centres[k, m, a])
            if slack > most:
                most, which = slack, m
        if which >= 0:
            result[k, which] = weight * most
    return result
