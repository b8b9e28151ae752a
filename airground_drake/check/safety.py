"""SAFE-TRACE, SAFE-OWN and SAFE-HYP: distances of a run, who caused them, and hypotheses of the safety theorem.

Beside an obstacle that is expected to move at most at V the passive law is in force: n.v >= -(D - d - V h) / h where
D >= d + V h, else n.v >= 0. It is the other inequality with d + V h in place of d, and without a gain.
"""

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from math import isqrt
from typing import NamedTuple

import numpy as np

from .files import Json
from .plants import MOST_PARTS, STRAIGHT_M, Rows, least_radius_m, only_ahead, own_of, unicycle_of
from .rules import SMALL, Array, Disagreement, Found, close, holds
from .run import Run, column_of
from .scenario import Pair, expected_m_s, has_own_views, written
from .shapes import Away, Part, Shape

FAR_M = 1e-6  # largest error of a distance in floating point, m; pairs that are farther apart need no exact arithmetic


def safe_trace(run: Run) -> Found:
    """SAFE-TRACE: the distance of each pair, the least over its parts, is at least the safe one at all times."""
    # A pair tests the claim if it comes so near that one period at the speed limits could break it, or what the law
    # keeps between the points that it steers.
    margin, least, most = np.inf, 0, 0
    for pair in run.pairs:
        closing = pair.closing_m_s * run.scenario["control"]["period_s"]
        room = pair.cover_m + pair.more_m
        enough = pair.safe_m + max(margin, closing + room + 2.0 * SMALL)
        if run.apart_m[pair.robot, pair.other] - run.bent_m(pair) >= enough:
            continue  # neither the nearest pair nor near enough to count
        of_pair = _least_m(run, pair, enough) - pair.safe_m
        margin, near = min(margin, of_pair), of_pair
        if pair.more_m:
            steered = pair.shape.least_m(run.steered_apart(pair), pair.in_the_law.safe_m + closing + 2.0 * SMALL)
            near = min(near, steered - pair.in_the_law.safe_m)
        least += near - closing < -SMALL
        most += near - closing <= SMALL
    return Found("holds" if margin >= -SMALL else "refuted", float(margin), (least, most))


def _least_m(run: Run, pair: Pair, enough: float) -> float:
    """The least distance of a pair, m, at most `enough`; curved paths are divided where that matters."""
    apart, bent = run.apart(pair), run.bent_m(pair)
    least_m = pair.shape.least_m(apart, enough + bent) - bent
    if not bent or least_m >= pair.safe_m:
        return min(least_m, enough)
    lower = pair.shape.held_m(apart[:-1], apart[:-1], apart[1:], enough + bent)[1] - bent
    too_near = lower < pair.safe_m
    parts = _parts(bent)
    left = bent / parts**2
    least_m = min(enough, float(lower[~too_near].min(initial=np.inf)))
    begin = run.there(pair.other).start
    for k in (step for step in np.argsort(lower).tolist() if too_near[step]):  # skip distant ones
        fine = run.fine(pair.robot, begin + k, parts) - run.fine(pair.other, begin + k, parts)
        least_m = min(least_m, pair.shape.least_m(fine, least_m + left, parts) - left)
    return least_m


def _parts(bent_m: float) -> int:
    """Number of parts of a curved path, so that each is straight."""
    return min(math.ceil(math.sqrt(bent_m / STRAIGHT_M)), MOST_PARTS)


def safe_own(run: Run) -> Found | None:
    """SAFE-OWN: in each period no robot comes nearer than min(D, d + V h) to the other body, held as at the sample."""
    # With plants off the steered point it is min(D, d_law + V h) minus their cost, D the distance of the steered
    # points; bodies that are nearer already may stay so. In segments in which the bodies are nearer than d at an end,
    # it is at least min(D, d), D the distance of the bodies, once they have been d apart. It is asked from row to row,
    # where the robot's way from the sample could lead nearer than d + V h. A period beside an obstacle that may move
    # tests the claim if one at the speed limits could. None: nothing may move, and SAFE-TRACE says the same.
    if not any(map(expected_m_s, run.scenario["obstacles"].values())):
        return None
    period = run.scenario["control"]["period_s"]
    margin = np.inf
    least, most = 0, 0
    rows = np.arange(len(run.t_s) - 1)
    sample = run.sample_row[np.searchsorted(run.sample_row, rows, side="right") - 1]
    ways = {robot: run.body_m[robot] for robot in run.robots}
    bent = {name: w.bent_m() for name, w in run.ways.items()}
    step_m = {robot: np.maximum(*(_lengths(way[ends] - way[sample]) for ends in (rows, rows + 1))) + bent[robot]
              for robot, way in ways.items()}  # fmt: skip
    longest = max(float(step.max()) for step in step_m.values())
    for pair in run.pairs:
        keeps = pair.in_the_law.passive(period).safe_m - pair.cover_m
        keeps = pair.safe_m if pair.error_m and not pair.moves_m_s else keeps
        closing = pair.closing_m_s * period
        there = run.there(pair.other)
        both = rows[there.start : there.stop - 1]
        reach = keeps + closing + 2.0 * (longest + pair.cover_m)
        if run.apart_m[pair.robot, pair.other] > max(reach, pair.safe_m + longest):
            continue
        apart_m = pair.shape.held_m(run.apart(pair), run.apart(pair), run.apart(pair), np.inf)[0]
        kept = apart_m >= pair.safe_m - SMALL  # a pair that starts too near is judged once it has been apart
        too_near = np.logical_or.accumulate(kept)[:-1] & ~(kept[:-1] & kept[1:])
        reach = np.inf if too_near.any() else reach  # the other one may have come from afar
        for robot, other in ((pair.robot, pair.other), (pair.other, pair.robot)):
            if robot in ways:
                held = run.body_m[other][sample[both]]
                at, start, end = (ways[robot][k] - held for k in (sample[both], both, both + 1))
                at_m, least_m = pair.shape.held_m(at, start, end, reach)
                asked = too_near | (at_m <= keeps + step_m[robot][both])
                point = run.position_m[robot][sample[both]] - run.position_m[other][sample[both]]
                steered_m = pair.shape.held_m(point, point, point, np.inf)[0] if pair.cover_m else at_m
                due = np.minimum(np.minimum(steered_m - pair.cover_m, at_m), keeps)
                due = np.where(too_near, np.maximum(due, np.minimum(at_m, pair.safe_m)), due)
                left = least_m - bent[robot] - due
                for k in np.flatnonzero(asked & (left < 0.0)).tolist() if bent[robot] else ():
                    parts = _parts(bent[robot])
                    fine = run.fine(robot, int(both[k]), parts) - held[k]
                    left[k] = pair.shape.least_m(fine, steps=parts) - bent[robot] / parts**2 - due[k]
                margin = min(margin, float(left[asked].min(initial=np.inf)))
        if pair.moves_m_s:
            spare = (steered_m - pair.cover_m - keeps - closing)[sample[both] == both]
            least, most = least + int((spare < -SMALL).sum()), most + int((spare <= SMALL).sum())
    status = "holds" if margin >= -SMALL else "refuted"
    return Found(status, None if margin == np.inf else margin, (least, most))


def _lengths(vectors: Array) -> Array:
    return np.asarray(np.linalg.norm(vectors, axis=1))


def _root(square: Fraction) -> tuple[Fraction, Fraction]:
    """Lower and upper bound of a square root, 2^-160 relative to the denominator apart."""
    numerator = isqrt(square.numerator * square.denominator << 320)
    denominator = square.denominator << 160
    return Fraction(numerator, denominator), Fraction(numerator + 1, denominator)


def _missed_m(
    away: Away, step: list[Fraction], safe: Fraction, share: Fraction, gain: Fraction, point: bool
) -> Fraction:
    """Upper bound of a step's violation of its share of the avoidance inequality, m; at least 0."""
    # gain: A h, at most 1.
    least, most = _root(sum((c * c for c in away.vector), Fraction()))
    if not least:  # the law may take either side of a wall, and beside a point any unit vector
        return share * gain * safe + (_root(sum((c * c for c in step), Fraction()))[1] if point else 0)
    along = sum((c * s for c, s in zip(away.vector, step, strict=True)), Fraction())
    distances = (away.beyond / least, away.beyond / most)
    bounds = [share * (gain * (safe - d) if d <= safe else safe - d) for d in distances]
    return max(Fraction(), max(bounds) - min(along / least, along / most))


def gain_of(scenario: Json, period_s: float) -> Fraction:
    """A h of the decimal numbers as written; a gain above 1 counts as 1, which demands less."""
    return min(written(scenario["control"]["avoidance_gain_1_s"]) * written(period_s), Fraction(1))


class Shortfall(NamedTuple):
    """Violations of a pair's inequalities in one period, m: by the robot, and by the other robot."""

    own: Fraction
    other: Fraction

    @property
    def both(self) -> Fraction:
        return self.own + self.other


def shortfall_m(
    own_m: Array, other_m: Array, pair: Pair, gain: Fraction, last: Fraction = Fraction(1), seen_m: Array | None = None
) -> Fraction:
    """The largest violation of a pair's inequalities at one sample, m per period, in exact arithmetic."""
    # own_m, other_m: (K + 1, 3); seen_m: see `shortfalls_m`
    # gain: A h.
    # last: length of the last period, in periods; its step is extended to a whole one.
    periods = len(own_m) - 1
    lasts = [Fraction(1)] * (periods - 1) + [last]
    missed = shortfalls_m(own_m, other_m, pair, [pair.safe_m] * periods, [gain] * periods, lasts, seen_m)
    return max((shortfall.both for shortfall in missed.values()), default=Fraction())


def shortfalls_m(
    own_m: Array, other_m: Array, pair: Pair, safe_m: Sequence[float], gain: Sequence[Fraction],
    lasts: Sequence[Fraction] = (), seen_m: Array | None = None,
) -> dict[int, Shortfall]:  # fmt: skip
    """Violations of a pair's inequalities, by period, for the periods with a violation."""
    # There is an inequality for each convex part of what is avoided; the largest shortfall counts.
    # own_m, other_m: (K + 1, 3); safe_m, gain: (K,)
    # lasts: divisors of the steps of each period, (K,); by default 1.
    # seen_m: where the robot was measured, (K, 3). Beside an obstacle that may move, one that is safe_m away as
    # measured, less the error, may meet the inequality of that place instead.
    lasts = lasts or [Fraction(1)] * (len(own_m) - 1)
    share, shortfalls = Fraction(pair.share), dict[int, Shortfall]()
    for part, k in _near_periods(pair.shape, own_m, other_m, safe_m, lasts):
        here, there, after, beyond = (
            [Fraction(c) for c in place] for place in (own_m[k], other_m[k], own_m[k + 1], other_m[k + 1])
        )
        ways = part.away([a - b for a, b in zip(here, there, strict=True)])
        given, step = (
            (Fraction(safe_m[k]), share, gain[k], len(part.corners) == 1),
            [a - b for a, b in zip(after, here, strict=True)],
        )
        own, other = min(_missed_m(away, [axis / lasts[k] for axis in step], *given) for away in ways), Fraction()
        if seen_m is not None and own:
            sure = Fraction(safe_m[k]) + Fraction(pair.error_m)
            place = [Fraction(c) - b for c, b in zip(seen_m[k].tolist(), there, strict=True)]
            for away in part.away(place):
                if away.beyond >= sure * _root(sum((c * c for c in away.vector), Fraction()))[1]:
                    own = min(own, _missed_m(away, [axis / lasts[k] for axis in step], sure, *given[1:]))
        if pair.share < 1.0:  # a robot is a point: there is one way
            step = [(a - b) / lasts[k] for a, b in zip(beyond, there, strict=True)]
            other = _missed_m(Away([-c for c in ways[0].vector], ways[0].beyond), step, *given)
        if own + other > (shortfalls[k].both if k in shortfalls else 0):
            shortfalls[k] = Shortfall(own, other)
    return shortfalls


def _near_periods(
    shape: Shape, own_m: Array, other_m: Array, safe_m: Sequence[float], lasts: Sequence[Fraction]
) -> Iterator[tuple[Part, int]]:
    """Convex parts, each with a period in which the two could meet, whatever their direction."""
    # own_m, other_m: (K + 1, 3); safe_m, lasts: (K,)
    reach = np.linalg.norm(np.diff(own_m, axis=0), axis=1) + np.linalg.norm(np.diff(other_m, axis=0), axis=1)
    enough = reach / np.array([float(last) for last in lasts]) + np.asarray(safe_m) + FAR_M
    apart = own_m[:-1] - other_m[:-1]
    for bound, part, rows in shape.near(apart):
        if bound >= enough.max():
            break
        far = part.signed_m(apart[rows]) >= enough[rows]
        for k in (rows.start + np.flatnonzero(~far)).tolist():  # also where it is not a number
            yield part, k


def gain_of_pair(pair: Pair, gain: Fraction) -> Fraction:
    """The gain with which a pair meets the law: half of A h where one of two robots may stand."""
    return gain * Fraction(pair.share) if pair.halved else gain


def measured_shortfall_m(run: Run, law: Pair, rows: Rows, gain: Fraction, last: Fraction) -> Fraction:
    """The largest violation of a pair's inequality with measured positions, m per period."""
    # The steps are true ones. A pair that stands or is far violates nothing.
    samples = np.searchsorted(run.sample_row, rows[:-1])
    own_m, other_m = run.position_m[law.robot][rows], run.position_m[law.other][rows]
    measuring = [law.robot, law.other] if law.other in run.robots and has_own_views(run.scenario) else [law.robot]
    views = [
        (run.seen_m(law.robot, by) - (run.seen_m(law.other, by) if law.other in run.robots else 0.0))[samples]
        for by in measuring
    ]
    own_step, other_step = np.diff(own_m, axis=0), np.diff(other_m, axis=0)
    step, moves = own_step - other_step, np.logical_or(own_step.any(axis=1), other_step.any(axis=1))
    lasts, lacks = [Fraction(1)] * (len(step) - 1) + [last], Fraction()
    for part, k in _near_periods(law.shape, own_m, other_m, [law.safe_m] * len(step), lasts):
        if not moves[k]:
            continue
        gone = [Fraction(axis) / lasts[k] for axis in step[k].tolist()]
        given = gone, Fraction(law.safe_m), Fraction(1), gain, len(part.corners) == 1
        ways = [away for seen in views for away in part.away([Fraction(axis) for axis in seen[k].tolist()])]
        lacks = max(lacks, min(_missed_m(away, *given) for away in ways))
    return lacks


def lost_m(missed: Fraction, gain: Fraction, samples: int) -> float:
    """Bound of the distance that a shortfall can cost, m: e / (A h), or the sum over all samples if the gain is 0."""
    return float(missed / gain if gain else missed * samples)


def safe_hyp(run: Run) -> Found:
    """SAFE-HYP: the hypotheses of the safety theorem, up to e per pair; its margin is the least -e / (A h)."""
    period = run.scenario["control"]["period_s"]
    gain, lost = gain_of(run.scenario, period), 0.0
    try:
        _constants(run)
        _motion(run)
        _without_message(run)
        for pair in run.pairs:
            law = pair.in_the_law
            near = law.safe_m + pair.cover_m + pair.closing_m_s * period + FAR_M
            if pair.asynchronous:
                lost = max(lost, _lost_to_old_positions_m(run, pair, period))
                continue
            if run.apart_m[pair.robot, pair.other] > near:
                continue
            rows = run.period_rows(pair.other)
            own, other = run.position_m[pair.robot][rows], run.position_m[pair.other][rows]
            lasting = float(run.t_s[rows[-1]] - run.t_s[rows[-2]])
            last = Fraction(1) if abs(lasting - period) <= SMALL else Fraction(lasting) / Fraction(period)
            if pair.moves_m_s:
                seen = run.seen_m(pair.robot)[np.searchsorted(run.sample_row, rows[:-1])] if pair.error_m else None
                missed = float(shortfall_m(own, other, law.passive(period), Fraction(), last, seen)) - pair.slip_m
                about = f"{pair.robot}, {pair.other}"
                holds("passive law", missed <= SMALL, missed, "0 m missed", about=about)
            elif pair.error_m or pair.halved:
                lacks = measured_shortfall_m(run, law, rows, gain_of_pair(pair, gain), last)
                lost = max(lost, lost_m(lacks, gain_of_pair(pair, gain), len(run.sample_row)) - pair.drift_m)
            else:
                lacks = shortfall_m(own, other, law, gain, last)
                lost = max(lost, lost_m(lacks, gain, len(run.sample_row)) - pair.drift_m)
    except Disagreement as broken:
        return Found("refuted", because=broken)
    return Found("holds" if lost <= SMALL else "refuted", -lost if lost <= SMALL else None)


def _lost_to_old_positions_m(run: Run, pair: Pair, period_s: float) -> float:
    """The sum of violations of the asynchronous law by two UGVs, m."""
    # A step obeys the law if it ends outside of the other's disc, leads away from all of the disc, or is 0. Violations
    # do not recover. Pairs that stay far need no law.
    ends = np.append(run.sample_row, len(run.t_s) - 1)
    spans = np.diff(run.t_s[ends])
    longest, lost, too_far = max(float(spans.max()), period_s), Fraction(), True
    for robot, other in ((pair.robot, pair.other), (pair.other, pair.robot)):
        heard_s, way = column_of(run.samples, f"{robot}.heard_{other}_s"), run.position_m[robot][ends]
        k = np.searchsorted(run.sample_s, heard_s - SMALL).clip(0, len(heard_s) - 1)
        sent = (np.abs(run.sample_s[k] - heard_s) <= SMALL) & (k <= np.arange(len(k)))
        about = f"{robot}, {other}"
        holds("position heard before", sent, heard_s, "a control sample so far", about=about, t_s=run.sample_s)
        there, steps = run.position_m[other][ends], np.diff(way, axis=0)
        speed = max(float((_lengths(np.diff(there, axis=0)) / spans).max()), float(run.robots[other]["max_speed_m_s"]))
        steps[-1] *= max(1.0, period_s / float(spans[-1])) if abs(spans[-1] - period_s) > SMALL else 1.0
        age = run.t_s[ends[:-1]] - run.t_s[ends[:-1]][k]
        radius, apart = speed * (age + longest), way[:-1] - there[:-1][k]
        too_far &= run.apart_m[pair.robot, pair.other] > pair.safe_m + float(radius.max()) + 2.0 * speed * longest
        after = _lengths(apart) + (apart * steps).sum(axis=1) / np.maximum(_lengths(apart), FAR_M)
        doubtful = ~((_lengths(apart) > radius + pair.safe_m + FAR_M) & (after > radius + pair.safe_m + FAR_M))
        for i in np.flatnonzero(doubtful & steps.any(axis=1)).tolist():
            lost += _missed_towards_old_m(apart[i], steps[i], Fraction(float(radius[i])), Fraction(pair.safe_m))
    return 0.0 if too_far else float(lost)


def _missed_towards_old_m(apart: Array, step: Array, radius: Fraction, safe: Fraction) -> Fraction:
    """The violation by one step, m: of the distance to the disc, or of the cone away from it."""
    away, gone = ([Fraction(axis) for axis in vector.tolist()] for vector in (apart, step))
    inner = sum((a * b for a, b in zip(away, gone, strict=True)), Fraction())
    square = sum((a * a for a in away), Fraction())
    turning = _root(sum((b * b for b in gone), Fraction()))[1] * radius - inner
    least = 2 * max(turning, Fraction()) / safe  # half of the distance is kept in any case
    low, high = _root(square)
    if low >= safe + radius:
        least = min(least, max(safe + radius - min((square + inner) / low, (square + inner) / high), Fraction()))
    return least


def _constants(run: Run) -> None:
    """A h <= 1, each pair without the passive law starts apart, and the sensing range covers d + (closing speed) h."""
    control = run.scenario["control"]
    limit = {name: robot["max_speed_m_s"] for name, robot in run.robots.items()}
    period, reach = written(control["period_s"]), written(control["sensing_range_m"])
    gain = written(control["avoidance_gain_1_s"]) * period
    holds("gain: A h <= 1", gain <= 1, float(gain), "1 at most")
    for pair in (pair.in_the_law for pair in run.pairs):
        about = f"{pair.robot}, {pair.other}"
        speed = written(limit[pair.robot]) + written(limit.get(pair.other, pair.moves_m_s))
        least = written(pair.safe_m) + speed * period + written(pair.error_m)
        holds("sensing range", reach >= least, float(reach), f"{float(least)} at least", about=about)
        start = np.inf if pair.moves_m_s else pair.shape.least_m(run.steered_apart(pair)[:1])
        holds("safe start", start >= pair.safe_m - SMALL, start, f"{pair.safe_m} at least", about=about)
        if pair.error_m and not pair.moves_m_s:
            kept = pair.safe_m - pair.error_m - pair.drift_m
            bears = float(gain_of_pair(pair, gain)) * (pair.error_m + kept) - pair.error_m
            holds("gain for errors", bears >= -SMALL, bears, "0 m at least", about=about)
        if pair.start_s is not None:
            required = pair.safe_m - pair.more_m
            start = _first_m(run, pair, required)
            holds("safe start of the bodies", start >= required - SMALL, start, f"{required} at least", about=about)


def _first_m(run: Run, pair: Pair, most_m: float) -> float:
    """The least distance of a pair's bodies when both first exist, and under commands given before, `most_m` at most.

    What is farther is not searched: rows in which a body rests, or turns about one point, are equally near.
    """
    rows, bent = run.there(pair.other), run.bent_m(pair)
    many = int(np.searchsorted(run.t_s[rows], run.t_s[rows.start] + pair.start_s - SMALL)) + 1
    apart = run.apart(pair)[:many]
    if len(apart) < 2 or not bent:
        return pair.shape.least_m(apart, most_m)
    parts = _parts(bent)
    off = bent / parts**2
    least = most_m + off
    for k in range(rows.start, rows.start + len(apart) - 1):
        way = run.fine(pair.robot, k, parts) - run.fine(pair.other, k, parts)
        least = pair.shape.least_m(way, least, steps=parts)
    return least - off


def _rolled_m(run: Run, robot: str) -> Array:
    """Forward motion of a unicycle from row to row, m; negative if it drove backwards."""
    way = run.ways[robot]
    assert way.heading_rad is not None
    middle = 0.5 * (way.heading_rad[1:] + way.heading_rad[:-1])
    step = np.diff(way.place_m, axis=0)
    return np.asarray(step[:, 0] * np.cos(middle) + step[:, 1] * np.sin(middle))


def _chord_rad(run: Run, robot: str) -> Array:
    """2 sin(turn / 2) from row to row: the chord of an arc over its radius."""
    heading = run.ways[robot].heading_rad
    assert heading is not None
    return np.asarray(2.0 * np.abs(np.sin(0.5 * np.diff(heading))))


def _motion(run: Run) -> None:
    """Robots and obstacles keep their speed limits, and UGVs their height; straight motion is the law of motion."""
    for robot, spec in run.robots.items():
        place = run.position_m[robot]
        drive = unicycle_of(spec)
        if drive and only_ahead(drive):
            holds("never backwards", _rolled_m(run, robot) >= -SMALL, _rolled_m(run, robot), "0 at least", about=robot)
            spare = _rolled_m(run, robot) - least_radius_m(drive) * _chord_rad(run, robot)
            holds("least turning radius", spare >= -SMALL, spare, "0 m at least to spare", about=robot)
        if own := own_of(spec):
            for key, unit in (("drift_m_s", "m/s"), ("cover_m", "m")):
                speeds = column_of(run.samples, f"{robot}.{key}")
                about = f"{own[key]} {unit} at most"
                holds(f"declared {key}", speeds <= own[key] + SMALL, speeds, about, about=robot, t_s=run.sample_s)
        speed = np.linalg.norm(run.sampled(robot, "v", "m_s"), axis=1)
        slow = speed <= spec["max_speed_m_s"] + SMALL
        most = f"{spec['max_speed_m_s']} at most"
        holds("speed limit", slow, speed, most, about=robot, t_s=run.sample_s)
        if run.error_m:
            for by in run.robots if has_own_views(run.scenario) else (robot,):
                off = np.linalg.norm(run.seen_m(robot, by) - place[run.sample_row], axis=1)
                most, about = f"{run.error_m} m at most", robot if by == robot else f"{robot} by {by}"
                holds("error of the measured position", off <= run.error_m, off, most, about=about, t_s=run.sample_s)
        elif run.links["delay_s"]:
            seen = run.seen_m(robot)
            close("announced position", seen, place[run.sample_row], within=SMALL, about=robot, t_s=run.sample_s)
        if robot in run.ugvs:
            close("planar motion", place[:, 2], np.full(len(place), place[0, 2]), within=0.0, about=robot, t_s=run.t_s)
    for name in run.moving:
        rows = run.period_rows(name)
        expected = expected_m_s(run.scenario["obstacles"][name])
        speed = np.linalg.norm(np.diff(run.position_m[name][rows], axis=0), axis=1) / np.diff(run.t_s[rows])
        slow = speed <= expected + SMALL / run.scenario["control"]["period_s"]
        holds("declared speed", slow, speed, f"{expected} at most", about=name, t_s=run.t_s[rows[:-1]])


def _without_message(run: Run) -> None:
    """A UGV that misses another one's message at a sample stands, unless it knows that the other one is far."""
    if not run.links["loss"]:
        return
    period_s = float(run.scenario["control"]["period_s"])
    for pair in (pair.in_the_law for pair in run.pairs if pair.robot in run.ugvs and pair.other in run.ugvs):
        for robot, other in ((pair.robot, pair.other), (pair.other, pair.robot)):
            heard_s = column_of(run.samples, f"{robot}.heard_{other}_s")
            sample = np.searchsorted(run.sample_s, heard_s - SMALL).clip(0, len(heard_s) - 1)
            apart_m = np.linalg.norm(run.seen_m(robot) - run.seen_m(other)[sample], axis=1)
            fastest = [run.robots[name]["max_speed_m_s"] for name in (robot, other)]
            least_m = pair.safe_m + 2.0 * run.error_m + sum(fastest) * period_s
            far = apart_m - fastest[1] * (run.sample_s - heard_s) >= least_m - SMALL
            way_m = period_s * np.linalg.norm(run.sampled(robot, "v", "m_s"), axis=1)
            knows = (np.abs(heard_s - run.sample_s) <= SMALL) | (far & (heard_s < run.sample_s))
            about = f"{robot}, {other}"
            stands = knows | (way_m <= SMALL)
            holds("standing without a message", stands, way_m, "0 m in a period", about=about, t_s=run.sample_s)
