"""COMM: what a run spent on messages and gatekeeper solves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import TraceError
from airground_drake.run.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S, TraceClaim
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.instants import GATED_METHODS, intervening, silent, talk_is_due, without_proposals
from airground_drake.verify.runs.standing import map_conflicts, standing_conflicts

KINDS = ("proposal", "decision")


class Message(NamedTuple):
    """A proposal or a decision: when, s, and the UGV for whose trigger the proposal was sent."""

    t_s: float
    cause: str


@dataclass(frozen=True)
class Spent:
    """The evidence: messages by kind, of the run and of a scheme without a trigger, and the fraction saved.

    `ugvs` has the messages of each UGV and the intervals in which it was intervened on.
    """

    spent: dict[str, int]
    always_on: dict[str, int]
    saved: dict[str, float]
    ugvs: dict[str, dict[str, Any]]
    outside_interventions: list[dict[str, Any]]
    without_proposals: list[str]
    without_decisions: list[str]


class Comm(TraceClaim):
    """COMM."""

    id = "COMM"
    summary = "The UAV talked only while it was needed, and less than if it always talked."
    statement = (
        "Messages and gatekeeper solves were spent only while the UGV concerned, or the UGV that it was to make way "
        "for, was being intervened on. An always-on scheme would have spent at least as many. All parts of a joint "
        "plan were sent together, and one refusal withdrew them all. No proposal was decided on after it was "
        "withdrawn. A proposal in force was replaced only by a part of a joint plan, or while another UGV was being "
        "intervened on. Each proposal showed the obstacles that the UAV knew: its own map, and what UGVs sensed when "
        "they answered."
    )
    formula = (
        "every proposal and decision in [trigger, release + intervention period + gatekeeper period]; "
        "proposals <= n ceil(duration / intervention period), decisions <= n ceil(duration / gatekeeper period); "
        "all parts of a joint plan sent; no decision on a proposal that is withdrawn; none in force replaced but by a "
        "part of a joint plan or while another UGV is intervened on; "
        "map of a proposal = known and phantom obstacles, then all sensed by UGVs at answers that the UAV has read"
    )
    latex = (
        r"t_{\text{message}} \in [t_{\text{trigger}}, t_{\text{release}} + h_{\text{UAV}} + h_{\text{gate}}]",
        r"\text{proposals} \le n \lceil T / h_{\text{UAV}} \rceil, \quad \text{decisions} \le n \lceil T / "
        r"h_{\text{gate}} \rceil",
    )
    method = (
        "Counts of proposal events and of decisions (each is one solve and one answer). Each must be in an interval in "
        "which the mode of the UGV, or of the UGV whose trigger is the proposal's cause, is 'intervening'. After a "
        "release the UAV withdraws its proposal at its next planning instant, and the gatekeeper notices at its next "
        "sample: hence the allowance of one period each. Positions show what UGVs sensed when they answered; the UAV "
        "reads an answer at the next planning instant if the proposal is still in force. Proposals are withdrawn as "
        "for EXEC."
    )
    equations = "(20), (26)"
    assumptions = (
        "Always-on means a proposal per planning period and a decision per gatekeeper period, for every UGV.",
        "Every proposal sent and every decision made is recorded.",
        "Third-party policies may send another map than the UAV's.",
    )
    does_not_establish = (
        "Bytes on a channel, or the cost of supervising: the UAV observes all UGVs all the time, which is not counted. "
        "The saving is that of this run; one with more trouble triggers more. Whether triggers were right is THR-TRIG."
    )

    def applies(self, trace: Trace) -> bool:
        """Method (a) sends nothing by construction."""
        return trace.meta.get("method") != "a"

    exercised_by = "proposals sent"

    def check(self, trace: Trace) -> Finding:
        """Count, look for strays, compare with always-on; the margin is the smaller fraction saved of both kinds."""
        by_ugv = {ugv: _messages(trace, ugv) for ugv in trace.ugvs}
        spent = {kind: sum(len(each[kind]) for each in by_ugv.values()) for kind in KINDS}
        most = _always_on(trace)
        without = {"proposal": without_proposals(trace), "decision": _without_decisions(trace, by_ugv)}
        if without["decision"] and not spent["decision"]:
            return silent(trace, without["decision"], "decision")
        strays = [stray for ugv, sent in by_ugv.items() for stray in _strays(trace, ugv, sent)]
        misused = [*map_conflicts(trace), *standing_conflicts(trace)] if len(trace.proposals) and not strays else []
        over = {"spent": spent, "always_on": most} if any(spent[kind] > most[kind] for kind in KINDS) else None
        saved = {kind: 1.0 - spent[kind] / most[kind] for kind in KINDS if most[kind]}
        per_ugv = {
            ugv: {kind: len(sent[kind]) for kind in KINDS} | {"intervals_s": intervening(trace, ugv).tolist()}
            for ugv, sent in by_ugv.items()
        }
        return Finding(
            "refuted" if strays or over or misused else "holds",
            margin=None if strays or misused else min(saved.values(), default=None),
            unit="fraction saved",
            quantity="messages or decisions saved against always-on",
            counterexample=min(strays + misused, key=lambda stray: float(stray["t_s"]), default=over),
            evidence=asdict(Spent(spent, most, saved, per_ugv, strays, *without.values())),
            exercised=spent["proposal"],
        )


def _messages(trace: Trace, ugv: str) -> dict[str, list[Message]]:
    """The messages of a UGV by kind.

    Raises:
        TraceError: if a message is not of a UGV of the trace, or a decision has no time or no proposal.
    """
    named = {e["robot"] for e in trace.events if e["kind"] == "proposal"} | set(trace.decisions["robot"])
    if strangers := named - set(trace.ugvs):
        raise TraceError(f"proposals or decisions for {sorted(strangers)}, which are not UGVs of the trace")
    rows = trace.proposals.to_dict("records")
    by_time = {(row["robot"], row["issued_s"]): str(row["cause"]) for row in rows}
    by_number = {row["number"]: str(row["cause"]) for row in rows}
    times = [float(e["t_s"]) for e in trace.events if (e["kind"], e["robot"]) == ("proposal", ugv)]
    if np.setdiff1d(_decisions(trace, ugv, "issued_s"), times).size:
        raise TraceError(f"{ugv}: a decision is about a proposal that is not among the events")
    decided = zip(_decisions(trace, ugv, "t_s").tolist(), _decisions(trace, ugv, "number").tolist(), strict=True)
    return {
        "proposal": [Message(t, by_time.get((ugv, t), ugv)) for t in times],
        "decision": [Message(t, by_number.get(number, ugv)) for t, number in decided],
    }


def _strays(trace: Trace, ugv: str, sent: dict[str, list[Message]]) -> Iterator[dict[str, Any]]:
    """Messages while neither the UGV nor the one that it was to make way for was being intervened on."""
    for kind, messages in sent.items():
        for message in messages:
            if not any(_is_called(trace, name, message.t_s) for name in {ugv, message.cause}):
                yield {"robot": ugv, "kind": kind, "t_s": message.t_s}


def _is_called(trace: Trace, ugv: str, t: float) -> bool:
    """Whether a UGV was intervened on at a time, s, or less than the allowance before it."""
    allowance = trace.scenario.intervention.period_s + trace.scenario.gatekeeper.period_s
    intervals = intervening(trace, ugv)
    begins, ends = intervals[:, 0] - TIME_TOLERANCE_S, intervals[:, 1] + allowance + TIME_TOLERANCE_S
    return bool(((t >= begins) & (t <= ends)).any())


def _without_decisions(trace: Trace, sent: dict[str, dict[str, list[Message]]]) -> list[str]:
    """UGVs that got a proposal, were intervened on for long enough, and never decided."""
    gated = trace.meta["method"] in GATED_METHODS
    return [u for u, own in sent.items() if gated and own["proposal"] and not own["decision"] and talk_is_due(trace, u)]


def _always_on(trace: Trace) -> dict[str, int]:
    """What a scheme without a trigger would have spent."""
    scenario, n = trace.scenario, len(trace.ugvs)
    before = scenario.duration_s - TIME_TOLERANCE_S  # the first instant is at 0
    gated = trace.meta["method"] in GATED_METHODS
    return {
        "proposal": n * math.ceil(before / scenario.intervention.period_s),
        "decision": n * math.ceil(before / scenario.gatekeeper.period_s) if gated else 0,
    }


def _decisions(trace: Trace, ugv: str, column: str) -> Array:
    table = trace.decisions
    values = table.loc[table["robot"] == ugv, column].to_numpy(dtype=np.float64)
    if not np.isfinite(values).all():
        raise TraceError(f"decisions of {ugv}: column {column!r} has values that are not finite")
    return values
