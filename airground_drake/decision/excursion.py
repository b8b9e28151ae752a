"""How far the decision variable goes between two instants, exactly.

Between two updates a task error e moves on a straight line and the noise n is linear, so that x = ||e|| + n is convex:
it is largest at an end, and smallest at an end or where its slope is 0. With d = e1 - e0 the change of e, u the
distance along d from the point nearest to the origin, p the distance of that point, and k the change of n over ||d||,

    x = sqrt(u^2 + p^2) + k u + const,   smallest at u = -k p / sqrt(1 - k^2)   if |k| < 1,

because sqrt(u^2 + p^2) >= p sqrt(1 - k^2) - k u (Cauchy). For |k| >= 1 it is monotone. A reference with corners is
straight between them.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from airground_drake.arrays import Array

SUPERVISING, INTERVENING = 0, 1
"""Modes of `decision.trigger.Mode`, as numba takes them; the third is REFRACTORY."""


@njit(cache=True)
def extremes(before: Array, after: Array) -> tuple[Array, Array]:
    """Least and largest x over a step, (n,) and (n,), m.

    Args:
        before: task error, m, and noise, m, of n UGVs at the beginning of the step, (n, 4).
        after: the same at its end, (n, 4); both are linear in between.
    """
    least, most = np.empty(len(before)), np.empty(len(before))
    for j in range(len(before)):
        x, y, z, n = before[j]
        dx, dy, dz, dn = after[j, 0] - x, after[j, 1] - y, after[j, 2] - z, after[j, 3] - n
        start = np.sqrt(x * x + y * y + z * z) + n
        end = np.sqrt(after[j, 0] ** 2 + after[j, 1] ** 2 + after[j, 2] ** 2) + after[j, 3]
        least[j], most[j] = min(start, end), max(start, end)
        length = np.sqrt(dx * dx + dy * dy + dz * dz)
        if abs(dn) >= length:  # monotone, or at rest
            continue
        along = (x * dx + y * dy + z * dz) / length
        cx, cy, cz = (y * dz - z * dy) / length, (z * dx - x * dz) / length, (x * dy - y * dx) / length
        slope = dn / length
        level = np.sqrt(1.0 - slope * slope)
        aside = np.sqrt(cx * cx + cy * cy + cz * cz)
        travelled = -slope * aside / level - along
        if 0.0 < travelled < length:
            least[j] = min(least[j], aside * level - slope * along + n)
    return least, most


@njit(cache=True)
def gathered(t: float, position: Array, reference: Array, noise: Array) -> Array:
    """Signals of n UGVs as `task_errors` takes them, from positions and references of which theirs are the first, m."""
    n = len(noise)
    signals = np.empty(1 + 7 * n)
    signals[0] = t
    signals[1 : 1 + 3 * n] = position[: 3 * n]
    signals[1 + 3 * n : 1 + 6 * n] = reference[: 3 * n]
    signals[1 + 6 * n :] = noise
    return signals


@njit(cache=True)
def task_errors(signals: Array) -> Array:
    """Task error, m, and noise, m, of every UGV, (n, 4).

    Args:
        signals: time, s, positions and references (3n each), m, and noise (n), m: (1 + 7n,).
    """
    n = len(signals) // 7
    parts = np.empty((n, 4))
    for j in range(n):
        for a in range(3):
            parts[j, a] = signals[1 + 3 * (n + j) + a] - signals[1 + 3 * j + a]
        parts[j, 3] = signals[1 + 6 * n + j]
    return parts


@njit(cache=True)
def excursions(begun: Array, now: Array) -> tuple[Array, Array]:
    """Least and largest x between two instants whose signals are these, see `task_errors`; (n,) and (n,), m."""
    return extremes(task_errors(begun), task_errors(now))


@njit(cache=True)
def transitions_due(
    status: Array, t: float, least: Array, most: Array, levels: tuple[float, float, float]
) -> npt.NDArray[np.bool_]:
    """For which UGVs a transition of the trigger is due, (n,).

    Args:
        status: mode, number of triggers, times of the last trigger and of the last release, s, per UGV: (4n,).
        t: time, s.
        least: smallest x in this step, (n,), m.
        most: largest, (n,), m.
        levels: zeta, m, release, m, and dwell, s, of the trigger.
    """
    zeta, release, dwell = levels
    due = np.zeros(len(least), dtype=np.bool_)
    for j in range(len(least)):
        mode, triggers, triggered_at = status[4 * j], status[4 * j + 1], status[4 * j + 2]
        if mode == SUPERVISING:
            due[j] = most[j] >= zeta
        elif mode == INTERVENING:
            due[j] = least[j] <= release and least[j] < zeta
        else:
            due[j] = t >= (triggered_at + dwell if triggers else 0.0)
    return due


@njit(cache=True)
def anything_due(status: Array, begun: Array, now: Array, levels: tuple[float, float, float]) -> bool:
    """Whether a transition is due for any UGV in a step without corners, see `transitions_due`."""
    least, most = excursions(begun, now)
    return bool(transitions_due(status, now[0], least, most, levels).any())
