"""LIVE-PROG: every accepted intervention ended for a stated reason, and every answer has its reason (method (d))."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import zip_longest

from airground_drake.run.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.beginnings import discovers
from airground_drake.verify.runs.gate_record import DecisionRecord, Deviation, GateClaim, conclude, reasons_of
from airground_drake.verify.runs.proposals import ProposalRecord, proposal_of, withdrawn_s

NO_DIFFERENCE = 1e-6
"""Relative gain from which on an outcome is better."""
METHOD = "d"


@dataclass
class Patience:
    """How often and how long a UGV has gone along so far, by the decisions before.

    Attributes:
        tries: acceptances since the last rest.
        since: when it was last on its own, or when it accepted the intervention that it executes, s.
        until: when that intervention is over, s; None if the UGV is on its own.
    """

    tries: int = 0
    since: float = 0.0
    until: float | None = None


@dataclass(frozen=True)
class Ended:
    """The evidence: counts of decisions, of accepting ones, of reasons, and of how accepted interventions ended."""

    decisions: int
    executing: int
    reasons: dict[str, int]
    accepted_interventions_ended: dict[str, int]
    most_tries: float


class LiveProg(GateClaim):
    """LIVE-PROG."""

    id = "LIVE-PROG"
    summary = "Every accepted intervention ended for a stated reason, and in time."
    statement = (
        "Every accepted intervention went on until the UGV gave it back for a stated reason, the UAV withdrew it by "
        "the protocol, or the run ended. None lasted longer than allowed, and no UGV went along more often without a "
        "rest than allowed. Every answer and its reason follow from the rules."
    )
    formula = (
        "accepted(t0) to min(end of motion, t0 + longest_s); tries <= most, 0 after rest_s on its own; first answer: "
        "accept iff tries left and (stalls, cost) of accepting is better than of refusing by 1e-6, or it is another "
        "UGV's trigger and accepting does not stall; so again, at no try, when an obstacle is sensed that is not on "
        "the proposal's map"
    )
    latex = (
        r"\text{accepted from } t_0 \text{ to } \min(t_{\text{motion}}, t_0 + \tau_{\text{longest}}), \quad "
        r"\text{tries} \le N",
        r"\text{accept} \Leftrightarrow (\text{stalls}, V)_{\text{accept}} < (\text{stalls}, "
        r"V)_{\text{refuse}} \text{ and tries are left, or it makes way}",
    )
    method = (
        "For each UGV, decision by decision, the rules give the answer and its reason from the recorded outcomes. If "
        "the decisions on an accepted proposal end without a refusal, the proposal must have been withdrawn, as for "
        "EXEC."
    )
    equations = "(20)"
    assumptions = (
        "The outcomes of either choice are the recorded ones (GATE-MODEL recomputes them).",
        "At the gatekeeper's first sample after the last decision on a proposal, that is no longer in force.",
    )
    does_not_establish = (
        "That an intervention was useful, that the UGV was where it should be, or that it arrives (LIVE-GOAL)."
    )

    exercised_by = "decisions that accepted a proposal, at first or again"

    def applies(self, trace: Trace) -> bool:
        """Only method (d) judges by outcomes."""
        return trace.meta.get("method") == METHOD

    def judge_rows(self, trace: Trace, rows: list[DecisionRecord]) -> Finding:
        """Go through the decisions; the margin is what is left of the time that an intervention may last."""
        compared, ends, longest = list[Deviation](), Counter[str](), 0.0
        for ugv in trace.ugvs:
            patience, mine = Patience(), [row for row in rows if row.robot == ugv]
            for last, row in zip_longest([None, *mine], mine):
                found = [] if row is None else list(judge_decision(trace, row, last, patience))
                if last is not None and last.given["decision"] == "accept":
                    if row is None or last.number != row.number:
                        found.append(ending(trace, last, ends))
                    elif row.given["decision"] == "refuse":
                        ends[str(row.given["reason"])] += 1
                compared += found
                if row is None or any(one.wrong for one in found):
                    break  # what follows rests on it
                if row.given["decision"] == "accept":
                    longest = max(longest, row.t_s - patience.since)
        accepted = int((trace.decisions["decision"] == "accept").sum())
        finding = Finding(
            "holds",
            margin=trace.scenario.gatekeeper.longest_s - longest,
            unit="s",
            quantity="time that an intervention may last, less the longest that one was executed",
            evidence=asdict(
                Ended(len(rows), accepted, reasons_of(trace), dict(ends), float(trace.decisions["tries"].max()))
            ),
            exercised=accepted,
        )
        return conclude(finding, compared)


def ending(trace: Trace, last: DecisionRecord, ends: Counter[str]) -> Deviation:
    """How a proposal ended after a last decision that accepts it, counted in `ends`.

    It was withdrawn before the next sample of the gatekeeper, or the run was over.
    """
    after = last.t_s + trace.scenario.gatekeeper.period_s + TIME_TOLERANCE_S
    withdrawn, over = withdrawn_s(trace, proposal_of(trace, last.number)) <= after, after > trace.t[-1]
    ends["withdrawn" if withdrawn else "end of the run"] += 1
    return Deviation(last, "end of an accepted intervention", float(not (withdrawn or over)), 0.0)


def judge_decision(
    trace: Trace, row: DecisionRecord, last: DecisionRecord | None, patience: Patience
) -> Iterator[Deviation]:
    """A decision against the rules, from what is known of the UGV before; `patience` is brought up to date."""
    gate, given, t = trace.scenario.gatekeeper, row.given, row.t_s
    on, same = proposal_of(trace, row.number), last is not None and last.number == row.number
    standing = str(last.given["decision"]) if same and last is not None else None
    if patience.until is not None and standing != "accept" and last is not None:
        patience.until, patience.since = None, last.t_s + gate.period_s
    on_its_own = t - patience.since - gate.rest_s
    if patience.until is None and on_its_own >= -TIME_TOLERANCE_S:
        certain = on_its_own > TIME_TOLERANCE_S
        accepts = given["decision"] == "accept" and standing is None
        patience.tries = 0 if certain or given["tries"] <= float(accepts) else patience.tries
    if standing == "accept":
        answer = ("refuse", "over") if patience.until is not None and t >= patience.until else ("accept", "kept")
        if answer[0] == "accept" and discovers(trace, row.robot, t, on):
            answer = _by_outcome(row, on)
        if answer[0] == "refuse":
            patience.until, patience.since = None, t
    elif standing == "refuse":
        answer = ("refuse", "kept")
    else:
        answer = ("refuse", "exhausted") if patience.tries >= gate.tries else _by_outcome(row, on)
        if answer[0] == "accept":
            end = min(float(on.times_s[-1]), t + gate.longest_s)
            patience.tries, patience.since, patience.until = patience.tries + 1, t, end
    theirs = (given["decision"], given["reason"])
    yield Deviation(row, "answer or reason", float(answer != theirs), 0.0, recomputed=list(answer), standing=standing)
    yield Deviation(row, "tries", given["tries"] - patience.tries, 0.0, recomputed=patience.tries)
    yield Deviation(row, "tries: more than allowed", max(0.0, given["tries"] - gate.tries), 0.0)


def _by_outcome(row: DecisionRecord, on: ProposalRecord) -> tuple[str, str]:
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
