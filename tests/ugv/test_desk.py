"""What UGVs read and answer over a channel, whatever it does to messages."""

from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.model.geometry.motion import Motion
from airground_drake.uav.channel import Delivery, Message
from airground_drake.uav.messages import ACCEPT, DONE, REFUSE, SILENT, Report
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.desk import MOST_REPEATS, Desk, Obeying, read, replied

NOTHING = (Report(),)


def proposal(number: int) -> Message:
    of = Proposal("way", 0.0, Motion(np.array([0.0, 9.0]), np.zeros((2, 3))), number=number)
    return Message("proposal", number, number, 0, 0.0, 0, of)


def withdrawal(number: int) -> Message:
    return Message("withdrawal", number, number, 0, 0.0)


def arrived(*messages: Message) -> tuple[Delivery, ...]:
    return tuple(Delivery(0.1 * k, k, 0, message) for k, message in enumerate(messages))


def holds(*messages: Message) -> int | None:
    (held,) = read(Desk.empty(1), arrived(*messages), 1.0).held
    return None if held is None else held.number


MESSAGES = st.lists(st.builds(lambda make, n: make(n), st.sampled_from([proposal, withdrawal]), st.integers(0, 4)))


@given(messages=MESSAGES, data=st.data())
@examples(200)
def test_what_a_ugv_holds_depends_on_the_highest_number_alone(messages: list[Message], data: Any) -> None:
    """However often messages arrive after their first copy."""
    newest = max((message.about for message in messages), default=-1)
    first = next((message for message in messages if message.about == newest), None)
    gone = any(message.kind == "withdrawal" and message.about == newest for message in messages)
    expected = newest if first is not None and first.kind == "proposal" and not gone else None
    assert holds(*messages) == expected
    again = data.draw(st.lists(st.sampled_from(messages))) if messages else []
    assert holds(*messages, *again) == expected


def answer(desk: Desk, asked: set[int], verdict: float, number: int, t: float, told: int = 1) -> Desk:
    """After a sample at which the UGV has this verdict on what it holds."""
    about = -1 if desk.held[0] is None else desk.held[0].number
    return replied(desk, asked, (verdict, float(about)), (Report(number),), told, t, 0.5)[0]


def test_every_copy_is_answered_and_a_refusal_is_repeated_a_few_times() -> None:
    desk = read(Desk.empty(1), arrived(proposal(3)), 1.0)
    desk = answer(desk, {0}, REFUSE, 0, 1.0)
    assert answer(desk, set(), REFUSE, 0, 1.4) is desk
    for k in range(1, 9):
        desk = answer(desk, set(), REFUSE, 0, 1.0 + k)
    assert [message.attempt for message in desk.outbox] == [*range(MOST_REPEATS + 1)]
    desk = read(desk, arrived(proposal(3), proposal(3)), 12.0)
    desk = answer(desk, {0}, REFUSE, 0, 12.0)
    assert [(m.number, m.about, m.content.holds) for m in desk.outbox] == [(0, 3, 3)] * (MOST_REPEATS + 2)


def test_an_acceptance_is_said_once_and_done_again() -> None:
    desk = answer(read(Desk.empty(1), arrived(proposal(3)), 1.0), {0}, ACCEPT, 0, 1.0)
    assert answer(desk, set(), ACCEPT, 0, 9.0) is desk
    desk = answer(answer(desk, set(), DONE, 1, 9.0), set(), DONE, 1, 9.5)
    assert [(message.content.verdict, message.number, message.attempt) for message in desk.outbox] == [
        (ACCEPT, 0, 0), (DONE, 1, 0), (DONE, 1, 1),
    ]  # fmt: skip


def test_a_withdrawal_is_confirmed_by_an_answer_of_its_own() -> None:
    desk = answer(read(Desk.empty(1), arrived(proposal(3)), 1.0), {0}, ACCEPT, 0, 1.0)
    desk = read(desk, arrived(proposal(3), withdrawal(3)), 2.0)
    desk, told = replied(desk, {0}, (SILENT, -1.0), NOTHING, 1, 2.0, 0.5)
    last = desk.outbox[-1]
    assert (last.number, last.about, last.content.verdict, last.content.holds, told) == (1, 3, SILENT, -1, 2)
    assert replied(desk, set(), (SILENT, -1.0), NOTHING, told, 9.0, 0.5)[0] is desk


def test_who_obeys_answers_what_it_reads_at_its_time() -> None:
    now = Obeying.empty(1).after(arrived(proposal(3), proposal(3), withdrawal(3)))
    assert [(m.content.verdict, m.content.holds, m.sent_s, m.attempt) for m in now.desk.outbox] == [
        (ACCEPT, 3, 0.0, 0), (ACCEPT, 3, 0.1, 1), (SILENT, -1, 0.2, 0),
    ]  # fmt: skip
    assert now.after(arrived(proposal(3), proposal(3), withdrawal(3))) is now
    assert now.desk.read_s == (0.0, 0.1, 0.2)
