"""Compiled inner loops of set-based avoidance (7)-(8) (numba); see `avoidance.py` for the maths.

Scalar code without temporaries, because the gatekeeper computes the command of hundreds of thousands of periods, and
numba compiles an expression of whole arrays several times as long as a loop. No fast-math: results are those of IEEE
arithmetic in the order written.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array, Flags, Indices
from airground_drake.base.compiling import njit
from airground_drake.model.bodies.world import Neighbours
from airground_drake.model.geometry.convex import may_be_within, nearest
from airground_drake.model.geometry.outline import SPEED

# Added to every bound in the projection, m/s. The bound of a robot in contact is 0. Without the margin rounding would
# miss it every other time, and `_scale_back` would stop a robot that should slide along.
MARGIN_M_S = 1e-12
# Constraints contradict each other if one is missed by more than this where the others are met, m/s.
CONTRADICTION_M_S = 1e-9
# Violations that exceed the least one by no more than this share count as least: no speed is spent on rounding.
ABOVE_LEAST = 1e-9
# So do violations that exceed it by this, m/s. Between two points in opposite directions but for rounding, a fast
# velocity along both boundaries would otherwise win by its rounding error.
ABOVE_LEAST_M_S = 1e-11
# Normals within 1e-10 rad of linear dependence count as dependent: the square of the sine of that angle.
DEPENDENT = 1e-20
ROUNDING = 1e-15  # relative rounding error up to which a constraint counts as met

AUGMENTED, RECURSION_NEAREST, RECURSION_LISTED = 0, 1, 2
# Augmented, but the robot stands where no velocity meets all constraints: where they come from measured positions, the
# least violation may lead the wrong way, and standing keeps what there is.
STANDING = 3


class Layer(NamedTuple):
    """The numbers of `Avoidance`."""

    gain: float
    period: float
    sensing_range: float
    composition: int


@njit(cache=True)
def fill_half_spaces(
    position: Array,  # of the robot, (3,), m
    mobility: Array,  # of the robot, (3,), see `Neighbours`
    still: Array,  # outlines at rest, (m, W)
    parts: Array,  # outlines that move, (P, W)
    carrier: Indices,  # rows in `places` of the bodies of the parts, (P,)
    others: Indices,  # the n of these parts that the robot keeps away from, (n,)
    places: Array,  # of the bodies that move, (M, 3), m
    distance: Array,  # safe distances from the cores, (m + n,), m
    share: Array,  # shares of the inequalities, (m + n,); with one below 0 (see `Neighbours`) there may be two
    layer: Layer,
    # Results, (2 (m + n), ...), of which the first K entries count. `which` is about what, static outlines first;
    # normal . v >= bound, m/s; `retreat` is the speed away that the robot should have, m/s, 0 if it need not retreat.
    which: Indices,
    normal: Array,
    bound: Array,
    retreat: Array,
) -> int:
    """Write the velocity constraints of one robot, those within sensing range, and return their number K.

    Of each distance (7) these are the value D, (1), the Jacobian, (2), which is the unit vector n away from what is
    avoided, and from these a bound on n.v, (8) as an inequality.
    """
    gain, period, reach, planar = layer.gain, layer.period, layer.sensing_range, mobility[2] == 0.0
    x, y, z = position[0], position[1], position[2]
    count, m = 0, len(still)
    for k in range(len(distance)):
        if k < m:
            if not may_be_within(still, k, x, y, reach):
                continue
            speed = still[k, SPEED]
            apart = nearest(still[k], x, y, z, planar, normal[count], reach)
        else:
            part = others[k - m]
            origin, speed = carrier[part], parts[part, SPEED]
            px, py, pz = places[origin, 0], places[origin, 1], places[origin, 2]
            apart = nearest(parts[part], x - px, y - py, z - pz, planar, normal[count], reach)
        old = share[k] < 0.0 and speed == 0.0  # an old position counts at whatever distance
        if apart > reach and not old:
            continue
        for a in range(3):
            normal[count, a] *= mobility[a]
        which[count], retreat[count], excess = k, 0.0, apart - distance[k]
        if speed > 0.0:
            retreat[count] = max(speed - excess / period, 0.0)
            excess -= speed * period
        elif old:
            excess += share[k]
        if share[k] < 0.0 and excess < 0.0:
            which[count + 1] = k
            _lead_away(apart, -share[k], planar, normal, bound, retreat, count)
            count += 1
        elif speed > 0.0 or old:
            bound[count] = min(-excess / period, 0.0)
        else:
            bound[count] = -share[k] * gain * excess if excess <= 0.0 else -share[k] * excess / period
        count += 1
    return count


@njit(cache=True, inline="always")
def _lead_away(
    apart: float, unsure: float, planar: bool, normal: Array, bound: Array, retreat: Array, count: int
) -> None:
    """Turn constraint `count`, whose normal leads away from a place, into two that lead away from all places near it.

    D n.v >= unsure ||v||, with the distance D = `apart` from the place, m: in the plane a cone between two half-planes.
    Where it has no inside, and in space, the two contradict each other, so that the robot stands.
    """
    cosine = min(unsure / max(apart, 1e-300), 1.0) if planar else 1.0
    sine = np.sqrt(1.0 - cosine * cosine)
    x, y = normal[count, 0], normal[count, 1]
    for side in range(2):
        k, turned = count + side, cosine if side == 0 else -cosine
        normal[k, 0], normal[k, 1], normal[k, 2] = sine * x - turned * y, sine * y + turned * x, 0.0
        bound[k], retreat[k] = 0.0, retreat[count]
        if sine == 0.0:
            normal[k, 0], normal[k, 1], bound[k] = 1.0 - 2.0 * side, 0.0, 1.0


@njit(cache=True)
def avoid_one(lower: Array, normal: Array, bound: Array, composition: int, max_speed: float) -> Array:
    """Velocity of one robot, (3,) m/s: the avoidance tasks above `lower`, composed by (5) or as `Avoidance` says.

    A non-finite `lower` counts as 0. With the composition `STANDING`, a robot also stands if only velocities above
    `max_speed`, m/s, meet the constraints.
    """
    if not is_finite(lower):
        lower = np.zeros(3)
    for k in range(len(bound)):
        if _dot(normal[k], lower) < bound[k]:
            break
    else:
        return lower.copy()
    if composition == AUGMENTED:
        return _augmented(lower, normal, bound)
    if composition == STANDING:
        velocity = _augmented(lower, normal, bound)
        for k in range(len(bound)):
            if _dot(normal[k], velocity) < bound[k] - CONTRADICTION_M_S:
                return np.zeros(3)
        return velocity if _dot(velocity, velocity) <= (max_speed + CONTRADICTION_M_S) ** 2 else np.zeros(3)
    return _recursion(lower, normal, bound, composition == RECURSION_NEAREST)


@njit(cache=True)
def _augmented(lower: Array, normal: Array, bound: Array) -> Array:
    """The closest velocity to `lower` under all constraints, exact in floating point; see `Avoidance`."""
    velocity = _closest_feasible(lower, normal, bound)
    speed = _dot(velocity, velocity)
    velocity = _scale_back(velocity, normal, bound)
    if _dot(velocity, velocity) >= 1e-6 * speed or speed < CONTRADICTION_M_S:
        return velocity
    # between two touching bodies the margins leave no room: use the exact bounds, which let it slide along
    touched = bound.copy()
    for k in range(len(bound)):
        if bound[k] <= CONTRADICTION_M_S:
            touched[k] = np.minimum(bound[k], 0.0)
    exactly, missed = _closest(lower, normal, touched, CONTRADICTION_M_S)
    if missed > 0.0:
        return velocity
    exactly = _scale_back(exactly, normal, bound)
    return exactly if _dot(exactly, exactly) > _dot(velocity, velocity) else velocity


@njit(cache=True)
def yielding(task: Array, normal: Array, retreat: Array, max_speed: float) -> Array:
    """The velocity, (3,), m/s, closest to `task` with which a robot retreats as it should, within its speed limit."""
    for k in range(len(retreat)):
        if retreat[k] > 0.0:
            break
    else:
        return task
    bound = np.empty(len(retreat))
    for k in range(len(retreat)):
        bound[k] = retreat[k] if retreat[k] > 0.0 else -np.inf
    velocity = avoid_one(task, normal, bound, AUGMENTED, np.inf)
    limit_one(velocity, max_speed)
    return velocity


@njit(cache=True)
def _recursion(lower: Array, normal: Array, bound: Array, nearest_first: bool) -> Array:
    """(5) as printed, from the lowest priority to the highest: each projection takes only the next lower level."""
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
def commands(lower: Array, positions: Array, near: Neighbours, layer: Layer) -> Array:
    """Velocities of k robots, (k, 3), m/s; see `Avoidance.command`."""
    # Reading an array of a named tuple within the loop would count references.
    members, carrier, others, still, parts, distance, share, mobility, max_speed = near
    velocity = limit_speed(lower, max_speed)
    most = 2 * distance.shape[1]
    normal, bound, which, retreat = np.empty((most, 3)), np.empty(most), np.empty(most, np.intp), np.empty(most)
    for i in range(len(velocity)):
        count = fill_half_spaces(
            positions[members[i]], mobility[i], still, parts, carrier, others[i], positions, distance[i], share[i],
            layer, which, normal, bound, retreat,
        )  # fmt: skip
        task = yielding(velocity[i], normal[:count], retreat[:count], max_speed[i])
        safe = avoid_one(task, normal[:count], bound[:count], layer.composition, max_speed[i])
        for a in range(3):
            velocity[i, a] = safe[a]
    return velocity


@njit(cache=True)
def limit_speed(velocity: Array, max_speed: Array) -> Array:
    """Velocities (n, 3) scaled down to at most max_speed (n,), m/s, keeping their direction."""
    limited = velocity.copy()
    for i in range(len(velocity)):
        limit_one(limited[i], max_speed[i])
    return limited


@njit(cache=True)
def limit_one(velocity: Array, max_speed: float) -> None:
    """Scale a velocity (3,) down to a speed limit, m/s, in place."""
    speed = np.sqrt(_dot(velocity, velocity))
    if speed > max_speed:
        for a in range(3):
            velocity[a] *= max_speed / speed


@njit(cache=True)
def is_finite(velocity: Array) -> bool:
    """Whether all three numbers are."""
    return bool(np.isfinite(velocity[0]) and np.isfinite(velocity[1]) and np.isfinite(velocity[2]))


@njit(cache=True)
def _raised(bound: Array, by: float) -> Array:
    """All bounds, raised by an amount, m/s."""
    raised = np.empty(len(bound))
    for k in range(len(bound)):
        raised[k] = bound[k] + by
    return raised


@njit(cache=True)
def _dot(a: Array, b: Array) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def _closest_feasible(lower: Array, normal: Array, bound: Array) -> Array:
    """Closest velocity to `lower` under all constraints; where none meets them, see `_least_violation`."""
    within = _raised(bound, MARGIN_M_S)
    velocity, missed = _closest(lower, normal, within, CONTRADICTION_M_S)
    return velocity if missed == 0.0 else _least_violation(normal, within)


@njit(cache=True)
def _least_violation(normal: Array, bound: Array) -> Array:
    """Slowest velocity with the least maximum violation, up to `ABOVE_LEAST` and `ABOVE_LEAST_M_S`."""
    # Constraints contradict each other only where a robot is inside several safe distances at once. Lower
    # priorities then have no influence: they might be hostile. The least violation is found from below: each
    # contradiction proves that every velocity misses some constraint by a certain amount, and the bounds are lowered
    # by that amount.
    still = np.zeros(normal.shape[1])
    least, more = 0.0, np.inf
    while more > 1e-14 * least:
        more = _closest(still, normal, _raised(bound, -least), 0.0)[1]
        least += more
    lowered = _raised(bound, -((1.0 + ABOVE_LEAST) * least + ABOVE_LEAST_M_S))
    return _closest(still, normal, lowered, CONTRADICTION_M_S)[0]


@njit(cache=True)
def _closest(lower: Array, normal: Array, bound: Array, contradiction: float) -> tuple[Array, float]:
    """Closest velocity to `lower` (d,) with normal (K, d) . v >= bound (K,), and the unavoidable violation, m/s."""
    # The dual active-set method of Goldfarb and Idnani (Mathematical Programming 27, 1983) in d dimensions. The
    # velocity is always the closest one under the active constraints; each of these pushes with a force >= 0. The
    # constraint that is missed most joins them; a constraint whose force falls to 0 on the way leaves.
    #
    # A constraint that the active ones contradict is left out if it is missed by no more than `contradiction`, m/s.
    # Otherwise the certain violation is above 0: every velocity misses some constraint by at least that much, and the
    # velocity returned means nothing.
    count, d = normal.shape
    velocity, settled = lower.copy(), np.zeros(count, dtype=np.bool_)  # active or left out
    active, force, pull = np.empty(d, dtype=np.int64), np.empty(d + 1), np.empty(d)
    across, share = np.empty((d + 1, d)), np.empty((d + 1, d))
    size = 0
    for _ in range(10 * (count + d)):  # more than ever needed: a bound in case that rounding makes it go in circles
        p = _most_missed(velocity, normal, bound, settled)
        if p < 0:
            break
        settled[p] = True
        force[size] = 0.0
        while True:
            _split(normal[p], across, share, size)
            step, leaving = _first_release(force, share, pull, size)
            missed, free, squared = _missed(velocity, normal, bound, p), _squared(across, size), _squared(normal, p)
            if leaving < 0 and (free <= DEPENDENT * squared or squared < 1e-18):
                if missed <= contradiction:
                    break
                return velocity, _certain_violation(bound, p, pull, active[:size])
            joins = missed < step * free
            if joins:
                step = missed / free
            for a in range(d):
                velocity[a] += step * across[size, a]
            for m in range(size):
                force[m] -= step * pull[m]
            force[size] += step
            if joins:
                active[size] = p
                size += 1
                _meet(velocity, normal, bound, active[:size], across)
                break
            settled[active[leaving]] = False
            size -= 1
            _remove(leaving, normal, active[: size + 1], force, across, share)
    return velocity, 0.0


@njit(cache=True)
def _missed(velocity: Array, normal: Array, bound: Array, k: int) -> float:
    """By how much a velocity misses a constraint, m/s."""
    missed = bound[k]
    for a in range(len(velocity)):
        missed -= normal[k, a] * velocity[a]
    return missed


@njit(cache=True)
def _squared(vectors: Array, k: int) -> float:
    squared = 0.0
    for a in range(vectors.shape[1]):
        squared += vectors[k, a] ** 2
    return squared


@njit(cache=True)
def _most_missed(velocity: Array, normal: Array, bound: Array, settled: Flags) -> int:
    """Index of the constraint that is missed most, by more than rounding, among those not settled; -1 without one."""
    missed_most, worst = -1, 0.0
    for k in range(len(bound)):
        missed = _missed(velocity, normal, bound, k)
        if missed > worst and not settled[k]:
            terms = abs(bound[k])
            for a in range(len(velocity)):
                terms += abs(normal[k, a] * velocity[a])
            if missed > ROUNDING * terms:
                missed_most, worst = k, missed
    return missed_most


@njit(cache=True)
def _first_release(force: Array, share: Array, pull: Array, size: int) -> tuple[float, int]:
    """How far the velocity can move before the force of an active constraint falls to 0, and which one that is."""
    # Writes into `pull` the weights of the active normals in the new one, which is across[size] + sum of pull * normal.
    # Without such a constraint: inf and -1.
    step, leaving = np.inf, -1
    for m in range(size):
        pull[m] = share[size, m]
    for m in range(size - 1, -1, -1):
        for n in range(m):
            pull[n] -= pull[m] * share[m, n]
        if pull[m] > 0.0 and force[m] < step * pull[m]:
            step, leaving = max(force[m], 0.0) / pull[m], m
    return step, leaving


@njit(cache=True)
def _certain_violation(bound: Array, p: int, pull: Array, active: npt.NDArray[np.int64]) -> float:
    """Unavoidable violation of p or an active constraint, m/s: a weighted mean that is the same for all velocities."""
    weight, total = 1.0, bound[p]
    for m in range(len(active)):
        weight -= pull[m]
        total -= pull[m] * bound[active[m]]
    return total / weight


@njit(cache=True)
def _remove(
    leaving: int, normal: Array, active: npt.NDArray[np.int64], force: Array, across: Array, share: Array
) -> None:
    """Remove an active constraint and its force, and orthogonalise the normals after it again."""
    for m in range(leaving, len(active)):
        force[m] = force[m + 1]
    for m in range(leaving, len(active) - 1):
        active[m] = active[m + 1]
        _split(normal[active[m]], across, share, m)


@njit(cache=True)
def _split(vector: Array, across: Array, share: Array, k: int) -> None:
    """Orthogonalise a vector against across[:k] into across[k]; its coefficients go into share[k, :k]."""
    # Gram-Schmidt, twice: of nearly parallel vectors, one pass leaves a part along the others as large as the rest.
    for a in range(len(vector)):
        across[k, a] = vector[a]
    for m in range(k):
        share[k, m] = 0.0
    for _ in range(2):
        for m in range(k):
            along, squared = 0.0, 0.0
            for a in range(len(vector)):
                along += across[m, a] * across[k, a]
                squared += across[m, a] ** 2
            share[k, m] += along / squared
            for a in range(len(vector)):
                across[k, a] -= along / squared * across[m, a]


@njit(cache=True)
def _meet(velocity: Array, normal: Array, bound: Array, active: npt.NDArray[np.int64], across: Array) -> None:
    """Project a velocity, in place, onto the active constraints with equality."""
    # Twice: with nearly parallel normals the first pass misses by the rounding error over the sine of their angle,
    # which is too much. The second pass starts beside the goal and misses by the rounding error only.
    for _ in range(2):
        for m in range(len(active)):
            missed, along = bound[active[m]], 0.0
            for a in range(len(velocity)):
                missed -= normal[active[m], a] * velocity[a]
                along += normal[active[m], a] * across[m, a]
            for a in range(len(velocity)):
                velocity[a] += missed / along * across[m, a]


@njit(cache=True)
def _scale_back(velocity: Array, normal: Array, bound: Array) -> Array:
    """Shorten a velocity, in place, until every constraint that v = 0 satisfies holds in floating point."""
    # A robot that is inside the safe distance by rounding only counts as being at it.
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
