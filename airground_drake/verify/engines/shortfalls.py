"""Violations of the avoidance inequalities by recorded positions, in exact rational arithmetic.

The unit of time is the control period: the velocity of a body is the step to its next sample, and the gain is
a = min(A h, 1). The second body is a point or a core: a wall, a polygon or a prism (`outlines.Cores`). Let D be the
signed distance of the first body from it, d the distance to keep, and n the unit vector away from the nearest point; in
a polygon, the normal of the nearest edge. The theorem `budget` (coq/Budget.v) asks of each sample that either

    n.step_1 >= q_1 b - e_1 and -n.step_2 >= q_2 b - e_2,    b = a (d - D) where D <= d, else d - D,    q_1 + q_2 = 1,

or the two are far: D >= d + ||step_1|| + ||step_2||. If e_1 + e_2 <= e at every sample, then D >= d - e / a at all
times, where that is above 0.

Where robots act on measured positions, D and n are of these, the steps and "far" are of true ones, and the pair meets
the law together, with the gain a of the pair (a half of the law's beside a robot), or both bodies stand:

    n.step_1 - n.step_2 >= b - e.

Positions and corners are doubles, which are rational numbers, and so is the nearest point
of a core: only square roots are enclosed.
"""

from collections.abc import Iterator, Sequence
from fractions import Fraction
from math import inf, isqrt, nextafter
from typing import Any, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array, Indices
from airground_drake.verify.engines.outlines import Cores, away_from

SCREEN_M = 1e-9  # floats decide pairs by more than this, m: for bodies within 1e5 m they err by less than 1e-10 m
BITS = 160  # lengths are enclosed to 2^-160 units
# Inside a core every face counts whose distance exceeds the nearest face's by no more than this, m: floats may choose
# another one. The excess counts as missed.
TIE_M = Fraction(1, 10**12)
POINT = Cores(np.zeros((1, 2)), np.array(0.0), np.array(0.0))  # the core of a body whose place is its centre


def demanded(lacking: Any, inside: Any, outside: Any) -> Any:
    """The law's inequality, defined only here: required rate of separation, or minus the allowed rate of approach."""
    # lacking: d - D, the missing distance: an array of doubles, or one rational number.
    return np.where(lacking >= 0, inside, outside) * lacking


def shortfalls(
    first: Array, second: Array, d: float, share: Fraction, gain: Fraction, last: Fraction,
    core: Cores = POINT, *, planar: bool = False, held: bool = False, seen: Sequence[tuple[Array, Array]] = (),
) -> Array:  # fmt: skip
    """A pair's violation at each sample, e_1 + e_2, rounded up: (K,), m per control period."""
    # With a body that may move with V, the first one alone keeps the passive law: share 1, gain 0, d + V h in place of
    # d, and the second held where it is at each sample. Then e bounds how much the first one reduces min(D, d + V h) by
    # its own motion.
    # first, second: (K + 1, 3), m
    # gain: a.
    # planar: whether the first body stays in its plane: then no way leads out of a core through its top.
    # seen: measured places of both, (K, 3), m, if robots act on these; if each measures the other, those of both: then
    # the pair has to meet the law by one of them.
    other = np.broadcast_to(second, first.shape)
    missed = np.zeros(len(first) - 1)
    pair = _Pair(core, planar, Fraction(d), share, gain, held)
    for k in _doubtful(first, other, pair, float(last), by_law=not seen).tolist():
        places = [first[k], first[k + 1], other[k], other[k] if held else other[k + 1]]
        views = [[own[k], there[k]] for own, there in seen] or [[]]
        lasts = last if k == len(missed) - 1 else Fraction(1)
        missed[k] = rounded_up(min(_shortfall(np.stack([*places, *view]), pair, lasts) for view in views))
    return missed


def shortage(place: Array, other: Array, d: float, core: Cores = POINT, *, planar: bool = False) -> Fraction:
    """Upper bound of d minus the distance of a position, (3,), m, from a core; 0 if not positive."""
    (here, there), shape, unit = _in_units(np.stack([place, other]), core)
    return max(Fraction(d) - _apart(_ways_off(shape, _minus(here, there), planar, unit)), Fraction(0))


class _Pair(NamedTuple):
    """A core, whether the first body stays in its plane, d in m, q_1, a, and whether the second body is held."""

    core: Cores
    planar: bool
    d: Fraction
    share: Fraction
    gain: Fraction
    held: bool


def _doubtful(first: Array, other: Array, pair: _Pair, last: float, *, by_law: bool) -> Indices:
    """Indices of samples that need exact arithmetic: neither far nor, `by_law`, met by more than `SCREEN_M`."""
    distance, normal = away_from(pair.core, (first - other)[:-1], planar=pair.planar)
    normal[~normal.any(axis=1)] = np.nan
    d, share = float(pair.d), float(pair.share)
    bound = demanded(d - distance, float(pair.gain), 1.0)
    met = np.full(len(distance), by_law)
    reach = np.zeros(len(distance))
    for body, sign, part in ((first, 1.0, share), (other, -1.0, 1.0 - share)):
        step = np.zeros_like(body[1:]) if pair.held and sign < 0.0 else np.diff(body, axis=0)
        step[-1] /= last
        reach += np.linalg.norm(step, axis=1)
        if part > 0.0:  # an obstacle has no inequality
            met &= sign * np.einsum("ka,ka->k", normal, step) - part * bound > SCREEN_M
    return np.flatnonzero((distance - d - reach <= SCREEN_M) & ~met)


def _shortfall(places: Array, pair: _Pair, lasts: Fraction) -> Fraction:
    """Upper bound of e at one sample, m."""
    # places: of the first body at the sample and at the next, and of the second; and of both at the sample as measured,
    # if the law acted on these: (4, 3) or (6, 3), m. Then the pair meets the law together.
    (here, after, there, beyond, *seen), shape, unit = _in_units(places, pair.core)
    steps = (_minus(after, here), _minus(there, beyond))
    if seen and not any(map(any, steps)):  # both stand
        return Fraction(0)
    ways = _ways_off(shape, _minus(here, there), pair.planar, unit)
    reach = sum((_length(step, unit)[1] for step in steps), Fraction(0)) / lasts
    if _apart(ways) >= pair.d + reach:
        return Fraction(0)
    asked = [(steps[0], pair.share), (steps[1], 1 - pair.share)]
    if seen:
        ways = _ways_off(shape, _minus(*seen), pair.planar, unit)
        asked = [([a + b for a, b in zip(*steps, strict=True)], Fraction(1))]
    if not ways:  # n is unknown: along any n a step is at least minus its length
        return pair.gain * pair.d + reach
    apart = _apart(ways)
    bound = demanded(pair.d - apart, pair.gain, Fraction(1))  # it decreases with the distance
    totals = list[Fraction]()
    for way in ways:
        missed = apart - way.apart
        for step, part in asked:
            along = Fraction(_dot(way.normal, step), unit) / lasts
            missed += max(part * bound - min(along / length for length in _length(way.normal, 1)), Fraction(0))
        totals.append(missed)
    return min(totals)


class _Shape(NamedTuple):
    """A core in integer units: distinct corners, and the heights of base and top."""

    corners: list[list[int]]
    base: int
    top: int


class _Way(NamedTuple):
    """A direction (not normalised) of increasing distance, and a lower bound of the distance, m, along it."""

    normal: Sequence[int]
    apart: Fraction


def _ways_off(shape: _Shape, place: Sequence[int], planar: bool, unit: int) -> list[_Way]:
    """The directions away from a core, or out of it by the nearest faces (ties within `TIE_M`); none on a point."""
    # On a wall both sides are right.
    x, y, z = place
    corners, count = shape.corners, len(shape.corners)
    edges = [(a, _minus(b, a)) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)]
    edges = edges if count > 2 else edges[: count - 1]
    faces = [([ey, -ex, 0], (x - ax) * ey - (y - ay) * ex) for (ax, ay), (ex, ey) in edges]
    if count > 2 and all(side <= 0 for _, side in faces):
        faces += [] if planar else [([0, 0, 1], z - shape.top), ([0, 0, -1], shape.base - z)]
        ways = [_Way(normal, min(Fraction(side, unit) / norm for norm in _length(normal, 1))) for normal, side in faces]
        return [way for way in ways if way.apart >= _apart(ways) - TIE_M]
    rise = z - min(max(z, shape.base), shape.top)
    vectors = [([x - ax, y - ay, rise], 1) for ax, ay in corners]
    for ((ax, ay), (ex, ey)), (_, side) in zip(edges, faces, strict=True):
        squared = ex * ex + ey * ey
        if 0 < (x - ax) * ex + (y - ay) * ey < squared:
            vectors.append(([ey * side, -ex * side, rise * squared], squared))
    vector, scale = min(vectors, key=lambda option: Fraction(_dot(option[0], option[0]), option[1] ** 2))
    if any(vector):
        return [_Way(vector, _length(vector, unit * scale)[0])]
    return [_Way([sign * part for part in faces[0][0]], Fraction(0)) for sign in (1, -1)] if count == 2 else []


def _apart(ways: Sequence[_Way]) -> Fraction:
    """A lower bound of the distance, m; without a way it is 0."""
    return max((way.apart for way in ways), default=Fraction(0))


def _in_units(places: Array, core: Cores) -> tuple[list[list[int]], _Shape, int]:
    """Places (K, 3), m, and a core as whole numbers of 1 / unit m: the denominators of doubles are powers of 2."""
    corners = list(dict.fromkeys(map(tuple, core.corners.tolist())))
    numbers = [*places.ravel().tolist(), *(x for corner in corners for x in corner), float(core.base), float(core.top)]
    ratios = [x.as_integer_ratio() for x in numbers]
    unit = max(bottom for _, bottom in ratios)
    whole = iter([top * (unit // bottom) for top, bottom in ratios])
    whole_places = [_next(whole, 3) for _ in places]
    return whole_places, _Shape([_next(whole, 2) for _ in corners], *_next(whole, 2)), unit


def _next(numbers: Iterator[int], count: int) -> list[int]:
    return [next(numbers) for _ in range(count)]


def _length(vector: Sequence[int], unit: int) -> tuple[Fraction, Fraction]:
    """Bounds of the length of a vector in units, m; both are exact where the length is a whole number of units."""
    squared, scale = _dot(vector, vector) << (2 * BITS), unit << BITS
    root = isqrt(squared)
    return Fraction(root, scale), Fraction(root + (root * root < squared), scale)


def rounded_up(value: Fraction) -> float:
    """The least double that is not below a number."""
    double = float(value)
    return double if Fraction(double) >= value else nextafter(double, inf)


def _minus(first: Sequence[int], second: Sequence[int]) -> list[int]:
    return [a - b for a, b in zip(first, second, strict=True)]


def _dot(first: Sequence[int], second: Sequence[int]) -> int:
    return sum(a * b for a, b in zip(first, second, strict=True))
