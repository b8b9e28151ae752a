"""The cause of each approach closer than required.

The other body is held at its position of the control sample: then any loss of distance is due to the robot's own
motion. For a body off its steered point the law promises less, by the cover of lags, delays and hand points. A loss
within this cover is due to earlier commands.
"""

from math import ceil
from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array, Indices
from airground_drake.sim.trace import Trace, per_trace
from airground_drake.verify.engines.outlines import apart_by_blocks, away_from, least_distances, over_time
from airground_drake.verify.runs.control_law import Inequalities, avoided, inequalities_of
from airground_drake.verify.runs.pairs import (
    BENT_M,
    CENTRE,
    DISTANCE_TOLERANCE_M,
    MOST_PARTS,
    Gap,
    Pair,
    apart_of,
    bent,
    bounds_of,
    cores_of,
    gap_over_time,
    is_planar,
    least_gap,
    off_m_of,
    origin_of,
    pairs_of,
    steered,
)
from airground_drake.verify.runs.passive import AT_LIMIT_M_S, STANDING_M_S, Periods, periods_of

SHOWN_M_S = 0.005  # a sentence shows a smaller speed as 0.00 m/s: the robot stood
BLOCKED_M_S = 1e-6  # an inequality blocks a retreat if the retreat would miss it by more than this, m/s


def samples_before(trace: Trace) -> Indices:
    """The row of the last control sample at or before the beginning of each segment between rows, (T - 1,)."""
    samples = trace.sample_rows
    return samples[np.searchsorted(samples, np.arange(len(trace.t) - 1), side="right") - 1]


@per_trace
def steps_of(trace: Trace, robot: str) -> Array:
    """Largest distance of a robot's body from its position at the control sample, by segment, (T - 1,), m."""
    place, sample = trace.body(robot), trace.body(robot)[samples_before(trace)]
    begun, ended = (np.linalg.norm(at - sample, axis=1) for at in (place[:-1], place[1:]))
    return np.asarray(np.maximum(begun, ended) + off_m_of(trace, robot))


class OwnMargins(NamedTuple):
    """A robot's margins to a required distance by its own motion, in the segments between rows, (T - 1,), m."""

    # inf: the two were too far apart for one period to matter, or one was absent.

    # Of min(D, L) - c, which the theorem promises. D is the distance of the steered points at the control sample, L
    # what the law keeps, V h included, and c how far both bodies may be from the steered points. Bodies that are nearer
    # than D - c already may stay so.
    of_law: Array
    # Of min(D, d) where the gap is below the required one: D of the bodies at the sample, d the distance to keep. Only
    # c lets it fall below the margin of the law. Where two bodies start or appear too near, it applies only after they
    # have been apart.
    of_body: Array

    @property
    def least(self) -> Array:
        """The smaller of both, (T - 1,), m."""
        return np.minimum(self.of_law, self.of_body)


def own_margins(trace: Trace, pair: Pair, robot: str) -> OwnMargins:
    """A robot's margins by its own motion, with the other body held at its position of the control sample."""
    other = pair.other(robot)
    rows = np.arange(len(trace.t) - 1)
    sample = samples_before(trace)
    cores = cores_of(trace).get(other, CENTRE)
    place = trace.body(robot)
    origin = origin_of(trace, other)
    planar = is_planar(trace, robot)
    keeps = pair.keeps_m(trace.scenario.control.period_s) - pair.cover_m
    off_m = off_m_of(trace, robot)
    step = steps_of(trace, robot)
    bounds = apart_by_blocks(cores, place - origin).min(axis=1)
    beside = cores.take(np.flatnonzero(bounds <= max(keeps, pair.safe_m) + step.max())).take((slice(None), None))
    margins = OwnMargins(np.full(len(rows), np.inf), np.full(len(rows), np.inf))
    if not len(beside.base):
        return margins
    at_sample = away_from(beside, place[sample] - origin[sample], planar=planar).distance.min(axis=0)
    there = (sample >= pair.row) & (rows < pair.last)
    gaps = gap_over_time(trace, pair)
    short = pair.required_m - DISTANCE_TOLERANCE_M
    broken = there & (rows >= _first_apart(pair, gaps)) & (np.minimum(gaps[:-1], gaps[1:]) < short)
    near = there & ((at_sample <= keeps + step) | broken)
    start, end = (place[rows[near] + k] - origin[sample[near]] for k in (0, 1))
    least = least_distances(beside, start, end, planar=planar)[0].min(axis=0, initial=np.inf) - off_m
    points = (trace.position(robot) - steered(trace, other))[sample[near]]
    of_points = away_from(beside, points, planar=planar).distance.min(axis=0) - pair.cover_m
    of_law = np.minimum(np.minimum(of_points, at_sample[near]), keeps)
    of_body = np.where(broken[near], np.minimum(at_sample[near], pair.safe_m), -np.inf)
    due = np.maximum(of_law, of_body)
    for k in np.flatnonzero(least < due).tolist() if off_m else ():
        row = int(rows[near][k])
        parts = min(ceil((off_m / BENT_M) ** 0.5), MOST_PARTS)
        fine = bent(trace, robot, row, np.linspace(0.0, 1.0, parts + 1)) - origin[sample[row]]
        least[k] = least_distances(beside, fine[:-1], fine[1:], planar=planar)[0].min() - off_m / parts**2
    margins.of_law[near], margins.of_body[near] = least - of_law, least - of_body
    return margins


def _first_apart(pair: Pair, gaps: Array) -> int:
    """The first row at which an existing pair has its distance; without one, the number of rows."""
    apart = np.flatnonzero(gaps[pair.row :] >= pair.required_m - DISTANCE_TOLERANCE_M)
    return pair.row + int(apart[0]) if len(apart) else len(gaps)


class Encounter(NamedTuple):
    """How two bodies came nearer to each other than required."""

    first: str  # the robot
    second: str  # the obstacle or the other robot
    required_m: float  # gap to keep
    gap_m: float  # the least gap; 0 where they overlap
    t_s: float  # time of the collision, or else of the least gap
    collided: bool  # whether they collided; in the model both go on
    # `robot` if a robot's own motion reduced the distance; `under way` if it did so only within the law's allowance for
    # a body with a lag or delay, and `both` if an obstacle moved meanwhile; `other` if only the other body's motion
    # reduced it; `nobody` if they started or appeared there.
    doing: str
    # How far a body with a lag or delay drove on, from its last place at the required distance, or from its place when
    # the other appeared, to the least gap; 0 unless this is the cause, or the other appeared.
    under_way_m: float
    appeared: bool  # whether the obstacle appeared nearer than required
    # The robot's action beside an obstacle that may move: `retreated at its limit`, `retreated`, `stood` or `moved
    # aside`; '' beside others.
    reaction: str = ""
    speed_m_s: float = 0.0  # speed of the robot's command then
    blocked_by: tuple[str, ...] = ()  # the bodies whose inequalities kept it from retreating
    caught_s: tuple[float, ...] = ()  # first and last time without a pause in which they did; () if never

    def cause(self, trace: Trace) -> str:
        """The cause, as a sentence without a full stop."""
        if self.doing in ("under way", "both"):
            drove = f"{self.first} drove {self.under_way_m:.2f} m on by commands under way"
            moved = ", which moved, too" if self.doing == "both" else ""
            return f"{drove}, to {self.gap_m:.2f} m from {self.second}{moved}"
        if self.doing == "robot":
            return f"{self.first} moved to {self.gap_m:.2f} m from {self.second}"
        if self.doing == "nobody" and self.appeared:
            t_s = trace.t[trace.there_from(self.second)]
            appeared = f"{self.second} appeared at {t_s:.9g} s too near to {self.first}: not caused by motion"
            if not self.under_way_m:
                return appeared
            return f"{appeared}; {self.first} drove {self.under_way_m:.2f} m on by commands under way"
        if self.doing == "nobody":
            return f"{self.first} starts {self.gap_m:.2f} m from {self.second}: not caused by motion"
        speed = f", {self.speed_m_s:.2f} m/s" if self.reaction.startswith("retreated") else ""
        blocked = f", blocked by {' and '.join(self.blocked_by)}" if self.blocked_by else ""
        came = f"{self.second} came to {self.gap_m:.2f} m by its own motion"
        return f"{came}; {self.first} {self.reaction}{speed}{blocked}"


@per_trace
def encounters(trace: Trace) -> list[Encounter]:
    """The pairs that came nearer to each other than required, by time."""
    pairs = zip(pairs_of(trace), apart_of(trace).tolist(), strict=True)
    least = [least_gap(trace, pair) for pair, apart_m in pairs if apart_m <= pair.safe_m]
    short = [gap for gap in least if gap.margin_m < -DISTANCE_TOLERANCE_M]
    return sorted((_encounter(trace, gap) for gap in short), key=lambda encounter: encounter.t_s)


def _encounter(trace: Trace, least: Gap) -> Encounter:
    pair, gaps = least.pair, gap_over_time(trace, least.pair)
    hits = np.flatnonzero(gaps <= trace.scenario.safe_distance.collision_m)
    t_s = float(trace.t[hits[0]]) if len(hits) else least.t_s
    appeared = pair.row > 0 and bool(gaps[pair.row] < pair.required_m - DISTANCE_TOLERANCE_M)
    doing = _whose_doing(trace, least)
    since = _too_near(trace, pair, gaps, least.t_s)
    moved = pair.second not in trace.robots and bool(np.ptp(origin_of(trace, pair.second)[since], axis=0).any())
    doing = "both" if doing == "under way" and moved else doing
    drove_on = doing in ("under way", "both") or (doing == "nobody" and appeared and bounds_of(trace)[pair.first].late)
    legs = np.diff(trace.body(pair.first)[since], axis=0)
    under_way_m = float(np.linalg.norm(legs, axis=1).sum()) if drove_on else 0.0
    encounter = Encounter(
        first=pair.first, second=pair.second, required_m=pair.required_m, gap_m=max(least.gap_m, 0.0), t_s=t_s,
        collided=bool(len(hits)), doing=doing, under_way_m=under_way_m, appeared=appeared,
    )  # fmt: skip
    return _with_reaction(trace, pair, gaps, encounter) if pair.speed_m_s > 0.0 else encounter


def _whose_doing(trace: Trace, least: Gap) -> str:
    pair = least.pair
    robots = [name for name in (pair.first, pair.second) if name in trace.robots]
    own = {robot: own_margins(trace, pair, robot) for robot in robots}
    if any(margins.of_law.min(initial=np.inf) < -DISTANCE_TOLERANCE_M for margins in own.values()):
        return "robot"
    taking = [robot for robot in robots if own[robot].of_body.min(initial=np.inf) < -DISTANCE_TOLERANCE_M]
    if taking:
        late = any(bounds_of(trace)[robot].late for robot in taking)
        return "robot" if not late or any(_steered_nearer(trace, pair, robot) for robot in taking) else "under way"
    if least.row <= _first_apart(pair, gap_over_time(trace, pair)):
        return "nobody"
    moved = np.ptp(origin_of(trace, pair.second)[pair.rows], axis=0).any()
    return "other" if moved and pair.second not in trace.robots else "robot"


def _steered_nearer(trace: Trace, pair: Pair, robot: str) -> bool:
    """Whether commands led a robot's steered point closer than the law allows (the body follows later)."""
    rows = trace.sample_rows[(trace.sample_rows >= pair.row) & (trace.sample_rows <= pair.last)]
    place, origin = trace.position(robot), steered(trace, pair.other(robot))[rows[:-1]]
    cores, planar = cores_of(trace).get(pair.other(robot), CENTRE), is_planar(trace, robot)
    before, after = (over_time(cores, place[at] - origin, planar=planar) for at in (rows[:-1], rows[1:]))
    keeps_m = pair.keeps_m(trace.scenario.control.period_s)
    return bool((after < np.minimum(before, keeps_m) - DISTANCE_TOLERANCE_M).any())


def _too_near(trace: Trace, pair: Pair, gaps: Array, t_s: float) -> slice:
    """The rows from the last one with the required gap up to a time."""
    end = min(int(np.searchsorted(trace.t, t_s)), len(trace.t) - 1)
    apart = np.flatnonzero(gaps[pair.row : end] >= pair.required_m - DISTANCE_TOLERANCE_M)
    return slice(pair.row + (int(apart[-1]) if len(apart) else 0), end + 1)


def _with_reaction(trace: Trace, pair: Pair, gaps: Array, encounter: Encounter) -> Encounter:
    """An encounter with the robot's reaction to an obstacle that may move, and what limited it."""
    periods, t_s = periods_of(trace, pair), encounter.t_s
    before = np.flatnonzero((trace.t[periods.row] < t_s) | (periods.row == pair.row))
    k = int(before[-1])
    given = inequalities_of(trace, pair.first)
    number = np.searchsorted(trace.sample_rows, periods.row)
    blocked = [_blocked_by(trace, pair, periods, period, given, int(number[period])) for period in before.tolist()]
    short = gaps[periods.row[before]] < pair.required_m - DISTANCE_TOLERANCE_M
    held = np.array([bool(names) for names in blocked]) & short
    caught: tuple[float, ...] = ()
    names = dict[str, None]()
    if held.any():
        end = int(np.flatnonzero(held)[-1])
        # after the last period before in which it was free
        begin = int(np.flatnonzero(~np.append(False, held[:end]))[-1])
        ends = np.append(trace.t[periods.row], t_s)
        caught = float(ends[begin]), float(min(ends[end + 1], max(t_s, ends[end])))
        names = dict.fromkeys(name for of_period in blocked[begin : end + 1] for name in of_period)
    velocity = periods.velocity[k]
    speed = float(np.linalg.norm(velocity))
    limit = trace.scenario.robots[pair.first].max_speed_m_s
    away = float(periods.normal[k] @ velocity)
    return encounter._replace(
        reaction=_reaction(speed, away, limit), speed_m_s=speed, blocked_by=(*names,), caught_s=caught
    )


def _reaction(speed: float, away: float, limit: float) -> str:
    """A robot's reaction in words, from its speed, its speed away from the obstacle, and its limit, m/s."""
    if speed < SHOWN_M_S:
        return "stood"
    if away <= STANDING_M_S:
        return "moved aside"
    return "retreated at its limit" if speed >= limit - AT_LIMIT_M_S else "retreated"


def _blocked_by(trace: Trace, pair: Pair, periods: Periods, k: int, given: Inequalities, sample: int) -> list[str]:
    """The bodies whose inequalities forbid a robot's straight retreat in a period."""
    h = trace.scenario.control.period_s
    limit = trace.scenario.robots[pair.first].max_speed_m_s
    wished = min(pair.speed_m_s - (float(periods.apart_m[k]) - pair.law_m) / h, limit)
    if wished <= BLOCKED_M_S:
        return []
    retreat = wished * periods.normal[k]
    of_sample = np.flatnonzero(given.sample == sample)
    missed = given.normal[of_sample] @ retreat < given.bound[of_sample] - BLOCKED_M_S
    bodies = avoided(trace)
    names = dict.fromkeys(bodies[column] for column in given.column[of_sample[missed]].tolist())
    return [name for name in names if name != pair.second]
