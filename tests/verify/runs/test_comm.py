"""COMM."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from builders.edits import first_of, with_meta, with_signals
from builders.runs import run_of
from verify.judging import counterexample, judge

from airground_drake.run.trace import Trace
from airground_drake.verify.runs.standing import standing_conflicts


def more_decisions(trace: Trace, **columns: Any) -> Trace:
    """The last decision once more, with some columns changed."""
    extra = trace.decisions.iloc[[-1]].assign(**columns)
    return replace(trace, decisions=pd.concat([trace.decisions, extra], ignore_index=True))


def proposals(trace: Trace, *times: float, robot: str = "ugv1") -> Trace:
    template = first_of(trace.events, "proposal")
    return with_meta(trace, events=[*trace.events, *({**template, "t_s": t, "robot": robot} for t in times)])


def without(trace: Trace, kind: str) -> Trace:
    return with_meta(trace, events=[event for event in trace.events if event["kind"] != kind])


def supervising(signals: pd.DataFrame) -> pd.DataFrame:
    return signals.assign(**{"ugv1.mode": 0.0})


MESSAGES: dict[str, tuple[str, Callable[[Trace], Trace]]] = {
    "decision after the allowance": ("refuted", lambda trace: more_decisions(trace, t_s=10.95)),
    "decision before the trigger": ("refuted", lambda trace: more_decisions(trace, t_s=8.1)),
    "decision for the other UGV": ("error", lambda trace: more_decisions(trace, robot="ugv2")),
    "decision for nobody": ("error", lambda trace: more_decisions(trace, robot="ugv9")),
    "decision at no time": ("error", lambda trace: more_decisions(trace, t_s=np.nan)),
    "decision on no proposal": ("error", lambda trace: more_decisions(trace, issued_s=9.0)),
    "proposal while supervising": ("refuted", lambda trace: proposals(trace, 5.0)),
    "proposal to the other UGV": ("refuted", lambda trace: proposals(trace, 9.0, robot="ugv2")),
    "proposal to the UAV": ("error", lambda trace: proposals(trace, 9.0, robot="uav")),
    "more proposals than always-on": ("refuted", lambda trace: proposals(trace, *np.linspace(8.2, 10.7, 721))),
    "no proposals": ("error", lambda trace: without(trace, "proposal")),
    "no decisions": ("not_run", lambda trace: replace(trace, decisions=trace.decisions.iloc[:0])),
    "nothing": ("not_run", lambda trace: with_meta(replace(trace, decisions=trace.decisions.iloc[:0]), events=[])),
    "no column": ("error", lambda trace: replace(trace, decisions=trace.decisions.drop(columns="t_s"))),
    "never intervening": ("refuted", lambda trace: with_signals(trace, supervising)),
}  # fmt: skip


@pytest.mark.parametrize("name", MESSAGES)
def test_comm_mutants(name: str) -> None:
    status, mutate = MESSAGES[name]
    assert judge("COMM", mutate(run_of("d"))).status == status


def test_comm_allows_the_latency_of_a_withdrawal() -> None:
    released = next(event["t_s"] for event in run_of("d").events if event["kind"] == "release")
    assert judge("COMM", more_decisions(run_of("d"), t_s=released + 0.1)).status == "holds"
    assert judge("COMM", more_decisions(run_of("d"), t_s=released + 0.1001)).status == "refuted"


def test_comm_counts() -> None:
    finding = judge("COMM", run_of("d"))
    assert finding.evidence["spent"] == {"proposal": 1, "decision": len(run_of("d").decisions)}
    assert finding.evidence["always_on"] == {"proposal": 720, "decision": 720}
    assert finding.margin == pytest.approx(1.0 - len(run_of("d").decisions) / 720)


@pytest.fixture(scope="module")
def told(run: Callable[[str, str], Trace]) -> Trace:
    """A UGV refuses, and tells the UAV of an obstacle."""
    return run("case_b", "d")


def with_map(trace: Trace, row: int, points: list[float], radii: list[float]) -> Trace:
    columns = {name: trace.proposals[name].tolist() for name in ("mapped_m", "mapped_radius_m")}
    columns["mapped_m"][row], columns["mapped_radius_m"][row] = points, radii
    return replace(trace, proposals=trace.proposals.assign(**columns))


def test_the_obstacles_in_proposals_are_what_the_uav_knew(told: Trace) -> None:
    assert judge("COMM", told).status == "holds"
    first, last = (list(told.proposals["mapped_m"].iloc[k]) for k in (0, -1))
    radii, end = list(told.proposals["mapped_radius_m"].iloc[-1]), len(told.proposals) - 1
    assert len(last) > len(first)
    for wrong in (
        with_map(told, 0, last, radii),  # before anybody has told it
        with_map(told, end, last[:-3], radii[:-1]),  # forgotten
        with_map(told, end, [*last, *last[-3:]], [*radii, radii[-1]]),
        with_map(told, end, [last[0] + 1e-3, *last[1:]], radii),
        with_map(told, end, last, [radii[0] + 1e-3, *radii[1:]]),
    ):
        assert counterexample("COMM", wrong)["kind"] == "map of a proposal"


def test_a_proposal_stands_until_it_is_over_and_no_longer(told: Trace) -> None:
    refused = told.decisions[told.decisions["decision"] == "refuse"].iloc[[0]]
    for later, kind in ((0.0, None), (1.0, "decision on what was withdrawn")):
        again = refused.assign(t_s=refused["t_s"] + later)
        both = pd.concat([told.decisions, again], ignore_index=True)
        assert (judge("COMM", replace(told, decisions=both)).counterexample or {"kind": None})["kind"] == kind
    last = told.proposals.iloc[[-1]]
    when = float(last["issued_s"].iloc[0]) + 0.2
    events = [e for e in told.events if e["kind"] == "proposal"][-1:]
    twice = replace(
        told, proposals=pd.concat([told.proposals, last.assign(issued_s=when, number=90)], ignore_index=True)
    )
    twice = with_meta(twice, events=[*told.events, *({**event, "t_s": when} for event in events)])
    assert counterexample("COMM", twice)["kind"] in ("replaced while in force", "decision on what was withdrawn")
    # the policies may have been asked about another UGV, and have helped this one only
    asked = with_signals(twice, lambda signals: signals.assign(**{"ugv2.mode": 1.0}))
    kinds = [{str(each["kind"]) for each in standing_conflicts(trace)} for trace in (twice, asked)]
    assert kinds[0] - kinds[1] == {"replaced while in force"}


def test_a_ugv_that_no_policy_helps_does_not_keep_the_others_from_being_judged() -> None:
    """ugv2 is intervened on for a while without a proposal: the messages to ugv1 are judged all the same."""

    def intervening(signals: pd.DataFrame) -> pd.DataFrame:
        return signals.assign(**{"ugv2.mode": (signals["t_s"] > 9.0) * 1.0})

    trace = with_signals(run_of("d"), intervening)
    finding = judge("COMM", trace)
    assert finding.status == "holds"
    assert (finding.evidence["without_proposals"], finding.evidence["without_decisions"]) == (["ugv2"], ["ugv2"])
    assert judge("COMM", proposals(trace, 5.0)).status == "refuted"


def test_a_joint_plan_of_which_a_part_was_not_sent_is_refuted(run: Callable[[str, str], Trace]) -> None:
    trace = run("doorway", "d")
    assert judge("COMM", trace).status == "holds"
    parties = [len(party) for party in trace.proposals["party"]]
    lost = int(np.argmax(parties))
    assert parties[lost] > 1
    gone = trace.proposals.iloc[lost]
    kept = trace.proposals[trace.proposals["number"] != gone["number"]].reset_index(drop=True)
    decisions = trace.decisions[trace.decisions["number"] != gone["number"]].reset_index(drop=True)
    sent = (gone["robot"], float(gone["issued_s"]))
    events = [e for e in trace.events if not (e["kind"] == "proposal" and (e["robot"], float(e["t_s"])) == sent)]
    partial = with_meta(replace(trace, proposals=kept, decisions=decisions), events=events)
    assert counterexample("COMM", partial)["kind"] == "part of a joint plan not sent"
