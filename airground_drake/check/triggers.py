"""ZENO-TRACE and THR-TRIG: the trigger (20), run again on the decision variable of (15).

THR-QUALITY: the same triggers against the task error without noise.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise, zip_longest
from typing import NamedTuple

import numpy as np

from .rules import SMALL, Array, Disagreement, Found, close, holds
from .run import Run
from .scenario import Levels

# Recorded and recomputed events may differ by this: ten times the accuracy of the simulator's event isolation.
EVENT_S = 1e-5
# Recorded and recomputed decision variables may differ by this: x moves less within the event isolation.
VARIABLE_M = 1e-6
NOISE_M = 1e-8  # noise moves by less within 1e-9 s, and rows closer than that are one
LARGEST_SAMPLE = 9.0  # largest noise sample, in standard deviations: one in 1e19 normal samples is larger
SUPERVISING, INTERVENING, REFRACTORY = 0.0, 1.0, 2.0


class Step(NamedTuple):
    """A change of the trigger's mode; `event` is its name in the trace: trigger, release or ''."""

    t_s: float
    event: str
    mode: float


@dataclass(frozen=True)
class Variable:
    """x(t) = ||rho_rd(t) - rho(t)|| + n(t), where both are linear in time between knots; x is monotone there."""

    t_s: Array  # knots, (K,)
    parts_m: Array  # rho_rd - rho and n at the knots, (K, 4)
    x_m: Array  # x at the knots, (K,)

    def at(self, t_s: float) -> float:
        """Value of x at a time, m."""
        parts = np.array([np.interp(t_s, self.t_s, part) for part in self.parts_m.T])
        return float(np.linalg.norm(parts[:3]) + parts[3])

    def reaches(self, level_m: float, after_s: float, *, above: bool) -> float | None:
        """First time after `after_s` at which x is at or above the level, or below it if not `above`; by bisection."""
        later = np.flatnonzero(((self.x_m >= level_m) == above) & (self.t_s > after_s))
        if not len(later):
            return None
        low, high = max(after_s, float(self.t_s[later[0] - 1])), float(self.t_s[later[0]])
        for _ in range(60):
            middle = (low + high) / 2.0
            there = (self.at(middle) >= level_m) == above
            low, high = (low, middle) if there else (middle, high)
        return high


def decision_variable(run: Run, ugv: str) -> Variable:
    return _variable(run, ugv, run.column(f"{ugv}.noise_m"))


def _variable(run: Run, ugv: str, noise_m: Array) -> Variable:
    """x with this noise, (T,), m, cut at the preset's corners and at x's turning points."""
    corners = run.presets[ugv].corner_s
    t = np.union1d(run.t_s, corners[(corners > run.t_s[0]) & (corners < run.t_s[-1])])
    moving = np.column_stack([run.position_m[ugv], noise_m])
    parts = _interpolated(run.t_s, moving, t)
    parts[:, :3] = run.presets[ugv].position_m(t) - parts[:, :3]
    knots = np.union1d(t, _turning_points_s(t, parts))
    at_knots = _interpolated(t, parts, knots)
    return Variable(knots, at_knots, np.linalg.norm(at_knots[:, :3], axis=1) + at_knots[:, 3])


def _interpolated(t_s: Array, values: Array, at_s: Array) -> Array:
    return np.stack([np.interp(at_s, t_s, column) for column in values.T], axis=1)


def _turning_points_s(t_s: Array, parts_m: Array) -> Array:
    """Times at which x has a minimum within a segment."""
    # On a segment x(u) = ||r + u w|| + n + u m, 0 <= u <= 1. With L = ||w||, the point u0 = -r.w / L^2 of least norm c,
    # and v = L (u - u0): ||r + u w|| = sqrt(c^2 + v^2). So x' = L v / sqrt(c^2 + v^2) + m is 0 at v = -m c / sqrt(L^2 -
    # m^2) if |m| < L, and nowhere else.
    step = np.diff(parts_m, axis=0)
    turns = np.linalg.norm(step[:, :3], axis=1) > np.abs(step[:, 3])
    r, w, m = parts_m[:-1][turns, :3], step[turns, :3], step[turns, 3]
    length = np.linalg.norm(w, axis=1)
    u0 = -(r * w).sum(axis=1) / length**2
    c = np.linalg.norm(r + u0[:, None] * w, axis=1)
    u = u0 - m * c / np.sqrt(length**2 - m**2) / length
    inside = (u > 0.0) & (u < 1.0)
    return np.asarray((t_s[:-1][turns] + u * np.diff(t_s)[turns])[inside])


def automaton(x: Variable, levels: Levels) -> list[Step]:
    # It triggers when x reaches zeta while supervising, also at t = 0; it releases when x falls below the release
    # level. A release before the dwell after the trigger is over leads to a rest until then, and a trigger at its end
    # if x is still at zeta or above.
    steps: list[Step] = []
    trigger = float(x.t_s[0]) if x.x_m[0] >= levels.zeta_m else x.reaches(levels.zeta_m, float(x.t_s[0]), above=True)
    while trigger is not None:
        steps.append(Step(trigger, "trigger", INTERVENING))
        release, rested = x.reaches(levels.release_m, trigger, above=False), trigger + levels.dwell_s
        if release is None:
            break
        steps.append(Step(release, "release", REFRACTORY if release < rested else SUPERVISING))
        if release >= rested:
            trigger = x.reaches(levels.zeta_m, release, above=True)
        elif rested > x.t_s[-1]:
            break
        else:
            steps.append(Step(rested, "", SUPERVISING))
            still_above = x.at(rested) >= levels.zeta_m
            trigger = rested if still_above else x.reaches(levels.zeta_m, rested, above=True)
    return steps


def thr_trig(run: Run) -> Found:
    """THR-TRIG: the recorded triggers, releases, modes and noise are those of (15) and of the automaton run on x."""
    lags_s: list[float] = []
    least, most = 0, 0
    try:
        for ugv in run.ugvs:
            x = decision_variable(run, ugv)
            steps = automaton(x, run.levels)
            at_rows = np.interp(run.t_s, x.t_s, x.x_m)  # rows are knots
            recorded = run.column(f"{ugv}.decision_variable_m")
            close("decision variable", recorded, at_rows, within=VARIABLE_M, about=ugv, t_s=run.t_s)
            lags_s += _lags_s(run, ugv, steps)
            least += _transitions(steps, before_s=float(run.t_s[-1]) - EVENT_S, at_once_s=EVENT_S)
            most += _transitions(steps, before_s=np.inf, at_once_s=0.0)
            _modes_are_the_automatons(run, ugv, steps)
            _noise_moves_as_it_must(run, ugv)
    except Disagreement as broken:
        return Found("refuted", because=broken)
    margin = EVENT_S - max(lags_s) if lags_s else None
    return Found("holds", margin, (least, most))


def _transitions(steps: list[Step], before_s: float, at_once_s: float) -> int:
    """Number of transitions before a time; the end of a rest and a trigger within `at_once_s` of it count as one."""
    ends_of_a_rest_with_a_trigger = sum(
        before.event == "" and after.event == "trigger" and after.t_s - before.t_s <= at_once_s
        for before, after in pairwise(steps)
    )
    return sum(step.t_s < before_s for step in steps) - ends_of_a_rest_with_a_trigger


def _lags_s(run: Run, ugv: str, steps: list[Step]) -> list[float]:
    """Differences of recorded and recomputed event times, s; an event in the last 1e-5 s may be missing in one."""
    ours = [(step.t_s, step.event) for step in steps if step.event]
    theirs = sorted((float(when), kind) for kind in ("trigger", "release") for when in run.times_s(ugv, kind))
    lags: list[float] = []
    for recomputed, recorded in zip_longest(ours, theirs):
        first_s = min(event[0] for event in (recomputed, recorded) if event is not None)
        if recomputed is not None and recorded is not None:
            lags.append(abs(recomputed[0] - recorded[0]))
            fits = recomputed[1] == recorded[1] and lags[-1] <= EVENT_S
        else:
            fits = first_s >= run.t_s[-1] - EVENT_S
        if not fits:
            raise Disagreement("triggers and releases", recorded, recomputed, ugv, first_s)
    return lags


def _modes_are_the_automatons(run: Run, ugv: str, steps: list[Step]) -> None:
    """The recorded mode is the automaton's just before or just after the row."""
    times = np.array([step.t_s for step in steps])
    modes = np.array([SUPERVISING, *(step.mode for step in steps)])
    before = modes[np.searchsorted(times, run.t_s - EVENT_S)]
    after = modes[np.searchsorted(times, run.t_s + EVENT_S)]
    recorded = run.column(f"{ugv}.mode")
    holds("mode", (recorded == before) | (recorded == after), recorded, after, about=ugv, t_s=run.t_s)


def _noise_moves_as_it_must(run: Run, ugv: str) -> None:
    """The noise obeys (15) from 0, by Euler's method, with one sample for each noise period."""
    decision = run.scenario["decision"]
    noise = run.column(f"{ugv}.noise_m")
    end = run.t_s[1:]
    close("noise at the start", noise[0], 0.0, within=NOISE_M, about=ugv, t_s=float(run.t_s[0]))
    step = np.diff(run.t_s)
    driven = noise[1:] - noise[:-1] * (1.0 - decision["leak_1_s"] * step)
    period = np.floor((end - step / 2.0) / decision["noise_period_s"])
    by_length = np.lexsort((step, period))
    longest = by_length[np.append(np.diff(period[by_length]) > 0, True)]  # row of each period with the longest step
    sample = (driven / step)[longest][np.searchsorted(period[longest], period)]
    close("noise of one sample", driven, sample * step, within=NOISE_M, about=ugv, t_s=end)
    most = LARGEST_SAMPLE * decision["noise_m_sqrt_s"] / decision["noise_period_s"] ** 0.5
    small = np.abs(sample) * step <= most * step + NOISE_M
    holds("sample of the noise", small, np.abs(sample), f"{most} at most", about=ugv, t_s=end)


def zeno_trace(run: Run) -> Found:
    """ZENO-TRACE: t_(k+1) - t_k >= min_inter_event_s for consecutive triggers of each UGV."""
    bound = float(run.scenario["decision"]["min_inter_event_s"])
    if bound <= 0.0:
        return Found("not_run")
    gaps: list[float] = []
    for ugv in run.ugvs:
        gaps += np.diff(run.times_s(ugv, "trigger")).tolist()
    if not gaps:
        return Found("holds", exercised=(0, 0))
    margin = min(gaps) - bound
    return Found("holds" if margin >= -SMALL else "refuted", margin, (len(gaps), len(gaps)))


def thr_quality(run: Run) -> Found:
    """THR-QUALITY: at triggers, and in excursions without one, the noise-free error is within w of the threshold."""
    # w is the width of the hysteresis; half the threshold for the bare trigger.
    zeta, release = run.levels.zeta_m, run.levels.release_m
    tolerance = zeta - release if release < zeta else zeta / 2.0
    off: list[float] = []
    for ugv in run.ugvs:
        error = _variable(run, ugv, np.zeros(len(run.t_s)))
        triggers, releases = run.times_s(ugv, "trigger").tolist(), run.times_s(ugv, "release").tolist()
        off += _off_m(error, run.levels, tolerance, triggers, releases)
    if not off:
        return Found("holds", exercised=(0, 0))
    margin = tolerance - max(off)
    return Found("holds" if margin >= 0.0 else "refuted", margin, (len(off), len(off)))


def _off_m(
    error: Variable, levels: Levels, tolerance: float, triggers: list[float], releases: list[float]
) -> Iterator[float]:
    """Distance of the error from the threshold at each trigger, and in each missed excursion."""
    begin_s, end_s = float(error.t_s[0]), float(error.t_s[-1])
    for trigger in [*triggers, None]:
        if trigger is None and begin_s >= end_s:  # the dwell outlasts the run
            return
        until = end_s if trigger is None else trigger
        excursions = list(_excursions(error, levels, min(begin_s, until), until))
        serves = trigger is not None and bool(excursions) and excursions[-1][1] == until
        missed = [_largest(error, *span) - levels.zeta_m for span in (excursions[:-1] if serves else excursions)]
        yield from (above for above in missed if above > tolerance)
        if trigger is None:
            continue
        if not serves:
            yield max(levels.zeta_m - error.at(trigger), 0.0)
        else:
            late = trigger - excursions[-1][0] > EVENT_S
            yield max(_largest(error, excursions[-1][0], trigger) - levels.zeta_m, 0.0) if late else 0.0
        after = [release for release in releases if release >= trigger]
        if not after:  # triggered to the end
            return
        begin_s = max(after[0], trigger + levels.dwell_s)


def _excursions(error: Variable, levels: Levels, begin_s: float, end_s: float) -> Iterator[tuple[float, float]]:
    """Begin and end of each excursion: the error reaches the threshold, and falls below the release level."""
    at_s: float | None = begin_s
    while at_s is not None and at_s <= end_s:
        start = at_s if error.at(at_s) >= levels.zeta_m else error.reaches(levels.zeta_m, at_s, above=True)
        if start is None or start > end_s:
            return
        at_s = error.reaches(levels.release_m, start, above=False)
        yield start, end_s if at_s is None else min(at_s, end_s)


def _largest(error: Variable, begin_s: float, end_s: float) -> float:
    """Largest error between two times, m."""
    inside = error.x_m[(error.t_s >= begin_s) & (error.t_s <= end_s)]
    return max(error.at(begin_s), error.at(end_s), *inside.tolist())
