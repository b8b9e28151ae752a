"""The UAV's interventions in a run, messages, and avoidance during interventions; strict JSON."""

import math
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import TraceError
from airground_drake.base.registry import method_of
from airground_drake.sim.trace import Trace
from airground_drake.ugv.reasons import OVER
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.geometry import interpolate
from airground_drake.verify.runs.control_law import BINDING_M_S, inequalities_of
from airground_drake.verify.runs.gate_record import DecisionRecord, rows_of
from airground_drake.verify.runs.proposals import ProposalRecord, proposals_of, row_at


def interventions(trace: Trace) -> list[dict[str, Any]]:
    """Every proposal of a run, by time, with its outcome; [] if malformed, which claims report."""
    try:
        sent = proposals_of(trace)
    except (LookupError, TraceError, TypeError, ValueError):
        return []
    numbers = {ugv: trace.sampled(f"{ugv}.executing") for ugv in trace.ugvs}
    answers = dict(iter(trace.decisions.sort_values("t_s", kind="stable").groupby("number")))
    none = trace.decisions.iloc[:0]
    return [_became(trace, proposal, numbers[proposal.ugv], answers.get(proposal.number, none)) for proposal in sent]


def _became(trace: Trace, sent: ProposalRecord, numbers: Array, answers: Any) -> dict[str, Any]:
    """The outcome of a proposal, from the proposals that its UGV executed (S,), and from decisions about it."""
    times = trace.sampled("t_s")
    during = np.flatnonzero(numbers == sent.number)
    begun_s = float(times[during[0]]) if during.size else None
    ended_s = float(times[during[-1] + 1]) if during.size and during[-1] + 1 < len(times) else None
    yes = answers[answers["decision"] == "accept"]
    tries = int(yes["tries"].iloc[0]) if len(yes) else -1
    accepted_s = float(yes["t_s"].iloc[0]) if len(yes) else None
    return {
        "number": sent.number,
        "robot": sent.ugv,
        "policy": sent.policy,
        "cause": sent.cause,
        "sent_s": sent.issued_s,
        "accepted_s": accepted_s if method_of(trace.meta["method"]).gated else begun_s,
        "begun_s": begun_s,
        "ended": _unexecuted(trace, sent, answers) if begun_s is None else _executed(trace, sent, answers, ended_s),
        "tries": tries if tries >= 0 else None,
    }


def _end(how: str, t_s: float, reason: str = "") -> dict[str, Any]:
    return {"how": how, "t_s": t_s, "reason": reason}


def _unexecuted(trace: Trace, sent: ProposalRecord, answers: Any) -> dict[str, Any]:
    """The end of a proposal that was never executed."""
    refused = answers[answers["decision"] == "refuse"]
    if len(refused):
        return _end("refused", float(refused["t_s"].iloc[0]), str(refused["reason"].iloc[0]))
    about = trace.messages[trace.messages["about"] == sent.number]
    if len(about) and about.loc[about["kind"] == "proposal", "received_s"].isna().all():
        return _end("lost", sent.issued_s)
    withdrawn = about.loc[about["kind"] == "withdrawal", "sent_s"]
    if len(withdrawn):
        return _end("withdrawn first", float(withdrawn.min()))
    return _end("end of the run", float(trace.t[-1]))


def _executed(trace: Trace, sent: ProposalRecord, answers: Any, ended_s: float | None) -> dict[str, Any]:
    """The end of a proposal executed up to a time, s; None: to the end of the run."""
    if ended_s is None:
        return _end("end of the run", float(trace.t[-1]))
    refused = answers[(answers["decision"] == "refuse") & ((answers["t_s"] - ended_s).abs() <= TIME_TOLERANCE_S)]
    if len(refused):
        reason = str(refused["reason"].iloc[0])
        return _end("over" if reason == OVER else "given up", ended_s, reason)
    if ended_s >= sent.times_s[-1] - TIME_TOLERANCE_S:
        return _end("over", ended_s)
    later = (row.issued_s for row in proposals_of(trace) if row.ugv == sent.ugv and row.issued_s > sent.issued_s)
    if any(issued_s <= ended_s + TIME_TOLERANCE_S for issued_s in later):
        return _end("replaced", ended_s)
    row = row_at(trace, ended_s)
    called = any(trace.column(f"{name}.mode")[row] == 1.0 for name in (sent.ugv, sent.cause))
    return _end("withdrawn" if called else "released", ended_s)


def messages(trace: Trace) -> dict[str, Any] | None:
    """Number of messages of a run, and of an always-on scheme; None without interventions."""
    method = method_of(trace.meta["method"])
    scenario = trace.scenario
    ugvs = trace.ugvs
    if not method.intervenes:
        return None
    delivered = trace.messages[trace.messages["received_s"].notna()]
    parties = {"proposal": "receiver", "withdrawal": "receiver", "answer": "sender"}
    robots = {
        ugv: {f"{kind}s": int(((delivered["kind"] == kind) & (delivered[party] == ugv)).sum())
              for kind, party in parties.items()}
        for ugv in ugvs
    }  # fmt: skip
    before_s = scenario.duration_s - TIME_TOLERANCE_S  # the first instant is at 0
    planned, decided = (math.ceil(before_s / part.period_s) for part in (scenario.intervention, scenario.gatekeeper))
    return {
        **{f"{kind}s": sum(counts[f"{kind}s"] for counts in robots.values()) for kind in parties},
        "always_on": {"proposals": len(ugvs) * planned, "answers": len(ugvs) * decided * method.gated},
        "robots": robots,
    }


def avoidance(trace: Trace) -> dict[str, dict[str, int]]:
    """By UGV the numbers of control samples at which it executed a proposal, avoidance bound, and both."""
    counted = {}
    for ugv in trace.ugvs:
        executes = trace.sampled(f"{ugv}.executing") >= 0
        given = inequalities_of(trace, ugv)
        bound = np.zeros(len(executes), dtype=np.bool_)
        bound[given.sample[given.slack(trace.chosen(ugv)) <= BINDING_M_S]] = True
        counts = {"executing": executes, "binding": bound, "both": executes & bound}
        counted[ugv] = {name: int(flags.sum()) for name, flags in counts.items()}
    return counted


def farthest_from_prediction(trace: Trace) -> dict[str, Any] | None:
    """Where a UGV was farthest from its gatekeeper's prediction while the answer stood; None where none is recorded."""
    # Returns `robot`, `t_s` (of the decision), `decision`, `away_m`, `after_s`.
    if not len(trace.problems):
        return None
    try:
        rows = rows_of(trace)
    except TraceError:  # which claims report
        return None
    numbers = {ugv: trace.sampled(f"{ugv}.executing") for ugv in trace.ugvs}
    return max((_off_prediction(trace, row, numbers[row.robot]) for row in rows), key=lambda row: float(row["away_m"]))


def _off_prediction(trace: Trace, row: DecisionRecord, numbers: Array) -> dict[str, Any]:
    times, yes = trace.sampled("t_s"), row.given["decision"] == "accept"
    first = int(np.searchsorted(times, row.t_s - TIME_TOLERANCE_S))
    other = np.flatnonzero(numbers[first:] != (row.number if yes else -1))
    until = (times[first + other[0]] if other.size else trace.t[-1]) + TIME_TOLERANCE_S
    ends = row.t_s + row.dt * np.arange(1.0, row.stages + 1.0)
    ends = ends[ends <= until]
    went = interpolate(trace.t, trace.position(row.robot), ends)
    away = np.linalg.norm(went - row.constant[int(yes)][: len(ends)], axis=1)
    k = int(np.argmax(away)) if len(ends) else 0
    about = {"robot": row.robot, "t_s": row.t_s, "decision": str(row.given["decision"])}
    return {**about, "away_m": float(away[k]) if len(ends) else 0.0, "after_s": row.dt * (k + 1)}
