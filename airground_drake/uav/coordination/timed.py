"""Timed motions in the plane: their exact distances from each other and from discs over all times, and short cuts.

A timed motion is an array (M, 3) of times, s, and places, m. It is straight between its rows, and rests at the last
place. Functions are compiled by numba without fast-math: results are those of IEEE arithmetic in the order written.
"""

import numpy as np

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.compiling import njit
from airground_drake.model.geometry.convex import passes
from airground_drake.uav.coordination.intervals import Indices


def timed(times: Array, places: Array) -> Array:
    """A timed motion (M, 3) from times (M,), s, and places (M, 2), m."""
    return np.ascontiguousarray(np.column_stack([times, places]), dtype=np.float64)


def at_rest(place: Array) -> Array:
    """The timed motion of a robot that stays at a place (2,), m."""
    return timed(np.zeros(1), np.asarray(place, dtype=np.float64)[None])


def distance(one: Array, other: Array, begin: float = 0.0) -> float:
    """Least distance of two timed motions (M, 3) from a time, s, on, in m."""
    return float(closest(one, other, begin, np.inf))


def speed(motion: Array) -> float:
    """Largest speed of a timed motion (M, 3), m/s."""
    legs = np.diff(motion, axis=0)
    return float((np.hypot(legs[:, 1], legs[:, 2]) / legs[:, 0]).max(initial=0.0))


@njit(cache=True)
def without_repeats(motion: Array) -> Array:
    """The timed motion without rows that repeat the time before, or lie on the line between their neighbours."""
    rows, many = motion.copy(), 1
    for k in range(1, len(motion)):
        if motion[k, 0] - motion[k - 1, 0] > 1e-9:
            rows[many] = motion[k]
            many += 1
    needed = np.full(many, True)
    for k in range(1, many - 1):
        before, here, after = rows[k - 1], rows[k], rows[k + 1]
        off = here - before - (here[0] - before[0]) / (after[0] - before[0]) * (after - before)
        needed[k] = max(abs(off[1]), abs(off[2])) > 1e-12
    return rows[:many][needed]


@njit(cache=True)
def approach(x: float, y: float, vx: float, vy: float) -> float:
    """Least distance from the origin, m, of a point that goes straight from (x, y), m, by (vx, vy), m."""
    squared = vx * vx + vy * vy
    s = min(max(-(x * vx + y * vy) / squared, 0.0), 1.0) if squared > 0.0 else 0.0
    return float(np.hypot(x + s * vx, y + s * vy))


@njit(cache=True)
def place(motion: Array, t: float, hint: int) -> tuple[float, float, int]:
    """Place of a timed motion at time t, s, and the row before it; the search begins at row `hint`."""
    k = hint
    while k + 1 < len(motion) and motion[k + 1, 0] <= t:
        k += 1
    if k + 1 == len(motion) or t <= motion[k, 0]:
        return motion[k, 1], motion[k, 2], k
    share = (t - motion[k, 0]) / (motion[k + 1, 0] - motion[k, 0])
    x = motion[k, 1] + share * (motion[k + 1, 1] - motion[k, 1])
    return x, motion[k, 2] + share * (motion[k + 1, 2] - motion[k, 2]), k


@njit(cache=True)
def closest(one: Array, other: Array, begin: float, end: float) -> float:
    """Least distance of two timed motions over [begin, end], m; `end` may be infinite."""
    i, j = 0, 0
    ax, ay, i = place(one, begin, 0)
    bx, by, j = place(other, begin, 0)
    least = float(np.hypot(ax - bx, ay - by))
    t = begin
    while t < end:
        until = end
        if i + 1 < len(one):
            until = min(until, one[i + 1, 0])
        if j + 1 < len(other):
            until = min(until, other[j + 1, 0])
        if until == np.inf:
            break
        cx, cy, i = place(one, until, i)
        dx, dy, j = place(other, until, j)
        x, y = ax - bx, ay - by
        least = min(least, approach(x, y, (cx - dx) - x, (cy - dy) - y))
        ax, ay, bx, by, t = cx, cy, dx, dy, until
    return least


@njit(cache=True)
def free_pieces(preset: Array, other: Array, apart: float) -> Flags:
    """Which pieces between the rows of a timed motion (K, 3) stay `apart`, m, from another motion; (K - 1,)."""
    free = np.empty(len(preset) - 1, np.bool_)
    for k in range(len(free)):
        free[k] = closest(preset[k : k + 2], other, preset[k, 0], preset[k + 1, 0]) >= apart
    return free


@njit(cache=True)
def straight_is_free(
    motion: Array, i: int, j: int, rows: Array, keep: Array, others: Array, begins: Indices, apart: Array
) -> bool:
    # It keeps the allowed distances. Where one of the two rows is nearer, it comes no nearer than that row.
    # motion: (M, 3); rows: (m, W); keep: (m,), m; others: (R, 3); begins: (B + 1,); apart: (B,), m
    t, x, y = motion[i, 0], motion[i, 1], motion[i, 2]
    until, u, v = motion[j, 0], motion[j, 1], motion[j, 2]
    for k in range(len(rows)):
        if not passes(rows[k], keep[k], x, y, u, v, 1e-9):
            return False
    straight = np.empty((2, 3))
    straight[0, 0], straight[0, 1], straight[0, 2] = t, x, y
    straight[1, 0], straight[1, 1], straight[1, 2] = until, u, v
    for k in range(len(begins) - 1):
        other = others[begins[k] : begins[k + 1]]
        ax, ay, h = place(other, t, 0)
        bx, by, h = place(other, until, h)
        least = min(apart[k], np.hypot(x - ax, y - ay), np.hypot(u - bx, v - by))
        if closest(straight, other, t, until) < least - 1e-9:
            return False
    return True


@njit(cache=True)
def straightened(
    motion: Array, upto: int, rows: Array, keep: Array, others: Array, begins: Indices, apart: Array
) -> Array:
    """The timed motion without needless detours between its first `upto` rows."""
    # From each row that is kept the motion goes straight, at constant speed, to a later row. The function tries the
    # farthest row, then the row at three quarters of the way there, and so on, until `straight_is_free` allows one.
    # Rows keep their times. The other arguments are those of `straight_is_free`.
    kept = np.empty(len(motion), np.int64)
    kept[0], count, i = 0, 1, 0
    while i + 1 < upto:
        j = upto - 1
        while j > i + 1 and not straight_is_free(motion, i, j, rows, keep, others, begins, apart):
            j = i + max(1, (j - i) * 3 // 4)
        kept[count] = j
        count += 1
        i = j
    for i in range(upto, len(motion)):
        kept[count] = i
        count += 1
    return motion[kept[:count]]
