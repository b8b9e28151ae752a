"""By how much recorded positions miss the inequalities of set-based avoidance, in exact rational arithmetic.

The unit of time is the control period: the velocity of a body is the step to its next sample, and the gain is
a = min(A h, 1). Let D be the distance of two bodies that keep d, and n the unit vector from the second to the first.
The theorem `disturbed` (proofs/Safety.v) asks of each sample that either

    n.step_1 >= q_1 b - e_1 and -n.step_2 >= q_2 b - e_2,    b = a (d - D) where D <= d, else d - D,    q_1 + q_2 = 1,

or the two are far: D >= d + ||step_1|| + ||step_2||. If e_1 + e_2 <= e at every sample, then D >= d - e / a at all
times. Positions are doubles, which are rational numbers: only square roots are enclosed.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import inf, isqrt, nextafter
from typing import Any

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array

SCREEN_M = 1e-9
"""Floats decide pairs by more than this, m: for bodies within 1e5 m they err by less than 1e-10 m."""
BITS = 160
"""Lengths are enclosed to 2^-160 units."""


def demanded(lacking: Any, inside: Any, outside: Any) -> Any:
    """Rate at which two bodies have to part, or may approach at most: the law's inequality, here and nowhere else.

    Args:
        lacking: d - D, the missing distance: an array of doubles, or one rational number.
        inside: rate per distance where D <= d: the gain.
        outside: the same where D > d: one over the period.
    """
    return np.where(lacking >= 0, inside, outside) * lacking


def shortfalls(first: Array, second: Array, d: float, share: Fraction, gain: Fraction, last: Fraction) -> Array:
    """What a pair misses at each sample, e_1 + e_2, rounded up: (K,), m per control period.

    Args:
        first: positions of a robot at K samples and at the end of the run, (K + 1, 3), m.
        second: those of another robot, (K + 1, 3), m, or the place of an obstacle, (3,), m.
        d: safe distance of the centres, m.
        share: q_1; the second body takes the rest.
        gain: a.
        last: control periods from the last sample to the end of the run, at most 1.
    """
    other = np.broadcast_to(second, first.shape)
    found = np.zeros(len(first) - 1)
    for k in _doubtful(first, other, d, float(share), float(gain), float(last)).tolist():
        ends = np.concatenate([first[k : k + 2], other[k : k + 2]])
        found[k] = rounded_up(_shortfall(ends, Fraction(d), share, gain, last if k == len(found) - 1 else Fraction(1)))
    return found


def shortage(one: Array, other: Array, d: float) -> Fraction:
    """By how much two places (3,), m, are closer than d, m, from above; 0 if they are not."""
    (here, there), unit = _in_units(np.stack([one, other]))
    return max(Fraction(d) - _length(_minus(here, there), unit)[0], Fraction(0))


def _doubtful(first: Array, other: Array, d: float, share: float, gain: float, last: float) -> npt.NDArray[np.intp]:
    """Samples that floats find neither far nor met by more than `SCREEN_M`: their numbers."""
    apart = (first - other)[:-1]
    distance = np.linalg.norm(apart, axis=1)
    normal = apart / np.where(distance > 0.0, distance, np.nan)[:, None]
    bound = demanded(d - distance, gain, 1.0)
    met, reach = np.ones(len(apart), dtype=np.bool_), np.zeros(len(apart))
    for body, sign, part in ((first, 1.0, share), (other, -1.0, 1.0 - share)):
        step = np.diff(body, axis=0)
        step[-1] /= last
        reach += np.linalg.norm(step, axis=1)
        if part > 0.0:  # nothing is asked of an obstacle
            met &= sign * np.einsum("ka,ka->k", normal, step) - part * bound > SCREEN_M
    return np.flatnonzero((distance - d - reach <= SCREEN_M) & ~met)


def _shortfall(ends: Array, d: Fraction, share: Fraction, gain: Fraction, lasts: Fraction) -> Fraction:
    """e_1 + e_2 of one sample, from above.

    Args:
        ends: where the first body is and goes, and where the second is and goes, (4, 3), m.
        d: safe distance, m.
        share: of the first body.
        gain: a.
        lasts: control periods from here to there.
    """
    (here, after, there, beyond), unit = _in_units(ends)
    apart, steps = _minus(here, there), (_minus(after, here), _minus(beyond, there))
    low, high = _length(apart, unit)
    reach = sum((_length(step, unit)[1] for step in steps), Fraction(0)) / lasts
    if low >= d + reach:
        return Fraction(0)
    if low == 0:  # n is unknown: along any n a step is at least minus its length
        return gain * d + reach
    bound = demanded(d - low, gain, Fraction(1))  # it decreases with the distance
    missed = Fraction(0)
    for step, sign, part in zip(steps, (1, -1), (share, 1 - share), strict=True):
        along = Fraction(sign * _dot(apart, step), unit * unit) / lasts
        missed += max(part * bound - min(along / low, along / high), Fraction(0))
    return missed


def _in_units(places: Array) -> tuple[list[list[int]], int]:
    """Places (K, 3), m, as whole numbers of 1 / unit m: the denominators of doubles are powers of 2."""
    ratios = [[x.as_integer_ratio() for x in place] for place in places.tolist()]
    unit = max(bottom for place in ratios for _, bottom in place)
    return [[top * (unit // bottom) for top, bottom in place] for place in ratios], unit


def _length(vector: Sequence[int], unit: int) -> tuple[Fraction, Fraction]:
    """Bounds of the length of a vector in units, m; the lower one is exact where the length is a whole number."""
    found, scale = isqrt(_dot(vector, vector) << (2 * BITS)), unit << BITS
    return Fraction(found, scale), Fraction(found + 1, scale)


def rounded_up(value: Fraction) -> float:
    """The least double that is not below a number."""
    found = float(value)
    return found if Fraction(found) >= value else nextafter(found, inf)


def _minus(one: Sequence[int], other: Sequence[int]) -> list[int]:
    return [a - b for a, b in zip(one, other, strict=True)]


def _dot(one: Sequence[int], other: Sequence[int]) -> int:
    return sum(a * b for a, b in zip(one, other, strict=True))
