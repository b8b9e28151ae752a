"""Under method (d) every answer and its reason follow from the rules, and accepted interventions end."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import zip_longest

from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.runs.gate_record import DecisionRecord, rows_of
from airground_drake.verify.runs.proposals import METHOD, ProposalRecord, proposal_of
from oracles.fault import Fault
from oracles.protocol import held_until
from oracles.sensing import news

NO_DIFFERENCE = 1e-6
"""Relative gain from which on an outcome is better."""


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


def wrong_answers(trace: Trace) -> list[Fault]:
    """The first answer of each UGV that the rules do not give, or the first acceptance that just ends."""
    if trace.meta["method"] != METHOD:
        return []
    found, rows = list[Fault](), rows_of(trace)
    for ugv in trace.ugvs:
        patience, mine = Patience(), [row for row in rows if row.robot == ugv]
        for last, row in zip_longest([None, *mine], mine):
            faults = [] if row is None else [*_judged(trace, row, last, patience)]
            if last is not None and last.given["decision"] == "accept" and (row is None or last.number != row.number):
                faults += _unended(trace, last)
            found += faults
            if faults:
                break  # what follows rests on it
    return found


def _unended(trace: Trace, last: DecisionRecord) -> Iterator[Fault]:
    """An acceptance without a further decision: its proposal was withdrawn before the next sample, or the run over."""
    after = last.t_s + trace.scenario.gatekeeper.period_s + TIME_TOLERANCE_S
    if held_until(trace, proposal_of(trace, last.number)) > after and after <= trace.t[-1]:
        yield Fault("an acceptance just ends", last.robot, last.t_s)


def _judged(trace: Trace, row: DecisionRecord, last: DecisionRecord | None, patience: Patience) -> Iterator[Fault]:
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
        if answer[0] == "accept" and len(news(trace, row.robot, on.mapped, t - gate.period_s, t)):
            answer = _by_outcome(row, on)
        if answer[0] == "refuse":
            patience.until, patience.since = None, t
    elif standing == "refuse":
        answer = ("refuse", "kept")
    else:
        answer = ("refuse", "exhausted") if patience.tries >= gate.tries else _by_outcome(row, on)
        answer = ("refuse", "over") if t >= on.times_s[-1] else answer
        if answer[0] == "accept":
            end = min(float(on.times_s[-1]), t + gate.longest_s)
            patience.tries, patience.since, patience.until = patience.tries + 1, t, end
    if answer != (given["decision"], given["reason"]):
        yield Fault("answer or reason", row.robot, t, {"due": answer, "standing": standing})
    if given["tries"] != patience.tries:
        yield Fault("tries", row.robot, t, {"due": patience.tries, "recorded": given["tries"]})


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
