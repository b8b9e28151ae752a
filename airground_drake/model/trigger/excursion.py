"""The exact range of the decision variable between two instants.

Between two updates a task error e moves on a straight line and the noise n is linear, so that x = ||e|| + n is convex:
it is largest at an end, and smallest at an end or where its slope is 0. Let u be the distance along the change of e
from the point nearest to the origin, p the distance of that point, and k the change of n over the length of that of e.
Then

    x = sqrt(u^2 + p^2) + k u + const,   smallest at u = -k p / sqrt(1 - k^2)   if |k| < 1,

because sqrt(u^2 + p^2) >= p sqrt(1 - k^2) - k u (Cauchy). For |k| >= 1 it is monotone. A reference with corners is
straight between them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.compiling import njit
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.geometry.moving import at


class Corners(NamedTuple):
    """Corners of the references of n UGVs: the vertices of their presets."""

    times: Array  # of all vertices, in order, (C,), s
    ugvs: npt.NDArray[np.int64]  # the UGV of each, (C,)
    first: npt.NDArray[np.int64]  # rows of each UGV's own vertices: from `first[j]` to before `first[j + 1]`, (n + 1,)
    own_times: Array  # their times, (C,), s
    places: Array  # and places, (C, 3), m
    slopes: Array  # velocity from each place to the next, (C, 3), m/s; 0 at the last place of each UGV

    @classmethod
    def of(cls, presets: Sequence[Motion]) -> Corners:
        """The corners of presets; no rows without presets."""
        order = sorted((t, j) for j, preset in enumerate(presets) for t in preset.times.tolist())
        return cls(
            np.array([t for t, _ in order], dtype=np.float64),
            np.array([j for _, j in order], dtype=np.int64),
            np.cumsum([0, *(len(preset.times) for preset in presets)], dtype=np.int64),
            np.concatenate([np.zeros(0), *(preset.times for preset in presets)]),
            np.concatenate([np.zeros((0, 3)), *(preset.positions for preset in presets)]),
            np.concatenate([np.zeros((0, 3)), *(np.append(p.slopes, [np.zeros(3)], axis=0) for p in presets)]),
        )


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
    if root == 0.0:  # squares of such numbers are no numbers any more
        return largest
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
def bends(corners: Corners, begin: float, end: float) -> tuple[int, int]:
    """The first corner within a step, in s, and the one after the last."""
    times = corners.times
    first = int(np.searchsorted(times, begin, side="right"))
    return first, max(first, int(np.searchsorted(times, end, side="left")))


@njit(cache=True)
def stretches(begun: Array, now: Array, corners: Corners) -> tuple[Array, Array, Flags]:
    """A step cut at its corners: times (s,), s, task errors and noise then, (s, n, 4), m, and which UGVs bend, (n,)."""
    # Of a UGV whose reference bends, the error is that of the straight step, plus what the reference leaves it by.
    first, last = bends(corners, begun[0], now[0])
    before, after = begun[1:].reshape(-1, 5), now[1:].reshape(-1, 5)
    n, stops = len(before), last - first + 2
    times, bent = np.empty(stops), np.zeros(n, dtype=np.bool_)
    times[0], times[stops - 1] = begun[0], now[0]
    for corner in range(first, last):
        times[1 + corner - first] = corners.times[corner]
        bent[corners.ugvs[corner]] = True
    parts = np.empty((stops, n, 4))
    for k in range(stops):
        share = (times[k] - times[0]) / (times[stops - 1] - times[0])
        for j in range(n):
            for a in range(4):
                parts[k, j, a] = before[j, a] + share * (after[j, a] - before[j, a])
    for j in range(n):
        if not bent[j]:
            continue
        rows = slice(corners.first[j], corners.first[j + 1])
        places = np.empty((stops, 3))
        for k in range(stops):
            place, _ = at(corners.own_times[rows], corners.places[rows], corners.slopes[rows], times[k])
            for a in range(3):
                places[k, a] = place[a]
        for k in range(stops):
            share = (times[k] - times[0]) / (times[stops - 1] - times[0])
            for a in range(3):
                parts[k, j, a] += places[k, a] - places[0, a] - share * (places[stops - 1, a] - places[0, a])
    return times, parts, bent


@njit(cache=True)
def ranges(begun: Array, now: Array, corners: Corners) -> Array:
    """Least x of (15) since a step began, then the largest, (2n,), m, from its signals as `gathered` gives them."""
    found = spans(begun, now)
    first, last = bends(corners, begun[0], now[0])
    if last > first:
        times, parts, bent = stretches(begun, now, corners)
        n = len(bent)
        x, least, most = np.empty((len(times), n)), np.full(n, np.inf), np.full(n, -np.inf)
        for k in range(len(times)):
            at_stop = variables(parts[k])
            for j in range(n):
                x[k, j] = at_stop[j]
        for k in range(len(times) - 1):
            piece = extremes(parts[k], parts[k + 1], x[k : k + 2])
            for j in range(n):
                least[j], most[j] = min(least[j], piece[0, j]), max(most[j], piece[1, j])
        for j in range(n):
            if bent[j]:
                found[0, j], found[1, j] = least[j], most[j]
    return found.ravel()
