"""SAFE-HYP: the hypotheses of the safety theorems along a run, recomputed from its positions.

Exact arithmetic (`engines.shortfalls`) finds how far each step misses the avoidance inequalities, and the distance that
follows. The parameters of the controllers are compared with the scenario (`demands`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, partial
from itertools import groupby, permutations
from math import inf, isfinite, nextafter
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.base.exact import decimal
from airground_drake.model.plants.budget import AT_REST, kept_distance, part_of_gain
from airground_drake.model.plants.plant import Premise, Recorded
from airground_drake.sim.trace import Trace, per_trace
from airground_drake.verify.claim import TIME_TOLERANCE_S, TraceClaim
from airground_drake.verify.engines.geometry import interpolate
from airground_drake.verify.engines.outlines import Cores, apart_by_blocks
from airground_drake.verify.engines.shortfalls import POINT, SCREEN_M, rounded_up, shortage, shortfalls
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.control_law import BINDING_M_S, inequalities_of
from airground_drake.verify.runs.demands import differences
from airground_drake.verify.runs.old_positions import heard_at, missed_m, unsure_m
from airground_drake.verify.runs.pairs import (
    DISTANCE_TOLERANCE_M,
    MOST_LISTED,
    Pair,
    apart_of,
    bounds_of,
    cores_of,
    distances_when_there,
    is_planar,
    pair_of,
    pairs_of,
    parts_of,
    snapshot,
    start_margin,
)
from airground_drake.verify.runs.passive import beside, beside_moving, last_period, period_ends, speeds

# A speed may be above its limit by this much, m/s: a command that is shortened to its limit errs by 1e-15 m/s, and in
# one period of 25 ms this moves a robot by 2.5e-11 m.
VELOCITY_TOLERANCE_M_S = 1e-9
AVOIDANCE = "avoidance"  # the hypothesis that the steps met the inequalities
PASSIVE = "avoidance beside an obstacle that may move"  # the hypothesis that the steps met the passive law
DECLARED = "declared speed"  # the hypothesis that an obstacle moved no faster than it was expected to
# The hypotheses that a pair begins apart: the points that the law steers, and bodies with a lag or delay.
START, BODIES = "safe start", "safe start of the bodies"
MEASURED = "error of the measured position"  # the hypothesis that the errors of measured positions keep their bounds
ANNOUNCED = "announced position"  # the hypothesis that robots are at their announced positions
UNHEARD = "standing without a message"  # the hypothesis that UGVs stand while a near one's position is unknown
BUILT = "controller parameters"  # the hypothesis that the controllers were built with the scenario's parameters


@dataclass(frozen=True)
class _Hypothesis:
    """One hypothesis over K instants or pairs: margins (K,); it is broken where one is below -`slop`."""

    name: str
    unit: str
    t: Array
    margin: Array
    slop: float
    about: dict[str, Any]
    others: Sequence[str] = ()

    def broken(self) -> npt.NDArray[np.intp]:
        """Instants at which it does not hold, also those with a margin that is not a number."""
        return np.flatnonzero(~(self.margin >= -self.slop))

    def at(self, k: int) -> dict[str, Any]:
        """The numbers to repeat the evaluation at instant k by hand."""
        other = {"second": self.others[k]} if self.others else {}
        described = {"hypothesis": self.name, **self.about, **other, "t_s": float(self.t[k])}
        return {**described, "margin": float(self.margin[k]), "unit": self.unit}


class Guarantee(NamedTuple):
    """The promised distance of a pair of bodies: their gap is at least `gap_m` at all times of the run."""

    pair: Pair  # the two bodies
    # Violation of the inequalities at each sample, e_i + e_j, (K,), m per control period; 0: both are met.
    missed_m: Array
    # What the bodies keep where their steered points keep m - max(e / a - w / A, s). There m is the distance in the
    # law, e the largest of `missed_m`, a = min(A h, 1), w the drift that users' plants declare, and s the deficit of
    # the points' distance at the start, or when the obstacle appeared. Without a gain no distance is restored, and the
    # points keep m - K e - s. -inf: no guarantee.
    gap_m: float
    why: str = ""  # the reason if there is no guarantee

    @property
    def margin_m(self) -> float:
        """The promised minus the safe distance; at most 0."""
        return self.gap_m - self.pair.required_m


class SafeHyp(TraceClaim):
    id = "SAFE-HYP"
    subject = "conditions of the proof"
    summary = "Every step of the run met the conditions under which the safety theorem (SAFE-INV) holds."
    statement = (
        "At every control sample of the run the hypotheses of the safety theorem held, up to an error e for each pair "
        "of bodies. So each pair of robots and static bodies kept d - e / (A h) at all times of the run, with A / 2 "
        "for A if one of two robots may have to stand. Beside an obstacle that may move, the passive law held and the "
        "obstacle was no faster than declared, so d was kept in every period that began at d + V h or more. The "
        "controllers had the scenario's parameters; a controller of the user's own is judged by its steps alone. If "
        "robots act on measured positions, the inequalities are about these, the errors were within their bound, and d "
        "is about true bodies. Beside an obstacle that may move, true or measured positions must meet the law; of two "
        "robots that measure each other, the view of one suffices. If messages between UGVs may be lost, a UGV stood "
        "unless it knew that the senders of missing messages were far. If UGVs act on old positions (`control.law: "
        "asynchronous`), each step avoided all points that the other could reach before it decided again, up to e, and "
        "the two kept d minus the sum of all e."
    )
    latex = (
        r"n^\top (p_i^{k+1} - p_i^k) \ge q\, b - e_i, \quad b = \begin{cases} A h (d - D) & D \le d \\ d - D & D > d "
        r"\end{cases}",
        r"\text{or} \quad D \ge d + \lVert p_i^{k+1} - p_i^k \rVert + \lVert p_j^{k+1} - p_j^k \rVert; \quad q = 1 "
        r"\text{ (obstacle)}, \; q = 1/2 \text{ (robot)}",
        r"e = \max_k (e_i + e_j) \quad \Rightarrow \quad D \ge d - \frac{e}{A' h}, \quad \frac{e}{A' h} \le 10^{-9} "
        r"\text{ m}, \quad A' = A \text{ or } A/2",
        r"n^\top (p_i^{k+1} - p_i^k) \ge \min(0, \, d + V h - D) - e_i, \quad \lVert \dot{o}_j \rVert \le V \quad "
        r"\text{(obstacle that may move)}",
        r"n^\top s \ge d + \rho - D - e \;\; (D \ge d + \rho), \text{ or } D \, n^\top s \ge \rho \lVert s \rVert "
        r"- e d / 2, \text{ or } s = 0, \quad \rho = V (t_k - t_{\mathrm{heard}} + h) \quad \text{(old positions)}",
        r"D(0) \ge d, \quad A h \le 1, \quad \lVert v \rVert \le v_{\max}, \quad v_z = 0 \text{ (UGV)}, \quad "
        r"R \ge d + c h",
    )
    method = (
        "Exact arithmetic on the recorded positions at the control samples and on the corners of obstacles, which are "
        "rational numbers; square roots are enclosed. Pairs and samples are skipped if floating-point numbers show "
        "that they are far apart, or that an inequality is met by more than 1e-9 m. D and d are distances of a robot's"
        " centre from another centre, or from a convex core: a point, a wall, a polygon or a prism; n is the unit "
        "vector away from its nearest point, inside a polygon the normal of its nearest edge. A barrier of several "
        "parts has an inequality for each part, and the promised distance is the least over the parts. The radii are "
        "subtracted from the listed distances. The parameters of the controllers were read back from the diagram and "
        "are compared with the scenario. Rows less than 1e-9 s apart count as one instant. With position errors, D and"
        " n are measured and steps are true: a pair meets the sum of its inequalities, with half the gain between two "
        "robots, or is far apart, or stands. The same holds for two robots if one may miss the other's message. An old"
        " position is the sender's position at the recorded sample of the last message that arrived."
    )
    equations = "(7)-(8), (11) in the inequality form of the package (set-based avoidance)"
    assumptions = (
        "The command of a row is the velocity applied since the row before (the trace's convention).",
        "The points that the law steers move straight from row to row. For robots that turn, lag or receive commands "
        "late, D and d are about these points: d is d_law of SAFE-BUDGET.",
        "Beside an obstacle with `appears_s` the hypotheses are judged from that time on, rounded up to a control "
        "sample; the safe start is that D >= d at that sample. At that sample, the bodies of robots that lag, receive "
        "commands late or never drive backwards must also be clear, and so must their paths during the delay under "
        "commands already given. Otherwise nothing is promised for the pair.",
        "Robots act on the measured positions that are recorded.",
        "With `control.law: asynchronous` UGVs are discs that follow commands exactly, and the positions that they "
        "receive were exact when sent.",
        "Beside an obstacle that may move no safe start is required, because the robot is passive near it.",
    )
    does_not_establish = (
        "The theorem (SAFE-INV) and the outcome (SAFE-TRACE). A broken hypothesis does not mean that the distance was "
        "violated, only that no more than d - e / (A h) is promised: inside several safe distances at once the "
        "inequalities can contradict each other. It says nothing about other runs. For periods in which a robot was "
        "passive, only SAFE-OWN applies."
    )

    theorems = (
        "Safety.safe_always", "Safety.recovers", "Safety.unseen", "Safety.standing", "Safety.capped",
        "Convex", "Budget", "Pieces", "Plants", "Turning", "Passive.own_doing", "Passive.kept", "Passive.since",
        "Passive.restored", "Passive.held_off", "Mixed.drifting", "Mixed.unicycle_chord", "Mixed.lagging",
        "Mixed.delayed", "Mixed.shares", "Async", "LawChecker.sound", "LawChecker.obeys_exactly",
    )  # fmt: skip
    exercised_by = "avoidance inequalities that bound a command at a control sample"

    def check(self, trace: Trace) -> Finding:
        """Evaluate all hypotheses; the first violation in time is the counterexample."""
        kept = sorted(guarantees(trace), key=lambda promised: promised.margin_m)
        others = [*_static(trace), *_sampled(trace), *_unheard(trace), *_of_plants(trace), *_beside_moving(trace)]
        different = list(differences(trace))
        broken = [h.at(int(k)) for h in [*others, *_avoidance(trace, kept)] for k in h.broken()[:1]]
        broken += [{"hypothesis": BUILT, "t_s": float(trace.t[0]), **difference} for difference in different[:1]]
        first = min(broken, key=lambda entry: float(entry["t_s"]), default=None)
        worst = _worst(others)
        listed = [_listed(trace, promised) for promised in kept[:MOST_LISTED]]
        shown = _shown(first, worst, listed, kept)
        name = shown["hypothesis"]
        in_range, binding = _binding(trace)
        evidence: dict[str, Any] = {
            "e_m": float(max((promised.missed_m.max() for promised in kept), default=0.0)),
            # None if no pair came within reach, or there is no guarantee for a pair that did
            "guarantee_m": _finite(kept[0].gap_m) if kept else None,
            "pairs": listed,
            "pairs_in_reach": len(kept),
            "different_parameters": different,
            "worst": worst,
            "inequalities_in_range": in_range,
            "inequalities_that_bind": binding,
            "tolerance_m": DISTANCE_TOLERANCE_M,
        }
        more = {
            "beside_moving": beside_moving(trace), "least_shares": least_shares(trace), "own_plants": own_plants(trace)
        }  # fmt: skip
        evidence |= {key: rows for key, rows in more.items() if rows}
        if own := trace.scenario.ugv_controller:
            evidence["own_controller"] = f"{own.kind} is judged by its steps, not by what it was built with"
        return Finding(
            "refuted" if first else "holds",
            margin=shown.get("margin"),
            unit=shown.get("unit", ""),
            quantity="distance promised less the safe one" if name == AVOIDANCE else f"least slack of {name!r}",
            where={key: shown[key] for key in shown if key not in ("margin", "unit")},
            counterexample=_against(trace, first, broken) if first else None,
            evidence=evidence,
            exercised=sum(binding.values()),
        )


def _against(trace: Trace, first: dict[str, Any], broken: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The hypothesis broken first, with the numbers to repeat the evaluation by hand."""
    against = first | snapshot(trace, map(str, first.values()), first["t_s"])
    if first["hypothesis"] != DECLARED:
        return against
    declared = trace.scenario.barriers[first["other"]].expected_speed_m_s
    speeds = f"{first['other']} moved at {declared - first['margin']:.2f} m/s at {first['t_s']:.2f} s"
    more = sorted({str(entry["hypothesis"]) for entry in broken} - {DECLARED})
    return against | {"why": f"{speeds}, declared {declared:.2f}", "also_broken": more}


def _worst(hypotheses: Sequence[_Hypothesis]) -> list[dict[str, Any]]:
    """Where each hypothesis has its least margin, for each robot or pair that it is about."""
    least: dict[tuple[str, str], dict[str, Any]] = {}
    for h in hypotheses:
        entry = h.at(int(np.argmin(h.margin)))
        key = h.name, str(next(iter(h.about.values()), ""))
        if entry["margin"] <= least.get(key, entry)["margin"]:
            least[key] = entry
    return list(least.values())


def _shown(
    first: dict[str, Any] | None, worst: Sequence[dict[str, Any]], listed: Sequence[Any], kept: Sequence[Guarantee]
) -> dict[str, Any]:
    """The entry with the finding's margin: the hypothesis broken first, otherwise the inequalities."""
    if first and first["hypothesis"] == BUILT:
        return first
    name = first["hypothesis"] if first else AVOIDANCE
    least: dict[str, Any] = {
        "margin": _finite(kept[0].margin_m) if kept else 0.0, "unit": "m", "hypothesis": AVOIDANCE
    }  # fmt: skip
    least |= {key: listed[0][key] for key in ("first", "second")} if kept else {}
    named = (entry for entry in worst if entry["hypothesis"] == name)
    return min(named, key=lambda entry: float(entry["margin"]), default=least)


def _listed(trace: Trace, promised: Guarantee) -> dict[str, Any]:
    """A row of the evidence, with the sample of the largest violation, if any."""
    e, k = float(promised.missed_m.max()), int(np.argmax(promised.missed_m))
    pair, why = promised.pair, {"why": promised.why} if promised.why else {}
    described = {"first": pair.first, "second": pair.second, "safe_distance_m": pair.required_m}
    t = float(trace.t[trace.sample_rows[k]]) if e > 0.0 else None
    return {**described, "guarantee_m": _finite(promised.gap_m), "e_m": e, "t_s": t, **why}


def _finite(metres: float) -> float | None:
    return metres if isfinite(metres) else None


def _gain(trace: Trace, pair: Pair) -> Fraction:
    """a = min(A h, 1), of the exact decimals, or the part of it by which the pair recovers a distance."""
    control, bounds = trace.scenario.control, bounds_of(trace)
    of_law = min(decimal(control.avoidance_gain_1_s) * decimal(control.period_s), Fraction(1))
    return of_law * Fraction(part_of_gain(bounds[pair.first], bounds.get(pair.second, AT_REST)))


@per_trace
def guarantees(trace: Trace) -> list[Guarantee]:
    """The promised distance of each pair that comes near."""
    # Other pairs stay so far apart that the longest steps of both could not break their distance.
    return list(_guarantees(trace))


def _guarantees(trace: Trace) -> Iterator[Guarantee]:
    samples, last = period_ends(trace), last_period(trace)
    places = {name: trace.position(name)[samples] for name in trace.robots}
    longest = {name: _longest(way, float(last)) for name, way in places.items()}
    pairs, bounds = pairs_of(trace), bounds_of(trace)
    reach = np.array([pair.law_m + longest[pair.first] + longest.get(pair.second, 0.0) for pair in pairs])
    reach += [_unsure_m(trace, pair) if pair.asynchronous else 0.0 for pair in pairs]
    beyond = SCREEN_M + np.array([pair.cover_m for pair in pairs])  # of the bodies from the points that are steered
    for k in np.flatnonzero(apart_of(trace) <= reach + beyond).tolist():
        pair = pairs[k]
        if pair.speed_m_s > 0.0:  # see `passive`
            continue
        if pair.asynchronous:
            yield _of_old_positions(trace, pair)
            continue
        begin = int(np.searchsorted(samples, pair.row))
        end = int(np.searchsorted(samples, pair.last)) + 1
        there, planar = slice(begin, end), is_planar(trace, pair.first)
        first = places[pair.first][there]
        beside = _beside(trace, pair, places, there, float(reach[k]))
        both = bounds[pair.first], bounds.get(pair.second, AT_REST)
        gain = _gain(trace, pair)
        asked = Fraction(pair.share), gain, last if end == len(samples) else Fraction(1)
        seen = partial(_seen, trace, pair, there) if pair.error_m or part_of_gain(*both) < 1.0 else None
        missed = [
            shortfalls(first, place, pair.law_m, *asked, core, planar=planar, seen=seen(place) if seen else ())
            for place, core in beside
        ]
        begun = [shortage(first[0], place.reshape(-1, 3)[0], pair.law_m, core, planar=planar) for place, core in beside]
        most = np.max([np.zeros(len(first) - 1), *missed], axis=0)
        e, short = Fraction(float(most.max())), max(begun, default=Fraction(0))
        lost = max(e / gain - Fraction(pair.drift_m), short) if gain else (len(samples) - 1) * e + short
        missed_m = np.concatenate([np.zeros(begin), most, np.zeros(len(samples) - end)])
        gap, why = -rounded_up(lost - Fraction(pair.required_m)), ""
        if pair.under_way_s is not None or pair.error_m:
            start = start_margin(trace, pair)
            if not start >= -DISTANCE_TOLERANCE_M:
                gap, why = -inf, f"{BODIES} missed by {-start:.3g} m"
            elif pair.error_m and not _bears_errors(pair, gain, lost):
                gap, why = -inf, "the steered points came too near for errors of measured positions"
            elif lost > 0:  # it reduces the distance of the points, which gives the distance of the bodies
                points = nextafter(pair.law_m - rounded_up(lost) - pair.views_m, -inf)
                kept = kept_distance(points, *both, gain=trace.scenario.control.avoidance_gain_1_s) - pair.radii_m
                gap, why = min(gap, kept), "" if isfinite(kept) else "the steered points came too near"
        yield Guarantee(pair, missed_m, gap, why)


def _unsure_m(trace: Trace, pair: Pair) -> float:
    """The largest uncertainty of one UGV's position for the other, m; inf without a received position."""
    both_ways = [*permutations((pair.first, pair.second))]
    if any((heard_at(trace, *names) < 0).any() for names in both_ways):
        return inf
    return max(float(unsure_m(trace, *names).max()) for names in both_ways)


def _of_old_positions(trace: Trace, pair: Pair) -> Guarantee:
    """The distance that two UGVs keep under the asynchronous law: theorem Async.old_positions."""
    missed = missed_m(trace, pair.first, pair.second, pair.law_m) + missed_m(trace, pair.second, pair.first, pair.law_m)
    places = [trace.position(name)[0] for name in (pair.first, pair.second)]
    short = shortage(places[0], places[1], pair.law_m)
    lost = sum(map(Fraction, missed.tolist()), short)
    if lost > Fraction(pair.law_m) / 2:
        return Guarantee(pair, missed, -inf, "the steps miss half of the distance in all")
    return Guarantee(pair, missed, -rounded_up(lost - Fraction(pair.required_m)))


def _seen(trace: Trace, pair: Pair, there: slice, place: Array) -> list[tuple[Array, Array]]:
    """Measured positions of a pair at the samples, (K, 3), m, each; if each measures the other, those of both."""
    samples = slice(there.start, there.stop - 1)
    if pair.second not in trace.robots:
        own = trace.as_seen(pair.first, pair.first)[samples]
        return [(own, np.broadcast_to(place, own.shape))]
    measuring = [pair.first, pair.second] if pair.views_m else [pair.first]
    return [(trace.as_seen(by, pair.first)[samples], trace.as_seen(by, pair.second)[samples]) for by in measuring]


def _bears_errors(pair: Pair, gain: Fraction, lost: Fraction) -> bool:
    """Whether err (1 - A h) <= A h kept, where kept is d_law - err minus losses and drifts."""
    error = Fraction(pair.error_m)
    kept = Fraction(pair.law_m) - error - Fraction(pair.drift_m) - lost
    return error < kept and error * (1 - gain) <= gain * kept


def _beside(
    trace: Trace, pair: Pair, places: dict[str, Array], there: slice, reach: float
) -> list[tuple[Array, Cores]]:
    """The obstacles of the first body of a pair: positions and core of the second, or of each part of a barrier."""
    # Parts that stay beyond reach of the way of the first are left out. A point is given by its place.
    if pair.second in places:
        return [(places[pair.second][there], POINT)]
    cores = cores_of(trace)[pair.second]
    if cores.are_points:
        return [(place, POINT) for place in cores.points]
    bounds = apart_by_blocks(cores, places[pair.first][there])
    near = np.flatnonzero((bounds <= reach + SCREEN_M).any(axis=1)).tolist()
    return [(np.zeros(3), cores.take(k)) for k in near]


def _longest(places: Array, last: float) -> float:
    """The longest step between samples, m."""
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    steps[-1] /= last
    return float(steps.max())


def _avoidance(trace: Trace, kept: Sequence[Guarantee]) -> Iterator[_Hypothesis]:
    """The lost distance, m, because a sample violates the inequalities."""
    t = trace.sampled("t_s")
    for promised in kept:
        pair, missed_m = promised.pair, promised.missed_m
        gain = float(_gain(trace, pair))
        lost = np.maximum(missed_m / gain - pair.drift_m, 0.0) if gain else missed_m * len(t)
        lost = np.cumsum(missed_m) if pair.asynchronous else lost
        about = {"first": pair.first, "second": pair.second}
        yield _Hypothesis(AVOIDANCE, "m", t, 0.0 - lost, DISTANCE_TOLERANCE_M, about)


def _beside_moving(trace: Trace) -> Iterator[_Hypothesis]:
    """Beside obstacles that may move: the passive law, and their declared speeds."""
    t, period_s = trace.sampled("t_s"), trace.scenario.control.period_s
    for periods in beside(trace):
        about = {"first": periods.pair.first, "second": periods.pair.second}
        yield _Hypothesis(PASSIVE, "m", trace.t[periods.row], 0.0 - periods.missed_m, DISTANCE_TOLERANCE_M, about)
    for name, speed in speeds(trace).items():
        spare = trace.scenario.barriers[name].expected_speed_m_s - speed
        yield _Hypothesis(DECLARED, "m/s", t, spare, DISTANCE_TOLERANCE_M / period_s, {"other": name})
        yield _straight(trace, name, {"other": name})


def _straight(trace: Trace, name: str, about: dict[str, Any]) -> _Hypothesis:
    """A steered point or an obstacle moves straight between control samples."""
    ends, place = period_ends(trace), trace.position(name)
    off = np.linalg.norm(place - interpolate(trace.t[ends], place[ends], trace.t), axis=1)
    return _Hypothesis("straight motion", "m", trace.t, 0.0 - off, DISTANCE_TOLERANCE_M, about)


def _binding(trace: Trace) -> tuple[int, dict[str, int]]:
    """Numbers of avoidance inequalities in range, and of those that limited a command, by pair."""
    count = {"ugv beside obstacle": 0, "uav beside obstacle": 0}
    count |= {"ugv beside ugv": 0, "ugv beside uav": 0, "uav beside ugv": 0}
    count |= {"uav beside uav": 0} if len(trace.uavs) > 1 else {}
    kind_of = trace.scenario.kind_of
    beside = ["obstacle" for _ in parts_of(trace).owner] + [kind_of(robot) for robot in trace.robots]
    in_range = 0
    for robot in trace.robots:
        given = inequalities_of(trace, robot)
        in_range += int((given.distance <= trace.scenario.control.sensing_range_m).sum())
        for column in given.column[given.slack(trace.chosen(robot)) <= BINDING_M_S].tolist():
            count[f"{kind_of(robot)} beside {beside[column]}"] += 1
    return in_range, count


def _static(trace: Trace) -> Iterator[_Hypothesis]:
    """Hypotheses on the scenario and the start: gain, sensing range, distances at t = 0."""
    control = trace.scenario.control
    limit = {name: robot.max_speed_m_s for name, robot in trace.scenario.robots.items()}
    period, reach = decimal(control.period_s), decimal(control.sensing_range_m)
    stable = np.array([float(1 - decimal(control.avoidance_gain_1_s) * period)])
    yield _Hypothesis("gain: A h <= 1", "1", trace.t[:1], stable, 0.0, {})

    @cache
    def room(safe: float, *speeds: float) -> float:
        return float(reach - decimal(safe) - sum(map(decimal, speeds)) * period)

    order = {robot: k for k, robot in enumerate(trace.robots)}
    pairs = sorted(pairs_of(trace), key=lambda pair: order[pair.first])
    for robot, own in groupby(pairs, key=lambda pair: pair.first):
        beside = list(own)
        others = [pair.second for pair in beside]
        rows = [pair.row for pair in beside]
        away = trace.position(robot)[0] - np.stack([trace.position(name)[0] for name in trace.robots])
        apart = dict(zip(trace.robots, np.linalg.norm(away, axis=1).tolist(), strict=True))
        apart |= distances_when_there(trace, robot)
        start, about = trace.t[rows], {"first": robot}
        excess = np.array([np.inf if pair.speed_m_s else apart[pair.second] - pair.law_m for pair in beside])
        of_bodies = np.array([start_margin(trace, pair) for pair in beside])
        for name, margins in ((START, excess), (BODIES, of_bodies)):
            if np.isfinite(margins).any():
                yield _Hypothesis(name, "m", start, margins, DISTANCE_TOLERANCE_M, about, others)
        left = [
            room(pair.law_m, limit[robot], limit.get(pair.second, pair.speed_m_s)) - pair.error_m for pair in beside
        ]
        yield _Hypothesis("sensing range", "m", start, np.array(left), 0.0, about, others)


def _sampled(trace: Trace) -> Iterator[_Hypothesis]:
    """Hypotheses at the control samples: their spacing, straight motion between them, speed limits, planar motion."""
    period = trace.scenario.control.period_s
    robots = trace.scenario.robots
    t = trace.t
    samples = trace.sample_rows
    spacing = np.diff(t[period_ends(trace)])
    yield _Hypothesis("sampling", "s", t[samples], period - spacing, TIME_TOLERANCE_S, {})
    for robot in trace.robots:
        place, about = trace.position(robot), {"robot": robot}
        if not trace.plant(robot).measured:  # the cover of such a robot is from the straight line
            yield _straight(trace, robot, about)
        spare = robots[robot].max_speed_m_s - np.linalg.norm(trace.command(robot)[1:], axis=1)
        yield _Hypothesis("speed limit", "m/s", t[:-1], spare, VELOCITY_TOLERANCE_M_S, about)
        if trace.scenario.position_error_m or (trace.scenario.sensing and not trace.scenario.announces):
            for of in trace.robots if bounds_of(trace)[robot].own_views else (robot,):
                of_other = {} if of == robot else {"other": of}
                left = error_margins(trace, robot, of)
                yield _Hypothesis(MEASURED, "m", trace.sampled("t_s"), left, 0.0, about | of_other)
        elif trace.scenario.announces:
            off = np.linalg.norm(trace.as_seen(robot, robot) - place[samples], axis=1)
            yield _Hypothesis(ANNOUNCED, "m", trace.sampled("t_s"), 0.0 - off, DISTANCE_TOLERANCE_M, about)
        if robot in trace.ugvs:
            yield _Hypothesis("planar motion", "m", t, 0.0 - np.abs(place[:, 2] - place[0, 2]), 0.0, about)


def _unheard(trace: Trace) -> Iterator[_Hypothesis]:
    """UGVs stand if they miss a message of another one that is not certainly far."""
    if trace.scenario.asynchronous or trace.scenario.ugv_links is None or not trace.scenario.ugv_links.loss:
        return
    t, period, bounds = trace.sampled("t_s"), trace.scenario.control.period_s, bounds_of(trace)
    speed = {ugv: bounds[ugv].speed_m_s for ugv in trace.ugvs}
    for first, second in permutations(trace.ugvs, 2):
        heard = trace.sampled(f"{first}.heard_{second}_s")
        known = trace.as_seen(first, second)[np.searchsorted(t, heard - TIME_TOLERANCE_S).clip(0, len(t) - 1)]
        apart = np.linalg.norm(trace.as_seen(first, first) - known, axis=1) - speed[second] * (t - heard)
        least = pair_of(trace, first, second).law_m + bounds[first].error_m + bounds[second].error_m
        spare = apart - least - (speed[first] + speed[second]) * period
        driven = period * np.linalg.norm(trace.chosen(first), axis=1)
        spare[heard > t] = -inf  # never heard so far
        unheard = np.minimum(np.maximum(spare, 0.0 - driven), 0.0)
        margin = np.where(np.abs(heard - t) <= TIME_TOLERANCE_S, 0.0, unheard)
        yield _Hypothesis(UNHEARD, "m", t, margin, DISTANCE_TOLERANCE_M, {"first": first, "second": second})


def error_margins(trace: Trace, by: str, of: str) -> Array:
    """Margins of the errors of a robot's position, as a robot measures it, to their bound, (S,), m; exact signs."""
    most = decimal(trace.scenario.position_error_m)
    seen, true = trace.as_seen(by, of).tolist(), trace.position(of)[trace.sample_rows].tolist()
    margins = list[float]()
    for measured, place in zip(seen, true, strict=True):
        squared = sum((Fraction(a) - Fraction(b)) ** 2 for a, b in zip(measured, place, strict=True))
        margins.append(float(most) - float(squared) ** 0.5)
        if (squared <= most**2) != (margins[-1] >= 0.0):
            margins[-1] = 0.0 if squared <= most**2 else -nextafter(0.0, 1.0)
    return np.array(margins)


def least_shares(trace: Trace) -> list[dict[str, Any]]:
    """The least factor s by which commands were shortened (1: not), and the recovery gain s A."""
    gain = trace.scenario.control.avoidance_gain_1_s
    names = [ugv for ugv in trace.ugvs if trace.plant(ugv).steering is not None]
    shares = {name: float(trace.sampled(f"{name}.command_share").min()) for name in names}
    return [{"robot": name, "share": share, "gain_1_s": share * gain} for name, share in shares.items()]


def own_plants(trace: Trace) -> list[dict[str, Any]]:
    """The largest and the declared drift and cover of each robot with a user's plant."""
    plants = []
    for name, robot in trace.scenario.robots.items():
        if measured := trace.plant(name).measured:
            drift, cover = (float(trace.sampled(f"{name}.{key}").max()) for key in measured)
            bounds, (keys,) = bounds_of(trace)[name], robot.plant
            plants.append({
                "robot": name, "plant": keys.kind, "drift_m_s": drift, "declared_drift_m_s": bounds.drift_m_s,
                "cover_m": cover, "declared_cover_m": bounds.cover_m,
            })  # fmt: skip
    return plants


def _of_plants(trace: Trace) -> Iterator[_Hypothesis]:
    ends = period_ends(trace)
    whole = np.flatnonzero(np.diff(trace.t[ends]) > 0.5 * trace.scenario.control.period_s)
    for name, robot in trace.scenario.robots.items():
        plant = trace.plant(name)
        measured = np.array([trace.sampled(f"{name}.{key}") for key in plant.measured]).T
        run = Recorded(
            trace.t, trace.signals(name), ends[whole], ends[whole + 1], trace.sampled("t_s"), measured,
            robot.max_speed_m_s,
        )  # fmt: skip
        for given in (*plant.premises(run), *_covers(trace, name)):
            slop = DISTANCE_TOLERANCE_M if given.unit == "m" else VELOCITY_TOLERANCE_M_S
            yield _Hypothesis(given.name, given.unit, given.t_s, given.margin, slop, {"robot": name})


def _covers(trace: Trace, robot: str) -> Iterator[Premise]:
    """A body stays within its cover of the steered point."""
    if trace.is_apart(robot) and not trace.plant(robot).measured:
        away = np.linalg.norm(trace.body(robot) - trace.position(robot), axis=1)
        yield Premise("cover of the body", "m", trace.t, bounds_of(trace)[robot].rolling_m - away)
