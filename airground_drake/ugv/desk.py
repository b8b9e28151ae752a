"""What UGVs read and answer over a channel that may lose, double and delay messages.

Everything may be read twice. A proposal whose number is not above the newest number read is stale; a withdrawal counts
as read, so that its proposal is stale if it arrives later. A UGV answers every copy that it reads, also one of a
withdrawal; it repeats a refusal and `done`, but no more than `MOST_REPEATS` times.
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
    """What lies in front of n UGVs: what they have read, what they hold, what they have sent."""

    held: Proposals  # the proposals in force, one entry per UGV
    newest: tuple[int, ...]  # the highest number of a proposal that each has read of, (n,)
    last: tuple[Message | None, ...]  # the last answer of each
    # When each message that arrived was read, s, in the order of arrival.
    read_s: History[float] = field(default_factory=History)
    outbox: History[Message] = field(default_factory=History)  # all answers

    @classmethod
    def empty(cls, count: int) -> Desk:
        """Of `count` UGVs that have read nothing."""
        return cls((None,) * count, (-1,) * count, (None,) * count)


def read(desk: Desk, arrived: Sequence[Delivery], t: float) -> Desk:
    """After reading, at time t, s, all that arrived since."""
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
    desk: Desk, asked: Collection[int], answers: Sequence[float], reports: Reports, told: int, t: float, retry_s: float
) -> tuple[Desk, int]:
    """After answering at time t, s, and how many answers there are then."""
    # asked: UGVs that have read a message at this sample. A report with a new number is a new answer to what is held.
    last, new = list(desk.last), list[Message]()
    for i, (held, newest, report, before) in enumerate(zip(desk.held, desk.newest, reports, desk.last, strict=True)):
        verdict = answer_to(held, answers, i)
        content = Told(verdict, report, newest, -1 if held is None else held.number)
        was = Told() if before is None else before.content
        if held is not None and report.number > (-1 if before is None else before.number):
            message = Message("answer", report.number, held.number, i, t, 0, content)
        elif (content.newest, content.holds) != (was.newest, was.holds):
            message, told = Message("answer", told, newest, i, t, 0, content), told + 1
        elif before is not None and (i in asked or _repeats(before, verdict, t, retry_s)):
            message = before._replace(sent_s=t, attempt=before.attempt + 1)
        else:
            continue
        last[i] = message
        new.append(message)
    if not new:
        return desk, told
    return replace(desk, last=tuple(last), outbox=desk.outbox.plus(new)), told


@dataclass(frozen=True)
class Obeying(Immutable):
    """UGVs under method (b), which accept all that they read, when they read it."""

    desk: Desk
    reports: Reports
    told: int = 0  # answers sent so far

    @classmethod
    def empty(cls, count: int) -> Obeying:
        """Of `count` UGVs that have read nothing."""
        return cls(Desk.empty(count), (Report(),) * count)

    def after(self, arrived: Sequence[Delivery]) -> Obeying:
        """After all that arrived, each message at its time."""
        now, first = self, len(self.desk.read_s)
        for k, delivery in enumerate(arrived[first:], first + 1):
            i, t, told, reports = delivery.message.ugv, delivery.received_s, now.told, list(now.reports)
            desk = read(now.desk, arrived[:k], t)
            if desk.held[i] is not now.desk.held[i]:
                reports[i] = Report() if desk.held[i] is None else Report(told)
                told += desk.held[i] is not None
            answers = [number for answer in obeyed(desk.held) for number in answer]
            desk, told = replied(desk, {i}, answers, tuple(reports), told, t, math.inf)
            now = Obeying(desk, tuple(reports), told)
        return now


def obeyed(held: Proposals) -> list[list[float]]:
    """The answers of UGVs that accept all that they hold, (n, 2)."""
    return [[SILENT, -1.0] if proposal is None else [ACCEPT, float(proposal.number)] for proposal in held]


def _repeats(last: Message, verdict: float, t: float, retry_s: float) -> bool:
    """Whether a UGV says again, without being asked, that it does not follow the proposal that it holds."""
    return verdict in (REFUSE, DONE) and last.attempt < MOST_REPEATS and t >= last.sent_s + retry_s - SAME_S
