"""THR-QUALITY: the triggers of a run against its task error without noise.

THR-TRIG compares the trigger with its own variable, x = e + n of (15). This claim compares it with the task error
e = ||rho_rd - rho|| alone, which is what the trigger is for.

The UAV *watches* a UGV while its trigger may act: from the start of the run, or from a release and the end of the
dwell, to the next trigger. An *excursion* of e starts when e reaches the threshold zeta while the UAV watches, or when
the watch starts if e is there already. It ends when e falls below the release level. The tolerance w is the width of
the hysteresis, zeta less the release level: so much noise must not matter, says the scenario. The bare threshold has no
hysteresis; there w is zeta / 2. A trigger is

    served   in an excursion: late by the time since its start;
    early    outside, if e >= zeta - w, or if e reaches zeta before the release: early by the time until then;
    false    outside, if e < zeta - w and e does not reach zeta before the release.

An excursion that ends without a trigger, or lasts to the end of the run, is *missed* if e exceeds zeta + w in it.
"""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TraceClaim
from airground_drake.verify.claims.thr_trig import EVENT_TOLERANCE_S, levels_of
from airground_drake.verify.engines.geometry import NormSignal
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.triggers import Transition, recorded_events, task_error

# The drift of a run is the growth of the task error over this time before it first reaches the threshold, s.
BEFORE_S = 1.0


@dataclass(frozen=True)
class Decided:
    """A trigger, or an excursion without one."""

    robot: str  # the UGV
    t_s: float  # time of the trigger, or of the excursion's end, s
    kind: Literal["served", "early", "false", "missed"]  # see above
    error_m: float  # task error then; at its largest for a missed excursion, m
    off_m: float  # distance of the error from the threshold: below it at the trigger, or above it before the trigger, m
    late_s: float | None  # time since the error reached the threshold, s; negative: until then; None: not reached


class ThrQuality(TraceClaim):
    id = "THR-QUALITY"
    subject = "timing of triggers"
    summary = "The UAV intervened when the real task error, without noise, was close to the threshold."
    statement = (
        "The task error without noise agreed with the threshold to within the width of the hysteresis: no trigger came "
        "at a smaller error, and no larger error went without a trigger while one was allowed."
    )
    latex = (
        r"e(t) = \lVert \rho_{rd}(t) - \rho(t) \rVert, \quad w = \zeta - \zeta_{release} \quad "
        r"(\zeta / 2 \text{ if bare})",
        r"e(T) \ge \zeta - w \text{ at a trigger } T \text{ outside an excursion of } e",
        r"e(t) \le \zeta + w \text{ in an excursion until its trigger}",
    )
    method = (
        "e is rebuilt from positions and preset, exactly in continuous time. An excursion starts when e reaches zeta "
        "while a trigger is allowed, and ends when e falls below the release level. A trigger in an excursion is late "
        "by the time since its start. Outside, it is early if e >= zeta - w or if e reaches zeta before the release, "
        "and false otherwise. An excursion without a trigger is missed if e exceeds zeta + w. If e is at least zeta "
        "when triggers become allowed, as at the end of a dwell, the excursion starts then, and an immediate trigger "
        "is not late. The shares of false and missed triggers, and decision times, are compared with (17)-(18) for the "
        "noise of the run and its drift: the growth of e in the last second before it first reaches zeta."
    )
    equations = "(15), (17)-(18), (20)"
    assumptions = (
        "Positions are linear in time between rows.",
        "The trace records every trigger and release (THR-TRIG recomputes them).",
        "(17)-(18) assume a constant drift, two thresholds, no leak, and no noise before the drift begins. In a run "
        "the noise accumulates from t = 0, so errors can be much more frequent.",
    )
    does_not_establish = (
        "That the threshold is a good one (THR-CHOICE), or that another seed does as well. An intervention changes the"
        " error: a false trigger may have prevented an excursion. Excursions within the dwell after a trigger, and "
        "releases, are not judged. A few triggers are no estimate of (17)-(18); see THR-DDM."
    )
    exercised_by = "triggers, and excursions without one"

    def check(self, trace: Trace) -> Finding:
        """Judge the decisions of each UGV; the finding is about the UGV that is farthest off."""
        zeta, release, dwell = levels_of(trace)
        tolerance = zeta - release if release < zeta else zeta / 2.0
        decisions: list[Decided] = []
        ddm: dict[str, dict[str, float | None]] = {}
        for ugv in trace.ugvs:
            e = task_error(trace, ugv)
            judge = Judge(ugv, e, zeta, release, tolerance)
            own = list(judge.decisions(recorded_events(trace, ugv), dwell))
            decisions += own
            drift = drift_of(e, zeta)
            if drift is not None:
                ddm[ugv] = _ddm(own, zeta, drift, trace.scenario.decision.noise_m_sqrt_s)
        counts = Counter(decided.kind for decided in decisions)
        timed = [(decided.late_s, k) for k, decided in enumerate(decisions)
                 if decided.late_s is not None and decided.kind != "missed"]  # fmt: skip
        latest, earliest = max(timed, default=(0.0, 0)), min(timed, default=(0.0, 0))
        evidence = {
            "zeta_m": zeta,
            "tolerance_m": tolerance,
            "counts": {kind: counts[kind] for kind in ("served", "early", "false", "missed")},
            "latest": decisions[latest[1]] if latest[0] > EVENT_TOLERANCE_S else None,
            "earliest": decisions[earliest[1]] if earliest[0] < -EVENT_TOLERANCE_S else None,
            "decisions": decisions,
            "ddm": ddm,
        }
        if not decisions:
            return Finding("holds", evidence=evidence, exercised=0)
        worst = max(decisions, key=lambda decided: decided.off_m)
        good = worst.off_m <= tolerance
        return Finding(
            "holds" if good else "refuted",
            margin=tolerance - worst.off_m,
            unit="m",
            quantity="task error within the tolerance of the threshold",
            where={"robot": worst.robot, "t_s": worst.t_s},
            counterexample=None if good else {"what": f"{worst.kind} at the task error without noise", **asdict(worst)},
            evidence=evidence,
            exercised=len(decisions),
        )


class Watch(NamedTuple):
    """From `begin` the trigger of a UGV may act; it does at `trigger`, None: not before `until`, s."""

    # `until` is the release after the trigger, or the end of the run.

    begin: float
    trigger: float | None
    until: float


def watches(events: Sequence[Transition], dwell: float, begin: float, end: float) -> Iterator[Watch]:
    """When the UAV watched a UGV, from its recorded triggers and releases by time; `dwell` in s."""
    watching = True
    for k, (time, kind) in enumerate(events):
        if kind == "trigger":
            released = events[k + 1][0] if k + 1 < len(events) else end
            yield Watch(min(begin, time), time, released)
            begin = time + dwell
        else:
            begin = max(begin, time)
        watching = kind == "release"
    if watching and begin < end:
        yield Watch(begin, None, end)


@dataclass(frozen=True)
class Judge:
    """Judges the decisions about a UGV by its task error e; threshold, release level and tolerance are in m."""

    robot: str
    e: NormSignal
    zeta: float
    release: float
    tolerance: float

    def decisions(self, events: Sequence[Transition], dwell: float) -> Iterator[Decided]:
        for watch in watches(events, dwell, float(self.e.t[0]), float(self.e.t[-1])):
            yield from self._of_watch(watch)

    def _of_watch(self, watch: Watch) -> Iterator[Decided]:
        stop = watch.until if watch.trigger is None else watch.trigger
        begun = self._reached(watch.begin, stop)
        while begun is not None:
            over = self.e.reaches(self.release, begun, above=False)
            if over is None or over >= stop:
                break
            yield from self._missed(begun, over)
            # from a knot below on: at the crossing itself e may equal the threshold, and no time would pass
            low = int(np.searchsorted(self.e.t, over)) + int(np.argmax(self.e.x[self.e.t >= over] < self.release))
            begun = self._reached(float(self.e.t[low]), stop)
        if watch.trigger is not None:
            yield self._trigger(watch.trigger, begun, watch.until)
        elif begun is not None:
            yield from self._missed(begun, stop)

    def _missed(self, begun: float, over: float) -> Iterator[Decided]:
        """The excursion between two times as a decision, if e left the tolerance in it."""
        peak = self._peak(begun, over)
        if peak > self.zeta + self.tolerance:
            yield Decided(self.robot, over, "missed", peak, peak - self.zeta, over - begun)

    def _trigger(self, time: float, begun: float | None, released: float) -> Decided:
        """The decision of a trigger; `begun` is the start of its excursion, None outside of one."""
        error = float(self.e.at(time))
        if begun is not None:
            late = time - begun
            above = self._peak(begun, time) - self.zeta if late > EVENT_TOLERANCE_S else 0.0
            return Decided(self.robot, time, "served", error, max(above, 0.0), late)
        comes = self._reached(time, released)
        kind: Any = "early" if comes is not None or error >= self.zeta - self.tolerance else "false"
        below = max(self.zeta - error, 0.0)
        return Decided(self.robot, time, kind, error, below, None if comes is None else time - comes)

    def _reached(self, after: float, before: float) -> float | None:
        """The first time at which e is at the threshold or above, s; None: not in this interval."""
        if self.e.at(after) >= self.zeta:
            return after
        reached = self.e.reaches(self.zeta, after, above=True)
        return reached if reached is not None and reached <= before else None

    def _peak(self, begin: float, end: float) -> float:
        """The largest e between two times, m: e is monotone between knots."""
        inside = self.e.x[(self.e.t > begin) & (self.e.t < end)]
        return float(max(self.e.at(begin), self.e.at(end), *inside))


def drift_of(e: NormSignal, zeta: float) -> float | None:
    """Growth of e over `BEFORE_S` before it first reaches zeta, m/s; None without growth, or if e starts there."""
    reached = e.reaches(zeta, float(e.t[0]), above=True)
    if reached is None or e.x[0] >= zeta:
        return None
    begin = max(reached - BEFORE_S, float(e.t[0]))
    grown = float(e.at(reached) - e.at(begin))
    return grown / (reached - begin) if grown > 0.0 else None


def _ddm(decisions: Sequence[Decided], zeta: float, drift: float, noise: float) -> dict[str, float | None]:
    """The decisions about a UGV compared with (17)-(18), without initial deviation."""
    alone = zeta / drift
    scale = alone * (drift / noise) ** 2 if noise > 0.0 else math.inf
    late = [decided.late_s for decided in decisions if decided.late_s is not None and decided.kind != "missed"]
    wrong = sum(decided.kind in ("false", "missed") for decided in decisions)
    return {
        "drift_m_s": drift,
        "noise_m_sqrt_s": noise,
        "error_rate": wrong / len(decisions) if decisions else None,
        "error_rate_of_18": 0.5 * (1.0 - math.tanh(scale)),
        "decision_time_s": alone + sum(late) / len(late) if late else None,  # None: no lateness is known
        "decision_time_of_17_s": alone * math.tanh(scale),
        "decision_time_without_noise_s": alone,
    }
