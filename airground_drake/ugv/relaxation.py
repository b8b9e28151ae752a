"""The relaxation (27) without a solver: half-planes, reachable boxes, lower bounds, rounding.

Supporting half-planes n.(p - o) >= d - u stand for (26d): for unit n, ||p - o|| >= n.(p - o), so that they imply (26d)
and are never optimistic. At the end of a stage any plan, relaxed or not, is in a box: between the running sums of the
smaller and of the larger mode velocity.
"""

import numpy as np

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.compiling import njit
from airground_drake.ugv.cost import Terms
from airground_drake.ugv.problem import Problem


def nearest_in_reach(problem: Problem) -> Array:
    """Nearest point of each stage's box to each point, (N, m, 3), m."""
    low, high = problem.boxes
    return np.clip(problem.centres, low[:, None], high[:, None])


def within_reach(problem: Problem) -> Flags:
    """Whether a relaxed plan can come within the safe distance, (N, m); otherwise (26d) costs nothing."""
    squared = np.square(nearest_in_reach(problem) - problem.centres).sum(axis=2)
    within: Flags = squared < np.square(problem.distances)
    return within


def unavoidable_cost(problem: Problem) -> float:
    """Lower bound of (25) over all plans, relaxed or not: the task error of the nearest points of the boxes."""
    low, high = problem.boxes
    beyond = np.maximum(0.0, np.maximum(low - problem.reference, problem.reference - high))
    errors = problem.dt * problem.terms.error_weights * np.square(beyond).sum(axis=1)
    return (1.0 - 1e-9) * float(np.cumsum(errors[::-1])[-1])  # the last digits of the sums must not cut an optimum


def normals_along(problem: Problem, positions: Array) -> Array:
    """Unit vectors (N, m, 3) from the points to a guiding trajectory (N, 3)."""
    # Where no plan can come near, (26d) demands nothing. There the vectors point to the nearest place that any plan
    # could reach, so that no plan violates the half-plane.
    guide = np.where(within_reach(problem)[:, :, None], positions[:, None, :], nearest_in_reach(problem))
    offset = guide - problem.centres
    norm = np.sqrt(np.einsum("kmi,kmi->km", offset, offset))[:, :, None]
    if norm.min(initial=np.inf) > 1e-9:
        return offset / norm
    return np.where(norm > 1e-9, offset / np.maximum(norm, 1e-9), [1.0, 0.0, 0.0])


def offsets(problem: Problem, normals: Array) -> Array:
    """d + n.(o - reference): right-hand sides (N, m) of the half-planes for the task error in the plane, m."""
    at = problem.reference[:, None, :].copy()
    at[:, :, 2] = problem.initial[2]
    return problem.distances + np.einsum("kmi,kmi->km", normals, problem.centres - at)


def dual_bound(problem: Problem, normals: Array, omega: Array, multipliers: Array | None = None) -> float:
    """Lower bound of (25), with distances along half-planes, by weak duality; valid for any arguments."""
    # For multipliers l >= 0 of the half-planes, (25) is at least the Lagrangian. Its minimum over u >= 0 has a closed
    # form. Its task error is convex in omega, hence at least its linearisation at any omega, and the minimum of that
    # over [0, 1]^N has a closed form, too. At an optimum of the relaxation, with its multipliers, the bound is the
    # optimum. A solver's tolerances cost tightness only, never validity.
    # normals: (N, m, 3); omega: (N,)
    # multipliers: of the half-planes, (N, m), 1/m; negative ones count as 0. None: those of an optimum at omega.
    at = problem.positions(omega)
    if multipliers is None:
        multipliers = _multipliers(problem.terms, normals, at)
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


@njit(cache=True)
def _multipliers(terms: Terms, normals: Array, positions: Array) -> Array:
    """Multipliers of the half-planes, (N, m), 1/m, at an optimum with these positions and no ties."""
    # The derivative of b u^2 dt on the half-plane that is violated most at each stage. Where two are violated equally,
    # an optimum may share it between them: ask the solver there.
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


def sum_up_rounding(relaxed: Array) -> Array:
    """Round relaxed accept variables (N,) in [0, 1] to {0, 1} so that their running sums stay close.

    At each stage the mode with the larger accumulated deficit (28) is chosen; ties go to accepting, the mode
    with the lower index, as (29) has it. The running sums then differ by at most 1/2.
    """
    binary = np.zeros(len(relaxed))
    deficit = 0.0  # sum of relaxed up to this stage minus sum of binary before it
    for k, share in enumerate(relaxed.tolist()):
        deficit += share
        # the other mode's deficit is (k + 1 - sum relaxed) - (k - sum binary) = 1 - deficit
        if deficit >= 1.0 - deficit:
            binary[k] = 1.0
            deficit -= 1.0
    return binary


def rounding_deviation(relaxed: Array, binary: Array, dt: float) -> float:
    """max over k of |dt * sum_{r <= k} (relaxed - binary)|, s."""
    return float(dt * np.abs(np.cumsum(relaxed - binary)).max(initial=0.0))
