"""Proposals and answers of a run, and which proposal each UGV executes at each control sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.errors import TraceError
from airground_drake.run.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.engines.geometry import interpolate
from airground_drake.verify.runs.control_law import selected
from airground_drake.verify.runs.instants import GATED_METHODS, row_at, samples_of


class Answer(NamedTuple):
    """A decision about a proposal.

    Attributes:
        t_s: when.
        accepted: whether it accepts.
        done: whether it ends the proposal because its motion was executed to the end.
    """

    t_s: float
    accepted: bool
    done: bool

    @property
    def refused(self) -> bool:
        """Whether it withdraws the proposal, and all other parts of its joint plan."""
        return not (self.accepted or self.done)


@dataclass(frozen=True, eq=False)
class ProposalRecord:
    """A proposal: a row of `Trace.proposals`.

    Attributes:
        number: identifies it.
        ugv: the UGV that gets it.
        policy: the policy that made it.
        issued_s: time of sending.
        times_s: times of the vertices of the motion that it asks for, (M,).
        positions_m: the vertices, (M, 3).
        chosen: J_int^+ J_int, (3, 3).
        mapped_m: obstacles on the UAV's map, (k, 3).
        mapped_radius_m: their radii, (k,).
        cause: UGV whose trigger it was sent for: `ugv`, or another UGV that `ugv` is to make way for.
        party: UGVs with a part in the same joint plan; empty: it stands alone.
    """

    number: int
    ugv: str
    policy: str
    issued_s: float
    times_s: Array
    positions_m: Array
    chosen: Array
    mapped_m: Array
    mapped_radius_m: Array
    cause: str
    party: tuple[str, ...]

    def place(self, t: float | Array) -> Array:
        """Where the UGV is to be at times: (3,) or (K, 3), m; at rest before the first vertex and after the last."""
        return interpolate(self.times_s, self.positions_m, t)

    def rates(self, t: float) -> list[Array]:
        """Velocities of that place at a time, (3,), m/s: two at a vertex, before and after it, else one."""
        legs = {int(np.searchsorted(self.times_s, t + shift)) for shift in (-TIME_TOLERANCE_S, TIME_TOLERANCE_S)}
        return [self._slopes[leg] for leg in sorted(legs)]

    @cached_property
    def _slopes(self) -> Array:
        """Velocity on the way to each vertex and after the last one, (M + 1, 3), m/s; 0 before the first one."""
        return np.pad(np.diff(self.positions_m, axis=0) / np.diff(self.times_s)[:, None], ((1, 1), (0, 0)))


def proposals_of(trace: Trace) -> list[ProposalRecord]:
    """All proposals of a run, by time.

    Raises:
        TraceError: if one is malformed, two have the same number, they are not those of the events, or a decision is
            on a proposal that its UGV never got.
    """
    return trace.derived("proposals", lambda: _proposals_of(trace))


def _sent(trace: Trace, row: Mapping[Any, Any]) -> ProposalRecord:
    """The proposal of a row of the table."""
    times, places, selection, mapped, radii = (
        np.asarray(row[name], dtype=np.float64).ravel()
        for name in ("times_s", "positions_m", "selection", "mapped_m", "mapped_radius_m")
    )
    label = f"proposal to {row['robot']} at t = {row['issued_s']} s"
    numbers = np.concatenate([times, places, selection, mapped, radii, [row["issued_s"]]])
    if not np.isfinite(numbers).all() or not len(times) or not (np.diff(times) > 0.0).all():
        raise TraceError(f"{label}: numbers that are not finite, or times that do not increase")
    shaped = len(places) == 3 * len(times) and len(selection) and not len(selection) % 3
    if not shaped or len(mapped) != 3 * len(radii) or row["robot"] not in trace.ugvs:
        raise TraceError(f"{label}: no motion of a UGV of the trace")
    if row["cause"] not in trace.ugvs or not _is_cause(trace, row["robot"], row["cause"], row["issued_s"]):
        raise TraceError(f"{label}: its cause {row['cause']!r} is no UGV whose trigger it can have been sent for")
    party = tuple(ugv for i, ugv in enumerate(trace.ugvs) if i in row["party"])
    if len(party) != len(row["party"]) or (party and row["robot"] not in party):
        raise TraceError(f"{label}: not in the joint plan of the UGVs {list(row['party'])}")
    return ProposalRecord(
        int(row["number"]), str(row["robot"]), str(row["policy"]), float(row["issued_s"]), times,
        places.reshape(-1, 3), selected(selection), mapped.reshape(-1, 3), radii, str(row["cause"]), party,
    )  # fmt: skip


def _proposals_of(trace: Trace) -> list[ProposalRecord]:
    found = [_sent(trace, row) for row in trace.proposals.to_dict("records")]
    recorded = sorted((s.ugv, s.issued_s, s.policy) for s in found)
    events = sorted((e["robot"], float(e["t_s"]), e["policy"]) for e in trace.events if e["kind"] == "proposal")
    if recorded != events:
        raise TraceError(f"the proposals recorded are {recorded}, those of the events {events}")
    known = {sent.number: (sent.ugv, sent.issued_s) for sent in found}
    if len(known) != len(found):
        raise TraceError("two proposals have the same number")
    columns = (trace.decisions[name].tolist() for name in ("number", "robot", "issued_s"))
    for number, ugv, issued in zip(*columns, strict=True):
        if known and known.get(number) != (ugv, issued):  # decisions without any proposal are COMM's to refuse
            raise TraceError(f"a decision of {ugv} is on proposal {number}, issued at {issued} s, which it never got")
    return sorted(found, key=lambda sent: sent.issued_s)


def _is_cause(trace: Trace, ugv: str, cause: str, issued_s: float) -> bool:
    """Whether the cause is intervened on, and the UGV itself only if it is the cause.

    The mode of a row is in force up to it. A trigger may be at that very instant, so the mode of the next row counts,
    too.
    """
    row = row_at(trace, issued_s)
    called = {name: trace.column(f"{name}.mode")[row : row + 2] == 1.0 for name in (ugv, cause)}
    return bool(called[cause].any()) and (cause == ugv or not called[ugv].all())


def proposal_of(trace: Trace, number: int) -> ProposalRecord:
    """The proposal with a number.

    Raises:
        TraceError: if no proposal has it.
    """
    found = trace.derived("proposals by number", lambda: {one.number: one for one in proposals_of(trace)})
    if number not in found:
        raise TraceError(f"no proposal has the number {number}")
    return found[number]


def parts_of(trace: Trace, sent: ProposalRecord) -> list[ProposalRecord]:
    """The other parts of the joint plan that a proposal is part of."""
    if not sent.party:
        return []
    same = (sent.issued_s, sent.party)
    return [one for one in proposals_of(trace) if (one.issued_s, one.party) == same and one.number != sent.number]


def accepted_at(trace: Trace, ugv: str) -> list[ProposalRecord | None]:
    """The proposal that a UGV executes, at each control sample of the run, or None.

    A proposal is in force from its sending until it is withdrawn (`withdrawn_s`). Under method (b) it is accepted all
    that time; under (c) and (d) while the gatekeeper's last decision accepts it. A part of a joint plan is executed
    only while every other part in force is accepted or done.
    """
    return trace.derived(("accepted", ugv), lambda: _accepted_at(trace, ugv))


def _accepted_at(trace: Trace, ugv: str) -> list[ProposalRecord | None]:
    mine = [sent for sent in proposals_of(trace) if sent.ugv == ugv]
    return [
        next((one for one in reversed(mine) if _in_force(trace, one, now) and _is_executed(trace, one, now)), None)
        for now in trace.t[samples_of(trace)].tolist()
    ]


def _in_force(trace: Trace, sent: ProposalRecord, now: float) -> bool:
    """Whether a proposal was in force after the last planning instant up to `now`, s."""
    period = trace.scenario.intervention.period_s
    planned = period * np.floor(now / period + 1e-6) + TIME_TOLERANCE_S
    return bool(sent.issued_s <= planned < withdrawn_s(trace, sent))


def _is_executed(trace: Trace, sent: ProposalRecord, now: float) -> bool:
    """Whether a proposal in force is accepted at `now`, s, and all other parts in force are accepted or done."""
    if trace.meta["method"] not in GATED_METHODS:
        return True
    own = _answer_at(trace, sent, now)
    if own is None or not own.accepted:
        return False
    others = [_answer_at(trace, part, now) for part in parts_of(trace, sent) if _in_force(trace, part, now)]
    return not any(answer is None or answer.refused for answer in others)


def _answer_at(trace: Trace, sent: ProposalRecord, now: float) -> Answer | None:
    """The decision about a proposal at the gatekeeper's last sample up to `now`, s, if there is one."""
    period = trace.scenario.gatekeeper.period_s
    asked = period * np.floor(now / period + 1e-6)
    answers = answers_to(trace, sent)
    k = int(np.searchsorted([answer.t_s for answer in answers], asked - TIME_TOLERANCE_S))
    return answers[k] if k < len(answers) and abs(answers[k].t_s - asked) <= TIME_TOLERANCE_S else None


def answers_to(trace: Trace, sent: ProposalRecord) -> list[Answer]:
    """Every decision about a proposal, by time."""
    return trace.derived("answers_to", lambda: _answers(trace)).get(sent.number, [])


def _answers(trace: Trace) -> dict[int, list[Answer]]:
    ends = {sent.number: float(sent.times_s[-1]) for sent in proposals_of(trace)}
    table = trace.decisions.sort_values("t_s", kind="stable")
    found: dict[int, list[Answer]] = {}
    for t, number, said, reason in zip(
        *(table[c].tolist() for c in ("t_s", "number", "decision", "reason")), strict=True
    ):
        before = found.setdefault(int(number), [])
        ran_out = t >= ends.get(int(number), np.inf) - TIME_TOLERANCE_S
        done = said != "accept" and ran_out and (reason == "over" or bool(before and before[-1].done))
        before.append(Answer(float(t), said == "accept", done))
    return found


def withdrawn_s(trace: Trace, sent: ProposalRecord, *, unless_replaced: bool = False) -> float:
    """The planning instant at which a proposal is taken back, s; infinite if it never is.

    That is the first instant at which one of these is so:

    - neither the UGV nor its cause is being intervened on;
    - the motion has run out;
    - another proposal is sent to the UGV (not counted with `unless_replaced`);
    - the UAV has a refusal of it, or of another part of its joint plan.
    """

    def first() -> float:
        alone = _over(trace, sent, unless_replaced)[0]
        return min([alone, *(t for t, refused in (_over(trace, part) for part in parts_of(trace, sent)) if refused)])

    return trace.derived(("withdrawn", sent.number, unless_replaced), first)


def _over(trace: Trace, sent: ProposalRecord, unless_replaced: bool = False) -> tuple[float, bool]:
    """When a proposal is taken back without regard to other parts, s, and whether the UAV has its refusal then."""
    t, period = trace.t, trace.scenario.intervention.period_s
    called = (trace.column(f"{sent.ugv}.mode") == 1.0) | (trace.column(f"{sent.cause}.mode") == 1.0)
    later = [one.issued_s for one in proposals_of(trace) if one.ugv == sent.ugv and one.issued_s > sent.issued_s]
    replaced = np.inf if unless_replaced else min(later, default=np.inf)
    for k in range(round(sent.issued_s / period) + 1, int(t[-1] / period + 1e-6) + 1):
        now = k * period
        row = row_at(trace, now)
        before = [answer for answer in answers_to(trace, sent) if answer.t_s < now - TIME_TOLERANCE_S]
        refused = bool(before) and before[-1].refused
        # the clock's rounding decides whether a motion that ends at this very instant has run out
        ended = t[row] >= sent.times_s[-1] or (bool(before) and before[-1].done)
        if not called[row] or ended or refused or replaced <= now + TIME_TOLERANCE_S:
            return now, refused
    return np.inf, False
