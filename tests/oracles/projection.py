"""The closest velocity under inequalities, by another algorithm than the controller's, for many samples at once.

Seidel's algorithm takes the constraints one by one. If the best velocity so far meets the next constraint, nothing
changes. Otherwise the best velocity lies on the boundary of that constraint: the same problem with one dimension less.
In one dimension the answer is the closest point of an interval.
"""

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array

Flags = npt.NDArray[np.bool_]

PARALLEL = 1e-10
"""A normal that is this short after projection into a plane belongs to a parallel plane, and says nothing there."""
ROUNDING_M_S = 5e-13
"""Velocities that miss an inequality by less meet it, m/s."""
CONTRADICTION_M_S = 1e-9
"""Inequalities contradict each other if every velocity misses one by more than this, m/s; as in the controller."""
ABOVE_LEAST, ABOVE_LEAST_M_S = 1e-9, 1e-11
"""A violation may exceed the least one by the first, relatively, and by the second, m/s: no speed is spent on
rounding."""
PARTS = 32
"""Into how many parts the range of the least violation is cut at a time."""


def closest(
    wanted: Array, normal: Array, bound: Array, contradiction: float = CONTRADICTION_M_S
) -> tuple[Array, Flags]:
    """argmin ||v - wanted||^2 with normal_k.v >= bound_k for all k, for B samples, in 1 to 3 dimensions d."""
    length = np.linalg.norm(normal, axis=2)
    flat = length <= PARALLEL
    possible = ~(flat & (bound > contradiction)).any(axis=1)
    unit = normal / np.where(flat, 1.0, length)[..., None]
    level = np.where(flat, -np.inf, bound / np.where(flat, 1.0, length))
    if wanted.shape[1] == 1:
        found, met = _in_interval(wanted[:, 0], unit[:, :, 0], level, contradiction)
        return found[:, None], possible & met
    found = wanted.copy()
    missed = _missed(unit, level, found) & possible[:, None]
    while missed.any():
        k = int(missed.any(axis=0).argmax())
        rows = np.flatnonzero(missed[:, k])
        found[rows], met = _on_boundary(wanted[rows], unit[rows, : k + 1], level[rows, : k + 1], contradiction)
        possible[rows] &= met
        missed[rows] = _missed(unit[rows], level[rows], found[rows]) & possible[rows, None]
        missed[:, : k + 1] = False
    return found, possible


def _missed(unit: Array, level: Array, velocity: Array) -> Flags:
    return np.asarray((unit @ velocity[..., None])[..., 0] < level - ROUNDING_M_S)


def _on_boundary(wanted: Array, unit: Array, level: Array, contradiction: float) -> tuple[Array, Flags]:
    """The closest velocities on the boundary of the last inequality, under those before it."""
    facing = unit[:, -1]
    along = _complement(facing)  # (B, d - 1, d)
    foot = facing * level[:, -1:]
    normal = np.einsum("bkd,bed->bke", unit[:, :-1], along)
    bound = level[:, :-1] - np.einsum("bkd,bd->bk", unit[:, :-1], foot)
    inner, met = closest(np.einsum("bed,bd->be", along, wanted), normal, bound, contradiction)
    return foot + np.einsum("bed,be->bd", along, inner), met


def _complement(facing: Array) -> Array:
    if facing.shape[1] == 2:
        return np.stack([-facing[:, 1], facing[:, 0]], axis=1)[:, None]
    axis = np.eye(3)[np.argmin(np.abs(facing), axis=1)]
    first = np.cross(facing, axis)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(facing, first)], axis=1)


def _in_interval(wanted: Array, sign: Array, level: Array, contradiction: float) -> tuple[Array, Flags]:
    """In one dimension: the closest number (B,) with sign_k x >= level_k, signs being 1 or -1 (0: nothing is asked)."""
    low = np.where(sign > 0.0, level, -np.inf).max(axis=1, initial=-np.inf)
    high = np.where(sign < 0.0, -level, np.inf).min(axis=1, initial=np.inf)
    over = low > high
    middle = np.where(over, 0.5 * (np.where(over, low, 0.0) + np.where(over, high, 0.0)), 0.0)
    return np.where(over, middle, np.clip(wanted, low, np.maximum(low, high))), ~(low > high + contradiction)


def shortened(velocity: Array, normal: Array, bound: Array) -> Array:
    """Velocities (B, d), shortened until they meet each inequality that standing still meets up to rounding."""
    rate, least = np.einsum("bkd,bd->bk", normal, velocity), np.minimum(bound, 0.0)
    broken = (rate < least) & (bound <= CONTRADICTION_M_S)
    factor = np.where(broken, least / np.where(broken, rate, 1.0), 1.0).min(axis=1, initial=1.0)
    return np.asarray(velocity * factor[:, None])


def least_violation(normal: Array, bound: Array) -> Array:
    """The slowest of the velocities that miss inequalities by as little as possible, (B, d), m/s; by section.

    Violations that exceed the least one by `ABOVE_LEAST` and `ABOVE_LEAST_M_S` count as equal to it.
    """
    rows, still = np.arange(len(bound)), np.zeros((normal.shape[0], normal.shape[2]))
    low = np.zeros(len(bound))
    high = np.maximum(0.0, bound.max(axis=1, initial=0.0)) + ROUNDING_M_S  # standing still misses none by more
    many = [np.repeat(each, PARTS - 1, axis=0) for each in (still, normal, bound)]
    for _ in range(10):  # to 2^-50 of it
        ends = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, PARTS + 1)
        met = closest(*many[:2], many[2] - ends[:, 1:-1].reshape(-1, 1), contradiction=0.0)[1].reshape(len(rows), -1)
        first = np.where(met.any(axis=1), met.argmax(axis=1), PARTS - 1)
        low, high = ends[rows, first], ends[rows, first + 1]
    enough = (1.0 + ABOVE_LEAST) * high[:, None] + ABOVE_LEAST_M_S
    return closest(still, normal, bound - enough, contradiction=0.0)[0]
