"""LIVE-PROG, and GATE-MODEL and GATE-FEAS under method (d), on a run of the simulator and on edits of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from verify.judging import CLAIMS

from airground_drake.scenarios.load import load
from airground_drake.scenarios.schema import Obstacle
from airground_drake.simulation import simulate
from airground_drake.trace import Trace
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
    return (table["lag_m"] > 0.0) & (table["decision"] == "accept")


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
        ("LIVE-PROG", executing, {"lag_m": lambda v: v + 1e-3}, "lag"),
        ("LIVE-PROG", executing, {"predicted_lag_m": lambda v: v + 1e-3}, "predicted lag"),
        ("LIVE-PROG", executing, {"decision": "refuse", "reason": "no_progress"}, "answer or reason"),
    ],
)
def test_an_edited_decision_is_refuted(
    decided: Trace, claim: str, where: Callable[[pd.DataFrame], Any], values: dict[str, Any], what: str
) -> None:
    finding = CLAIMS[claim].judge(edited(decided, where, **values))
    assert finding.status == "refuted", finding
    assert finding.counterexample is not None
    assert what in finding.counterexample["what"]


def test_what_leaves_a_direction_to_the_own_task_is_counted(decided: Trace) -> None:
    """LIVE-GATE assumes that none does."""

    def count(trace: Trace) -> Any:
        return CLAIMS["LIVE-PROG"].judge(trace).evidence["leave_a_direction"]

    along_x = decided.proposals.assign(selection=[[1.0, 0.0, 0.0]] * len(decided.proposals))
    assert count(decided) == 0
    assert count(replace(decided, proposals=along_x)) == 1


def test_a_map_that_was_not_sent_is_noticed(decided: Trace) -> None:
    """The outcome of the detour rests on the map in its message: with another one it is another."""
    proposals = decided.proposals.copy()
    walls = [[3.3, 9.5, 0.0], [5.0, 9.0, 0.0], [6.5, 7.5, 0.0]]
    proposals["mapped_m"] = [np.ravel(walls).tolist() for _ in range(len(proposals))]
    proposals["mapped_radius_m"] = [[0.0] * len(walls) for _ in range(len(proposals))]
    assert CLAIMS["GATE-MODEL"].judge(replace(decided, proposals=proposals)).status == "refuted"


def test_a_ugv_that_is_held_up_gives_the_intervention_back_and_the_claims_hold() -> None:
    """The tolerance is so small that the delay of an answer counts as being behind."""
    scenario, _ = load("case_b", ["gatekeeper.lag_m=0.01", "gatekeeper.behind_s=0.3", "gatekeeper.tries=1"])
    trace = simulate(scenario, "d")
    reasons = list(dict.fromkeys(trace.decisions["reason"]))
    assert "no_progress" in reasons
    assert "exhausted" in reasons
    for claim in ("LIVE-PROG", "GATE-MODEL", "GATE-FEAS", "EXEC", "SAFE-TRACE"):
        assert CLAIMS[claim].judge(trace).status == "holds", claim
    given_back = trace.decisions[trace.decisions["reason"] == "no_progress"].iloc[0]
    late = replace(trace, decisions=trace.decisions.replace({"reason": {"no_progress": "over"}}))
    assert CLAIMS["LIVE-PROG"].judge(late).status == "refuted"
    assert given_back["lag_m"] > given_back["predicted_lag_m"] + 0.01


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
