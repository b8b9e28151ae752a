"""Recorded proposals of a run, their acceptances, and the interventions on UGVs."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby, zip_longest
from typing import Any, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import TraceError
from airground_drake.sim.trace import Trace, per_trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.outlines import unpacked

METHOD = "d"  # only this method has tries and rests, and predicts where an accepted intervention leads
GATED_METHODS = ("c", "d")  # methods with an optimising gatekeeper


@dataclass(frozen=True, eq=False)
class ProposalRecord:
    """A proposal: a row of `Trace.proposals`."""

    number: int  # identifies it
    ugv: str  # the UGV that gets it
    policy: str  # the policy that made it
    issued_s: float  # time of sending
    times_s: Array  # times of the vertices of the proposed motion, (M,)
    positions_m: Array  # the vertices, (M, 3)
    selection: Array  # J_int of (12)-(14), (m, 3)
    mapped: Array  # outlines of the obstacles on the UAV's map, (k, W), see `model.geometry.outline`
    cause: str  # UGV whose trigger it was sent for: `ugv`, or another UGV that `ugv` is to make way for
    party: tuple[str, ...]  # UGVs with a part in the same joint plan; empty: it stands alone
    sender: str  # the UAV


def _sent(trace: Trace, row: Mapping[Any, Any]) -> ProposalRecord:
    times, places, selection, mapped = (
        np.asarray(row[name], dtype=np.float64).ravel() for name in ("times_s", "positions_m", "selection", "mapped")
    )
    label = f"proposal to {row['robot']} at t = {row['issued_s']} s"
    numbers = np.concatenate([times, places, selection, mapped, [row["issued_s"]]])
    if not np.isfinite(numbers).all() or not len(times) or not (np.diff(times) > 0.0).all():
        raise TraceError(f"{label}: numbers that are not finite, or times that do not increase")
    shaped = len(places) == 3 * len(times) and len(selection) and not len(selection) % 3
    if not shaped or row["robot"] not in trace.ugvs:
        raise TraceError(f"{label}: no motion of a UGV of the trace")
    if row["cause"] not in trace.ugvs:
        raise TraceError(f"{label}: its cause {row['cause']!r} is no UGV of the trace")
    try:
        outlines = unpacked(mapped.tolist())
    except ValueError as error:
        raise TraceError(f"{label}: obstacles on its map: {error}") from None
    if row["sender"] not in trace.uavs:
        raise TraceError(f"{label}: its sender {row['sender']!r} is no UAV of the trace")
    party = tuple(ugv for i, ugv in enumerate(trace.ugvs) if i in row["party"])
    if len(party) != len(row["party"]) or (party and row["robot"] not in party):
        raise TraceError(f"{label}: not in the joint plan of the UGVs {list(row['party'])}")
    return ProposalRecord(
        number=int(row["number"]), ugv=str(row["robot"]), policy=str(row["policy"]), issued_s=float(row["issued_s"]),
        times_s=times, positions_m=places.reshape(-1, 3), selection=selection.reshape(-1, 3), mapped=outlines,
        cause=str(row["cause"]), party=party, sender=str(row["sender"]),
    )  # fmt: skip


@per_trace
def proposals_of(trace: Trace) -> list[ProposalRecord]:
    proposals = [_sent(trace, row) for row in trace.proposals.to_dict("records")]
    recorded = sorted((s.ugv, s.issued_s, s.policy) for s in proposals)
    events = sorted((e["robot"], float(e["t_s"]), e["policy"]) for e in trace.events if e["kind"] == "proposal")
    if recorded != events:
        raise TraceError(f"the proposals recorded are {recorded}, those of the events {events}")
    known = {sent.number: (sent.ugv, sent.issued_s) for sent in proposals}
    if len(known) != len(proposals):
        raise TraceError("two proposals have the same number")
    columns = (trace.decisions[name].tolist() for name in ("number", "robot", "issued_s"))
    for number, ugv, issued in zip(*columns, strict=True):
        if known.get(number) != (ugv, issued):
            raise TraceError(f"a decision of {ugv} is on proposal {number}, issued at {issued} s, which it never got")
    return sorted(proposals, key=lambda sent: sent.issued_s)


@per_trace
def proposal_of(trace: Trace, number: int) -> ProposalRecord:
    proposal = next((sent for sent in proposals_of(trace) if sent.number == number), None)
    if proposal is None:
        raise TraceError(f"no proposal has the number {number}")
    return proposal


class Acceptance(NamedTuple):
    """An accepted proposal, from its acceptance until the UGV ends it, it is withdrawn, or the run ends."""

    on: ProposalRecord  # the proposal
    t_s: float  # when it was accepted
    end_s: float  # when the UGV gave it back, or the gatekeeper's first sample at which it was withdrawn
    until_s: float  # its latest end: its motion has ended, or it has lasted as long as allowed
    given_back: bool  # whether the UGV ended it
    # When the UGV sensed an obstacle for the first time that was not on the proposal's map, s.
    news_s: tuple[float, ...]


def acceptances(trace: Trace) -> dict[str, list[Acceptance]]:
    """All acceptances of a run by UGV and time; {} for another method."""
    return {ugv: _of_ugv(trace, ugv) for ugv in trace.ugvs} if trace.meta["method"] == METHOD else {}


def below_avoidance(trace: Trace) -> tuple[int, int]:
    """The numbers of executed interventions below avoidance, as under method (d), and of all."""
    count = sum(len({*trace.sampled(f"{ugv}.executing").tolist()} - {-1.0}) for ugv in trace.ugvs)
    return (count if trace.meta["method"] == METHOD else 0), count


def _of_ugv(trace: Trace, ugv: str) -> list[Acceptance]:
    gate = trace.scenario.gatekeeper
    accepted = list[Acceptance]()
    table = trace.decisions
    mine = table[table["robot"] == ugv].sort_values("t_s", kind="stable")
    given = zip(*(mine[name].tolist() for name in ("number", "decision", "t_s", "new")), strict=True)
    answers = [(*key, [(t, len(new)) for *_, t, new in rows]) for key, rows in groupby(given, lambda row: row[:2])]
    for (number, answer, rows), following in zip_longest(answers, answers[1:]):
        if answer == "accept":
            on = proposal_of(trace, number)
            back = following is not None and following[0] == number
            last = following[2][:1] if back else []
            end_s = last[0][0] if back else min(rows[-1][0] + gate.period_s, float(trace.t[-1]))
            until_s = min(float(on.times_s[-1]), rows[0][0] + gate.longest_s)
            news_s = tuple(t for t, new in [*rows[1:], *last] if new)
            accepted.append(Acceptance(on, rows[0][0], end_s, until_s, back, news_s))
    return accepted


def row_at(trace: Trace, t_s: float) -> int:
    """The row at a time, s, or the next one; for times after the run the last one."""
    return min(int(np.searchsorted(trace.t, t_s - TIME_TOLERANCE_S)), len(trace.t) - 1)


def intervening(trace: Trace, ugv: str) -> Array:
    """Intervals of mode 1, (K, 2), s; the mode of a row is in force since the row before."""
    inside = np.concatenate([[False], trace.column(f"{ugv}.mode")[1:] == 1.0, [False]])
    edges = np.flatnonzero(np.diff(inside.astype(np.int8)))
    return trace.t[edges].reshape(-1, 2)


def talk_is_due(trace: Trace, ugv: str) -> bool:
    """Whether a UAV with policies, not lost, intervenes on a UGV for longer than a proposal and a decision take."""
    given = trace.scenario
    spells = np.minimum(intervening(trace, ugv), given.lost_s[ugv] if given.intervention.policies else 0.0)
    return bool((np.diff(spells) > given.intervention.period_s + given.gatekeeper.period_s).any())


def without_proposals(trace: Trace) -> list[str]:
    """UGVs without a proposal although policies were asked: no path was found, or the policies failed."""
    asked, got = {*trace.plans["ugv"]}, {*trace.proposals["robot"]}
    return [ugv for ugv in trace.ugvs if ugv in asked - got]


def unreached(trace: Trace) -> set[str]:
    """UGVs none of whose proposals arrived in time for a decision."""
    sent = trace.messages[trace.messages["kind"] == "proposal"]
    in_time = sent["received_s"] <= trace.t[-1] - trace.scenario.gatekeeper.period_s
    return {*sent["receiver"]} - {*sent.loc[in_time, "receiver"]}


def lost_at_the_end(trace: Trace) -> list[str]:
    """UGVs in an intervention at the end for which the UAV's last search found no path."""
    return [ugv for ugv in trace.ugvs if _is_lost(trace, ugv)]


def _is_lost(trace: Trace, ugv: str) -> bool:
    switched = [
        event["kind"] for event in trace.events if event["robot"] == ugv and event["kind"] in ("trigger", "release")
    ]
    asked = trace.plans[trace.plans["ugv"] == ugv]
    last = asked[asked["t_s"] == asked["t_s"].max()]
    proposed = bool(last["outcome"].isin(["proposed", "passed over"]).any())
    return switched[-1:] == ["trigger"] and bool((last["reason"] != "").any()) and not proposed


def reasons(trace: Trace) -> dict[str, str]:
    """The reasons of the last policy asked, by UGV without a proposal; UGVs without a reason are left out."""
    last_reasons = trace.plans[trace.plans["reason"] != ""].groupby("ugv", sort=False)["reason"].last()
    lost = [*without_proposals(trace), *lost_at_the_end(trace)]
    return {ugv: str(last_reasons[ugv]) for ugv in dict.fromkeys(lost) if ugv in last_reasons.index}
