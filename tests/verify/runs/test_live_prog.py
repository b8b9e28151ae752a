"""LIVE-PROG, and GATE-MODEL and GATE-FEAS under method (d), on a run of the simulator and on edits of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from verify.judging import CLAIMS

from airground_drake.gatekeeper.patience import Commitment, Patience
from airground_drake.run.simulation import simulate
from airground_drake.run.trace import Trace
from airground_drake.scenarios.load import load
from airground_drake.scenarios.schema import Obstacle
from airground_drake.systems import components
from airground_drake.verify.runs.way_left import bounds_of_way_left


@pytest.fixture(scope="session")
def decided(run: Callable[[str, str], Trace]) -> Trace:
    """Case B: a proposal that leads nowhere, refused, and one that is accepted."""
    return run("case_b", "d")


def edited(trace: Trace, where: Callable[[pd.DataFrame], Any], **values: Any) -> Trace:
    """Columns of the first decision for which something holds, set or called with what is there."""
    decisions = trace.decisions.copy()
    row = int(np.flatnonzero(where(decisions))[0])
    for name, value in values.items():
        decisions.loc[row, name] = value(decisions.loc[row, name]) if callable(value) else value
    return replace(trace, decisions=decisions)


def accepted(table: pd.DataFrame) -> Any:
    return table["reason"] == "cheaper"


def refused(table: pd.DataFrame) -> Any:
    return table["reason"] == "stalls"


def executing(table: pd.DataFrame) -> Any:
    return (table["reason"] == "kept") & (table["decision"] == "accept")


@pytest.mark.parametrize("claim", ["LIVE-PROG", "GATE-MODEL", "GATE-FEAS"])
def test_the_run_itself_passes(decided: Trace, claim: str) -> None:
    finding = CLAIMS[claim].judge(decided)
    assert finding.status == "holds", finding
    assert not CLAIMS["GATE-OPT"].applies(decided)


@pytest.mark.parametrize(
    ("claim", "where", "values", "what"),
    [
        ("GATE-MODEL", accepted, {"accept_outcome_m2_s": lambda v: 0.999 * v}, "outcome"),
        ("GATE-MODEL", refused, {"refuse_stalls": 0.0}, "stalls"),
        ("GATE-MODEL", refused, {"accept_left_m": lambda v: 0.5 * v}, "outcome"),
        ("LIVE-PROG", refused, {"reason": "not_cheaper"}, "answer or reason"),
        ("LIVE-PROG", refused, {"decision": "accept"}, "answer or reason"),
        ("LIVE-PROG", refused, {"accept_stalls": 0.0}, "answer or reason"),
        ("LIVE-PROG", refused, {"decision": "accept", "reason": "makes_way", "accept_stalls": 0.0}, "answer or reason"),
        ("LIVE-PROG", accepted, {"reason": "makes_way"}, "answer or reason"),
        ("LIVE-PROG", accepted, {"reason": "kept"}, "answer or reason"),
        ("LIVE-PROG", accepted, {"tries": 0.0}, "tries"),
        ("LIVE-PROG", executing, {"decision": "refuse", "reason": "over"}, "answer or reason"),
        ("LIVE-PROG", executing, {"tries": 2.0}, "tries"),
    ],
)
def test_an_edited_decision_is_refuted(
    decided: Trace, claim: str, where: Callable[[pd.DataFrame], Any], values: dict[str, Any], what: str
) -> None:
    finding = CLAIMS[claim].judge(edited(decided, where, **values))
    assert finding.status == "refuted", finding
    assert finding.counterexample is not None
    assert what in finding.counterexample["what"]


def test_a_map_that_was_not_sent_is_noticed(decided: Trace) -> None:
    """The outcome of the detour rests on the map in its message: with another one it is another."""
    proposals = decided.proposals.copy()
    walls = [[3.3, 9.5, 0.0], [5.0, 9.0, 0.0], [6.5, 7.5, 0.0]]
    proposals["mapped_m"] = [np.ravel(walls).tolist() for _ in range(len(proposals))]
    proposals["mapped_radius_m"] = [[0.0] * len(walls) for _ in range(len(proposals))]
    assert CLAIMS["GATE-MODEL"].judge(replace(decided, proposals=proposals)).status == "refuted"


def test_an_accepted_intervention_that_just_ends_is_refuted(decided: Trace) -> None:
    """Its decisions stop while the proposal is in force."""
    last = int(np.flatnonzero(executing(decided.decisions))[-1])
    stopped = replace(decided, decisions=decided.decisions.drop(index=range(last - 3, len(decided.decisions))))
    finding = CLAIMS["LIVE-PROG"].judge(stopped)
    assert finding.counterexample is not None
    assert finding.counterexample["what"] == "end of an accepted intervention"


IMPATIENT = ["gatekeeper.tries=1", "gatekeeper.longest_s=1.0", "gatekeeper.rest_s=3.0", "intervention.retry_s=0.5"]


@pytest.fixture(scope="module")
def impatient() -> Trace:
    """Case B with a UGV that goes along once, for 1 s, and then not before it has been on its own for 3 s."""
    return simulate(load("case_b", IMPATIENT)[0], "d")


def test_a_ugv_goes_along_as_often_and_as_long_as_it_may(impatient: Trace) -> None:
    reasons = list(dict.fromkeys(impatient.decisions["reason"]))
    assert {"over", "exhausted"} <= set(reasons)
    for claim in ("LIVE-PROG", "GATE-MODEL", "GATE-FEAS", "EXEC", "COMM", "SAFE-TRACE"):
        assert CLAIMS[claim].judge(impatient).status == "holds", claim
    evidence = CLAIMS["LIVE-PROG"].judge(impatient).evidence
    assert evidence["accepted_interventions_ended"]["over"] >= 1


class NoRest(Patience):
    """The tries count anew at once."""

    def rested(self, now: Commitment, t: float) -> Commitment:
        return now if now.executing else replace(now, tries=0)


class LateByASample(Patience):
    """A try is over one sample too late."""

    def over(self, now: Commitment, t: float) -> bool:
        return t >= now.until + 0.05


@pytest.mark.parametrize("kind", [NoRest, LateByASample])
def test_a_patience_that_is_wired_wrongly_is_refuted(kind: type[Patience], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(components, "Patience", kind)
    finding = CLAIMS["LIVE-PROG"].judge(simulate(load("case_b", IMPATIENT)[0], "d"))
    assert finding.status == "refuted"


@pytest.mark.parametrize(("hidden", "answer"), [((6.5, 9.0), "refuse"), ((4.5, 10.0), "accept")])
def test_an_accepted_intervention_is_reconsidered_when_an_obstacle_is_new(
    hidden: tuple[float, float], answer: str
) -> None:
    """The obstacle is not on the UAV's map; it comes into sight after the acceptance."""
    scenario = load("case_a")[0]
    scenario.obstacles["hidden"] = Obstacle(position_m=[*hidden, 0.0], known_to_uav=False)
    trace = simulate(scenario, "d")
    mine = trace.decisions[trace.decisions["number"] == trace.decisions["number"].iloc[0]]
    first, again = (row for _, row in mine[mine["accept_stalls"] >= 0.0].iterrows())
    assert (first["decision"], again["decision"]) == ("accept", answer)
    assert first["tries"] == again["tries"] == 1.0
    for claim in ("LIVE-PROG", "GATE-MODEL", "GATE-FEAS"):
        assert CLAIMS[claim].judge(trace).status == "holds"
    late = edited(trace, lambda table: table.index == again.name, decision="accept", reason="kept")
    assert CLAIMS["LIVE-PROG"].judge(late).status == "refuted"


def test_the_way_left_is_bounded_from_both_sides() -> None:
    least, most = bounds_of_way_left(np.zeros(3), np.array([8.0, 0.0, 0.0]), np.array([[4.0, 0.0, 0.0]]), 2.0)
    true = 2.0 * np.sqrt(12.0) + 2.0 * np.pi / 3.0
    assert least == 8.0
    assert true <= most <= 1.01 * true
