"""UGVs that act on old positions of each other: received positions, and violations of the asynchronous law.

Let D be the distance from an old position of another UGV, and rho the distance that it can drive from there until it
decides again. The theorem `old_positions` (coq/Async.v) requires of each step s that n.s >= d + rho - D if D >= d +
rho, otherwise D n.s >= rho |s|. Violations do not recover, so they add up.
"""

from fractions import Fraction
from math import ceil, isqrt

import numpy as np

from airground_drake.base.arrays import Array, Indices
from airground_drake.base.exact import decimal
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.shortfalls import BITS, SCREEN_M, rounded_up
from airground_drake.verify.runs.passive import last_period, period_ends

SPARE_S = 1e-8  # time by which the law overestimates the age of positions, beyond the theorem's requirement


def unsure_s(scenario: Scenario) -> float:
    """Age of positions plus a period if all messages arrive, s; 0 under the shared law."""
    if scenario.control.law != "asynchronous" or (link := scenario.ugv_links) is None:
        return 0.0
    periods = ceil(decimal(link.delay_s) / decimal(scenario.control.period_s) * (1 - Fraction(1, 10**9)))
    return (periods + 1) * scenario.control.period_s + SPARE_S


def heard_at(trace: Trace, by: str, of: str) -> Indices:
    """The control sample of the last received position of a UGV at each sample, (S,); -1 without one."""
    t, heard = trace.sampled("t_s"), trace.sampled(f"{by}.heard_{of}_s")
    k = np.searchsorted(t, heard - TIME_TOLERANCE_S).clip(0, len(t) - 1)
    return np.where((np.abs(t[k] - heard) <= TIME_TOLERANCE_S) & (k <= np.arange(len(t))), k, -1)


def heard_places(trace: Trace, by: str, of: str) -> Array:
    """The last received position of a UGV at each sample, (S, 3), m."""
    return trace.position(of)[trace.sample_rows][heard_at(trace, by, of)]


def unsure_m(trace: Trace, by: str, of: str) -> Array:
    """Largest distance of a UGV from that position until it decides again, (S,), m."""
    since = trace.sampled("t_s") - trace.sampled(f"{by}.heard_{of}_s")
    return trace.scenario.ugvs[of].max_speed_m_s * (since + trace.scenario.control.period_s + SPARE_S)


def missed_m(trace: Trace, by: str, of: str, safe_m: float) -> Array:
    """Violations of the law towards another UGV, (S,), m, rounded up; without a position, whole steps."""
    ends, t, last = period_ends(trace), trace.t, float(last_period(trace))
    heard, way = heard_at(trace, by, of), trace.position(by)[ends]
    gone = np.diff(trace.position(of)[ends], axis=0) / np.diff(t[ends])[:, None]
    speed = max(float(np.linalg.norm(gone, axis=1).max()), trace.scenario.ugvs[of].max_speed_m_s)
    longest = max(trace.scenario.control.period_s, float(np.diff(t[ends]).max()))
    offset, steps = way[:-1] - trace.position(of)[ends[:-1]][heard], np.diff(way, axis=0)
    steps[-1] /= last
    unsure = speed * (t[ends[:-1]] - t[ends[:-1]][heard] + longest)
    apart, length = np.linalg.norm(offset, axis=1), np.linalg.norm(steps, axis=1)
    along = (offset * steps).sum(axis=1)
    keeps = safe_m + unsure
    met = (apart > keeps + SCREEN_M) & (along / np.maximum(apart, SCREEN_M) - keeps + apart > SCREEN_M)
    missed = np.where(heard < 0, safe_m, 0.0)
    for k in np.flatnonzero((heard >= 0) & ~met & (length > 0.0)).tolist():
        missed[k] = rounded_up(_missed(offset[k], steps[k], Fraction(unsure[k]), Fraction(safe_m)))
    return missed


def _missed(offset: Array, step: Array, unsure: Fraction, safe: Fraction) -> Fraction:
    """Upper bound of one step's violation, m."""
    w, s = ([Fraction(axis) for axis in vector.tolist()] for vector in (offset, step))
    squared, along = sum(a * a for a in w), sum(a * b for a, b in zip(w, s, strict=True))
    missed = max(unsure * _root(sum(a * a for a in s))[1] - along, Fraction(0)) / (safe / 2)
    least, most = _root(Fraction(squared))
    if least < safe + unsure:
        return missed
    arrives = Fraction(squared) + along
    return min(missed, max(safe + unsure - min(arrives / least, arrives / most), Fraction(0)))


def _root(square: Fraction | int) -> tuple[Fraction, Fraction]:
    """Lower and upper bound of a square root."""
    given = Fraction(square)
    root, whole = isqrt(given.numerator * given.denominator << 2 * BITS), given.denominator << BITS
    return Fraction(root, whole), Fraction(root + 1, whole)
