"""THR-TRIG: the events and modes of a run against those of the trigger (20), run again on it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise, zip_longest
from typing import Any, NamedTuple

import numpy as np

from airground_drake.base.errors import TraceError
from airground_drake.base.exact import decimal
from airground_drake.scenario.schema import Decision, Threshold
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TraceClaim
from airground_drake.verify.engines.geometry import NormSignal
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.theorem import Hypothesis, grounds
from airground_drake.verify.runs.triggers import (
    Conflict,
    Transition,
    column_conflict,
    decision_variable,
    noise_conflict,
    recorded_events,
    recorded_variable,
    transitions,
)

# Recorded and recomputed events may differ by this, s: ten times the accuracy of the simulator's event isolation.
EVENT_TOLERANCE_S = 1e-5

# Recorded and recomputed decision variables may differ by this, m: x moves less within the event isolation.
VARIABLE_TOLERANCE_M = 1e-6

# Mode after each kind of transition: 'refractory' is a release before the dwell is over, 'resume' the end of it.
MODES = {"trigger": 1, "release": 0, "refractory": 2, "resume": 0}

# Event that the trace has for a transition.
EVENT_KINDS = {"trigger": "trigger", "release": "release", "refractory": "release"}


def _is_root(rule: Threshold, zeta: float) -> bool:
    """Whether zeta, m, solves (19), with c2/c1 on the right or as printed, by the signs of its residual beside it."""
    ratio = rule.c2 / rule.c1_1_s if rule.rule == "bayes" else rule.c1_1_s / rule.c2
    level = ratio * (rule.drift_m_s / rule.noise_m_sqrt_s) ** 2
    u = [2.0 * side * zeta * rule.drift_m_s / rule.noise_m_sqrt_s**2 for side in (1.0 - 1e-9, 1.0 + 1e-9)]
    return math.sinh(u[0]) + u[0] <= level <= math.sinh(u[1]) + u[1]


class ThrTrig(TraceClaim):
    id = "THR-TRIG"
    subject = "triggers"
    summary = (
        "The UAV intervened exactly when the decision variable reached the threshold: never late, never without cause."
    )
    statement = (
        "The UAV triggered exactly when the decision variable reached the threshold, without missing or spurious "
        "triggers. After a crossing within the minimum inter-event time, it triggered at the end of this time if the "
        "variable was still above. No crossing between two updates was missed, however short, and none was invented. "
        "The noise in the variable obeys (15), with one sample for each of its periods."
    )
    latex = (
        r"x(t) = \lVert \rho_{rd}(t) - \rho(t) \rVert + n(t)",
        r"\text{recorded triggers and releases} = \text{automaton}(x), \quad |\Delta t| \le 10^{-5} \text{ "
        r"s}, \quad |\Delta x| \le 10^{-6} \text{ m}",
        r"n(0) = 0, \quad \dot n = \sigma w_k / \sqrt{h} - \lambda n, \quad |w_k| \le 9",
        r"x(s) = \lVert e_0 + s (e_1 - e_0) \rVert + n_0 + s (n_1 - n_0), \; s \in [0, 1]: \quad "
        r"\max x = \max(x(0), x(1)), \quad \min x = \min(x(0), x(1), p w + \text{const})",
    )
    method = (
        "(15) is rebuilt from positions, noise and the scenario's preset. The recorded x, the input of the trigger, is "
        "compared with it at every row: `port_against_15` in the evidence. If they agree, the rebuilt x is used "
        "between rows, too; if not, or if another block computes x, x is taken as linear between rows. It is cut at "
        "the preset's corners and at its turning points (closed form) into monotone pieces; crossings are then sign "
        "changes, located by Brent's method to 1e-12 s. The automaton is run again on x, and its events and the mode "
        "column are compared one by one. All rows within one noise period must contain the same noise sample, after "
        "correction for the leak. Theorems in Coq show that the running trigger misses nothing in a step: the largest "
        "value of x is at an end, and the least one has a closed form, with p the distance of the error's line from 0, "
        "k = (n1 - n0)/|e1 - e0| and w = sqrt(1 - k^2). The evidence has their hypotheses: the noise changes its rate "
        "at control samples only. Tests compare the running trigger with dense sampling."
    )
    equations = "(15), (20)"
    assumptions = (
        "Positions and integrated noise are linear in time between rows.",
        "The threshold in force is the one recorded in the trace: the scenario's, or the root of (19) by its rule.",
        "Events in the last 1e-5 s of the run may be on either side of its end.",
        "Where another block computes x (`decision_block` in the trace), x is linear in time between rows.",
        "Drake locates the sign change of a witness within a step; crossings are then late by at most 1e-6 s, or by at"
        " most 1e-9 s in steps shorter than that, which Drake does not search.",
    )
    does_not_establish = (
        "That the threshold is a good one (THR-CHOICE); that the noise has the stated distribution (THR-DDM), or the "
        "stated leak if no row lies within a noise period; or anything about a Wiener path between the noise samples. "
        "If x only touches a level to within rounding, 1e-12 m, the verdict depends on rounding. Two crossings less "
        "than 1e-6 s apart may be treated as simultaneous. If a hypothesis fails, the theorems say nothing about other "
        "runs of the scenario."
    )

    theorems = ("Isolation.largest_at_an_end", "Isolation.nowhere_below", "Isolation.attained")
    exercised_by = "transitions of the automaton that were due"

    def check(self, trace: Trace) -> Finding:
        """Compare the events of each UGV with the recomputed ones; the first disagreement is the counterexample."""
        levels = levels_of(trace)
        judged = [_judged(trace, ugv, levels) for ugv in trace.ugvs]
        wrong = [*_of_strangers(trace), *(conflict for ugv in judged for conflict in ugv.wrong)]
        expected = Counter(kind for ugv in judged for kind in _as_transitions(ugv.predicted))
        replayed = [ugv.evidence for ugv in judged]
        lags = [(replay["worst_time_difference_s"], replay["robot"]) for replay in replayed if replay["events"]]
        worst = max(lags) if lags and not wrong else None
        return Finding(
            "refuted" if wrong else "holds",
            margin=EVENT_TOLERANCE_S - worst[0] if worst else None,
            unit="s",
            quantity="time left by which an event may differ from the crossing",
            where={"robot": worst[1]} if worst else {},
            counterexample=min(wrong, key=lambda conflict: float(conflict["t_s"])) if wrong else None,
            evidence={
                "ugvs": replayed,
                "decision_block": _block(trace) or "that of (15)",
                **levels._asdict(),
                "transitions_due": dict(expected),
                **isolation(trace.scenario.decision.noise_period_s, trace.scenario.control.period_s, levels),
            },
            exercised=expected.total(),
        )


def isolation(noise_period_s: float, period_s: float, levels: TriggerLevels) -> dict[str, Any]:
    """Whether the theorems of Isolation.v apply, in words, and their hypotheses."""
    steps = decimal(noise_period_s) / decimal(period_s)
    says = f"the noise period is a whole number of control periods: {float(steps):g}"
    hypotheses = [
        Hypothesis.of("threshold", "the threshold is above 0", decimal(levels.zeta_m), "m", strict=True),
        Hypothesis.of("noise periods beside control samples", says, -(steps % 1)),
        Hypothesis.of("control periods in a noise period", "there is at least one", steps - 1),
    ]
    ground = grounds(ThrTrig.theorems, hypotheses)
    return {"isolation": ground.get("reason", ground["proof"]), "hypotheses": hypotheses}


class TriggerLevels(NamedTuple):
    """Threshold and release level of the trigger in force, m, and its dwell, s."""

    zeta_m: float
    release_m: float
    dwell_s: float


def levels_of(trace: Trace) -> TriggerLevels:
    return levels_by(trace.scenario.decision, float(trace.meta["zeta_m"]))


def levels_by(decision: Decision, zeta: float) -> TriggerLevels:
    """The levels by a scenario, with the threshold in force, m; TraceError if that is not the scenario's."""
    rule = decision.threshold
    if rule.rule == "fixed" and rule.zeta_m != zeta:
        raise TraceError(f"the threshold in force, {zeta} m, is not the scenario's")
    if rule.rule != "fixed" and not _is_root(rule, zeta):
        raise TraceError(f"the threshold in force, {zeta} m, is not what the scenario's rule computes")
    return TriggerLevels(*decision.levels(zeta))


def _block(trace: Trace) -> str:
    """The name of the block that computes the decision variable; '' for (15) itself."""
    return str(trace.meta.get("decision_block", ""))


def _of_strangers(trace: Trace) -> Iterator[Conflict]:
    """Triggers and releases of robots that are not UGVs."""
    for event in trace.events:
        if event["kind"] in ("trigger", "release") and event["robot"] not in trace.ugvs:
            what = f"spurious {event['kind']}: not a UGV"
            yield {"robot": str(event["robot"]), "t_s": float(event["t_s"]), "what": what}


class Reconstruction(NamedTuple):
    """The trigger of a UGV, run again."""

    evidence: dict[str, Any]  # `events` are those that the trace must have
    predicted: list[Transition]  # the automaton's
    wrong: list[Conflict]  # all disagreements


def _judged(trace: Trace, ugv: str, levels: TriggerLevels) -> Reconstruction:
    """Run the automaton again for a UGV, and compare all records with that."""
    x, against_15, off = _variable(trace, ugv)
    predicted = list(transitions(x, *levels))
    expected = [(time, EVENT_KINDS[kind]) for time, kind in predicted if kind in EVENT_KINDS]
    recorded = recorded_events(trace, ugv)
    lag, mismatch = _compare(expected, recorded, x)
    columns = column_conflict(trace, ugv, recorded)
    modes = _mode_conflict(trace, ugv, predicted)
    conflicts = (off, mismatch, columns, modes, noise_conflict(trace, ugv))
    evidence = {
        "robot": ugv,
        "events": [{"t_s": time, "kind": kind} for time, kind in expected],
        "worst_time_difference_s": lag,
        "largest_decision_variable_m": float(x.x.max()),
        "port_against_15": against_15,
    }
    wrong = [{"robot": ugv, **conflict} for conflict in conflicts if conflict is not None]
    return Reconstruction(evidence, predicted, wrong)


def _as_transitions(predicted: list[Transition]) -> Iterator[str]:
    """The automaton's transitions by name: the end of the dwell is one, also with a trigger at the same instant."""
    before = ""
    for (time, kind), (later, then) in pairwise([*predicted, (math.inf, "")]):
        at_once = kind == "resume" and (later, then) == (time, "trigger")
        if not at_once:
            yield "retrigger" if before == "at once" else kind
        before = "at once" if at_once else kind


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


def _variable(trace: Trace, ugv: str) -> tuple[NormSignal, dict[str, Any], Conflict | None]:
    """The trigger's decision variable, its comparison with (15), and the first row that differs."""
    recorded = recorded_variable(trace, ugv)
    if _block(trace):
        return recorded, {"status": "not_run", "reason": "another block computes the decision variable"}, None
    rebuilt = decision_variable(trace, ugv)
    value = rebuilt.at(trace.t)
    port = trace.column(f"{ugv}.decision_variable_m")
    off = np.abs(port - value)
    compared = {"status": "holds", "largest_difference_m": float(off.max())}
    if not (off > VARIABLE_TOLERANCE_M).any():
        return rebuilt, compared, None
    k = int(np.argmax(off > VARIABLE_TOLERANCE_M))
    conflict = {
        "t_s": float(trace.t[k]),
        "what": "recorded decision variable is not that of (15)",
        "decision_variable_m": float(value[k]),
        "recorded_m": float(port[k]),
        "difference_m": float(off[k]),
    }
    return recorded, {**compared, "status": "refuted"}, conflict


def _mode_conflict(trace: Trace, ugv: str, predicted: list[Transition]) -> Conflict | None:
    """First row at which the recorded mode is not the recomputed one."""
    t, mode = trace.t, trace.column(f"{ugv}.mode")
    times = np.array([time for time, _ in predicted])
    modes = np.array([0, *(MODES[kind] for _, kind in predicted)])
    sides = [modes[np.searchsorted(times, t + shift)] for shift in (-EVENT_TOLERANCE_S, EVENT_TOLERANCE_S)]
    wrong = (mode != sides[0]) & (mode != sides[1])
    if not wrong.any():
        return None
    k = int(np.argmax(wrong))
    return {"t_s": float(t[k]), "what": "recorded mode", "mode": int(sides[1][k]), "recorded_mode": float(mode[k])}
