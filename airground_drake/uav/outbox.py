"""What a UAV sends over a channel that may lose messages: everything until it has been read.

A proposal is repeated until an answer names it or a newer one; a withdrawal, until the UGV says that it does not hold
the proposal, or gets another one.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

from airground_drake.model.bodies.motion import SAME_S
from airground_drake.uav.channel import Delivery, Message, Transit
from airground_drake.uav.messages import SILENT, Report, Reports
from airground_drake.uav.planner import PlannerState


@dataclass(frozen=True)
class Outbox:
    """All that a UAV has sent, and what it waits for."""

    proposals: int = 0  # of those of the planner, taken
    withdrawn: int = 0  # of these, too
    messages: tuple[Message, ...] = ()
    waiting: Mapping[int, Message] = field(default_factory=dict)  # per UGV, the message to repeat, as last sent

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Immutable: the copy is the object itself."""
        return self


def posted(box: Outbox, memory: PlannerState) -> Outbox:
    """With what the planner has sent since; nobody waits any more for what was said to the same UGV before."""
    if (box.proposals, box.withdrawn) == (len(memory.sent), len(memory.withdrawn)):
        return box
    to = {proposal.number: i for i, proposal in memory.sent}
    withdrawn = [
        Message("withdrawal", box.withdrawn + k, number, to[number], t)
        for k, (number, t) in enumerate(memory.withdrawn[box.withdrawn :])
    ]
    proposals = [Message("proposal", p.number, p.number, i, p.issued, 0, p) for i, p in memory.sent[box.proposals :]]
    new = sorted([*withdrawn, *proposals], key=lambda message: message.sent_s)  # of one instant, withdrawals first
    waiting = {**box.waiting, **{message.ugv: message for message in new}}
    return Outbox(len(memory.sent), len(memory.withdrawn), box.messages + tuple(new), waiting)


def repeated(box: Outbox, heard: Transit, t: float, retry_s: float) -> Outbox:
    """With what is sent again at time t, s, after `retry_s` without the answer that is waited for."""
    waiting = {ugv: message for ugv, message in box.waiting.items() if not _was_read(message, heard.newest.get(ugv))}
    again = [
        message._replace(sent_s=t, attempt=message.attempt + 1)
        for message in waiting.values()
        if t >= message.sent_s + retry_s - SAME_S
    ]
    if len(waiting) == len(box.waiting) and not again:
        return box
    return replace(
        box, messages=box.messages + tuple(again), waiting={**waiting, **{message.ugv: message for message in again}}
    )


def _was_read(message: Message, heard: Delivery | None) -> bool:
    if heard is None or heard.message.content.newest < message.about:
        return False
    return message.kind == "proposal" or bool(heard.message.content.holds != message.about)


def answers_heard(heard: Transit, ugvs: Iterable[int]) -> tuple[list[float], Reports]:
    """The last answers of all UGVs that the UAV has got, as (2n,), and the reports with them."""
    answers, reports = list[float](), list[Report]()
    for last in map(heard.newest.get, ugvs):
        answers += [SILENT, -1.0] if last is None else [last.message.content.verdict, float(last.message.about)]
        reports.append(Report() if last is None else last.message.content.report)
    return answers, tuple(reports)
