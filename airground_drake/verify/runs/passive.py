"""Robots beside obstacles that may move, period by period: distances and reactions.

A robot keeps n.v >= -(D - d - V h) / h, or n.v >= 0 if D < d + V h: then it is *passive*. Any loss below min(D, d + V
h) is due to the obstacle's own motion. With a measured distance D' and errors up to e, the first inequality may hold
for D' - e in place of D, if D' - e >= d + V h (theorem Passive.own_doing, `advances`).
"""

from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array, Flags, Indices
from airground_drake.sim.trace import Trace, per_trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.outlines import away_from
from airground_drake.verify.engines.shortfalls import POINT, SCREEN_M, rounded_up, shortfalls
from airground_drake.verify.runs.pairs import DISTANCE_TOLERANCE_M, Pair, cores_of, is_planar, origin_of, pairs_of

STANDING_M_S = 1e-9  # a robot that is commanded no more than this stands, m/s
AT_LIMIT_M_S = 1e-6  # a speed this near to the limit is at the limit, m/s


def passive_pairs(trace: Trace) -> list[Pair]:
    return [pair for pair in pairs_of(trace) if pair.speed_m_s > 0.0]


def period_ends(trace: Trace) -> Indices:
    """Rows of the control samples, and the last row: between them are the K control periods, (K + 1,)."""
    return np.append(trace.sample_rows, len(trace.t) - 1)


def last_period(trace: Trace) -> Fraction:
    """Length of the last control period of a run, in periods."""
    ends, period = period_ends(trace), trace.scenario.control.period_s
    lasting = float(trace.t[ends[-1]] - trace.t[ends[-2]])
    return Fraction(1) if abs(lasting - period) <= TIME_TOLERANCE_S else Fraction(lasting) / Fraction(period)


class Periods(NamedTuple):
    """The K control periods in which both bodies of a pair exist."""

    pair: Pair  # a robot and an obstacle that may move
    row: Indices  # at which each begins, (K,)
    apart_m: Array  # D at that row, (K,), m
    normal: Array  # away from the nearest point of the obstacle, (K, 3)
    keeps_m: float  # d + V h, m
    missed_m: Array  # violation of the passive law by the robot, (K,), m per period; 0: it is met
    too_fast: Flags  # whether the obstacle moves faster than it is expected to, (K,)
    velocity: Array  # of the robot, (K, 3), m/s

    @property
    def passive(self) -> Flags:
        """Whether the robot is so near that it only promises not to come nearer itself."""
        return self.apart_m < self.keeps_m

    @property
    def kept(self) -> Flags:
        """Whether all hypotheses are met, so that d is kept if the obstacle is no faster than V."""
        return ~self.passive & (self.missed_m <= DISTANCE_TOLERANCE_M) & ~self.too_fast

    @property
    def stood(self) -> Flags:
        return self.passive & (np.linalg.norm(self.velocity, axis=1) <= STANDING_M_S)

    @property
    def away_m_s(self) -> Array:
        """The commanded speed away from the obstacle, (K,), m/s."""
        return np.asarray(np.einsum("ka,ka->k", self.normal, self.velocity))

    @property
    def retreated(self) -> Flags:
        """Whether it was passive and retreated as fast as the obstacle may approach."""
        return self.passive & (self.away_m_s >= self.pair.speed_m_s - AT_LIMIT_M_S)


@per_trace
def periods_of(trace: Trace, pair: Pair) -> Periods:
    """The control periods of a robot beside an obstacle that may move."""
    ends, period = period_ends(trace), trace.scenario.control.period_s
    which = np.flatnonzero((ends[:-1] >= pair.row) & (ends[:-1] < pair.last))
    row = ends[which]
    around = np.append(row, ends[which[-1:] + 1])  # the ends, too
    cores = cores_of(trace)[pair.second]
    planar = is_planar(trace, pair.first)
    keeps = pair.keeps_m(period)
    first = trace.position(pair.first)[around]
    origin = origin_of(trace, pair.second)[around]
    away = away_from(cores.take((slice(None), None)), (first - origin)[:-1], planar=planar)
    nearest, k = away.distance.argmin(axis=0), np.arange(len(row))
    last = last_period(trace) if len(which) and which[-1] == len(ends) - 2 else Fraction(1)
    missed = np.zeros(len(row))
    longest = np.linalg.norm(np.diff(first, axis=0), axis=1).max(initial=0.0)
    if away.distance.min(initial=np.inf) <= keeps + longest + SCREEN_M:
        for part in range(len(cores.base)):
            core = POINT if cores.are_points else cores.take(part)
            place = origin + cores.points[part] if cores.are_points else origin
            missing = partial(
                shortfalls, first, place, share=Fraction(1), gain=Fraction(0), last=last, core=core, planar=planar,
                held=True,
            )  # fmt: skip
            of_part = missing(d=keeps)
            if pair.error_m and of_part.any():
                seen, there = trace.as_seen(pair.first, pair.first)[which], np.broadcast_to(place, first.shape)[:-1]
                sure = rounded_up(Fraction(keeps) + Fraction(pair.error_m))
                as_seen = missing(d=sure, seen=[(seen, there)])
                far = away_from(core, seen - there, planar=planar).distance >= sure
                of_part = np.where(far, np.minimum(of_part, as_seen), of_part)
            missed = np.maximum(missed, of_part)
    missed = np.maximum(missed - pair.slip_m, 0.0)  # for which the law keeps a larger distance
    moved = np.linalg.norm(np.diff(origin, axis=0), axis=1)
    lasting = np.diff(trace.t[around])
    return Periods(
        pair=pair, row=row, apart_m=away.distance[nearest, k], normal=away.normal[nearest, k], keeps_m=keeps,
        missed_m=missed, too_fast=moved > pair.speed_m_s * lasting + DISTANCE_TOLERANCE_M,
        velocity=trace.chosen(pair.first)[which],
    )  # fmt: skip


def beside(trace: Trace) -> list[Periods]:
    """The control periods of every robot beside every obstacle that may move."""
    return [periods_of(trace, pair) for pair in passive_pairs(trace)]


def speeds(trace: Trace) -> dict[str, Array]:
    """Mean speeds of the obstacles that move during the control periods, (K,), m/s, by name; 0 while not there."""
    ends, mean = period_ends(trace), dict[str, Array]()
    for name, barrier in trace.scenario.barriers.items():
        if barrier.moves:
            speed = np.linalg.norm(np.diff(trace.position(name)[ends], axis=0), axis=1) / np.diff(trace.t[ends])
            there = (ends[:-1] >= trace.there_from(name)) & (ends[:-1] < trace.there_until(name))
            mean[name] = np.where(there, speed, 0.0)
    return mean


def beside_moving(trace: Trace) -> list[dict[str, Any]]:
    """Each robot beside each obstacle that may move, in numbers of control periods."""
    rows, fast = list[dict[str, Any]](), speeds(trace)
    slop = DISTANCE_TOLERANCE_M / trace.scenario.control.period_s
    for periods in beside(trace):
        pair = periods.pair
        speed = fast.get(pair.second, np.zeros(1))
        over = np.flatnonzero(speed > pair.speed_m_s + slop)
        rows.append({
            "first": pair.first,
            "second": pair.second,
            "safe_distance_m": pair.required_m,
            "declared_m_s": pair.speed_m_s,
            "fastest_m_s": float(speed.max()),
            "too_fast_s": float(trace.t[period_ends(trace)[over[0]]]) if len(over) else None,
            "too_fast_m_s": float(speed[over[0]]) if len(over) else None,
            "periods": len(periods.row),
            # all hypotheses were met: the distance is proved for every motion of the obstacle within its declared speed
            "kept_periods": int(periods.kept.sum()),
            # too near for that: the robot did not reduce the distance
            "passive_periods": int(periods.passive.sum()),
            # of these: the whole loss is the obstacle's motion above its declared speed
            "retreating_periods": int(periods.retreated.sum()),
            "standing_periods": int(periods.stood.sum()),
            "e_m": float(periods.missed_m.max(initial=0.0)),
        })  # fmt: skip
    return rows
