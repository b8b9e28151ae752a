"""The protocol: who had which proposal in force when, and who executed which, from messages and modes alone."""

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import TIME_TOLERANCE_S
from airground_drake.verify.runs.proposals import GATED_METHODS, ProposalRecord, proposals_of, row_at
from oracles.channel import has_channel, heard, held, retry_s
from oracles.fault import Fault


class Answer(NamedTuple):
    """A decision about a proposal: when, s; whether it accepts; whether it ends it because its motion is over."""

    t_s: float
    accepted: bool
    done: bool

    @property
    def refused(self) -> bool:
        return not (self.accepted or self.done)


def wrong_executions(trace: Trace) -> list[Fault]:
    """Samples at which a UGV executes another proposal than it should; messages that break the planner's rules."""
    return [*_executed_otherwise(trace), *_replaced_needlessly(trace), *_recorded_otherwise(trace)]


def _executed_otherwise(trace: Trace) -> Iterator[Fault]:
    """The first control sample at which each UGV executes another proposal than messages and modes say."""
    times = trace.sampled("t_s")
    for ugv in trace.ugvs:
        due = [-1 if sent is None else sent.number for sent in executed_at(trace, ugv)]
        recorded = trace.sampled(f"{ugv}.executing")
        if (wrong := np.flatnonzero(recorded != due)).size:
            k = int(wrong[0])
            both = {"due": due[k], "recorded": int(recorded[k])}
            yield Fault("executes another proposal than it should", ugv, float(times[k]), both)


def _recorded_otherwise(trace: Trace) -> Iterator[Fault]:
    """Answers that are not read, and proposals that are not withdrawn, when they should be."""
    table, ends = trace.messages, trace.t[-1] - TIME_TOLERANCE_S
    of = {kind: table[table["kind"] == kind] for kind in ("withdrawal", "answer")}
    period_s, read = trace.scenario.intervention.period_s, of["answer"].dropna(subset="read_s")
    waited_s = (read["read_s"] - read["sent_s"]).to_numpy(dtype=np.float64)
    if has_channel(trace):
        waited_s = np.zeros(0)  # see `oracles.channel`
    if ((waited_s <= 0.0) | (waited_s > max(period_s, trace.scenario.gatekeeper.period_s) + TIME_TOLERANCE_S)).any():
        yield Fault("answers are not read at the next planning instant")
    withdrawn = of["withdrawal"].groupby("about")["sent_s"].min().to_dict()
    for sent in proposals_of(trace):
        due, recorded = withdrawn_s(trace, sent), withdrawn.get(sent.number, np.inf)
        due = due if due < lost_s(trace, sent) - TIME_TOLERANCE_S else np.inf  # nobody is left to say so
        if min(due, ends) != min(recorded, ends) and abs(due - recorded) > TIME_TOLERANCE_S:
            yield Fault("withdrawn at another time", sent.ugv, sent.issued_s, {"due": due, "recorded": recorded})


def _replaced_needlessly(trace: Trace) -> Iterator[Fault]:
    """Proposals that replace one in force, though no other UGV needs it."""
    for ugv in trace.ugvs:
        for before, after in pairwise(sent for sent in proposals_of(trace) if sent.ugv == ugv):
            t, row = after.issued_s + TIME_TOLERANCE_S, row_at(trace, after.issued_s)
            mates = [other for other in trace.scenario.in_charge(after.sender) if other != ugv]
            others = any(trace.column(f"{other}.mode")[row] == 1.0 for other in mates)
            alone = not (after.party or others) and after.cause == ugv
            if alone and withdrawn_s(trace, before, unless_replaced=True) > t and before.times_s[-1] > t:
                yield Fault("replaced while in force", ugv, after.issued_s, after.policy)


def lost_s(trace: Trace, sent: ProposalRecord) -> float:
    """When the UAV that sent a proposal is lost, s; infinite if it never is."""
    return trace.scenario.aerial[sent.sender].lost_at_s or np.inf


def parts_of(trace: Trace, sent: ProposalRecord) -> list[ProposalRecord]:
    same = (sent.issued_s, sent.party)
    return [one for one in proposals_of(trace) if sent.party and one is not sent and (one.issued_s, one.party) == same]


def parties(trace: Trace, sent: ProposalRecord) -> list[str]:
    """The UGVs for which a proposal stands: its own, its cause, and those of the other parts of its joint plan."""
    return sorted({sent.ugv, sent.cause, *(part.ugv for part in parts_of(trace, sent))})


def executed_at(trace: Trace, ugv: str) -> list[ProposalRecord | None]:
    """The proposal that a UGV should execute, at each control sample of the run, or None.

    A proposal is in force from its sending until it is withdrawn (`withdrawn_s`). Under method (b) it is executed all
    that time; under (c) and (d) while the gatekeeper's last decision accepts it.
    """

    def found() -> list[ProposalRecord | None]:
        mine = [sent for sent in reversed(proposals_of(trace)) if sent.ugv == ugv]
        return [
            next((one for one in mine if _in_force(trace, one, now) and _is_accepted(trace, one, now)), None)
            for now in trace.sampled("t_s").tolist()
        ]

    return trace.derived(("executed", ugv), found)


def _in_force(trace: Trace, sent: ProposalRecord, now: float) -> bool:
    """Whether a proposal was in force after the last planning instant up to `now`, s; with a channel, for its UGV."""
    if has_channel(trace):
        begin, end = held(trace, sent)
        return begin <= now + TIME_TOLERANCE_S < end
    period = trace.scenario.intervention.period_s
    planned = period * np.floor(now / period + 1e-6) + TIME_TOLERANCE_S
    return bool(sent.issued_s <= planned < withdrawn_s(trace, sent))


def _is_accepted(trace: Trace, sent: ProposalRecord, now: float) -> bool:
    if trace.meta["method"] not in GATED_METHODS:
        return True
    own = _answer_at(trace, sent, now)
    return own is not None and own.accepted


def _answer_at(trace: Trace, sent: ProposalRecord, now: float) -> Answer | None:
    """The decision about a proposal at the gatekeeper's last sample up to `now`, s, if there is one."""
    period = trace.scenario.gatekeeper.period_s
    asked = period * np.floor(now / period + 1e-6)
    answers = answers_to(trace, sent)
    k = int(np.searchsorted([answer.t_s for answer in answers], asked - TIME_TOLERANCE_S))
    return answers[k] if k < len(answers) and abs(answers[k].t_s - asked) <= TIME_TOLERANCE_S else None


def answers_to(trace: Trace, sent: ProposalRecord) -> list[Answer]:
    return trace.derived("answers_to", lambda: _answers(trace)).get(sent.number, [])


def _answers(trace: Trace) -> dict[int, list[Answer]]:
    ends = {sent.number: float(sent.times_s[-1]) for sent in proposals_of(trace)}
    found: dict[int, list[Answer]] = {}
    table = trace.decisions.sort_values("t_s", kind="stable")
    columns = (table[name].tolist() for name in ("t_s", "number", "decision", "reason"))
    for t, number, said, reason in zip(*columns, strict=True):
        before = found.setdefault(int(number), [])
        ran_out = t >= ends.get(int(number), np.inf) - TIME_TOLERANCE_S
        done = said != "accept" and ran_out and (reason == "over" or bool(before and before[-1].done))
        before.append(Answer(float(t), said == "accept", done))
    return found


def withdrawn_s(trace: Trace, sent: ProposalRecord, *, unless_replaced: bool = False) -> float:
    """The planning instant at which a proposal is taken back, s; infinite if it never is.

    That is the first instant at which one of these is so:

    - neither the UGV, nor its cause, nor any party of its joint plan is being intervened on;
    - the motion has run out;
    - another proposal is sent to the UGV (not counted with `unless_replaced`);
    - the UAV has a refusal of it, or of another part of its joint plan;
    - over a channel, it has no answer, and it is too late to repeat it.

    Once the UAV is lost, a proposal is over when its motion has run out, and nobody says so.
    """

    def first() -> float:
        alone = _over(trace, sent, unless_replaced)[0]
        return min([alone, *(t for t, refused in (_over(trace, part) for part in parts_of(trace, sent)) if refused)])

    return trace.derived(("withdrawn", sent.number, unless_replaced), first)


def held_until(trace: Trace, sent: ProposalRecord) -> float:
    """When a UGV learns that a proposal is taken back, s."""
    return held(trace, sent)[1] if has_channel(trace) else withdrawn_s(trace, sent)


def known_answers(trace: Trace, sent: ProposalRecord, now: float) -> list[Answer]:
    """The decision about a proposal that the UAV knows of at a planning instant, s, over a channel; [] if none."""
    last = heard(trace, sent.ugv, now)
    table = trace.decisions
    (t,) = table.loc[table["answer"] == last["number"], "t_s"].tolist() or [None] if last else [None]
    return [answer for answer in answers_to(trace, sent) if answer.t_s == t]


def _over(trace: Trace, sent: ProposalRecord, unless_replaced: bool = False) -> tuple[float, bool]:
    """When a proposal is taken back without regard to other parts, s, and whether the UAV has its refusal then."""
    t, period = trace.t, trace.scenario.intervention.period_s
    called = np.any([trace.column(f"{name}.mode") == 1.0 for name in parties(trace, sent)], axis=0)
    later = [one.issued_s for one in proposals_of(trace) if one.ugv == sent.ugv and one.issued_s > sent.issued_s]
    replaced = np.inf if unless_replaced else min(later, default=np.inf)
    for k in range(round(sent.issued_s / period) + 1, int(t[-1] / period + 1e-6) + 1):
        now = k * period
        row = row_at(trace, now)
        before = [answer for answer in answers_to(trace, sent) if answer.t_s < now - TIME_TOLERANCE_S]
        if has_channel(trace):
            before = known_answers(trace, sent, now)
        refused = bool(before) and before[-1].refused
        # the clock's rounding decides whether a motion that ends at this very instant has run out
        ended = t[row] >= sent.times_s[-1] or (bool(before) and before[-1].done)
        if now >= lost_s(trace, sent) - TIME_TOLERANCE_S:
            if t[row] >= sent.times_s[-1]:
                return now, False
        elif not called[row] or ended or refused or replaced <= now + TIME_TOLERANCE_S or _missed(trace, sent, now):
            return now, refused
    return np.inf, False


LATE_S = 0.5
"""A motion that begins so long before its UGV can read of it is not proposed again."""


def _missed(trace: Trace, sent: ProposalRecord, now: float) -> bool:
    """Whether a proposal that stands alone is too late to be repeated: no answer, and its UGV is still at its start."""
    channel, next_s = trace.scenario.channel, now + trace.scenario.intervention.period_s
    if (
        channel is None
        or sent.party
        or sent.cause != sent.ugv
        or next_s < sent.issued_s + retry_s(trace) - TIME_TOLERANCE_S
    ):
        return False
    last, begins = heard(trace, sent.ugv, now), sent.times_s[0]
    if next_s + channel.delay_s <= begins + LATE_S + TIME_TOLERANCE_S or (last and last["about"] == sent.number):
        return False
    k = int(np.abs(trace.sampled("t_s") - now).argmin())
    seen = trace.scenario.sensing is not None
    place = [trace.sampled(f"{sent.ugv}.uav_saw_{a}_m")[k] for a in "xyz"] if seen else _place(trace, sent.ugv, now)
    there = [np.interp(now, sent.times_s, axis) for axis in sent.positions_m.T]
    return bool(np.linalg.norm(place - sent.positions_m[0]) < np.linalg.norm(np.subtract(place, there)))


def _place(trace: Trace, ugv: str, now: float) -> Array:
    return trace.position(ugv)[row_at(trace, now)]
