"""LIVE-PROG: every accepted intervention kept its predicted progress, and every answer has its reason (method (d))."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from airground_drake.arrays import Array
from airground_drake.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.segments import interpolate
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.beginnings import discovers
from airground_drake.verify.runs.gate_record import GateClaim, Off, Row, conclude
from airground_drake.verify.runs.outcome_rolls import foreseen
from airground_drake.verify.runs.proposals import Sent, proposals_of

LAG_TOLERANCE_M = 1e-6
"""Recorded and recomputed lags may differ by this, m: positions of the recomputed roll-out do."""
NO_DIFFERENCE = 1e-6
"""Relative gain from which on an outcome is better."""
METHOD = "d"


@dataclass
class Patience:
    """What a UGV has gone along with so far, by the decisions before.

    Attributes:
        tries: acceptances since the last rest.
        since: when it was last on its own, or began to be, s.
        until: when what it executes is over, s; None if it is on its own.
        on_time: when it was last no farther behind than it may be, s.
        lags: predicted distances from where it is to be, at the control samples since they were predicted, m.
        begun: when they were predicted, s.
    """

    tries: int = 0
    since: float = 0.0
    until: float | None = None
    on_time: float = 0.0
    lags: Array | None = None
    begun: float = 0.0


class LiveProg(GateClaim):
    """LIVE-PROG."""

    id = "LIVE-PROG"
    summary = "An accepted intervention went as predicted, or was given back in time."
    statement = (
        "Every accepted intervention stayed as near to where it was to be as predicted at its acceptance, or was given "
        "back after the time that the UGV waits, or at the end of its time; no UGV went along more often without a "
        "rest than it may; and every answer is the one that follows, with its reason."
    )
    formula = (
        "lag(t) = ||J^+ J (p(t) - rho_int(t))||, predicted along the roll-out; not for longer than behind_s lag > "
        "predicted + lag_m; accepted(t0) to min(end of motion, t0 + longest_s); tries <= most, 0 after rest_s on its "
        "own; first answer: accept iff tries left and (stalls, cost) of accepting is better than of refusing by 1e-6, "
        "or it is another UGV's trigger and accepting does not stall; so again, at no try, when an obstacle is sensed "
        "that is not on the proposal's map"
    )
    latex = (
        r"\text{lag}(t) = \lVert J^+ J (p(t) - \rho_{int}(t)) \rVert",
        r"\text{lag} > \text{lag}_{\text{predicted}} + \ell \quad \text{for no longer than } "
        r"\tau_{\text{behind}}",
        r"\text{accepted from } t_0 \text{ to } \min(t_{\text{motion}}, t_0 + \tau_{\text{longest}}), \quad "
        r"\text{tries} \le N",
        r"\text{accept} \Leftrightarrow (\text{stalls}, V)_{\text{accept}} < (\text{stalls}, "
        r"V)_{\text{refuse}} \text{ and tries are left, or it makes way}",
    )
    method = (
        "The decisions of each UGV are gone through by time; lags from the signals and the table of proposals, "
        "predicted ones from the roll-out of GATE-MODEL, repeated; the answer and its reason by the rules, from the "
        "recorded outcomes."
    )
    equations = "(20)"
    assumptions = (
        "The outcomes of either choice are the recorded ones (GATE-MODEL recomputes them).",
        "A sample of the gatekeeper at which the proposal is no longer in force is the first after its last decision.",
    )
    does_not_establish = (
        "That an intervention was of use, or that the UGV arrives (LIVE-GOAL); that the prediction is right: it says "
        "how far the UGV was from it."
    )

    exercised_by = "decisions that accepted a proposal, at first or again"

    def applies(self, trace: Trace) -> bool:
        """Only method (d) predicts progress."""
        return trace.meta.get("method") == METHOD

    def judge_rows(self, trace: Trace, rows: list[Row]) -> Finding:
        """Go through the decisions; the margin is what is left of the time for which a UGV may be behind."""
        sent, gate = proposals_of(trace), trace.scenario["gatekeeper"]
        compared = list[Off]()
        longest_behind, largest, accepted = 0.0, 0.0, 0
        for ugv in trace.ugvs:
            mine = [row for row in rows if row.given["robot"] == ugv]
            patience = Patience()
            last: Row | None = None
            for row in mine:
                found = list(judge_decision(trace, row, last, patience, sent))
                compared += found
                last = row
                if any(one.wrong for one in found):
                    break  # what follows rests on it
                if row.given["lag_m"] >= 0.0 and row.given["decision"] == "accept":
                    accepted += 1
                    largest = max(largest, float(row.given["lag_m"] - row.given["predicted_lag_m"]))
                    longest_behind = max(longest_behind, float(row.given["t_s"]) - patience.on_time)
        finding = Finding(
            "holds",
            margin=gate["behind_s"] - longest_behind,
            unit="s",
            quantity="time for which a UGV may be behind, less the longest that one was while it executed a proposal",
            evidence={
                "decisions": len(rows),
                "executing": accepted,
                "farthest_behind_prediction_m": largest,
                "reasons": {str(k): int(v) for k, v in trace.decisions["reason"].value_counts().items()},
                "most_tries": float(trace.decisions["tries"].max()),
                "leave_a_direction": leaving_a_direction(trace, sent),
            },
            exercised=accepted,
        )
        return conclude(finding, compared)


def leaving_a_direction(trace: Trace, sent: Sequence[Sent]) -> int:
    """How many accepted proposals leave a direction of the plane to the own task: LIVE-GATE assumes that none does."""
    accepted = trace.decisions[trace.decisions["decision"] == "accept"]
    which = set(accepted["number"])
    whole = [np.allclose(one.chosen[:2, :2], np.eye(2)) for one in sent if one.number in which]
    return whole.count(False)


def judge_decision(trace: Trace, row: Row, last: Row | None, patience: Patience, sent: Sequence[Sent]) -> Iterator[Off]:
    """A decision against the rules, from what is known of the UGV before; `patience` is brought up to date."""
    gate, given, t = trace.scenario["gatekeeper"], row.given, float(row.given["t_s"])
    same = last is not None and last.given["number"] == given["number"]
    standing = str(last.given["decision"]) if same and last is not None else None
    if patience.until is not None and standing != "accept" and last is not None:
        patience.until, patience.since = None, float(last.given["t_s"]) + gate["period_s"]
    on_its_own = t - patience.since - gate["rest_s"]
    if patience.until is None and on_its_own >= -TIME_TOLERANCE_S:
        certain = on_its_own > TIME_TOLERANCE_S
        accepts = given["decision"] == "accept" and standing is None
        patience.tries = 0 if certain or given["tries"] <= float(accepts) else patience.tries
    lag = predicted = -1.0
    if standing == "accept":
        lag, predicted = _lags(trace, row, patience, sent)
        if lag <= predicted + gate["lag_m"]:
            patience.on_time = t
        answer = _kept(t, patience, gate)
        on = next(one for one in sent if one.number == given["number"])
        if answer[0] == "accept" and discovers(trace, str(given["robot"]), t, on):
            answer = _by_outcome(row, on)
            if answer[0] == "accept":
                _commit(trace, given, on, patience, sent)
        if answer[0] == "refuse":
            patience.until, patience.since = None, t
    elif standing == "refuse":
        answer = ("refuse", "kept")
    else:
        on = next(one for one in sent if one.number == given["number"])
        answer = _first(row, on, patience, gate)
        if answer[0] == "accept":
            lag = predicted = _commit(trace, given, on, patience, sent)
            end = min(float(on.times_s[-1]), t + gate["longest_s"])
            patience.tries, patience.since, patience.until = patience.tries + 1, t, end
    theirs = (given["decision"], given["reason"])
    yield Off(row, "answer or reason", float(answer != theirs), 0.0, recomputed=list(answer), standing=standing)
    yield Off(row, "tries", given["tries"] - patience.tries, 0.0, recomputed=patience.tries)
    yield Off(row, "tries: more than allowed", max(0.0, given["tries"] - gate["tries"]), 0.0)
    yield Off(row, "lag, m", given["lag_m"] - lag, LAG_TOLERANCE_M, recomputed=lag)
    yield Off(row, "predicted lag, m", given["predicted_lag_m"] - predicted, LAG_TOLERANCE_M, recomputed=predicted)


def _commit(trace: Trace, given: dict[str, Any], on: Sent, patience: Patience, sent: Sequence[Sent]) -> float:
    """Keep the lags that are predicted now, where the UGV is on time; returns the first, m."""
    t, places = float(given["t_s"]), foreseen(trace, given, sent)[1].places_m
    after = trace.scenario["control"]["period_s"] * np.arange(float(len(places)))
    patience.lags = np.linalg.norm((places - on.place(t + after)) @ on.chosen.T, axis=1)
    patience.on_time = patience.begun = t
    return float(patience.lags[0])


def _lags(trace: Trace, row: Row, patience: Patience, sent: Sequence[Sent]) -> tuple[float, float]:
    """How far from where it is to be the UGV is, and was predicted to be, m."""
    t, robot = float(row.given["t_s"]), str(row.given["robot"])
    on = next(one for one in sent if one.number == row.given["number"])
    away = on.chosen @ (interpolate(trace.t, trace.position(robot), t) - on.place(t))
    assert patience.lags is not None
    k = min(round((t - patience.begun) / trace.scenario["control"]["period_s"]), len(patience.lags) - 1)
    return float(np.linalg.norm(away)), float(patience.lags[k])


def _kept(t: float, patience: Patience, gate: dict[str, Any]) -> tuple[str, str]:
    """Whether what is executed goes on."""
    if t - patience.on_time > gate["behind_s"]:
        return "refuse", "no_progress"
    assert patience.until is not None
    return ("refuse", "over") if t >= patience.until else ("accept", "kept")


def _first(row: Row, on: Sent, patience: Patience, gate: dict[str, Any]) -> tuple[str, str]:
    """The first answer to a proposal."""
    return ("refuse", "exhausted") if patience.tries >= gate["tries"] else _by_outcome(row, on)


def _by_outcome(row: Row, on: Sent) -> tuple[str, str]:
    """The answer that follows from the recorded outcomes."""
    given = row.given
    if given["accept_stalls"] < 0.0:
        return "refuse", "no_plan"
    stalls, cost = ([float(given[f"{choice}_{what}"]) for choice in ("refuse", "accept")] for what in
                    ("stalls", "outcome_m2_s"))  # fmt: skip
    better = stalls[1] < stalls[0] or (stalls[1] == stalls[0] and cost[1] < (1.0 - NO_DIFFERENCE) * cost[0])
    if better:
        return "accept", "cheaper"
    if stalls[1] == 1.0:
        return "refuse", "stalls"
    return ("accept", "makes_way") if on.cause != on.ugv else ("refuse", "not_cheaper")
