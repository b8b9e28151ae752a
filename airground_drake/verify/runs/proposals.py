"""Proposals of a run, as recorded."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import TraceError
from airground_drake.sim.trace import Trace, per_trace
from airground_drake.verify.engines.outlines import unpacked


@dataclass(frozen=True, eq=False)
class ProposalRecord:
    """A proposal: a row of `Trace.proposals`."""

    number: int  # identifies it
    ugv: str  # the UGV that gets it
    policy: str  # the policy that made it
    issued_s: float  # time of sending
    times_s: Array  # times of the vertices of the motion that it asks for, (M,)
    positions_m: Array  # the vertices, (M, 3)
    selection: Array  # J_int of (12)-(14), (m, 3)
    mapped: Array  # outlines of the obstacles on the UAV's map, (k, W), see `model.geometry.outline`
    cause: str  # UGV whose trigger it was sent for: `ugv`, or another UGV that `ugv` is to make way for
    party: tuple[str, ...]  # UGVs with a part in the same joint plan; empty: it stands alone
    sender: str  # the UAV


def _sent(trace: Trace, row: Mapping[Any, Any]) -> ProposalRecord:
    """The proposal of a row of the table."""
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
    """All proposals of a run, by time."""
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
