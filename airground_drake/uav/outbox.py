"""Repetition of UAVs' messages over a channel that may lose them, until they have been read.

A proposal is repeated until an answer names it or a newer one; a withdrawal, until the UGV says that it does not hold
the proposal, or gets another one. A UAV that is lost repeats nothing.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from airground_drake.base.history import History, Immutable
from airground_drake.model.bodies.motion import SAME_S
from airground_drake.uav.channel import Delivery, Message, Transit
from airground_drake.uav.messages import SILENT, Report, Reports
from airground_drake.uav.planner import PlannerState


@dataclass(frozen=True)
class Outbox(Immutable):
    """All messages that UAVs have sent, and the expected answers."""

    taken: tuple[tuple[int, int], ...] = ()  # of each UAV, proposals and withdrawals of its planner that were posted
    messages: History[Message] = field(default_factory=History)
    waiting: Mapping[int, Message] = field(default_factory=dict)  # per UGV, the message to repeat, as last sent


def posted(box: Outbox, memories: Sequence[PlannerState]) -> Outbox:
    """The outbox with the planners' new messages, which replace earlier ones to the same UGV."""
    taken = tuple((len(memory.sent), len(memory.withdrawn)) for memory in memories)
    if box.taken == taken:
        return box
    before, new = box.taken or ((0, 0),) * len(taken), list[Message]()
    count = sum(withdrawn for _, withdrawn in before)
    for memory, (proposals, withdrawn) in zip(memories, before, strict=True):
        to = {proposal.number: i for i, proposal in memory.sent}
        gone = memory.withdrawn[withdrawn:]
        new += [Message("withdrawal", count + k, number, to[number], t) for k, (number, t) in enumerate(gone)]
        new += [Message("proposal", p.number, p.number, i, p.issued, 0, p) for i, p in memory.sent[proposals:]]
        count += len(gone)
    new.sort(key=lambda message: message.sent_s)  # of one instant, a UAV's withdrawals first
    waiting = {**box.waiting, **{message.ugv: message for message in new}}
    return Outbox(taken, box.messages.plus(new), waiting)


def repeated(box: Outbox, heard: Transit, t: float, retry_s: float, left: Collection[int] = ()) -> Outbox:
    """The outbox with repetitions at time t, s, of messages without an answer for `retry_s`."""
    # left: UGVs whose UAV is lost
    waiting = {
        ugv: message
        for ugv, message in box.waiting.items()
        if ugv not in left and not _was_read(message, heard.newest.get(ugv))
    }
    again = [
        message._replace(sent_s=t, attempt=message.attempt + 1)
        for message in waiting.values()
        if t >= message.sent_s + retry_s - SAME_S
    ]
    if len(waiting) == len(box.waiting) and not again:
        return box
    return replace(
        box, messages=box.messages.plus(again), waiting={**waiting, **{message.ugv: message for message in again}}
    )


def _was_read(message: Message, heard: Delivery | None) -> bool:
    if heard is None or heard.message.content.newest < message.about:
        return False
    return message.kind == "proposal" or bool(heard.message.content.holds != message.about)


def answers_heard(heard: Transit, ugvs: Iterable[int]) -> tuple[list[float], Reports]:
    """The last received answers of all UGVs, (2n,), and their reports."""
    answers, reports = list[float](), list[Report]()
    for last in map(heard.newest.get, ugvs):
        answers += [SILENT, -1.0] if last is None else [last.message.content.verdict, float(last.message.about)]
        reports.append(Report() if last is None else last.message.content.report)
    return answers, tuple(reports)
