"""LIVE-HYP: a run meets the hypotheses of LIVE-WAIT and LIVE-GATE (coq/Patience.v)."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.finding import Finding
from airground_drake.verify.runs.gate_record import DecisionRecord, GateClaim
from airground_drake.verify.runs.proposals import METHOD, Acceptance, acceptances


class LiveHyp(GateClaim):
    id = "LIVE-HYP"
    summary = (
        "No UGV followed the UAV more often or longer than allowed, or reversed an acceptance without a new obstacle."
    )
    statement = (
        "Between two rests, no UGV accepted more proposals than allowed, and none executed proposals for longer than "
        "LIVE-WAIT allows. Every acceptance ended in time. No UGV ended an accepted proposal early, unless it first "
        "sensed an obstacle that was not on the proposal's map."
    )
    formula = (
        "between two rests of rest_s on its own: acceptances <= tries, time executed <= tries (longest_s + h); "
        "end <= until + h, until = min(end of motion, t0 + longest_s); given back before until only with news; h the "
        "period of the gatekeeper"
    )
    latex = (
        r"\text{between two rests: acceptances} \le N, \quad \text{time executed} \le N (\tau_{\text{longest}} + h)",
        r"t_{\text{end}} \le \min(t_{\text{motion}}, t_0 + \tau_{\text{longest}}) + h",
    )
    method = (
        "Intervals of acceptance are computed from the decisions of each UGV. The trace records the executed proposal "
        "at each control sample, and new obstacles with each decision."
    )
    equations = "(20)"
    assumptions = ("A proposal without a decision at a sample of the gatekeeper is no longer in force.",)
    does_not_establish = (
        "That accepted proposals were useful, that UGVs arrive (LIVE-GOAL), or why proposals were accepted or refused."
    )

    exercised_by = "acceptances"

    def applies(self, trace: Trace) -> bool:
        """Only method (d) has tries and rests."""
        return trace.meta.get("method") == METHOD

    def judge_rows(self, trace: Trace, rows: list[DecisionRecord]) -> Finding:
        """Judge all acceptances; the margin is the rest of the time that LIVE-WAIT allows."""
        gate, accepted = trace.scenario.gatekeeper, acceptances(trace)
        allowed_s = gate.tries * (gate.longest_s + gate.period_s)
        most = 0
        longest_s = 0.0
        where = dict[str, Any]()
        wrong = [fault for of_ugv in accepted.values() for fault in _wrong(trace, of_ugv)]
        for ugv, of_ugv in accepted.items():
            begins = _after_rests(of_ugv, gate.rest_s)
            tries = np.diff(np.searchsorted([acceptance.t_s for acceptance in of_ugv], [*begins, np.inf]))
            executed_s = _executed_s(trace, ugv, begins)
            k = int(np.argmax(executed_s))
            most = max(most, int(tries.max()))
            if executed_s[k] >= longest_s:
                longest_s, where = float(executed_s[k]), {"robot": ugv, "t_s": begins[k]}
            over = {"what": "more acceptances between two rests than allowed", "allowed": gate.tries}
            wrong += [
                {"robot": ugv, "t_s": begin, "found": int(count), **over}
                for begin, count in zip(begins, tries, strict=True)
                if count > gate.tries
            ]
        if longest_s > allowed_s + TIME_TOLERANCE_S:
            wrong.append({**where, "what": "longer from its own task than allowed, s", "found": longest_s})
        total = [acceptance for of_ugv in accepted.values() for acceptance in of_ugv]
        return Finding(
            "refuted" if wrong else "holds",
            margin=allowed_s - longest_s if not wrong or longest_s > allowed_s else None,
            unit="s",
            quantity="time that LIVE-WAIT allows between two rests, less the longest that was executed",
            where=where,
            counterexample=min(wrong, key=lambda fault: float(fault["t_s"]), default=None),
            evidence={
                "acceptances": len(total),
                "given_back": sum(acceptance.given_back for acceptance in total),
                "most_tries": most,
                "longest_between_rests_s": longest_s,
            },
            exercised=len(total),
        )


def _wrong(trace: Trace, of_ugv: list[Acceptance]) -> Iterator[dict[str, Any]]:
    """Acceptances that ended too late, or too early without a new obstacle."""
    period_s = trace.scenario.gatekeeper.period_s
    for acceptance in of_ugv:
        sent, end_s, until_s = acceptance.on, acceptance.end_s, acceptance.until_s
        at = {"robot": sent.ugv, "t_s": end_s, "number": sent.number, "until_s": until_s}
        if end_s > until_s + period_s + TIME_TOLERANCE_S:
            yield {**at, "what": "an acceptance was over too late"}
        early = acceptance.given_back and end_s < until_s - TIME_TOLERANCE_S
        if early and end_s not in acceptance.news_s:
            yield {**at, "what": "an acceptance was reversed without news"}


def _after_rests(of_ugv: list[Acceptance], rest_s: float) -> list[float]:
    """Times at which tries are reset, s: the start of the run, and each acceptance after a rest."""
    begins = [acceptance.t_s for acceptance in of_ugv]
    ends = [0.0, *(acceptance.end_s for acceptance in of_ugv)]
    rested = (t_s for t_s, end_s in zip(begins, ends, strict=False) if t_s - end_s >= rest_s - TIME_TOLERANCE_S)
    return [0.0, *(t_s for t_s in rested if t_s > 0.0)]


def _executed_s(trace: Trace, ugv: str, begins: list[float]) -> list[float]:
    """Time for which a UGV executed proposals between resets, s."""
    followed = np.append(trace.sampled(f"{ugv}.executing") >= 0, False).astype(np.int64)
    cuts = np.searchsorted(trace.sampled("t_s"), np.array(begins) - TIME_TOLERANCE_S)
    return [float(count) * trace.scenario.control.period_s for count in np.add.reduceat(followed, cuts)]
