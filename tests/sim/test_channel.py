"""Runs whose messages are late, lost, doubled and overtaken: what holds whatever the channel does."""

from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import faults_of
from properties import examples
from pydrake.common.value import Value
from sim.blocks.both_programs import found

from airground_drake.scenario.links import ANSWERING_S, repeats_after
from airground_drake.scenario.load import load, resolved
from airground_drake.scenario.schema import Channel, WayBack
from airground_drake.sim import blocks
from airground_drake.sim.blocks import channel, gatekeeper
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.uav.channel import Link, Quality
from airground_drake.ugv import desk
from airground_drake.verify import judge

Run = Callable[..., Trace]
NOISY = Channel(0.05, 1.0, 0.3, duplicate=0.5)
"""Many messages arrive after newer ones."""


def over(given: Channel | None, scenario: str = "lab", run: str = "d", *more: str) -> Trace:
    return simulate(replace(load(scenario, [*more]), channel=given), run)


def test_a_message_is_repeated_after_the_longest_way_there_and_back() -> None:
    for jitter_s, back_s in ((0.1, 0.4), (0.4, 0.1)):
        given = Channel(0.2, jitter_s, up=WayBack(delay_s=0.3, jitter_s=back_s))
        assert repeats_after(replace(load("minimal"), channel=given)) == pytest.approx(0.2 + 0.3 + 0.4 + ANSWERING_S)


@pytest.mark.parametrize(("scenario", "name", "more"), [
    ("case_b", "b", ()), ("case_b", "c", ()), ("case_b", "d", ()),
    pytest.param("doorway", "d", (), marks=pytest.mark.slow),
    pytest.param("two_uavs", "d", ("uavs.south.lost_at_s=0", "duration_s=16"), marks=pytest.mark.slow),
])  # fmt: skip
def test_a_channel_that_does_nothing_changes_nothing(scenario: str, name: str, more: tuple[str, ...]) -> None:
    without, silent = over(None, scenario, name, *more), over(Channel(), scenario, name, *more)
    for table in ("states", "samples", "decisions", "proposals", "plans"):
        both = (getattr(trace, table).drop(columns="answer", errors="ignore") for trace in (without, silent))
        pd.testing.assert_frame_equal(*both, check_exact=True)
    assert not faults_of(silent)


def test_without_a_channel_nothing_is_said_of_one() -> None:
    assert "channel" not in resolved(load("minimal"))
    assert resolved(load("minimal", ["channel={}"]))["channel"] | {"ugvs": None} == asdict(Channel())
    assert load("minimal").digest != load("minimal", ["channel={}"]).digest


CHANNELS = st.builds(
    Channel,
    delay_s=st.sampled_from([0.0, 0.05, 0.13, 0.7]),
    jitter_s=st.sampled_from([0.0, 0.4]),
    loss=st.sampled_from([0.0, 0.2, 0.7]),
    burst_s=st.sampled_from([0.0, 0.6]),
    duplicate=st.sampled_from([0.0, 0.5]),
    reorder=st.booleans(),
    seed=st.integers(0, 9),
    up=st.none() | st.builds(WayBack, delay_s=st.just(0.4), loss=st.sampled_from([None, 0.5])),
)


@pytest.mark.slow
@given(given_=CHANNELS, run=st.sampled_from("bcdd"), period_s=st.sampled_from([0.05, 0.2]))
@examples(6, 500)
def test_whatever_the_channel_does_the_protocol_is_kept(given_: Channel, run: str, period_s: float) -> None:
    """And under (d) every distance, and the bounds on how long a UGV follows the UAV."""
    settings = ("duration_s=17.0", "reproduction=[]", f"gatekeeper.period_s={period_s}")
    trace = over(given_, "case_b", run, *settings)
    assert not faults_of(trace)
    if run == "d":
        assert [*found(trace, "SAFE-TRACE", "SAFE-HYP", "LIVE-HYP").values()] == ["holds"] * 3


@pytest.mark.slow
@given(given_=CHANNELS, lost_at_s=st.sampled_from([0.0, 8.4, 9.13, 11.0]), run=st.sampled_from("bdd"))
@examples(2, 200)
def test_with_two_uavs_the_protocol_is_kept(given_: Channel, lost_at_s: float, run: str) -> None:
    settings = ("duration_s=15", f"uavs.south.lost_at_s={lost_at_s}", f"runs={{{run}: {{method: {run}}}}}")
    trace = over(given_, "two_uavs", run, *settings)
    assert not faults_of(trace)
    if run == "d":
        assert [*found(trace, "SAFE-TRACE", "SAFE-HYP", "LIVE-HYP", "GATE-PLAN").values()] == ["holds"] * 4


LOST = ("duration_s=11.2", "uavs.south.lost_at_s=9.3")
"""South is lost after it has repeated something, and before all answers are there."""


def test_a_uav_that_is_lost_repeats_nothing_and_hears_nothing() -> None:
    trace, lost_s = over(Channel(0.4, loss=0.4, seed=2), "two_uavs", "d", *LOST), 9.3
    of_south = trace.messages[trace.messages["sender"] == "south"]
    assert of_south["attempt"].max() > 0
    assert of_south["sent_s"].max() < lost_s < of_south["received_s"].max()
    told = trace.messages[trace.messages["receiver"] == "south"]
    assert told["read_s"].max() < lost_s < told["received_s"].max()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["b", "d"])
def test_over_the_shipped_link_messages_are_repeated_doubled_and_lost(run: Run, name: str) -> None:
    trace = run("noisy_link", name)
    assert trace.messages["attempt"].max() > 0
    assert trace.messages["copy"].max() == 1
    assert trace.messages["received_s"].isna().any()


def test_of_messages_that_never_arrive_there_is_nothing_to_decide() -> None:
    trace = over(Channel(100.0), "case_b", "d", "duration_s=13", "reproduction=[]")
    assert len(trace.proposals)
    verdicts = judge(trace, ["GATE-PLAN", "LIVE-HYP"])
    assert [(verdict.status, verdict.exercised) for verdict in verdicts] == 2 * [("holds", 0)]


def test_a_motion_begins_when_it_can_have_arrived() -> None:
    trace = over(Channel(0.6), "case_b", "d", "duration_s=13", "reproduction=[]")
    assert len(trace.proposals)
    for times, issued_s in zip(trace.proposals["times_s"], trace.proposals["issued_s"], strict=True):
        assert times[0] == pytest.approx(issued_s + 0.65)


def test_no_copy_leaves_in_the_instant_in_which_its_proposal_is_planned_anew() -> None:
    trace = over(Channel(0.3, loss=0.5), "case_b", "d")
    sent = trace.messages
    again, gone = sent[(sent["kind"] == "proposal") & (sent["attempt"] > 0)], sent[sent["kind"] == "withdrawal"]
    assert len(again) > 1
    assert len(gone) > 9
    assert again.merge(gone, on=["about", "sent_s"]).empty
    assert not faults_of(trace)


def never(box: Any, *_: Any) -> Any:
    return box


def all_is_new(before: Any, arrived: Any, t: float) -> Any:
    """Of the proposals that have arrived, the last one is taken up."""
    after, held = desk.read(before, arrived, t), list(before.held)
    for message in (delivery.message for delivery in arrived[len(before.read_s) :]):
        held[message.ugv] = message.content
    return replace(after, held=tuple(held)) if after is not before else before


repeated = channel.repeated
MUTANTS: dict[str, tuple[Any, str, Any, str, Channel]] = {
    "the UAV does not repeat": (channel, "repeated", never, "not repeated", Channel(loss=0.5)),
    "it repeats at once": (channel, "repeated", lambda box, heard, t, _, left: repeated(box, heard, t, 0.05, left),
                           "repeated at another time", Channel(0.3)),
    "old proposals are taken up": (gatekeeper, "read", all_is_new, "decision on proposal ",
                                   Channel(0.05, 1.5, 0.2, duplicate=0.9, seed=10)),
    "copies are not answered": (gatekeeper, "replied", lambda d, _, *more: desk.replied(d, (), *more),
                                "does not answer what it reads", NOISY),
    "the link loses without loss": (Link, "fate", lambda self, m: [] if m.number % 2 else [0.0], "lost without",
                                    Channel()),
    "the link is too late": (Link, "fate", lambda self, m: [0.4], "arrives at another time", Channel()),
}  # fmt: skip
"""What is replaced, by what, what an oracle says, and over which channel."""


@pytest.mark.parametrize("name", MUTANTS)
def test_a_protocol_with_a_fault_is_noticed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    module, attribute, wrong, what, given_ = MUTANTS[name]
    monkeypatch.setattr(module, attribute, wrong)
    scenario, settings = ("case_b", ["reproduction=[]"]) if given_ is not NOISY else ("lab", [])
    found = faults_of(over(given_, scenario, "d", *settings))
    assert any(fault.what.startswith(what) for faults in found.values() for fault in faults), found


def test_a_lost_uav_that_repeats_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(channel, "repeated", lambda *given: repeated(*given[:4]))
    trace = over(Channel(0.4, loss=0.4, seed=2), "two_uavs", "d", *LOST)
    assert {fault.what for fault in faults_of(trace)["channel"]} == {"repeated by a UAV that is lost"}


def test_an_idle_link_keeps_its_state() -> None:
    link = blocks.Uplink(Link(Quality(1.0, loss=0.5), 1, "up"), 0.05)
    context = link.CreateDefaultContext()
    link.GetInputPort("outbox").FixValue(context, Value(()))
    context.SetTime(3.0)
    assert link.now(context) is context.get_abstract_state(0).get_value()
