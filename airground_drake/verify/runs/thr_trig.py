"""ZENO-TRACE and THR-TRIG: the trigger (20) of a run, re-evaluated from positions, preset and noise.

The decision variable x(t) = ||rho_rd(t) - rho(t)|| + n(t) is, between rows, the norm of a vector that is linear
in time plus a number that is linear in time, so its turning points and crossings are found exactly.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise, zip_longest
from typing import Any

import numpy as np

from airground_drake.errors import TraceError
from airground_drake.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S, Finding, TraceClaim
from airground_drake.verify.engines.segments import NormSignal, corner_times, interpolate, travelled

EVENT_TOLERANCE_S = 1e-5
"""Recorded and recomputed events may differ by this, s: ten times the accuracy of the simulator's event isolation."""
VARIABLE_TOLERANCE_M = 1e-6
"""Recorded and recomputed decision variables may differ by this, m: x moves less within the event isolation."""
MODES = {"trigger": 1, "release": 0, "refractory": 2, "resume": 0}
"""Mode after each kind of transition: 'refractory' is a release before the dwell is over, 'resume' the end of it."""
EVENT_KINDS = {"trigger": "trigger", "release": "release", "refractory": "release"}
"""Event that the trace has for a transition."""

Transition = tuple[float, str]
"""Time in s, and a key of MODES or kind of event."""
Conflict = dict[str, Any]
"""What disagrees: `t_s`, `what`, and the values on both sides."""


def decision_variable(trace: Trace, ugv: str) -> NormSignal:
    """x(t) of (15) from positions and noise of the trace and the preset of its scenario, not the recorded one."""
    rows, preset = trace.t, trace.scenario["ugvs"][ugv]["preset"]
    waypoints, speed = np.asarray(preset["waypoints_m"], dtype=np.float64), preset["speed_m_s"]
    corners = corner_times(waypoints, speed)
    t = np.union1d(rows, corners[(corners > rows[0]) & (corners < rows[-1])])
    parts = interpolate(rows, np.column_stack([trace.position(ugv), trace.column(f"{ugv}.noise_m")]), t)
    parts[:, :3] = travelled(waypoints, speed, t) - parts[:, :3]
    return NormSignal.of(t, parts)


def transitions(x: NormSignal, zeta: float, release: float, dwell: float) -> Iterator[Transition]:
    """Run the trigger automaton on x: levels zeta >= release, m, and dwell, s (release = zeta, dwell = 0: bare)."""
    released, resume = -np.inf, float(x.t[0])
    while resume <= x.t[-1]:
        waited = resume > released  # at the start or the end of a refractory time x may be above already
        if waited and np.isfinite(released):
            yield resume, "resume"
        trigger = resume if waited and x.at(resume) >= zeta else x.reaches(zeta, resume, above=True)
        if trigger is None:
            return
        yield trigger, "trigger"
        found = x.reaches(release, trigger, above=False)
        if found is None:
            return
        released, resume = found, max(found, trigger + dwell)
        yield released, "refractory" if resume > released else "release"


def _recorded(trace: Trace, ugv: str) -> list[Transition]:
    """Trigger and release events of a UGV by time."""
    found = [(float(e["t_s"]), str(e["kind"])) for e in trace.events if e["robot"] == ugv]
    return sorted(event for event in found if event[1] in ("trigger", "release"))


def _column_conflict(trace: Trace, ugv: str, events: list[Transition]) -> Conflict | None:
    """First row at which the columns on triggers and releases do not agree with the events before it."""
    t = trace.t
    for kind, name in (("trigger", "triggered_at_s"), ("release", "released_at_s")):
        times = np.array([-1.0, *(time for time, what in events if what == kind)])
        counts = [np.searchsorted(times[1:], t + shift) for shift in (-TIME_TOLERANCE_S, TIME_TOLERANCE_S)]
        value = trace.column(f"{ugv}.{name}")
        wrong = np.all([np.abs(value - times[n]) > TIME_TOLERANCE_S for n in counts], axis=0)
        if kind == "trigger":
            wrong |= np.all([trace.column(f"{ugv}.triggers") != n for n in counts], axis=0)
        if wrong.any():
            k = int(np.argmax(wrong))
            return {"robot": ugv, "t_s": float(t[k]), "what": f"column {name} or count disagrees with the events"}
    return None


class ZenoTrace(TraceClaim):
    """ZENO-TRACE."""

    id = "ZENO-TRACE"
    statement = "In this run no UGV was triggered twice within the minimum inter-event time."
    formula = "t_(k+1) - t_k >= min_inter_event_s for consecutive triggers of each UGV, tolerance 1e-9 s"
    method = (
        "Differences of the recorded trigger times; the events must agree with the columns triggers, triggered_at_s "
        "and released_at_s at every row, otherwise the verdict is `error`. A bare trigger is held to the same bound."
    )
    equations = "(20)"
    assumptions = ("The trace records every trigger (THR-TRIG recomputes them independently).",)
    does_not_establish = (
        "Absence of Zeno behaviour in other runs: a finite run has finitely many events whatever the trigger is. The "
        "statement for all runs is ZENO-PROOF, that about refined noise ZENO-REFINE. With fewer than two triggers the "
        "claim holds for lack of a gap (the margin is then empty)."
    )

    def check(self, trace: Trace) -> Finding:
        """Compare the smallest gap of each UGV with the bound."""
        bound = float(trace.scenario["decision"]["min_inter_event_s"])
        if bound <= 0.0:
            return Finding("not_run", evidence={"reason": "min_inter_event_s is 0: no bound to compare with"})
        triggers: dict[str, list[float]] = {}
        for ugv in trace.ugvs:
            events = _recorded(trace, ugv)
            if conflict := _column_conflict(trace, ugv, events):
                raise TraceError(f"events and columns disagree: {conflict}")
            triggers[ugv] = [time for time, kind in events if kind == "trigger"]
        gaps = [
            (after - before, ugv, before, after) for ugv, times in triggers.items() for before, after in pairwise(times)
        ]
        evidence = {
            "triggers": {ugv: {"count": len(times), "t_s": times} for ugv, times in triggers.items()},
            "bound_s": bound,
            "most_triggers_possible": int(trace.scenario["duration_s"] / bound) + 1,
        }
        if not gaps:
            return Finding("holds", evidence=evidence | {"reason": "no UGV was triggered twice"})
        gap, ugv, before, after = min(gaps)
        smallest = {"robot": ugv, "previous_t_s": before, "t_s": after, "gap_s": gap}
        held = gap >= bound - TIME_TOLERANCE_S
        return Finding(
            "holds" if held else "refuted",
            margin=gap - bound,
            unit="s",
            where={"robot": ugv, "t_s": after},
            counterexample=None if held else smallest,
            evidence=evidence | {"smallest_gap": smallest},
        )


def _is_bayes(rule: dict[str, Any], zeta: float) -> bool:
    """Whether zeta, m, solves (19) with c2/c1 on the right, by the sign of its residual on both sides."""
    level = rule["c2"] / rule["c1_1_s"] * (rule["drift_m_s"] / rule["noise_m_sqrt_s"]) ** 2
    u = [2.0 * side * zeta * rule["drift_m_s"] / rule["noise_m_sqrt_s"] ** 2 for side in (1.0 - 1e-9, 1.0 + 1e-9)]
    return math.sinh(u[0]) + u[0] <= level <= math.sinh(u[1]) + u[1]


class ThrTrig(TraceClaim):
    """THR-TRIG."""

    id = "THR-TRIG"
    statement = (
        "The UAV triggered exactly when the decision variable reached the threshold, none missing and none spurious; "
        "a crossing inside the minimum inter-event time triggers at its end if the variable is still above."
    )
    formula = (
        "recorded triggers and releases = those of the automaton run on x(t) = ||rho_rd(t) - rho(t)|| + n(t), "
        "times equal within 1e-5 s; recorded x equal within 1e-6 m at every row"
    )
    method = (
        "x is rebuilt from positions, noise and the scenario's preset, cut at the preset's corners and at its turning "
        "points (closed form) into monotone pieces; crossings are then sign changes, located by Brent's method to "
        "1e-12 s. The automaton is run again on it and its events, and the mode column, are compared one by one."
    )
    equations = "(15), (20)"
    assumptions = (
        "Positions and integrated noise are linear in time between rows.",
        "The threshold in force is the one recorded in the trace: the scenario's, or the root of (19) with c2/c1.",
        "Events in the last 1e-5 s of the run may be on either side of its end.",
    )
    does_not_establish = (
        "That the threshold is a good one (THR-ROOT, THR-OPT), that the noise has the stated distribution (THR-DDM), "
        "or anything about a Wiener path between the noise samples. Where x only touches a level to within rounding, "
        "1e-12 m, a trigger and none are equally right and the verdict follows the rounding."
    )

    def check(self, trace: Trace) -> Finding:
        """Compare the events of each UGV with the recomputed ones; the first disagreement is the counterexample."""
        decision, zeta = trace.scenario["decision"], float(trace.meta["zeta_m"])
        if decision["threshold"]["rule"] == "fixed" and decision["threshold"]["zeta_m"] != zeta:
            raise TraceError(f"the threshold in force, {zeta} m, is not the scenario's")
        if decision["threshold"]["rule"] == "bayes" and not _is_bayes(decision["threshold"], zeta):
            raise TraceError(f"the threshold in force, {zeta} m, is not the Bayes-optimal one of the scenario")
        bare = decision["trigger"] == "bare"
        release, dwell = (zeta, 0.0) if bare else (decision["release_m"], decision["min_inter_event_s"])
        wrong: list[Conflict] = [
            {"robot": str(e["robot"]), "t_s": float(e["t_s"]), "what": f"spurious {e['kind']}: not a UGV"}
            for e in trace.events
            if e["kind"] in ("trigger", "release") and e["robot"] not in trace.ugvs
        ]
        evidence: list[dict[str, Any]] = []
        lags: list[tuple[float, str]] = []
        for ugv in trace.ugvs:
            x = decision_variable(trace, ugv)
            predicted, recorded = list(transitions(x, zeta, release, dwell)), _recorded(trace, ugv)
            expected = [(time, EVENT_KINDS[kind]) for time, kind in predicted if kind in EVENT_KINDS]
            lag, mismatch = _compare(expected, recorded, x)
            found = (mismatch, _column_conflict(trace, ugv, recorded), _signal_conflict(trace, ugv, x, predicted))
            wrong += [{"robot": ugv, **conflict} for conflict in found if conflict is not None]
            lags += [(lag, ugv)] if expected else []
            evidence.append(
                {
                    "robot": ugv,
                    "events": [{"t_s": time, "kind": kind} for time, kind in expected],
                    "worst_time_difference_s": lag,
                    "largest_decision_variable_m": float(x.x.max()),
                }
            )
        worst = max(lags) if lags and not wrong else None
        return Finding(
            "refuted" if wrong else "holds",
            margin=EVENT_TOLERANCE_S - worst[0] if worst else None,
            unit="s",
            where={"robot": worst[1]} if worst else {},
            counterexample=min(wrong, key=lambda conflict: float(conflict["t_s"])) if wrong else None,
            evidence={"ugvs": evidence, "zeta_m": zeta, "release_m": release, "dwell_s": dwell},
        )


def _compare(expected: list[Transition], recorded: list[Transition], x: NormSignal) -> tuple[float, Conflict | None]:
    """Largest time difference of the events that agree, s, and the first one that does not."""
    lag, end = 0.0, float(x.t[-1]) - EVENT_TOLERANCE_S
    for ours, theirs in zip_longest(expected, recorded):
        if ours and theirs and ours[1] == theirs[1] and abs(ours[0] - theirs[0]) <= EVENT_TOLERANCE_S:
            lag = max(lag, abs(ours[0] - theirs[0]))
            continue
        time, kind = min(event for event in (ours, theirs) if event)
        if (ours and theirs) or time < end:
            what = f"{'missing' if (time, kind) == ours else 'spurious'} {kind}"
            both = {"recomputed": ours, "recorded": theirs}
            return lag, {"t_s": time, "what": what, **both, "decision_variable_m": float(x.at(time))}
    return lag, None


def _signal_conflict(trace: Trace, ugv: str, x: NormSignal, predicted: list[Transition]) -> Conflict | None:
    """First row at which the recorded decision variable or mode is not the recomputed one."""
    t, mode, value = trace.t, trace.column(f"{ugv}.mode"), x.at(trace.t)
    times, modes = np.array([time for time, _ in predicted]), np.array([0, *(MODES[kind] for _, kind in predicted)])
    sides = [modes[np.searchsorted(times, t + shift)] for shift in (-EVENT_TOLERANCE_S, EVENT_TOLERANCE_S)]
    off = np.abs(trace.column(f"{ugv}.decision_variable_m") - value)
    wrong = (off > VARIABLE_TOLERANCE_M) | ((mode != sides[0]) & (mode != sides[1]))
    if not wrong.any():
        return None
    k = int(np.argmax(wrong))
    recomputed = {"decision_variable_m": float(value[k]), "mode": int(sides[1][k])}
    difference = {"difference_m": float(off[k]), "recorded_mode": float(mode[k])}
    return {"t_s": float(t[k]), "what": "recorded decision variable or mode", **recomputed, **difference}
