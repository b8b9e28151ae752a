"""How far the decision variable goes between two instants, exactly.

Between two updates a task error e moves on a straight line and the noise n is linear, so that x = ||e|| + n is convex:
it is largest at an end, and smallest at an end or where its slope is 0. Let u be the distance along the change of e
from the point nearest to the origin, p the distance of that point, and k the change of n over the length of that of e.
Then

    x = sqrt(u^2 + p^2) + k u + const,   smallest at u = -k p / sqrt(1 - k^2)   if |k| < 1,

because sqrt(u^2 + p^2) >= p sqrt(1 - k^2) - k u (Cauchy). For |k| >= 1 it is monotone. A reference with corners is
straight between them.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit

SUPERVISING, INTERVENING = 0, 1  # modes of `model.trigger.automaton.Mode`, as numba takes them; the third is REFRACTORY


@njit(cache=True)
def extremes(before: Array, after: Array, ends: Array) -> Array:
    """Least and largest x over a step, (2, n), m; `before` (n, 4), m."""
    # after: the same at its end, (n, 4); both are linear in between.
    extreme = np.empty((2, len(before)))
    for j in range(len(before)):
        x, y, z, n = before[j]
        dx, dy, dz, dn = after[j, 0] - x, after[j, 1] - y, after[j, 2] - z, after[j, 3] - n
        extreme[0, j], extreme[1, j] = min(ends[0, j], ends[1, j]), max(ends[0, j], ends[1, j])
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
            extreme[0, j] = min(extreme[0, j], aside * level - slope * along + n)
    return extreme


@njit(cache=True)
def norm(x: float, y: float, z: float) -> float:
    """Length of a vector, rounded as by `math.hypot`: squares in twice the precision, one correction of the root."""
    largest = max(abs(x), abs(y), abs(z))
    if not 0.0 < largest < np.inf:
        return largest
    square, low = 0.0, 0.0
    for component in (x, y, z):
        high, rest = _squared(component)
        both = square + high
        part = both - square
        low += rest + ((square - (both - part)) + (high - part))
        square = both
    root = np.sqrt(square + low)
    high, rest = _squared(root)
    return float(root + (((square - high) - rest) + low) / (2.0 * root))


@njit(cache=True)
def _squared(number: float) -> tuple[float, float]:
    """A square as the sum of two numbers, exactly (Veltkamp and Dekker)."""
    square, split = number * number, 134217729.0 * number
    high = split - (split - number)
    low = number - high
    return square, ((high * high - square) + 2.0 * high * low) + low * low


@njit(cache=True)
def variables(parts: Array) -> Array:
    """x of (15), (n,), m, of task errors and noise, (n, 4), m."""
    x = np.empty(len(parts))
    for j in range(len(parts)):
        x[j] = norm(parts[j, 0], parts[j, 1], parts[j, 2]) + parts[j, 3]
    return x


@njit(cache=True)
def gathered(t: float, position: Array, reference: Array, noise: Array) -> Array:
    """Time, s, then task error, m, noise, m, and x of (15), m, of each of n UGVs: (1 + 5n,)."""
    # `position` and `reference` begin with those of the UGVs, (3n + ...,), m; `noise` is (n,), m.
    signals = np.empty(1 + 5 * len(noise))
    signals[0] = t
    for j in range(len(noise)):
        for a in range(3):
            signals[1 + 5 * j + a] = reference[3 * j + a] - position[3 * j + a]
        signals[4 + 5 * j] = noise[j]
        signals[5 + 5 * j] = norm(signals[1 + 5 * j], signals[2 + 5 * j], signals[3 + 5 * j]) + noise[j]
    return signals


@njit(cache=True)
def spans(begun: Array, now: Array) -> Array:
    """Least and largest x of (15) over a step, (2, n), m, of its signals as `gathered` gives them at both ends."""
    before, after = begun[1:].reshape(-1, 5), now[1:].reshape(-1, 5)
    ends = np.empty((2, len(before)))
    for j in range(len(before)):
        ends[0, j], ends[1, j] = before[j, 4], after[j, 4]
    return extremes(before[:, :4], after[:, :4], ends)


@njit(cache=True)
def transitions_due(status: Array, t: float, least: Array, most: Array, levels: Array) -> npt.NDArray[np.bool_]:
    """For which UGVs a transition of the trigger is due, (n,); `status` (4n,), s; `t` in s; `least`, `most` (n,), m."""
    # levels: zeta, m, release, m, and dwell, s, of the trigger, (3,).
    zeta, release, dwell = levels[0], levels[1], levels[2]
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
def anything_due(status: Array, t: float, spans: Array, levels: Array) -> bool:
    """Whether a transition is due for any UGV, see `transitions_due`; `spans`: least x, then largest x, (2n,), m."""
    n = len(spans) // 2
    return bool(transitions_due(status, t, spans[:n], spans[n:], levels).any())
