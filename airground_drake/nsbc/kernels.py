"""Compiled inner loops of set-based avoidance (numba); `avoidance.py` explains and wraps them.

Scalar code without temporaries, because the gatekeeper rolls the closed loop out hundreds of thousands of
times. No fast-math: results are those of IEEE arithmetic in the order written.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from airground_drake.arrays import Array

MARGIN_M_S = 1e-12
"""Added to every bound in the projection, so that rounding leaves the bound itself satisfied, m/s."""
CONTRADICTION_M_S = 1e-9
"""Constraints that every trial misses by more contradict each other; by less, it is rounding, m/s."""
ABOVE_LEAST = 1e-9
"""A violation larger than the least by this, relatively, is as good: no speed is spent on what is rounding."""
ABOVE_LEAST_M_S = 1e-11
"""So is one that is larger by this, m/s: between two points in opposite directions but for rounding, a velocity along
both boundaries, as fast as the nearest far obstacle allows, would be better by what rounding makes of that speed."""
DEPENDENT = 1e-20
"""Square of the sine of the angle between normals of which one says what the others say: 1e-10 rad."""

AUGMENTED, RECURSION_NEAREST, RECURSION_LISTED = 0, 1, 2


@njit(cache=True)
def fill_half_spaces(
    position: Array,
    centre: Array,
    distance: Array,
    share: Array,
    gain: float,
    period: float,
    mobility: Array,
    sensing_range: float,
    normal: Array,
    bound: Array,
) -> None:
    """Write the velocity constraints of one robot: normal (K, 3), bound (K,); see `half_spaces`."""
    for k in range(len(bound)):
        squared = 0.0
        for a in range(3):
            normal[k, a] = position[a] - centre[k, a]
            squared += normal[k, a] ** 2
        reach = np.sqrt(squared)
        for a in range(3):
            normal[k, a] = mobility[a] * normal[k, a] / reach if reach > 0.0 else 0.0
        excess = reach - distance[k]
        if reach > sensing_range:
            bound[k] = -np.inf
        elif excess <= 0.0:
            bound[k] = -share[k] * gain * excess
        else:
            bound[k] = -share[k] * excess / period


@njit(cache=True)
def distances(points: Array, position: Array) -> Array:
    """Of points (m, 3) from a position (3,), m: (m,), m."""
    found = np.empty(len(points))
    for k in range(len(points)):
        x, y, z = points[k, 0] - position[0], points[k, 1] - position[1], points[k, 2] - position[2]
        found[k] = np.sqrt(x * x + y * y + z * z)
    return found


@njit(cache=True)
def within(points: Array, positions: Array, reach: float) -> npt.NDArray[np.bool_]:
    """Which of the points (m, 3) are no farther than that, m, from each of n positions (n, 3): (n, m)."""
    found = np.empty((len(positions), len(points)), dtype=np.bool_)
    for i in range(len(positions)):
        found[i] = distances(points, positions[i]) <= reach
    return found


@njit(cache=True)
def news_within(points: Array, positions: Array, reach: float, known: npt.NDArray[np.bool_]) -> bool:
    """Whether `within` would find a point that is not among the known ones, (n, m)."""
    for i in range(len(positions)):
        for k in range(len(points)):
            if not known[i, k]:
                x, y, z = points[k, 0] - positions[i, 0], points[k, 1] - positions[i, 1], points[k, 2] - positions[i, 2]
                if np.sqrt(x * x + y * y + z * z) <= reach:
                    return True
    return False


@njit(cache=True)
def avoid_one(lower: Array, normal: Array, bound: Array, composition: int) -> Array:
    """Velocity of one robot, (3,) m/s: the avoidance tasks above `lower`; see `avoid`.

    A `lower` that is not finite asks for nothing.
    """
    if not np.isfinite(lower).all():
        lower = np.zeros(3)
    for k in range(len(bound)):
        if _dot(normal[k], lower) < bound[k]:
            break
    else:
        return lower.copy()
    if composition == AUGMENTED:
        return _scale_back(_closest_feasible(lower, normal, bound), normal, bound)
    return _recursion(lower, normal, bound, composition == RECURSION_NEAREST)


@njit(cache=True)
def _recursion(lower: Array, normal: Array, bound: Array, nearest_first: bool) -> Array:
    """(5) as printed, from the lowest priority to the highest: each task sees only the level below it."""
    count = len(bound)
    done = np.zeros(count, dtype=np.bool_)
    velocity = lower.copy()
    for level in range(count):
        k = count - 1 - level
        if nearest_first:  # the lowest priority left is the one with the least demanding bound
            k = -1
            for j in range(count):
                if not done[j] and (k < 0 or bound[j] <= bound[k]):
                    k = j
        done[k] = True
        shortfall = bound[k] - _dot(normal[k], velocity)
        squared = _dot(normal[k], normal[k])
        if shortfall > 0.0 and squared > 0.0:
            for a in range(3):
                velocity[a] += normal[k, a] * (shortfall / squared)
    return velocity


@njit(cache=True)
def team_half_spaces(
    position: Array,
    centre: Array,
    distance: Array,
    share: Array,
    gain: float,
    period: float,
    mobility: Array,
    sensing_range: float,
) -> tuple[Array, Array]:
    """Constraints of n robots: normal (n, K, 3), bound (n, K)."""
    normal, bound = np.empty(centre.shape), np.empty(distance.shape)
    for i in range(len(position)):
        fill_half_spaces(
            position[i], centre[i], distance[i], share[i], gain, period, mobility[i], sensing_range, normal[i], bound[i]
        )
    return normal, bound


@njit(cache=True)
def team_avoid(lower: Array, normal: Array, bound: Array, composition: int) -> Array:
    """Velocities of n robots, (n, 3) m/s."""
    velocity = np.empty(lower.shape)
    for i in range(len(lower)):
        velocity[i] = avoid_one(lower[i], normal[i], bound[i], composition)
    return velocity


@njit(cache=True)
def gather(positions: Array, obstacles: Array, others: npt.NDArray[np.intp]) -> Array:
    """Points around k robots: (k, m + n, 3) from obstacles (m, 3) and positions of the others (k, n)."""
    m = len(obstacles)
    centre = np.empty((others.shape[0], m + others.shape[1], 3))
    for i in range(others.shape[0]):
        for a in range(3):
            for k in range(m):
                centre[i, k, a] = obstacles[k, a]
            for k in range(others.shape[1]):
                centre[i, m + k, a] = positions[others[i, k], a]
    return centre


@njit(cache=True)
def limit_speed(velocity: Array, max_speed: Array) -> Array:
    """Velocities (n, 3) scaled down to at most max_speed (n,), m/s, keeping their direction."""
    limited = velocity.copy()
    for i in range(len(velocity)):
        speed = np.sqrt(_dot(velocity[i], velocity[i]))
        if speed > max_speed[i]:
            for a in range(3):
                limited[i, a] *= max_speed[i] / speed
    return limited


@njit(cache=True)
def _dot(a: Array, b: Array) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def _closest_feasible(lower: Array, normal: Array, bound: Array) -> Array:
    """Closest velocity to `lower` under all constraints; where none meets them, see `_least_violation`."""
    velocity, shortfall = _closest(lower, normal, bound, False, False)
    return velocity if shortfall <= CONTRADICTION_M_S else _least_violation(normal, bound)


@njit(cache=True)
def _least_violation(normal: Array, bound: Array) -> Array:
    """Slowest velocity among those whose largest violation is least, but for `ABOVE_LEAST` of it and `ABOVE_LEAST_M_S`.

    Constraints contradict each other only where a robot is inside several safe distances at once. What the
    lower priorities ask for then has no say: they might be hostile.
    """
    low, high = 0.0, 0.0
    for k in range(len(bound)):
        high = max(high, bound[k] + MARGIN_M_S)  # standing still violates nothing by more
    still, in_conflict = np.zeros(3), np.arange(len(bound))  # which are enough to rule `low` out
    while high - low > 1e-13 * high:
        middle = 0.5 * (low + high)
        if middle <= low or middle >= high:
            break
        found, missed = _closest(still, normal[in_conflict], bound[in_conflict] - middle, True, True)
        if missed == 0.0 and len(in_conflict) < len(bound):
            found, missed = _closest(still, normal, bound - middle, True, True)
        if missed == 0.0:
            high = middle
        else:
            low = middle
            lacking = bound - middle - normal @ found
            in_conflict = np.flatnonzero(lacking >= -CONTRADICTION_M_S)
    return _closest(still, normal, bound - ((1.0 + ABOVE_LEAST) * high + ABOVE_LEAST_M_S), True, False)[0]


@njit(cache=True)
def _closest(lower: Array, normal: Array, bound: Array, every: bool, any_one: bool) -> tuple[Array, float]:
    """Closest velocity to `lower` under all constraints, and by how much it misses one, m/s (0: rounding at most).

    By enumeration of active sets of at most three, none among them: a projection in R^3 needs no larger one (a planar
    robot: two), so this is exact. Each trial is lower + J^+ (b - J lower), the augmented composition over that active
    set. Of those that meet all constraints the closest one is taken, else the one that misses least. Where standing
    still meets all constraints, no projection is longer than `lower`, and those that nothing of its size can reach are
    left out, unless `every` one is asked for. Then nothing is allowed for the rounding of fast velocities either, which
    would make them look better than slow ones. With `any_one`, the first that meets all is as good as the closest.
    """
    rounding = 0.0 if every else 1e-15
    worst = 0.0
    for k in range(len(bound)):
        worst = max(worst, bound[k])
    every = every or worst > CONTRADICTION_M_S
    reach = np.sqrt(_dot(lower, lower)) + 2.0 * worst + 1e-9
    row, level = np.empty((len(bound), 3)), np.empty(len(bound))
    count = 0
    planar = True
    for k in range(len(bound)):
        if bound[k] > -reach or (every and bound[k] > -np.inf):
            for a in range(3):
                row[count, a] = normal[k, a]
            level[count] = bound[k] + MARGIN_M_S
            planar = planar and normal[k, 2] == 0.0
            count += 1
    tolerance = 0.5 * MARGIN_M_S + 1e-14 * reach
    best, trial, best_cost = lower.copy(), np.empty(3), 0.0
    best_shortfall = _shortfall(row, level, count, best, tolerance, rounding, np.inf)
    active, across = np.empty(3, dtype=np.int64), np.empty((3, 3))
    independent = np.ones(4, dtype=np.bool_)  # the first 0, 1, 2, 3 of the active ones
    for i in range(count):
        for j in range(i, count):
            for m in range(j, j + 1 if planar or j == i else count):
                active[0], active[1], active[2] = i, j, m
                size = 1 if j == i else 2 if m == j else 3
                independent[size] = independent[size - 1] and _across(row, active[:size], across)
                if not independent[size]:
                    continue
                for a in range(3):
                    trial[a] = lower[a]
                _meet(row, level, active[:size], across, trial)
                shortfall = _shortfall(row, level, count, trial, tolerance, rounding, best_shortfall)
                cost = 0.0
                for a in range(3):
                    cost += (trial[a] - lower[a]) ** 2
                if shortfall < best_shortfall or (shortfall == best_shortfall and cost < best_cost):
                    best_shortfall, best_cost = shortfall, cost
                    for a in range(3):
                        best[a] = trial[a]
                    if any_one and shortfall == 0.0:
                        return best, shortfall
    return best, best_shortfall


@njit(cache=True)
def _shortfall(
    row: Array, level: Array, count: int, velocity: Array, tolerance: float, rounding: float, enough: float
) -> float:
    """By how much a velocity misses one of the constraints, m/s; 0 if by no more than tolerance and rounding.

    Of one that misses by more than `enough` it is not found how much more.
    """
    allowed = tolerance + rounding * np.sqrt(_dot(velocity, velocity))
    found = 0.0
    for k in range(count):
        found = max(found, level[k] - _dot(row[k], velocity))
        if found > allowed and found > enough:
            return found
    return found if found > allowed else 0.0


@njit(cache=True)
def _across(row: Array, active: npt.NDArray[np.int64], across: Array) -> bool:
    """Of the last active constraint the part of its normal that is orthogonal to those before it, by Gram-Schmidt.

    Written into `across`, where those of the ones before it stand; False where its normal depends on theirs but for
    rounding, so that a smaller set says the same.
    """
    k = len(active) - 1
    for a in range(3):
        across[k, a] = row[active[k], a]
    for _ in range(2):  # once leaves a part of the normals before, by rounding, as large as what is orthogonal
        for n in range(k):
            share = _dot(across[n], across[k]) / _dot(across[n], across[n])
            for a in range(3):
                across[k, a] -= share * across[n, a]
    squared = _dot(row[active[k]], row[active[k]])
    return squared >= 1e-18 and _dot(across[k], across[k]) > DEPENDENT * squared


@njit(cache=True)
def _meet(row: Array, level: Array, active: npt.NDArray[np.int64], across: Array, velocity: Array) -> None:
    """Take a velocity, in place, the shortest way to where the active constraints hold with equality.

    Twice: of nearly parallel ones the first pass leaves rounding, divided by the sine of their angle, which is more
    than what counts as met; the second one starts beside the goal, and what it leaves is rounding again.
    """
    for _ in range(2):
        for k in range(len(active)):
            normal = row[active[k]]
            share = (level[active[k]] - _dot(normal, velocity)) / _dot(across[k], normal)
            for a in range(3):
                velocity[a] += share * across[k, a]


@njit(cache=True)
def _scale_back(velocity: Array, normal: Array, bound: Array) -> Array:
    """Shorten a velocity, in place, until every constraint that v = 0 satisfies holds in floating point.

    A robot in contact is at the safe distance but for rounding, on either side of it: it counts as there.
    """
    while True:
        scale = 1.0
        for k in range(len(bound)):
            rate, least = _dot(normal[k], velocity), min(bound[k], 0.0)
            if rate < least and bound[k] <= CONTRADICTION_M_S:
                scale = min(scale, least / rate)
        if scale == 1.0:
            return velocity
        scale = np.nextafter(scale, 0.0) if scale > 1e-300 else 0.0
        for a in range(3):
            velocity[a] *= scale
