"""What a run cannot have had is refused: messages, positions heard, executions, references."""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pandas as pd
import pytest
from sim.blocks.test_positions import team

from airground_drake.report.possible import impossible
from airground_drake.scenario.load import load
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace

CHANNEL = {
    "delay_s": 0.2, "jitter_s": 0.1, "loss": 0.3, "burst_s": 0.3, "duplicate": 0.3, "up": {"loss": 0.5},
    "ugvs": {"delay_s": 0.05, "loss": 0.2},
}  # fmt: skip
SENSING = {"position_error_m": 0.01, "uav_error_m": 0.02}


@cache
def run(method: str = "d", *other: tuple[str, Any]) -> Trace:
    channel, runs = CHANNEL | dict(other), {name: {"method": name} for name in "bd"}
    return simulate(team(1, None, channel=channel, sensing=SENSING, runs=runs), method)


def column(table: str, name: Any, value: Callable[[Any], Any], rows: Callable[[Any], Any] | None = None) -> Any:
    def edit(trace: Trace) -> Trace:
        frame = getattr(trace, table).copy()
        at = np.ones(len(frame), dtype=bool) if rows is None else rows(frame)
        assert np.any(at)
        frame.loc[at, name] = value(frame.loc[at])
        return replace(trace, **{table: frame})

    return edit


def first(**cells: Any) -> Callable[[pd.DataFrame], Any]:
    """The first row with these cells."""

    def rows(frame: pd.DataFrame) -> Any:
        have = np.logical_and.reduce([frame[name] == value for name, value in cells.items()])
        return np.arange(len(frame)) == int(np.argmax(have))

    return rows


def only(table: str, keep: Callable[[pd.DataFrame], Any]) -> Any:
    return lambda trace: replace(trace, **{table: keep(getattr(trace, table))})


def earlier(trace: Trace) -> Trace:
    """A proposal is executed three samples earlier, and the decisions say so, too."""
    accepted = trace.decisions[trace.decisions["decision"] == "accept"].iloc[0]
    name, samples = f"{accepted['robot']}.executing", trace.samples.copy()
    k = int(np.argmax(samples[name] == accepted["number"]))
    samples.loc[k - 3 : k, name] = accepted["number"]
    before = [accepted.to_dict() | {"t_s": trace.sampled("t_s")[j]} for j in range(k - 3, k)]
    decisions = pd.concat([pd.DataFrame(before), trace.decisions])
    return replace(trace, samples=samples, decisions=decisions)


def called(method: str) -> Any:
    return lambda trace: replace(trace, meta=trace.meta | {"method": method})


def both(*edits: Any) -> Any:
    return lambda trace: edits[1](edits[0](trace))


def are_lost(frame: pd.DataFrame) -> Any:
    return frame["received_s"].isna()


FORGERIES: dict[str, tuple[str, Any]] = {
    "a lost message arrives": ("arrival of ", column("messages", "received_s", lambda f: f["sent_s"] + 0.25, are_lost)),
    "all arrive at once": ("arrival of ", column("messages", "received_s", lambda f: f["sent_s"])),
    "a message is lost": ("arrival of ", column("messages", ["received_s", "read_s"], lambda f: np.nan, first(copy=0))),
    "lost ones left out": ("what was sent before ", only("messages", lambda f: f[~are_lost(f) | (f["attempt"] == 0)])),
    "copies left out": ("arrival of ", only("messages", lambda f: f[f["copy"] == 0])),
    "a row twice": ("rows of messages", only("messages", lambda f: pd.concat([f, f.tail(1)]))),
    "read before it arrives": ("reading of ", column("messages", "read_s", lambda f: f["sent_s"])),
    "from a robot": ("who sends ", column("messages", "sender", lambda f: "ugv2", first(kind="proposal"))),
    "sent after the end": ("who sends ", column("messages", "sent_s", lambda f: 1e18)),
    "to another one": ("parties of proposal", column("proposals", "sender", lambda f: "ugv1")),
    "sent earlier": ("cause of proposal", column("proposals", "issued_s", lambda f: f["issued_s"] - 0.05)),
    "about another one": ("number of the proposal that answer ", column(
        "messages", "about", lambda f: 9, first(kind="answer"))),
    "a repeat about another one": ("number of the proposal that ", column(
        "messages", "about", lambda f: 9, first(attempt=1))),
    "all positions heard": ("last position of ", column("samples", "ugv1.heard_ugv2_s", lambda f: f["t_s"])),
    "a smaller error": ("measured position ugv1.seen", column("samples", "ugv1.seen_x_m", lambda f: 0.0)),
    "the UAV saw better": ("measured position ugv2.uav_saw", column(
        "samples", "ugv2.uav_saw_y_m", lambda f: f["ugv2.seen_y_m"])),
    "another reference": ("velocity of the preset of ", column("samples", "ugv2.ref_vx_m_s", lambda f: 0.1)),
    "nothing executed": ("number of the proposal", lambda trace: replace(trace, samples=trace.samples.assign(
        **{f"{ugv}.executing": -1 for ugv in trace.ugvs}))),
    "refusals called acceptances": ("number of ", column("decisions", "decision", lambda f: "accept")),
    "executed before it arrived": ("number of the proposal", earlier),
    "a part of a joint plan left out": ("parties of proposal 0", only("proposals", lambda f: f[f["number"] != 2])),
    "another cause": ("cause of proposal 0", column("proposals", "cause", lambda f: "ugv1", first(number=0))),
    "last repeats cut off": ("repetition of proposal 4", only(
        "messages", lambda f: f[(f["kind"] != "proposal") | (f["number"] != 4) | (f["attempt"] == 0)])),
    "a repeated answer cut off": ("answer of ugv2 to withdrawal 6", only(
        "messages", lambda f: f[(f["kind"] != "answer") | (f["number"] != 8) | (f["attempt"] == 0)])),
    "refusals left out that were not sent": ("decision on proposal 9", only(
        "decisions", lambda f: f[(f["number"] != 9) | (f["answer"] >= 0)])),
    "called method (a)": ("plans under (a)", called("a")),
    "called method (b)": ("parts of decisions under (b)", called("b")),
    "called method (c)": ("parts of decisions under (c)", called("c")),
    "a gap from nowhere": ("parts of decisions under (d)", column("decisions", "gap", lambda f: 0.0)),
    "places seen": ("places seen under ", lambda trace: replace(trace, seen=pd.DataFrame({"t_s": [1.0]}))),
    "a policy that was not asked": ("proposal of a plan", column("proposals", "policy", lambda f: "x")),
    "a proposal left out": ("proposal of a plan", only("proposals", lambda f: f[f["number"] != f["number"].max()])),
    "a proposal twice": ("proposal of a plan", only("proposals", lambda f: pd.concat([f, f.tail(1)]))),
    "sent between samples": ("time of proposal ", both(
        column("proposals", "issued_s", lambda f: f["issued_s"] + 0.02),
        column("plans", "t_s", lambda f: f["t_s"] + 0.02))),
    "decided between samples": ("time of a decision ", column(
        "decisions", "t_s", lambda f: f["t_s"] + 0.02, lambda f: f["answer"] < 0)),
    "decided too early": ("decision on proposal ", only("decisions", lambda f: pd.concat(
        [f.head(1).assign(t_s=lambda row: row["t_s"] - 0.1, answer=-1), f]))),
    "decided twice": ("time of a decision ", only("decisions", lambda f: pd.concat([f, f.tail(1)]))),
    "a decision on another policy": ("what ugv", column("decisions", "policy", lambda f: "x")),
    "another reason": ("answer of ", column("decisions", "reason", lambda f: "no_plan", first(decision="refuse"))),
    "a worse outcome": ("answer of ", column(
        "decisions", ["accept_stalls", "accept_outcome_m2_s"], lambda f: [1.0, 1e9], first(reason="cheaper"))),
    "more tries": ("answer of ", column("decisions", "tries", lambda f: f["tries"] + 1.0, first(reason="kept"))),
}  # fmt: skip


@pytest.mark.parametrize("name", FORGERIES)
def test_what_the_channel_does_not_allow_is_refused(name: str) -> None:
    due, edit = FORGERIES[name]
    (line,) = impossible(edit(run()), run().scenario)
    assert json.loads(json.dumps(line))["about"].startswith(due)


def test_a_channel_that_is_declared_better_than_it_was_is_refused() -> None:
    for better in ({"loss": 0.0}, {"delay_s": 0.1}, {"duplicate": 0.0}):
        scenario = team(1, None, channel=CHANNEL | better, sensing=SENSING)
        assert [*impossible(run(), scenario)]


@pytest.mark.parametrize("honest", [("b",), ("d",), ("d", ("reorder", False), ("delay_s", 0.21))])
def test_of_an_honest_run_nothing_is_said(honest: tuple[Any, ...]) -> None:
    assert len(run(*honest).messages)
    assert [*impossible(run(*honest), run(*honest).scenario)] == []


@pytest.mark.parametrize(("name", "method", "given"), [
    ("bayes_threshold", "d_printed", ("duration_s=25.0", "seed=375")),
    ("bayes_threshold", "d_printed", ("duration_s=10.0", "seed=45", "intervention.period_s=0.1")),
    ("case_b", "c", ()),
])  # fmt: skip
def test_decisions_go_on_until_the_uav_withdraws_a_motion_that_has_run_out(
    name: str, method: str, given: tuple[str, ...]
) -> None:
    honest = simulate(load(name, given), method)
    assert [*impossible(honest, honest.scenario)] == []


@pytest.mark.slow
@pytest.mark.parametrize("dwell_s", [0.0, 0.2])
def test_an_answer_to_a_proposal_stands_as_long_as_declared(dwell_s: float) -> None:
    """Two UGVs answer the same proposal twice; for one of them, the first answer stands for less than 0.2 s."""
    honest = simulate(load("crossing", [f"gatekeeper.min_dwell_s={dwell_s}", "duration_s=10.9"]), "c", engine="batch")
    assert [*impossible(honest, honest.scenario)] == []
    other = load("crossing", [f"gatekeeper.min_dwell_s={0.2 - dwell_s}", "duration_s=10.9"])
    said = [line["about"] for line in impossible(honest, other)]
    assert said
    assert {about.split(" of ")[0] for about in said} == {"answer"}


def test_without_a_channel_answers_are_those_of_decisions_and_a_lost_uav_is_silent() -> None:
    honest = simulate(load("two_uavs", {"duration_s": 12.0}), "d")
    assert [*impossible(honest, honest.scenario)] == []
    (line,) = impossible(only("decisions", lambda f: f[f["answer"] < 0])(honest), honest.scenario)
    assert line["about"].startswith("sending of answer ")
    for due, edit in (
        ("reading of proposal ", column("messages", "read_s", lambda f: np.nan, first(kind="proposal"))),
        ("sending of proposal ", both(
            only("proposals", lambda f: f.head(0)), both(only("plans", lambda f: f.head(0)),
                                                         only("decisions", lambda f: f.head(0))))),
        ("decision on proposal ", only("decisions", lambda f: pd.concat([f, f.tail(1).assign(t_s=12.0)]))),
    ):  # fmt: skip
        (line,) = impossible(edit(honest), honest.scenario)
        assert line["about"].startswith(due)
    tables = {name: getattr(honest, name).replace({"sender": {"south": "north"}}) for name in ("messages", "proposals")}
    (line,) = impossible(replace(honest, **tables), honest.scenario)
    assert line["about"].startswith("parties of proposal ")
    south = honest.messages["sender"].eq("south")
    for name, rows in (("sent_s", south), ("read_s", honest.messages["receiver"].eq("south"))):
        forged = column("messages", name, lambda f: 11.0, lambda f, rows=rows: rows)(honest)
        (line,) = impossible(forged, honest.scenario)
        assert line["about"].startswith("what south ")
