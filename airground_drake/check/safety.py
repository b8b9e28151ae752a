"""SAFE-TRACE and SAFE-HYP: the distances of a run, and the hypotheses of the invariance proof along it."""

from __future__ import annotations

from fractions import Fraction
from math import isqrt

import numpy as np

from .rules import SMALL, Disagreement, Found, at_most, close, holds
from .run import Run
from .scenario import Pair, written

FAR_M = 1e-6
"""Distances of floating-point numbers are this wrong at most, m; farther pairs need no exact arithmetic."""


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


def gain_of(run: Run) -> Fraction:
    """A h of the numbers as they are written, at most 1: the bound with 1 demands less."""
    control = run.scenario["control"]
    return min(written(control["avoidance_gain_1_s"]) * written(control["period_s"]), Fraction(1))


def shortfall_m(run: Run, pair: Pair) -> Fraction:
    """The most that a pair's inequalities together miss their bound by at any control sample, m per period; exact.

    Positions are taken as the rational numbers that they are. Samples at which the two cannot meet within a period,
    whatever their direction, need no inequality. Of a last period that is cut short, the step is extended.
    """
    rows, gain = np.append(run.sample_row, len(run.t_s) - 1), gain_of(run)
    own, other = run.position_m[pair.robot][rows], run.position_m[pair.other][rows]
    reach = np.linalg.norm(np.diff(own, axis=0), axis=1) + np.linalg.norm(np.diff(other, axis=0), axis=1)
    lasting, period = float(np.diff(run.t_s[rows])[-1]), run.scenario["control"]["period_s"]
    extended = Fraction(1) if abs(lasting - period) <= SMALL else Fraction(period) / Fraction(lasting)
    reach[-1] *= float(extended)
    near = np.linalg.norm(own - other, axis=1)[:-1] < pair.safe_m + reach + FAR_M
    safe, share, worst = Fraction(pair.safe_m), Fraction(pair.share), Fraction()
    for k in np.flatnonzero(near):
        here, there, after, beyond = (
            [Fraction(c) for c in place] for place in (own[k], other[k], own[k + 1], other[k + 1])
        )
        scale = extended if k == len(near) - 1 else Fraction(1)
        x = [a - b for a, b in zip(here, there, strict=True)]
        missed = _missed_m(x, [scale * (a - b) for a, b in zip(after, here, strict=True)], safe, share, gain)
        if pair.share < 1.0:
            step = [scale * (a - b) for a, b in zip(beyond, there, strict=True)]
            missed += _missed_m([-c for c in x], step, safe, share, gain)
        worst = max(worst, missed)
    return worst


def safe_hyp(run: Run) -> Found:
    """SAFE-HYP: the hypotheses of the safety theorem, up to e per pair; its margin is the least -e / (A h).

    How often inequalities bound a command is not counted here.
    """
    try:
        _constants(run)
        _motion(run)
    except Disagreement as broken:
        return Found("refuted", because=broken)
    gain, lost = gain_of(run), 0.0
    for pair in run.pairs:
        closing = pair.closing_m_s * run.scenario["control"]["period_s"]
        if run.apart_m[pair.robot, pair.other] > pair.safe_m + closing + FAR_M:
            continue
        missed = shortfall_m(run, pair)
        start = float(np.linalg.norm(run.position_m[pair.robot][0] - run.position_m[pair.other][0]))
        of_gain = missed / gain if gain else missed * len(run.sample_row)
        lost = max(lost, float(of_gain), pair.safe_m - start if start < pair.safe_m - FAR_M else 0.0)
    return Found("holds" if lost <= SMALL else "refuted", -lost if lost <= SMALL else None)


def _constants(run: Run) -> None:
    """A h <= 1, each pair starts apart, and the sensing range covers d + (closing speed) h."""
    control, limit = run.scenario["control"], {name: each["max_speed_m_s"] for name, each in run.robots.items()}
    period, reach = written(control["period_s"]), written(control["sensing_range_m"])
    gain = written(control["avoidance_gain_1_s"]) * period
    holds("gain: A h <= 1", gain <= 1, float(gain), "1 at most")
    for pair in run.pairs:
        about, speed = f"{pair.robot}, {pair.other}", written(limit[pair.robot]) + written(limit.get(pair.other, 0.0))
        least = written(pair.safe_m) + speed * period
        holds("sensing range", reach >= least, float(reach), f"{float(least)} at least", about=about)
        start = float(np.linalg.norm(run.position_m[pair.robot][0] - run.position_m[pair.other][0]))
        holds("safe start", start >= pair.safe_m - SMALL, start, f"{pair.safe_m} at least", about=about)


def _motion(run: Run) -> None:
    """Robots move straight from sample to sample, at most at their speed limits, and UGVs stay at their height."""
    rows = np.append(run.sample_row, len(run.t_s) - 1)
    at_most("spacing of the samples", np.diff(run.t_s[rows]), run.scenario["control"]["period_s"], within=SMALL)
    for robot, spec in run.robots.items():
        place = run.position_m[robot]
        on_chord = np.stack([np.interp(run.t_s, run.t_s[rows], axis[rows]) for axis in place.T], axis=1)
        close("straight motion", place, on_chord, within=SMALL, about=robot, t_s=run.t_s)
        speed = np.linalg.norm(run.command_m_s[robot][1:], axis=1)
        at_most("speed limit", speed, spec["max_speed_m_s"], within=SMALL, about=robot, t_s=run.t_s[:-1])
        if robot != run.uav:
            close("planar motion", place[:, 2], np.full(len(place), place[0, 2]), within=0.0, about=robot, t_s=run.t_s)
