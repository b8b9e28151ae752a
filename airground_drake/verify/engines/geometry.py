"""Exact geometry in continuous time of robots that move on straight lines between the rows of a trace.

Boxes around blocks of rows give lower bounds of distances, so exact computations are needed for near pairs only.

Times are in s, positions in m in one common frame; T is the number of rows. Row k ends segment k, which joins
position[k-1] at t[k-1] to position[k] at t[k].
"""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from scipy.optimize import brentq

from airground_drake.base.arrays import Array, Indices

# Rows closer than this are one instant, s: periods that are not binary fractions give simulator steps of 1e-17 s, and
# at 10 m/s a robot moves 1e-8 m meanwhile.
MERGE_S = 1e-9


class Approach(NamedTuple):
    """A minimum of the distance over continuous time."""

    distance_m: float  # the minimum
    t_s: float  # the earliest time at which it is attained, inside [t[row-1], t[row]]
    row: int  # row that ends the segment on which it is attained (0 only for a single row)


def instant_of(t: Array, row: int, share: float) -> float:
    """The time after a share of the segment that a row ends, s; of row 0, its time."""
    if row == 0:
        return float(t[0])
    return float(min(t[row - 1] + share * (t[row] - t[row - 1]), t[row]))


def interpolate(t: Array, values: Array, at: float | Array) -> Array:
    """Values (T, m) that are linear between the rows, at other times: (m,), or (K, m) for K times."""
    return np.stack([np.interp(at, t, column) for column in values.T], axis=-1)


def travelled(waypoints: Array, speed: float, t: float | Array) -> Array:
    """Position on a polyline travelled at constant speed from t = 0, held at its last point."""
    # waypoints: (m, 3), m; t: (K,), s
    # Returns (3,) or (K, 3), m.
    return interpolate(_lengths(waypoints), waypoints, speed * np.asarray(t))


def corner_times(waypoints: Array, speed: float) -> Array:
    """Times at which `travelled` passes its corners and stops, (m - 1,), s; none at standstill."""
    return _lengths(waypoints)[1:] / speed if speed > 0.0 else np.empty(0)


def _lengths(waypoints: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(waypoints, axis=0), axis=1))])


@dataclass(frozen=True)
class NormSignal:
    """x(t) = ||r(t)|| + n(t) for a vector r and a number n that are linear in time between knots, such as (15)."""

    t: Array  # knots, (K,), s; x is monotone between them
    parts: Array  # r and n at the knots, (K, 4), m
    x: Array  # value at the knots, (K,), m

    @classmethod
    def of(cls, t: Array, parts: Array) -> Self:
        """From times (T,) and parts (T, 4) whose x is convex between rows: its minima become knots too."""
        knots = np.union1d(t, _minima(t, parts))
        refined = interpolate(t, parts, knots)
        return cls(knots, refined, norm_sum(refined))

    def at(self, t: float | Array) -> Array:
        """x at one time or at (K,) times, m."""
        return norm_sum(interpolate(self.t, self.parts, t))

    def reaches(self, level: float, after: float, *, above: bool) -> float | None:
        """First time after `after`, s, at which x comes to be >= level (above) or < level (not above)."""
        begin = int(np.searchsorted(self.t, after, side="right"))
        there = (self.x[begin:] >= level) == above
        if not there.any():
            return None
        k = begin + int(np.argmax(there))
        left, right = max(after, float(self.t[k - 1])), float(self.t[k])
        ends = self.at(np.array([left, right])) - level
        if ends[0] * ends[1] >= 0.0:  # a crossing at a knot, up to rounding
            return left if abs(ends[0]) <= abs(ends[1]) else right
        return float(brentq(lambda t: float(self.at(t)) - level, left, right, xtol=1e-12))


def norm_sum(parts: Array) -> Array:
    """||r|| + n of parts (..., 4): (...), m."""
    total: Array = np.linalg.norm(parts[..., :3], axis=-1) + parts[..., 3]
    return total


def _minima(t: Array, parts: Array) -> Array:
    """Interior minima of x on the intervals between t (T,), s: at most one on each, as x is convex there."""
    # With r = r0 + u w and n = n0 + u m, u in [0, 1], let p be the distance of the line from the origin and s = ||w|| u
    # + r0.w/||w||; then x' = 0 where ||w|| s / sqrt(p^2 + s^2) = -m. Steps w and m are first divided by a power of 2
    # close to their size, which is exact: squares of very short ones would be 0.
    change = np.diff(parts, axis=0)
    exponent = np.frexp(np.abs(change).max(axis=1))[1]
    step = np.ldexp(change, -exponent[:, None])
    moving = np.linalg.norm(step[:, :3], axis=1) > np.abs(step[:, 3])  # otherwise x is monotone
    start = parts[:-1][moving, :3]
    w = step[moving, :3]
    m = step[moving, 3]
    length = np.linalg.norm(w, axis=1)
    along = (start * w).sum(axis=1) / length
    across = np.linalg.norm(start - (along / length)[:, None] * w, axis=1)
    towards = -m * across / np.sqrt(length**2 - m**2) - along
    whole = np.ldexp(length, exponent[moving])
    inside = (towards > 0.0) & (towards < whole)
    u = towards[inside] / whole[inside]
    turning: Array = t[:-1][moving][inside] + u * np.diff(t)[moving][inside]
    return turning[u < 1.0]


ROWS = 32  # Of a block. Between rows a robot moves straight, so on a block it stays in the box around its rows.
AT_ONCE = 300_000  # number of pairs of boxes compared together, to limit memory
ROUNDING_M = 1e-9  # allowance of a bound for rounding, m: distances up to 1e4 m err by 1e-12 m


class Boxes(NamedTuple):
    """Bounding boxes of K bodies for B blocks: corners (K, B, 3), m."""

    low: Array
    high: Array


def boxes_of(positions: Array) -> Boxes:
    """Bounding boxes of K bodies with positions (K, T, 3), m, at the rows and straight lines between them."""
    starts = np.arange(0, max(positions.shape[1] - 1, 1), ROWS)
    ends = positions[:, np.append(starts[1:], positions.shape[1] - 1)]  # the row at which the next block begins
    low, high = (side.reduceat(positions, starts, axis=1) for side in (np.minimum, np.maximum))
    return Boxes(np.minimum(low, ends), np.maximum(high, ends))


def apart_at_least(boxes: Boxes, first: Indices, second: Indices) -> Array:
    """Lower bounds of the distances of P pairs of bodies, given by their indices (P,): (P,), m."""
    least = np.empty(len(first))
    for some in np.array_split(np.arange(len(first)), len(first) * boxes.low.shape[1] // AT_ONCE + 1):
        these, those = first[some], second[some]
        gap = np.maximum(boxes.low[these] - boxes.high[those], boxes.low[those] - boxes.high[these])
        least[some] = np.sqrt(np.square(np.maximum(gap, 0.0)).sum(axis=2)).min(axis=1)
    return least - ROUNDING_M
