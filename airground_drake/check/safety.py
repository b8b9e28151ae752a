"""SAFE-TRACE and SAFE-HYP: the distances of a run, and the hypotheses of the invariance proof along it."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from math import isqrt

import numpy as np

from .rules import SMALL, Found
from .run import Run
from .scenario import Pair

FAR_M = 1e-6
"""Distances of floating-point numbers are this wrong at most, m; farther pairs need no exact arithmetic."""


@lru_cache(maxsize=4096)
def least_distance_m(run: Run, pair: Pair) -> float:
    """Least distance of a pair over continuous time.

    On a segment the relative position is r + s w, 0 <= s <= 1; |r + s w|^2 is least at s = -r.w / w.w.
    """
    relative = run.position_m[pair.robot] - run.position_m[pair.other]
    r, w = relative[:-1], np.diff(relative, axis=0)
    ww = (w * w).sum(axis=1)
    s = np.clip(-(r * w).sum(axis=1) / np.where(ww > 0.0, ww, 1.0), 0.0, 1.0)
    return float(np.linalg.norm(r + s[:, None] * w, axis=1).min())


def safe_trace(run: Run) -> Found:
    """SAFE-TRACE: ||p_i(t) - q_j(t)|| >= d_ij at every time, for every pair.

    A pair puts the claim to the test if it comes so near that one period at the speed limits could break it.
    """
    margin, least, most = np.inf, 0, 0
    for pair in run.pairs:
        closing = pair.closing_m_s * run.scenario["control"]["period_s"]
        if run.apart_m[pair.robot, pair.other] - pair.safe_m > max(margin, closing + SMALL):
            continue  # neither the nearest pair nor near enough to count
        of_pair = least_distance_m(run, pair) - pair.safe_m
        margin = min(margin, of_pair)
        least += of_pair - closing < -SMALL
        most += of_pair - closing <= SMALL
    return Found("holds" if margin >= -SMALL else "refuted", float(margin), (least, most))


def _root(square: Fraction) -> tuple[Fraction, Fraction]:
    """Bounds of a square root, 2^-160 relative to the denominator apart."""
    numerator = isqrt(square.numerator * square.denominator << 320)
    denominator = square.denominator << 160
    return Fraction(numerator, denominator), Fraction(numerator + 1, denominator)


def _missed_m(x: list[Fraction], step: list[Fraction], safe: Fraction, share: Fraction, gain: Fraction) -> Fraction:
    """By how much a step along x / |x| falls short of its share of the bound, at most; 0 if it meets it.

    Args:
        x: from what is avoided to the robot, m.
        step: of the robot to the next sample, m.
        safe: distance to be kept, m.
        share: of the inequality.
        gain: A h, at most 1.
    """
    least, most = _root(sum((c * c for c in x), Fraction()))
    if not least:  # no direction: any unit vector may be taken
        return max(Fraction(), share * gain * safe)
    along = sum((c * s for c, s in zip(x, step, strict=True)), Fraction())
    bounds = [share * (gain * (safe - d) if d <= safe else safe - d) for d in (least, most)]
    return max(Fraction(), max(bounds) - min(along / least, along / most))


def shortfall_m(run: Run, pair: Pair) -> Fraction:
    """The most that a pair's inequalities together miss their bound by at any control sample, m per period; exact.

    Positions are taken as the rational numbers that they are. Samples at which the two cannot meet within a period,
    whatever their direction, need no inequality: `FAR_M` more than rounding takes.
    """
    control = run.scenario["control"]
    gain = min(Fraction(control["avoidance_gain_1_s"]) * Fraction(control["period_s"]), Fraction(1))
    rows = np.append(run.sample_row, len(run.t_s) - 1)
    own, other = run.position_m[pair.robot][rows], run.position_m[pair.other][rows]
    reach = np.linalg.norm(np.diff(own, axis=0), axis=1) + np.linalg.norm(np.diff(other, axis=0), axis=1)
    near = np.linalg.norm(own - other, axis=1)[:-1] < pair.safe_m + reach + FAR_M
    safe, share, worst = Fraction(pair.safe_m), Fraction(pair.share), Fraction()
    for k in np.flatnonzero(near):
        here, there, after, beyond = (
            [Fraction(c) for c in place] for place in (own[k], other[k], own[k + 1], other[k + 1])
        )
        x = [a - b for a, b in zip(here, there, strict=True)]
        missed = _missed_m(x, [a - b for a, b in zip(after, here, strict=True)], safe, share, gain)
        if pair.share < 1.0:
            step = [a - b for a, b in zip(beyond, there, strict=True)]
            missed += _missed_m([-c for c in x], step, safe, share, gain)
        worst = max(worst, missed)
    return worst
