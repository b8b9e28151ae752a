"""Robots beside obstacles that may move, period by period: what each kept, lost, and did.

A robot keeps n.v >= -(D - d - V h) / h, and n.v >= 0 where D < d + V h: it is *passive* there. Whatever it then loses
of min(D, d + V h), the obstacle has moved itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from math import ceil
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.run.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.outlines import Cores, Indices, apart_by_blocks, away_from, least_distances
from airground_drake.verify.engines.shortfalls import POINT, SCREEN_M, shortfalls
from airground_drake.verify.runs.control_law import Inequalities, inequalities_of
from airground_drake.verify.runs.pairs import (
    BENT_M,
    DISTANCE_TOLERANCE_M,
    MOST_PARTS,
    Pair,
    apart_of,
    at_appearance,
    bent,
    cores_of,
    gap_over_time,
    is_planar,
    least_gap,
    numbers_of,
    off_m_of,
    origin_of,
    pairs_of,
    parts_of,
)

STANDING_M_S = 1e-9
"""A robot that is commanded no more than this stands, m/s."""
AT_LIMIT_M_S = 1e-6
"""A speed this near to the limit is at the limit, m/s."""
BLOCKED_M_S = 1e-6
"""An inequality blocks a retreat if the retreat would miss it by more than this, m/s."""

Flags = npt.NDArray[np.bool_]


def passive_pairs(trace: Trace) -> list[Pair]:
    """The pairs of a robot and an obstacle that may move."""
    return [pair for pair in pairs_of(trace) if pair.speed_m_s > 0.0]


def period_ends(trace: Trace) -> Indices:
    """Rows of the control samples, and the last row: between them are the K control periods, (K + 1,)."""
    return np.append(trace.sample_rows, len(trace.t) - 1)


def last_period(trace: Trace) -> Fraction:
    """How long the last control period of a run is, in periods."""
    ends, period = period_ends(trace), trace.scenario.control.period_s
    lasting = float(trace.t[ends[-1]] - trace.t[ends[-2]])
    return Fraction(1) if abs(lasting - period) <= TIME_TOLERANCE_S else Fraction(lasting) / Fraction(period)


class Periods(NamedTuple):
    """The control periods in which both bodies of a pair are there, K of them.

    Attributes:
        pair: a robot and an obstacle that may move.
        row: at which each begins, (K,).
        apart_m: D at that row, (K,), m.
        normal: away from the nearest point of the obstacle, (K, 3).
        keeps_m: d + V h, m.
        missed_m: how far the robot misses the passive law, (K,), m per period; 0: it is met.
        too_fast: whether the obstacle moves faster than it is expected to, (K,).
        velocity: of the robot, (K, 3), m/s.
    """

    pair: Pair
    row: Indices
    apart_m: Array
    normal: Array
    keeps_m: float
    missed_m: Array
    too_fast: Flags
    velocity: Array

    @property
    def passive(self) -> Flags:
        """Where the robot is so near that it only promises not to come nearer itself."""
        return self.apart_m < self.keeps_m

    @property
    def kept(self) -> Flags:
        """Where all hypotheses are met: d is kept, whatever the obstacle does within V."""
        return ~self.passive & (self.missed_m <= DISTANCE_TOLERANCE_M) & ~self.too_fast

    @property
    def stood(self) -> Flags:
        """Where it was passive and stood."""
        return self.passive & (np.linalg.norm(self.velocity, axis=1) <= STANDING_M_S)

    @property
    def retreated(self) -> Flags:
        """Where it was passive and went away from the obstacle as fast as that may come."""
        return self.passive & (np.einsum("ka,ka->k", self.normal, self.velocity) >= self.pair.speed_m_s - AT_LIMIT_M_S)


def periods_of(trace: Trace, pair: Pair) -> Periods:
    """The control periods of a robot beside an obstacle that may move."""
    return trace.derived(("periods", pair.first, pair.second), lambda: _periods(trace, pair))


def _periods(trace: Trace, pair: Pair) -> Periods:
    ends, period = period_ends(trace), trace.scenario.control.period_s
    last_row = len(trace.t) - 1 if pair.last is None else pair.last
    which = np.flatnonzero((ends[:-1] >= pair.row) & (ends[:-1] < last_row))
    row = ends[which]
    around = np.append(row, ends[which[-1:] + 1])  # the ends, too
    cores, planar, keeps = cores_of(trace)[pair.second], is_planar(trace, pair.first), pair.keeps_m(period)
    first, way = trace.position(pair.first)[around], origin_of(trace, pair.second)
    origin = np.zeros_like(first) if way is None else way[around]
    away = away_from(cores.take((slice(None), None)), (first - origin)[:-1], planar=planar)
    nearest, k = away.distance.argmin(axis=0), np.arange(len(row))
    last = last_period(trace) if len(which) and which[-1] == len(ends) - 2 else Fraction(1)
    missed = np.zeros(len(row))
    longest = np.linalg.norm(np.diff(first, axis=0), axis=1).max(initial=0.0)
    if away.distance.min(initial=np.inf) <= keeps + longest + SCREEN_M:
        for part in range(len(cores.base)):
            core = POINT if cores.are_points else cores.take(part)
            place = origin + cores.points[part] if cores.are_points else origin
            asked = Fraction(1), Fraction(0), last
            missed = np.maximum(missed, shortfalls(first, place, keeps, *asked, core, planar=planar, held=True))
    missed = np.maximum(missed - pair.slip_m, 0.0)  # for which the law keeps more
    moved = np.linalg.norm(np.diff(origin, axis=0), axis=1)
    lasting = np.diff(trace.t[around])
    return Periods(
        pair, row, away.distance[nearest, k], away.normal[nearest, k], keeps, missed,
        moved > pair.speed_m_s * lasting + DISTANCE_TOLERANCE_M, trace.chosen(pair.first)[which],
    )  # fmt: skip


def beside(trace: Trace) -> list[Periods]:
    """The control periods of every robot beside every obstacle that may move."""
    return [periods_of(trace, pair) for pair in passive_pairs(trace)]


def speeds(trace: Trace) -> dict[str, Array]:
    """Mean speeds of the obstacles that move during the control periods, (K,), m/s, by name; 0 while not there."""
    ends, found = period_ends(trace), dict[str, Array]()
    for name, each in trace.scenario.barriers.items():
        if each.moves:
            speed = np.linalg.norm(np.diff(trace.position(name)[ends], axis=0), axis=1) / np.diff(trace.t[ends])
            there = (ends[:-1] >= trace.there_from(name)) & (ends[:-1] < trace.there_until(name))
            found[name] = np.where(there, speed, 0.0)
    return found


@dataclass(frozen=True)
class BesideMoving:
    """A robot beside an obstacle that may move, in numbers of control periods.

    `kept_periods`: all hypotheses were met, so that the distance is proved whatever the obstacle does within its
    declared speed. In the `passive_periods` it was too near for that, and the robot did not bring itself nearer; in
    `standing_periods` of these it stood. In `retreating_periods` it retreated so fast that it would have kept the
    distance, and all that it lost is the obstacle's motion above its declared speed.
    """

    first: str
    second: str
    safe_distance_m: float
    declared_m_s: float
    fastest_m_s: float
    too_fast_s: float | None
    too_fast_m_s: float | None
    periods: int
    kept_periods: int
    passive_periods: int
    retreating_periods: int
    standing_periods: int
    e_m: float


def beside_moving(trace: Trace) -> list[BesideMoving]:
    """Each robot beside each obstacle that may move."""
    return trace.derived("beside moving", lambda: list(_beside_each(trace)))


def _beside_each(trace: Trace) -> Iterator[BesideMoving]:
    fast, slop = speeds(trace), DISTANCE_TOLERANCE_M / trace.scenario.control.period_s
    for one in beside(trace):
        pair, of_body = one.pair, fast.get(one.pair.second, np.zeros(1))
        over = np.flatnonzero(of_body > pair.speed_m_s + slop)
        yield BesideMoving(
            pair.first, pair.second, pair.required_m, pair.speed_m_s, float(of_body.max()),
            float(trace.t[period_ends(trace)[over[0]]]) if len(over) else None,
            float(of_body[over[0]]) if len(over) else None,
            len(one.row), int(one.kept.sum()), int(one.passive.sum()), int(one.retreated.sum()), int(one.stood.sum()),
            float(one.missed_m.max(initial=0.0)),
        )  # fmt: skip


def samples_before(trace: Trace) -> Indices:
    """The row of the last control sample at or before the beginning of each segment between rows, (T - 1,)."""
    samples = trace.sample_rows
    return samples[np.searchsorted(samples, np.arange(len(trace.t) - 1), side="right") - 1]


def steps_of(trace: Trace, robot: str) -> Array:
    """How far from its place at the control sample a robot's body gets in each segment between rows, (T - 1,), m."""

    def found() -> Array:
        place, sample = trace.body(robot), trace.body(robot)[samples_before(trace)]
        ends = [np.linalg.norm(each - sample, axis=1) for each in (place[:-1], place[1:])]
        return np.asarray(np.max(ends, axis=0) + off_m_of(trace, robot))

    return trace.derived(("steps", robot), found)


def own_margins(trace: Trace, pair: Pair, robot: str) -> Array:
    """What a robot left of min(D, L) - c by its own doing, for the T - 1 segments between rows, (T - 1,), m.

    The other body is held where it was at the control sample. D is the distance of the steered points then, L what the
    law keeps, V h included, and c how far both bodies may be from the steered points. Bodies that are nearer than D - c
    already, as when an obstacle appears beside a robot that lags, may stay so. inf: the two were too far apart
    for one period to matter, or not both there.
    """
    other, rows = pair.second if robot == pair.first else pair.first, np.arange(len(trace.t) - 1)
    sample = samples_before(trace)
    cores = cores_of(trace).get(other, Cores.at(np.zeros((1, 3))))
    origin = trace.body(other) if other in trace.robots else origin_of(trace, other)
    place, planar = trace.body(robot), is_planar(trace, robot)
    origin = np.zeros_like(place) if origin is None else origin
    keeps, off_m = pair.keeps_m(trace.scenario.control.period_s) - pair.cover_m, off_m_of(trace, robot)
    last = len(trace.t) - 1 if pair.last is None else pair.last
    step = steps_of(trace, robot)
    bounds = apart_by_blocks(cores, place - origin).min(axis=1)
    each = cores.take(np.flatnonzero(bounds <= keeps + step.max())).take((slice(None), None))
    found = np.full(len(rows), np.inf)
    if not len(each.base):
        return found
    at_sample = away_from(each, place[sample] - origin[sample], planar=planar).distance.min(axis=0)
    near = (at_sample <= keeps + step) & (sample >= pair.row) & (rows < last)
    start, end = (place[rows[near] + k] - origin[sample[near]] for k in (0, 1))
    least = least_distances(each, start, end, planar=planar)[0].min(axis=0, initial=np.inf) - off_m
    steered = _steered(trace, pair, robot, each, sample[near]) - pair.cover_m
    found[near] = least - np.minimum(np.minimum(steered, at_sample[near]), keeps)
    for k in np.flatnonzero(found < 0.0).tolist() if off_m else ():
        parts = min(ceil((off_m / BENT_M) ** 0.5), MOST_PARTS)
        fine = bent(trace, robot, k, np.linspace(0.0, 1.0, parts + 1)) - origin[sample[k]]
        exact = least_distances(each, fine[:-1], fine[1:], planar=planar)[0].min() - off_m / parts**2
        found[k] += float(exact) - float(least[np.count_nonzero(near[:k])])
    return found


def _steered(trace: Trace, pair: Pair, robot: str, each: Cores, rows: Indices) -> Array:
    """Distances of the steered points of a pair, or of one from the cores of an obstacle, at some rows, m."""
    other = pair.second if robot == pair.first else pair.first
    origin = trace.position(other) if other in trace.robots else origin_of(trace, other)
    place = trace.position(robot)[rows]
    away = away_from(each, place if origin is None else place - origin[rows], planar=is_planar(trace, robot))
    return np.asarray(away.distance.min(axis=0))


class Encounter(NamedTuple):
    """How an obstacle that may move came nearer to a robot than required.

    Attributes:
        first: the robot.
        second: the obstacle.
        required_m: gap to keep.
        gap_m: the least gap; 0 where they overlap.
        t_s: when they collided, or else when the gap was least.
        collided: whether they did; the model lets both go on.
        own_doing: whether the robot brought itself too near at any time.
        appeared: whether the obstacle appeared there.
        reaction: what the robot did then: `retreated at its limit`, `retreated`, `stood` or `moved aside`.
        speed_m_s: of the robot then.
        blocked_by: the bodies whose inequalities kept it from retreating.
        caught_s: from when to when they did, without a pause; () if never.
    """

    first: str
    second: str
    required_m: float
    gap_m: float
    t_s: float
    collided: bool
    own_doing: bool
    appeared: bool
    reaction: str
    speed_m_s: float
    blocked_by: list[str]
    caught_s: list[float]

    def told(self) -> str:
        """Whose doing it was, in a sentence without a full stop."""
        if self.appeared:
            return f"{self.second} appeared {self.gap_m:.2f} m from {self.first}: nobody's doing"
        if self.own_doing:
            return f"{self.first} brought itself to {self.gap_m:.2f} m from {self.second}"
        if self.t_s == 0.0:
            return f"{self.first} starts {self.gap_m:.2f} m from {self.second}: nobody's doing"
        speed = f", {self.speed_m_s:.2f} m/s" if self.reaction.startswith("retreated") else ""
        blocked = f", blocked by {' and '.join(self.blocked_by)}" if self.blocked_by else ""
        came = f"{self.second} came to {self.gap_m:.2f} m by its own motion"
        return f"{came}; {self.first} {self.reaction}{speed}{blocked}"


def encounters(trace: Trace) -> list[Encounter]:
    """The obstacles that may move that came nearer to a robot than required, by time."""

    def found() -> list[Encounter]:
        near = [least_gap(trace, pair) for pair in _near(trace, passive_pairs(trace))]
        short = [least.pair for least in near if least.margin_m < -DISTANCE_TOLERANCE_M]
        return sorted((_encounter(trace, pair) for pair in short), key=lambda each: each.t_s)

    return trace.derived("encounters", found)


def _near(trace: Trace, pairs: list[Pair]) -> list[Pair]:
    """Those of some pairs that may have come nearer than required."""
    apart, numbers = apart_of(trace), numbers_of(trace)
    return [pair for pair in pairs if apart[numbers[frozenset((pair.first, pair.second))]] <= pair.safe_m]


def _encounter(trace: Trace, pair: Pair) -> Encounter:
    least, gaps, periods = least_gap(trace, pair), gap_over_time(trace, pair), periods_of(trace, pair)
    hits = np.flatnonzero(gaps <= trace.scenario.safe_distance.collision_m)
    t_s = float(trace.t[hits[0]]) if len(hits) else least.t_s
    own = bool(own_margins(trace, pair, pair.first).min(initial=np.inf) < -DISTANCE_TOLERANCE_M)
    before = np.flatnonzero((trace.t[periods.row] < t_s) | (periods.row == pair.row))
    k = int(before[-1])
    given, samples = inequalities_of(trace, pair.first), trace.sample_rows
    number = np.searchsorted(samples, periods.row)
    blocked = [_blocked_by(trace, pair, periods, int(each), given, int(number[each])) for each in before]
    short = pair.required_m - DISTANCE_TOLERANCE_M
    held = [bool(each) and gaps[row] < short for each, row in zip(blocked, periods.row[before], strict=True)]
    end = max((each for each in range(len(held)) if held[each]), default=-1)
    begin = end
    while begin > 0 and held[begin - 1]:
        begin -= 1
    ends = np.append(trace.t[periods.row], t_s)
    caught = [float(ends[begin]), float(min(ends[end + 1], max(t_s, ends[end])))] if end >= 0 else []
    velocity = periods.velocity[k]
    speed, limit = float(np.linalg.norm(velocity)), trace.scenario.robots[pair.first].max_speed_m_s
    away = float(periods.normal[k] @ velocity)
    names = dict.fromkeys(name for each in blocked[begin : end + 1] for name in each) if end >= 0 else {}
    return Encounter(
        pair.first, pair.second, pair.required_m, max(least.gap_m, 0.0), t_s, bool(len(hits)), own,
        at_appearance(trace, least), _reaction(speed, away, limit), speed, [*names], caught,
    )  # fmt: skip


def _reaction(speed: float, away: float, limit: float) -> str:
    """What a robot did, from its speed, how fast that led away from the obstacle, and its limit, m/s."""
    if speed <= STANDING_M_S:
        return "stood"
    if away <= STANDING_M_S:
        return "moved aside"
    return "retreated at its limit" if speed >= limit - AT_LIMIT_M_S else "retreated"


def _blocked_by(trace: Trace, pair: Pair, periods: Periods, k: int, given: Inequalities, sample: int) -> list[str]:
    """The bodies whose inequalities forbid the straight retreat that a robot should make in a period."""
    h, limit = trace.scenario.control.period_s, trace.scenario.robots[pair.first].max_speed_m_s
    wished = min(pair.speed_m_s - (float(periods.apart_m[k]) - pair.law_m) / h, limit)
    if wished <= BLOCKED_M_S:
        return []
    retreat = wished * periods.normal[k]
    of_sample = np.flatnonzero(given.sample == sample)
    missed = given.normal[of_sample] @ retreat < given.bound[of_sample] - BLOCKED_M_S
    parts = parts_of(trace)
    columns = given.column[of_sample[missed]].tolist()
    m = len(parts.owner)
    names = [parts.names[parts.owner[c]] if c < m else trace.robots[c - m] for c in columns]
    return [name for name in dict.fromkeys(names) if name != pair.second]
