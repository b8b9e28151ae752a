"""What a channel does to messages, and what a UAV sends over it until it has been read."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.model.geometry.motion import Motion
from airground_drake.uav.channel import Link, Message, Quality, Transit
from airground_drake.uav.messages import Told
from airground_drake.uav.outbox import Outbox, answers_heard, posted, repeated
from airground_drake.uav.planner import PlannerState
from airground_drake.uav.policy import Proposal

QUALITIES = st.builds(
    Quality,
    delay_s=st.floats(0.0, 2.0),
    jitter_s=st.floats(0.0, 1.0),
    loss=st.floats(0.0, 0.9),
    burst_s=st.sampled_from([0.0, 0.5]),
    duplicate=st.floats(0.0, 1.0),
    reorder=st.booleans(),
)


def messages(count: int, every_s: float = 0.05) -> tuple[Message, ...]:
    return tuple(Message("answer", k, k, k % 3, every_s * k) for k in range(count))


@given(quality=QUALITIES, seed=st.integers(0, 99), cuts=st.lists(st.floats(0.0, 9.0), max_size=5))
@examples(100)
def test_what_arrives_does_not_depend_on_when_one_looks(quality: Quality, seed: int, cuts: Sequence[float]) -> None:
    link, sent = Link(quality, seed, "down"), messages(60)
    now = Transit()
    for t in [*sorted(cuts), 9.0]:
        now = link.carry(now, tuple(message for message in sent if message.sent_s <= t), t)
        assert link.carry(now, tuple(message for message in sent if message.sent_s <= t), t) is now
        assert all(delivery.received_s <= t + 1e-9 < later.received_s + 2e-9
                   for delivery in now.arrived for later in now.under_way)  # fmt: skip
    assert now == link.carry(Transit(), sent, 9.0)
    whole = link.carry(Transit(), sent, 99.0)
    assert {d.order for d in whole.arrived} | {m.number for m in whole.lost} == {*range(60)}
    assert [d.received_s for d in whole.arrived] == sorted(d.received_s for d in whole.arrived)
    assert quality.duplicate > 0.0 or len(whole.arrived) + len(whole.lost) == 60
    for ugv in range(3):
        mine = [delivery for delivery in whole.arrived if delivery.message.ugv == ugv]
        assert quality.reorder or [d.order for d in mine] == sorted(d.order for d in mine)
        own = tuple(message for message in sent if message.ugv == ugv)  # other UGVs' messages hold up none
        alone = [d.received_s for d in link.carry(Transit(), own, 99.0).arrived]
        assert [d.received_s for d in mine] == alone
        assert (whole.newest[ugv].order if mine else None) == max((d.order for d in mine), default=None)


@given(first=st.floats(0.0, 3.0), second=st.floats(0.0, 3.0), loss=st.floats(0.0, 0.9))
@examples(50)
def test_with_another_delay_the_same_messages_are_lost(first: float, second: float, loss: float) -> None:
    lost = [Link(Quality(d, loss=loss), 7, "up").carry(Transit(), messages(80), 99.0).lost for d in (first, second)]
    assert lost[0] == lost[1]


@pytest.mark.parametrize("burst_s", [0.0, 0.4])
def test_shares_and_bursts_are_as_asked_for(burst_s: float) -> None:
    link, sent = Link(Quality(0.1, 0.2, 0.3, burst_s, 0.25), 1, "down"), messages(9000)
    found = link.carry(Transit(), sent, math.inf)
    late = np.array([d.received_s - d.message.sent_s for d in found.arrived])
    assert len(found.lost) / 9000 == pytest.approx(0.3, abs=0.05 if burst_s else 0.02)
    assert sum(d.copy for d in found.arrived) / (9000 - len(found.lost)) == pytest.approx(0.25, abs=0.02)
    assert (late.min(), late.max()) == pytest.approx((0.1, 0.3), abs=1e-3)
    assert len({*late.tolist()}) == len(late)  # a copy is late by itself
    gone = np.diff([m.number for m in found.lost if m.ugv == 0])
    assert (np.mean(gone == 3) > 0.7) == (burst_s > 0.0)  # the next message of the same UGV is lost, too


def test_seeds_links_and_attempts_have_different_fates() -> None:
    links = Link(Quality(loss=0.5), 1, "down"), Link(Quality(loss=0.5), 2, "down"), Link(Quality(loss=0.5), 1, "up")
    fates = [[bool(link.fate(message)) for message in messages(40)] for link in links]
    fates.append([bool(links[0].fate(message._replace(attempt=1))) for message in messages(40)])
    assert all(one != other for one, other in pairwise([*fates, fates[0]]))


def proposal(number: int, t: float) -> Proposal:
    return Proposal("way", t, Motion(np.array([0.0, 9.0]), np.zeros((2, 3))), number=number)


def heard(*told: tuple[int, Told]) -> Transit:
    sent = tuple(Message("answer", k, about, 0, 0.0, 0, content) for k, (about, content) in enumerate(told))
    return Link(Quality(), 1, "up").carry(Transit(), sent, 0.0)


def test_a_proposal_is_repeated_until_an_answer_names_it_or_a_newer_one() -> None:
    box = posted(Outbox(), [PlannerState((), sent=((0, proposal(4, 1.0)),))])
    assert posted(box, [PlannerState((), sent=((0, proposal(4, 1.0)),))]) is box
    assert repeated(box, Transit(), 1.4, 0.5) is box
    again = repeated(box, heard((3, Told(newest=3))), 1.5, 0.5)
    assert [(m.kind, m.about, m.sent_s, m.attempt) for m in again.messages] == [
        ("proposal", 4, 1.0, 0), ("proposal", 4, 1.5, 1),
    ]  # fmt: skip
    assert repeated(again, Transit(), 1.9, 0.5) is again
    for newest in (4, 5):
        done = repeated(again, heard((newest, Told(newest=newest, holds=newest))), 9.0, 0.5)
        assert done.messages == again.messages
        assert not done.waiting


def test_a_withdrawal_is_repeated_until_the_ugv_holds_the_proposal_no_more_or_gets_another() -> None:
    sent = ((0, proposal(4, 1.0)),)
    box = posted(Outbox(), [PlannerState((), sent=sent, withdrawn=((4, 2.0),))])
    assert [message.kind for message in box.messages] == ["proposal", "withdrawal"]
    assert [message.kind for message in box.waiting.values()] == ["withdrawal"]
    for told, waits in ((Told(newest=4, holds=4), True), (Told(newest=4), False), (Told(newest=6, holds=6), False)):
        assert bool(repeated(box, heard((told.newest, told)), 9.0, 0.5).waiting) == waits
    more = posted(box, [PlannerState((), sent=(*sent, (0, proposal(5, 3.0))), withdrawn=((4, 2.0),))])
    assert [(message.kind, message.about) for message in more.waiting.values()] == [("proposal", 5)]


def test_the_uav_goes_by_the_answer_that_was_sent_last() -> None:
    late = heard((1, Told(1.0, newest=1)), (2, Told(-1.0, newest=2)))
    assert answers_heard(late, range(2))[0] == [-1.0, 2.0, 0.0, -1.0]


def test_several_uavs_share_numbers_of_withdrawals_and_a_lost_one_repeats_nothing() -> None:
    north = PlannerState((), sent=((0, proposal(0, 1.0)),), withdrawn=((0, 2.0),))
    south = PlannerState((), sent=((1, proposal(1, 1.0)), (2, proposal(3, 1.0))), withdrawn=((3, 2.0),))
    box = posted(posted(Outbox(), [PlannerState(()), south]), [north, south])
    assert sorted(message.number for message in box.messages if message.kind == "withdrawal") == [0, 1]
    assert {ugv: (message.kind, message.about) for ugv, message in box.waiting.items()} == {
        0: ("withdrawal", 0), 1: ("proposal", 1), 2: ("withdrawal", 3),
    }  # fmt: skip
    later = repeated(box, Transit(), 9.0, 0.5, {1, 2})
    assert [message.ugv for message in later.messages[len(box.messages) :]] == [*later.waiting] == [0]
