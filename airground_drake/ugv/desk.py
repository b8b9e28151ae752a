"""The UGVs' side of the protocol over a channel that may lose, duplicate and delay messages.

Every message may be read twice. A proposal is stale if its number is not above the highest number read. A withdrawal
counts as reading its proposal, which is stale if it arrives later. A UGV answers every copy that it reads, also one of
a withdrawal; it repeats a refusal and `done`, but no more than `MOST_REPEATS` times.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace

from airground_drake.base.history import History, Immutable
from airground_drake.model.bodies.motion import SAME_S
from airground_drake.uav.channel import Delivery, Message
from airground_drake.uav.messages import ACCEPT, DONE, REFUSE, SILENT, Proposals, Report, Reports, Told, answer_to

MOST_REPEATS = 5


@dataclass(frozen=True)
class Desk(Immutable):
    """The protocol state of n UGVs: messages read, proposals held, answers sent."""

    held: Proposals  # the proposals in force, one entry per UGV
    newest: tuple[int, ...]  # the highest number of a proposal that each has read of, (n,)
    last: tuple[Message | None, ...]  # the last answer of each
    # When each message that arrived was read, s, in the order of arrival.
    read_s: History[float] = field(default_factory=History)
    outbox: History[Message] = field(default_factory=History)  # all answers

    @classmethod
    def empty(cls, count: int) -> Desk:
        return cls((None,) * count, (-1,) * count, (None,) * count)


def read(desk: Desk, arrived: Sequence[Delivery], t: float) -> Desk:
    """The state after reading, at time t, s, all newly arrived messages."""
    new = arrived[len(desk.read_s) :]
    if not new:
        return desk
    held, newest = list(desk.held), list(desk.newest)
    for message in (delivery.message for delivery in new):
        i, number, now = message.ugv, message.about, held[message.ugv]
        if message.kind == "withdrawal" and now is not None and now.number <= number:
            held[i] = None
        elif message.kind == "proposal" and number > newest[i]:
            held[i] = message.content
        newest[i] = max(newest[i], number)
    return replace(desk, held=tuple(held), newest=tuple(newest), read_s=desk.read_s.plus([t] * len(new)))


def replied(
    desk: Desk, asked: Collection[int], answers: Sequence[float], reports: Reports, sent: int, t: float, retry_s: float
) -> tuple[Desk, int]:
    """The state after answering at time t, s, and the number of answers so far."""
    # asked: UGVs that have read a message at this sample. A report with a new number is a new answer to what is held.
    last, new = list(desk.last), list[Message]()
    for i, (held, newest, report, before) in enumerate(zip(desk.held, desk.newest, reports, desk.last, strict=True)):
        verdict = answer_to(held, answers, i)
        content = Told(verdict, report, newest, -1 if held is None else held.number)
        was = Told() if before is None else before.content
        if held is not None and report.number > (-1 if before is None else before.number):
            message = Message("answer", report.number, held.number, i, t, 0, content)
        elif (content.newest, content.holds) != (was.newest, was.holds):
            message, sent = Message("answer", sent, newest, i, t, 0, content), sent + 1
        elif before is not None and (i in asked or _repeats(before, verdict, t, retry_s)):
            message = before._replace(sent_s=t, attempt=before.attempt + 1)
        else:
            continue
        last[i] = message
        new.append(message)
    if not new:
        return desk, sent
    return replace(desk, last=tuple(last), outbox=desk.outbox.plus(new)), sent


@dataclass(frozen=True)
class Obeying(Immutable):
    """UGVs under method (b), which accept every proposal when they read it."""

    desk: Desk
    reports: Reports
    sent: int = 0  # answers sent so far

    @classmethod
    def empty(cls, count: int) -> Obeying:
        return cls(Desk.empty(count), (Report(),) * count)

    def after(self, arrived: Sequence[Delivery]) -> Obeying:
        """The state after reading each arrived message at its time."""
        now, first = self, len(self.desk.read_s)
        for k, delivery in enumerate(arrived[first:], first + 1):
            i, t, sent, reports = delivery.message.ugv, delivery.received_s, now.sent, list(now.reports)
            desk = read(now.desk, arrived[:k], t)
            if desk.held[i] is not now.desk.held[i]:
                reports[i] = Report() if desk.held[i] is None else Report(sent)
                sent += desk.held[i] is not None
            desk, sent = replied(desk, {i}, obeyed(desk.held), tuple(reports), sent, t, math.inf)
            now = Obeying(desk, tuple(reports), sent)
        return now


def obeyed(held: Proposals) -> list[float]:
    """The answers of UGVs that accept every held proposal, (2n,)."""
    answers = ((SILENT, -1.0) if proposal is None else (ACCEPT, float(proposal.number)) for proposal in held)
    return [number for answer in answers for number in answer]


def _repeats(last: Message, verdict: float, t: float, retry_s: float) -> bool:
    """Whether a UGV repeats, unasked, that it does not follow the proposal that it holds."""
    return verdict in (REFUSE, DONE) and last.attempt < MOST_REPEATS and t >= last.sent_s + retry_s - SAME_S
