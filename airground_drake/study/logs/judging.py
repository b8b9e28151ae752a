"""Judges tracks by a scenario: distances, and the avoidance law in each interval.

Motion between two samples is assumed to be straight; gaps of a track are not judged. An interval is the time between
two sampling instants of a pair. The law is written with steps instead of velocities, with each interval's own length h:

    n.(own step - other's step) >= A h (d - D) if D <= d, else >= d - D.

If interval k violates it by e_k, the deficit below d obeys deficit <= (1 - A h) deficit + e_k, by the induction of the
safety theorem.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import LogError
from airground_drake.check.files import Json
from airground_drake.check.rules import SMALL
from airground_drake.check.safety import shortfalls_m
from airground_drake.check.scenario import (
    Pair,
    barriers_of,
    expected_m_s,
    is_asynchronous,
    pairs_of,
    places_of,
    robots_of,
    uavs_of,
    written,
)
from airground_drake.check.shapes import Shape
from airground_drake.study.logs.tracks import Span, Track, Tracks, height_m, joint

# Whether a distance was kept where the log covers it; open: the position error decides.
KEPT, BROKEN, OPEN = "kept", "NOT KEPT", "open"
LAST_S = 1.0  # time before the least distance over which approaches are attributed to bodies, s
STEPS = 100  # number of parts of that time in which both motions are separated
STAMP_S = 2e-9  # accuracy of the time between two stamps
AT_ONCE = 2000  # differences of places whose distances are computed in one go
HALVINGS = 60  # halvings of an interval in the search for a time
# Share of a scenario's duration that a log may lack to cover all of it: two intervals, but no more than this. A body
# may begin later than the log, or end earlier, by no more, either.
MOST_SPARE = 0.05
# Robots that are always farther from their starts, and from obstacles, than so many times the scenario's size are in
# another frame.
FAR = 3.0
NOT_JUDGED = (
    "motion between two samples: it is taken as straight",
    "places of obstacles at rest, walls and maps: the scenario's are taken",
    "triggers, proposals, decisions, commands and arrivals",
)


# With `control.law: asynchronous`.
NOT_JUDGED_OF_OLD = "what UGVs had heard of each other: the law judged between two UGVs is the shared one, not theirs"


class JudgedPair(NamedTuple):
    """The results for a pair; distances are between surfaces, below 0 they overlap."""

    first: str  # a robot
    second: str  # an obstacle, or another robot
    safe_m: float  # distance to be kept
    least_m: float  # least distance of the positions in the log, over all covered times
    at_s: float  # when
    error_m: float  # sum of both position errors: true distances differ from the log's by no more
    below_s: list[Span]  # stretches in which the log's distance is below `safe_m`
    covered_s: float  # time for which both were recorded
    gaps_s: list[Span]  # stretches within the log in which one of them was not recorded
    intervals: int  # number of intervals in which the law was judged
    lacking: int  # number of intervals that violate it
    missed_m: float  # e, the largest violation in an interval, m
    missed_at_s: float  # when that interval begins
    missed_for_s: float  # its length
    missed_by_m: dict[str, float]  # each robot's violation of its share in that interval, m
    # Least distance at the beginning of a stretch: of the log, after a gap, or when an obstacle appears.
    starts_m: float
    starts_s: float  # when that stretch begins
    # "Safety" or, beside a moving obstacle, "Passive": it guarantees that the robot itself does not break the distance.
    theorem: str
    too_fast_m_s: float  # largest speed of an obstacle above the declared one; 0 if it kept that
    # Distance of the true bodies that follows from the theorem; None if not above 0, or for Passive.
    promised_m: float | None
    # Distance that a law must keep with such position errors so that the true bodies keep `safe_m`: the theorem of the
    # distance budget, eps + sqrt(d^2 + eps^2) between centres, for A h = 1.
    law_m: float
    came_m: dict[str, float]  # by how much each came nearer to the other in the last second before the least distance

    @property
    def status(self) -> str:
        """One of KEPT, BROKEN and OPEN; to 1e-9 m."""
        if self.least_m - self.error_m >= self.safe_m - SMALL:
            return KEPT
        return BROKEN if self.least_m + self.error_m < self.safe_m - SMALL else OPEN

    @property
    def margin_m(self) -> float:
        """The least distance minus the required one."""
        return self.least_m - self.safe_m

    @property
    def hypotheses(self) -> dict[str, bool]:
        """Hypotheses of the theorem, and whether they held."""
        obeys = {"obeys the avoidance law in every interval": self.missed_m <= SMALL}
        if self.passive:
            return obeys | {"the obstacle keeps its declared speed": self.too_fast_m_s == 0.0}
        return {"starts at the distance or farther": self.starts_m >= self.safe_m - SMALL} | obeys

    @property
    def passive(self) -> bool:
        """Whether the other body is an obstacle that may move."""
        return self.theorem == "Passive"


class Judged(NamedTuple):
    """The results for a log."""

    pairs: list[JudgedPair]  # the least margin first
    begin_s: float  # first time in the log
    end_s: float  # last one
    duration_s: float  # of the scenario
    longest_s: float  # longest interval with interpolated motion
    usual_s: float  # longest of the bodies' usual times between two samples
    stray_m: float  # how far a robot can be from that straight line at its speed limit
    speeds_m_s: dict[str, tuple[float, float]]  # largest speed of each robot in the log, and its limit
    away_m: dict[str, float]  # distance of each start in the log from that in the scenario; none of late bodies
    is_far: bool  # whether all robots start far from the scenario
    by_scenario: bool  # whether distances to obstacles at rest are judged, whose places are the scenario's
    not_judged: tuple[str, ...]

    @property
    def status(self) -> str:
        """The worst of the pairs."""
        statuses = {pair.status for pair in self.pairs}
        return next((status for status in (BROKEN, OPEN) if status in statuses), KEPT)

    @property
    def covers_all(self) -> bool:
        """Whether no pair has a gap, and the log is as long as the scenario, but for one interval at either end."""
        spare_s = min(2.0 * self.usual_s, MOST_SPARE * self.duration_s)
        lasts = self.end_s - self.begin_s >= self.duration_s - spare_s - SMALL
        return lasts and not any(pair.gaps_s for pair in self.pairs)


def judge(tracks: Tracks, scenario: Json, errors_m: Mapping[str, float] | None = None) -> Judged:
    # errors_m: by how much a body's recorded position may be wrong, by its name.
    bodies = tracks.bodies
    errors = {name: error_m for name, error_m in (errors_m or {}).items() if name in bodies}
    whole = _whole(bodies)
    if whole.begin == whole.end:
        raise LogError(f"the log has positions at {whole.begin:.6g} s only; wanted: at two times at least")
    every = (_judged(*tracked, scenario, errors, whole) for tracked in _tracked(bodies, scenario, whole))
    pairs = [judged for judged in every if judged is not None]
    robots = {name: robot for name, robot in robots_of(scenario).items() if name in bodies}
    speeds = {name: (_speed(bodies[name]), float(robot["max_speed_m_s"])) for name, robot in robots.items()}
    away = {
        name: float(np.linalg.norm((bodies[name].places_m[0] - np.array(robot["start_m"]))[:2]))
        for name, robot in robots.items() if bodies[name].t_s[0] <= whole.begin + bodies[name].gap_s
    }  # fmt: skip
    longest = {name: _longest(track) for name, track in bodies.items()}
    stray = max((0.5 * limit * longest[name] for name, (_, limit) in speeds.items()), default=0.0)
    if not pairs:
        raise LogError(f"no distance is left to judge: of {', '.join(bodies)} nothing else is in the log or scenario")
    to_rest = [pair.least_m for pair in pairs if pair.second not in {*bodies}]
    places = [ugv[key][:2] for ugv in scenario["ugvs"].values() for key in ("start_m", "target_m")]
    far_m = FAR * max(1.0, float(np.ptp(places, axis=0).max()))
    is_far = min(away.values(), default=0.0) > far_m
    if is_far and min(to_rest, default=0.0) > far_m:
        raise LogError(
            f"{next(iter(away))} starts {next(iter(away.values())):.3g} m from its start in the scenario, and no robot "
            "comes near an obstacle: the log is in another frame; wanted: positions in the scenario's frame, or a "
            "scenario without obstacles and map"
        )
    return Judged(
        pairs=sorted(pairs, key=lambda pair: pair.margin_m),
        begin_s=whole.begin,
        end_s=whole.end,
        duration_s=float(scenario["duration_s"]),
        longest_s=max(longest.values()),
        usual_s=max(track.usual_s for track in bodies.values()),
        stray_m=stray,
        speeds_m_s=speeds,
        away_m=away,
        is_far=is_far,
        by_scenario=bool(to_rest),
        not_judged=(*NOT_JUDGED, *((NOT_JUDGED_OF_OLD,) if is_asynchronous(scenario) else ())),
    )


def _whole(bodies: Mapping[str, Track]) -> Span:
    starts, ends = zip(*(track.t_s[[0, -1]].tolist() for track in bodies.values()), strict=True)
    return Span(min(starts), max(ends))


def courses(tracks: Tracks, scenario: Json) -> dict[tuple[str, str], list[tuple[Array, Array]]]:
    """Distances over time of each pair, between surfaces: times (m,), s, and distances (m,), m, of each stretch."""
    courses_m = {}
    for pair, own, other in _tracked(tracks.bodies, scenario, _whole(tracks.bodies)):
        times = [_knots(own, other, span) for span in _common(own, other)] if len(other.t_s) else []
        courses_m[pair.robot, pair.other] = [(t_s, _course(pair, own.at(t_s) - other.at(t_s))) for t_s in times]
    return courses_m


def _course(pair: Pair, apart: Array) -> Array:
    """Distances of the surfaces of a pair at differences of its places (K, 3), m: (K,), m."""
    # In slices: a long log beside a polygon of many corners would need gigabytes.
    slices = np.array_split(apart, 1 + len(apart) // AT_ONCE)
    return np.concatenate([_signed(pair.shape, places) for places in slices]) - pair.radii_m


def _tracked(bodies: Mapping[str, Track], scenario: Json, whole: Span) -> Iterator[tuple[Pair, Track, Track]]:
    """Each pair with its tracks; an obstacle's track is cut to the time during which it exists."""
    resting, barriers = places_of(scenario, np.zeros(1)), barriers_of(scenario)
    for pair in _pairs(scenario, bodies):
        there = _there(barriers[pair.other], whole) if pair.other in barriers else whole
        if pair.other in bodies:
            other = _seen(bodies[pair.other], pair.other, pair, scenario)
            during = (other.t_s >= there.begin - SMALL) & (other.t_s <= there.end + SMALL)
            other = replace(other, t_s=other.t_s[during], places_m=other.places_m[during])
        else:
            t_s = np.array([*there] if there.end >= there.begin else [])
            other = Track(t_s, np.repeat(resting[pair.other], len(t_s), axis=0), np.inf)
        yield pair, _seen(bodies[pair.robot], pair.robot, pair, scenario), other


def _pairs(scenario: Json, bodies: Mapping[str, Track]) -> list[Pair]:
    pairs, uavs = pairs_of(scenario), uavs_of(scenario)
    first = next(iter(uavs.values()))
    for name in bodies:
        if name not in robots_of(scenario) and name not in scenario["obstacles"]:
            known = uavs if scenario["safe_distance"].get("uav_m") else {}
            pairs += [pair for pair in pairs_of(scenario | {"uavs": known | {name: first}}) if name in pair[:2]]
            uavs = uavs | {name: first}
    movers = (name for name, obstacle in scenario["obstacles"].items() if obstacle["moves"])
    must_be = {*robots_of(scenario), *bodies, *movers}
    return [pair for pair in pairs if all(name in bodies or name not in must_be for name in (pair.robot, pair.other))]


def _seen(track: Track, name: str, pair: Pair, scenario: Json) -> Track:
    """A track for judging a pair: for pairs of UGVs and obstacles, in the plane at the scenario's heights."""
    flat = pair.robot in scenario["ugvs"] and (pair.other in scenario["ugvs"] or pair.other in barriers_of(scenario))
    is_obstacle = name in scenario["obstacles"]
    if not (flat or is_obstacle):
        return track
    places = track.places_m.copy()
    places[:, 2] = height_m(scenario, name)
    if is_obstacle and not scenario["obstacles"][name]["moves"]:
        places[:, :2] -= np.array(scenario["obstacles"][name]["position_m"] or [0.0, 0.0])[:2]
    return replace(track, places_m=places)


def _there(body: Json, whole: Span) -> Span:
    """The time span in which an obstacle exists, for a log that begins with the scenario."""
    return Span(max(whole.begin, float(body["appears_s"])), min(whole.end, float(body["disappears_s"]) or np.inf))


def _common(own: Track, other: Track) -> list[Span]:
    both = (Span(max(a.begin, b.begin), min(a.end, b.end)) for a in own.spans for b in other.spans)
    return [span for span in both if span.end >= span.begin]


def _knots(own: Track, other: Track, span: Span) -> Array:
    t_s = np.unique(np.concatenate([own.t_s, other.t_s, span]))
    return t_s[(t_s >= span.begin) & (t_s <= span.end)]


def _judged(
    pair: Pair, own: Track, other: Track, scenario: Json, errors_m: Mapping[str, float], whole: Span
) -> JudgedPair | None:
    """The results for a pair; None if the obstacle does not exist during the log."""
    if not len(other.t_s):
        return None
    eps = errors_m.get(pair.robot, 0.0) + errors_m.get(pair.other, 0.0)  # a body that is not in the log has no error
    spans = _common(own, other)
    if not spans:
        times = (f"{n} {t.t_s[0]:.12g} to {t.t_s[-1]:.12g} s" for n, t in ((pair.robot, own), (pair.other, other)))
        wanted = f"wanted: logs of the same time, or --without {pair.robot}"
        raise LogError(f"{' and '.join(times)} are never recorded at the same time; {wanted}")
    least, at, stretch = np.inf, 0.0, spans[0]
    below = list[Span]()
    law = _Law(pair, scenario)
    for span in spans:
        t_s = _knots(own, other, span)
        own_m, other_m = own.at(t_s), other.at(t_s)
        apart = own_m - other_m
        value, when = _least(pair.shape, apart, t_s)
        if value < least:
            least, at, stretch = value, when, span
        below += _below(pair.shape, apart, t_s, pair.safe_m - SMALL)
        law.add(t_s, own_m, other_m)
    body = barriers_of(scenario).get(pair.other)
    spare_s = MOST_SPARE * float(scenario["duration_s"])
    gaps = _gaps(spans, _there(body, whole) if body else whole, own, other, spare_s)
    too_fast = _too_fast(other, scenario, pair, errors_m.get(pair.other, 0.0))
    promised = pair.gap_m - law.deficit - eps
    return JudgedPair(
        first=pair.robot,
        second=pair.other,
        safe_m=pair.gap_m,
        least_m=least - pair.radii_m,
        at_s=at,
        error_m=eps,
        below_s=below,
        covered_s=sum(span.end - span.begin for span in spans),
        gaps_s=gaps,
        intervals=law.intervals,
        lacking=law.lacking,
        missed_m=law.missed,
        missed_at_s=law.missed_at,
        missed_for_s=law.missed_for,
        missed_by_m=law.missed_by,
        starts_m=law.starts - pair.radii_m,
        starts_s=law.starts_s,
        theorem="Passive" if pair.moves_m_s else "Safety",
        too_fast_m_s=too_fast,
        promised_m=promised if promised > 0.0 and law.intervals and not pair.moves_m_s else None,
        law_m=eps + math.hypot(pair.safe_m, eps) - pair.radii_m,
        came_m=_came(pair, own, other, Span(max(stretch.begin, at - LAST_S), at)),
    )


class _Law:
    """The avoidance law of a pair, stretch by stretch."""

    def __init__(self, pair: Pair, scenario: Json) -> None:
        self.pair, self.gain = pair, written(scenario["control"]["avoidance_gain_1_s"])
        self.intervals = self.lacking = 0
        self.missed = self.missed_at = self.missed_for = self.deficit = 0.0
        self.missed_by: dict[str, float] = {}
        self.starts, self.starts_s = np.inf, 0.0

    def add(self, t_s: Array, own_m: Array, other_m: Array) -> None:
        """Judge the intervals of a stretch; beside obstacles that may move, with d + V h for d and without a gain."""
        pair, h = self.pair, np.diff(t_s)
        moves = pair.moves_m_s > 0.0
        start = pair.shape.least_m(own_m[:1] - other_m[:1])
        if start < self.starts:
            self.starts, self.starts_s = start, float(t_s[0])
        deficit = max(0.0, pair.safe_m - start)
        self.deficit = max(self.deficit, deficit)
        if not len(h):
            return
        gains = [Fraction() if moves else min(self.gain * Fraction(step_s), Fraction(1)) for step_s in h.tolist()]
        safe = (pair.safe_m + pair.moves_m_s * h).tolist()
        shortfalls = shortfalls_m(own_m, other_m, pair, safe, gains)
        self.intervals += len(h)
        for k, gain in enumerate(gains):
            lacks = float(shortfalls[k].both) if k in shortfalls else 0.0
            deficit = (1.0 - float(gain)) * deficit + lacks
            self.deficit = max(self.deficit, deficit)
            self.lacking += lacks > SMALL
            if lacks > self.missed:
                self.missed, self.missed_at, self.missed_for = lacks, float(t_s[k]), float(h[k])
                self.missed_by = {pair.robot: float(shortfalls[k].own)}
                if pair.share < 1.0:
                    self.missed_by[pair.other] = float(shortfalls[k].other)


def _signed(shape: Shape, apart: Array) -> Array:
    return np.min([part.signed_m(apart) for part in shape.parts], axis=0)


def _least(shape: Shape, apart: Array, t_s: Array) -> tuple[float, float]:
    """Least distance along the straight steps from place to place, m, and when, s."""
    least = shape.least_m(apart)
    if len(apart) == 1:
        return least, float(t_s[0])
    _, steps = shape.held_m(apart[:-1], apart[:-1], apart[1:], least + SMALL)
    k = int(steps.argmin())
    return least, float(t_s[k] + _lowest(shape, apart[k], apart[k + 1]) * (t_s[k + 1] - t_s[k]))


def _lowest(shape: Shape, start: Array, end: Array) -> float:
    """The share of a step with the least distance."""
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        early, late = (2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0
        first, second = _signed(shape, start + np.array([[early], [late]]) * (end - start))
        low, high = (low, late) if first < second else (early, high)
    ends = np.array([low, 0.0, 1.0])
    return float(ends[_signed(shape, start + ends[:, None] * (end - start)).argmin()])


def _below(shape: Shape, apart: Array, t_s: Array, need_m: float) -> list[Span]:
    there, passes = shape.within(apart, need_m)
    below_s: list[Span] = []
    for k in np.flatnonzero(passes).tolist():
        # A step that is not below at an end has a lowest point, and a time at which it falls below.
        lowest = 0.0 if there[k] and there[k + 1] else _lowest(shape, apart[k], apart[k + 1])

        def crossing(above: float, k: int = k, below: float = lowest) -> float:
            for _ in range(HALVINGS):
                middle = 0.5 * (above + below)
                is_below = _signed(shape, (apart[k] + middle * (apart[k + 1] - apart[k]))[None])[0] < need_m
                above, below = (above, middle) if is_below else (middle, below)
            return below

        begin = t_s[k] + (0.0 if there[k] else crossing(0.0)) * (t_s[k + 1] - t_s[k])
        end = t_s[k] + (1.0 if there[k + 1] else crossing(1.0)) * (t_s[k + 1] - t_s[k])
        if below_s and there[k] and below_s[-1].end >= begin:
            below_s[-1] = Span(below_s[-1].begin, float(end))
        else:
            below_s.append(Span(float(begin), float(end)))
    if len(apart) == 1 and there[0]:
        below_s.append(Span(float(t_s[0]), float(t_s[0])))
    return below_s


def _gaps(spans: list[Span], whole: Span, own: Track, other: Track, spare_s: float) -> list[Span]:
    """Gaps between stretches with both bodies recorded, and at the ends if longer than usual or than `spare_s`."""
    edges = [whole.begin, *(edge for span in spans for edge in span), whole.end]
    gaps = [Span(*both) for both in zip(edges[::2], edges[1::2], strict=True)]
    inner = [gap for gap in gaps[1:-1] if gap.end > gap.begin]
    late = max(track.t_s[0] - whole.begin - min(track.gap_s, spare_s) * (1.0 + 1e-9) for track in (own, other))
    early = max(whole.end - track.t_s[-1] - min(track.gap_s, spare_s) * (1.0 + 1e-9) for track in (own, other))
    return joint(sorted([*inner, *(gap for gap, lacks in ((gaps[0], late), (gaps[-1], early)) if lacks > 0.0)]))


def _came(pair: Pair, own: Track, other: Track, span: Span) -> dict[str, float]:
    """The change of the distance due to each body's own motion."""
    t_s = np.linspace(span.begin, span.end, STEPS + 1)
    own_m, other_m = own.at(t_s), other.at(t_s)
    mixed = {(i, j): _signed(pair.shape, own_m[i : len(own_m) - 1 + i] - other_m[j : len(other_m) - 1 + j])
             for i in (0, 1) for j in (0, 1)}  # fmt: skip
    by_own = 0.5 * (mixed[0, 0] - mixed[1, 0] + mixed[0, 1] - mixed[1, 1]).sum()
    by_other = 0.5 * (mixed[0, 0] - mixed[0, 1] + mixed[1, 0] - mixed[1, 1]).sum()
    return {pair.robot: float(by_own), pair.other: float(by_other)}


def _too_fast(other: Track, scenario: Json, pair: Pair, error_m: float) -> float:
    """Largest speed of an obstacle, m/s, if it certainly exceeds the declared one; else 0."""
    if pair.other not in scenario["obstacles"]:
        return 0.0
    moved, lasts = _moved(other)
    declared = expected_m_s(scenario["obstacles"][pair.other])
    over = moved > declared * (lasts + STAMP_S) + 2.0 * error_m + SMALL
    return float((moved[over] / lasts[over]).max(initial=0.0))


def _speed(track: Track) -> float:
    moved, lasts = _moved(track)
    return float((moved / lasts).max(initial=0.0))


def _moved(track: Track) -> tuple[Array, Array]:
    """Displacements from each sample to a later one, m, and the time between them, s; not across gaps."""
    # That is at least half the usual time: with samples nanoseconds apart, rounding alone can give any speed.
    t_s, n = track.t_s, len(track.t_s)
    later = np.searchsorted(t_s, t_s + 0.5 * track.usual_s, side="left")
    later = np.maximum(later, np.arange(n) + 1)
    first = np.flatnonzero(later < n)
    gaps = np.append(0, np.cumsum(~track.is_known))
    first = first[gaps[first] == gaps[later[first]]]
    moved = np.linalg.norm(track.places_m[later[first]] - track.places_m[first], axis=1)
    return moved, t_s[later[first]] - t_s[first]


def _longest(track: Track) -> float:
    """Longest sampling interval without a gap, s; 0 for a static body."""
    return float(np.diff(track.t_s)[track.is_known].max(initial=0.0)) if np.isfinite(track.gap_s) else 0.0


def as_json(judged: Judged, tracks: Tracks) -> dict[str, Any]:
    pairs = [
        {
            **pair._asdict(), "status": pair.status, "margin_m": pair.margin_m, "hypotheses": pair.hypotheses,
            "below_s": [list(span) for span in pair.below_s], "gaps_s": [list(span) for span in pair.gaps_s],
        }
        for pair in judged.pairs
    ]  # fmt: skip
    bodies = {
        name: {
            **track.origin, "samples": len(track.t_s), "first_s": float(track.t_s[0]), "last_s": float(track.t_s[-1]),
            "gap_s": track.gap_s, "recorded_s": [list(span) for span in track.spans],
        }
        for name, track in tracks.bodies.items()
    }  # fmt: skip
    covered = {
        "begin_s": judged.begin_s, "end_s": judged.end_s, "duration_s": judged.duration_s, "origin": tracks.origin,
        "longest_interval_s": judged.longest_s, "stray_m": judged.stray_m, "all": judged.covers_all,
    }  # fmt: skip
    return {
        "status": judged.status, "covered": covered, "pairs": pairs, "bodies": bodies,
        "speeds_m_s": {name: list(both) for name, both in judged.speeds_m_s.items()}, "starts_away_m": judged.away_m,
        "not_used": tracks.ignored, "not_judged": list(judged.not_judged),
    }  # fmt: skip
