"""GATE-FEAS."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from builders.decisions import STAGE_S, STAGES, decided_run
from builders.edits import DecisionEdit, with_decision, with_signals
from hypothesis import given
from hypothesis import strategies as st
from verify.judging import FEAS, assert_decision_refuted
from verify.runs.cases import (
    contrary_answer,
    fractional_plan,
    lighter_slack,
    other_terminal_cost,
    standing_robot,
    task_error,
    without_point,
    without_terminal_cost,
    wrong_first_stage,
    wrong_reason,
)

from airground_drake.gatekeeper.answer import Rules, settle
from airground_drake.gatekeeper.solution import Solution
from airground_drake.intervention.messages import ACCEPT, REFUSE, SILENT
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Gatekeeper
from airground_drake.verify.runs import gate_feas
from airground_drake.verify.runs.gate_record import Row, rows_of

MUTANTS: list[tuple[DecisionEdit, str]] = [  # numbers that are off: test_tolerances.py
    (fractional_plan, "omega is not binary"),
    (wrong_first_stage, "first stage"),
    (without_point(0), "rock is left out"),
    (without_point(1), "ugv2 is left out"),
    (standing_robot, "nothing that the UGV senses"),
    (lighter_slack, "weight of slack"),
    (other_terminal_cost, "weight of the terminal cost"),
    (without_terminal_cost, "objective"),
    (contrary_answer, "answer or reason"),
    (wrong_reason, "answer or reason"),
]


@pytest.mark.parametrize(("edit", "what"), MUTANTS, ids=[f"{what}-{i}" for i, (_, what) in enumerate(MUTANTS)])
def test_a_mutant_is_refuted(relaxed: Trace, edit: DecisionEdit, what: str) -> None:
    assert_decision_refuted(FEAS, with_decision(relaxed, edit), what)


def test_hidden_slack_is_refuted() -> None:
    """The cost of the error alone, of a plan that leads inside the safe distance."""
    trace = decided_run()

    def hide(row: dict[str, Any], problem: dict[str, Any]) -> None:
        accept = problem["accept_m_s"].reshape(STAGES, 3)
        positions = problem["initial_m"] + STAGE_S * np.cumsum(accept, axis=0)
        problem["plan"], problem["positions_m"] = np.ones(STAGES), positions.ravel()
        row["objective"] = task_error(problem, positions)
        row["objective_accept"], row["first_stage"] = row["objective"], "accept"
        away = np.linalg.norm(positions[:, None] - problem["centres_m"].reshape(STAGES, 2, 3), axis=2)
        row["predicted_clearance_m"] = float((away - problem["distances_m"]).min())

    mutant = with_decision(trace, hide)
    assert rows_of(mutant)[2].clearance(rows_of(mutant)[2]["positions_m"]).min() < 0.0
    finding = FEAS.judge(mutant)
    assert finding.status == "refuted"
    assert finding.counterexample is not None
    assert finding.counterexample["what"] == "objective"


def test_a_decision_removed_from_both_tables_is_missed(relaxed: Trace) -> None:
    for row in (0, 2):
        gone = replace(relaxed, decisions=relaxed.decisions.drop(row), problems=relaxed.problems.drop(row))
        finding = FEAS.judge(gone)
        assert finding.status == "refuted"
        assert finding.counterexample is not None
        assert "missing" in finding.counterexample["what"]
    twice = [0, 1, 1, 2, 3, 4, 5]
    doubled = replace(relaxed, decisions=relaxed.decisions.iloc[twice], problems=relaxed.problems.iloc[twice])
    assert FEAS.judge(doubled).status == "refuted"


def test_no_row_is_exchanged_unnoticed(relaxed: Trace) -> None:
    order = [0, 2, 1, 3, 4, 5]
    assert FEAS.judge(replace(relaxed, problems=relaxed.problems.iloc[order])).status == "refuted"


def test_without_decisions_it_has_not_run_though_something_was_executed(relaxed: Trace) -> None:
    def executed(signals: pd.DataFrame) -> None:
        signals.loc[signals["t_s"] > 0.42, "ugv1.accepted"] = 1.0

    trace = with_signals(relaxed, executed)
    none = replace(trace, decisions=trace.decisions.iloc[:0], problems=trace.problems.iloc[:0])
    assert FEAS.judge(none).status == "not_run"


@given(
    st.tuples(st.floats(0.1, 10.0), st.floats(0.1, 10.0)),
    st.tuples(st.floats(0.1, 10.0), st.floats(0.1, 10.0)),
    st.sampled_from([SILENT, ACCEPT, REFUSE]),
    st.sampled_from([0.0, 0.1, 0.2, 0.3]),
    st.sampled_from([0.0, 0.05, 0.2]),
    st.booleans(),
    st.booleans(),
    st.booleans(),
    st.sampled_from([None, 0.0, 1.0]),
)
def test_the_rules_are_those_of_the_running_gatekeeper(
    costs: tuple[float, float],
    throughout: tuple[float, float],
    standing: float,
    stood: float,
    margin: float,
    equal: bool,
    planned: bool,
    literal: bool,
    rounded: float | None,
) -> None:
    accept, refuse = (costs[0], costs[0]) if equal else costs
    status: Any = "optimal" if planned else "refused_not_finite"
    kept = throughout
    plan = np.array([float(accept <= refuse)]) if planned else None
    first = None if rounded is None else np.array([rounded])
    decision = Solution(accept <= refuse, status, objective=min(costs), plan=plan, rounded=first)
    given = {"objective": min(costs), "accept_throughout": kept[0], "refuse_throughout": kept[1]}
    row = Row(given, 1.0, 1.0, 1.0, 0.0, {"plan": plan, "rounded": first})
    gate = Gatekeeper(switching_margin=margin, min_dwell_s=0.2)
    stands = {SILENT: None, ACCEPT: "accept", REFUSE: "refuse"}[standing]
    rules = Rules(switching_margin=margin, min_dwell=0.2, first_stage=literal)
    assert gate_feas.rule(row, stands, stood, gate, literal=literal) == settle(decision, kept, standing, stood, rules)


@pytest.mark.parametrize("run_name", ["c", "d"])
def test_a_proposal_that_nothing_is_decided_on_is_refuted(run: Callable[[str, str], Trace], run_name: str) -> None:
    trace = run("case_b", run_name)
    assert FEAS.judge(trace).status == "holds"
    issued = trace.decisions["issued_s"]
    for silent in sorted(set(issued))[:2]:
        rows = [k for k, row in enumerate(issued) if row != silent]
        problems = trace.problems.iloc[rows] if len(trace.problems) else trace.problems
        finding = FEAS.judge(replace(trace, decisions=trace.decisions.iloc[rows], problems=problems))
        assert finding.status == "refuted", silent
        assert finding.counterexample is not None
        assert finding.counterexample["what"] == "nothing is decided on a proposal"
        assert finding.counterexample["t_s"] == silent


@pytest.mark.parametrize(
    ("sent", "status"),
    [
        ([("ugv1", 11.5, 99.0)], "refuted"),
        ([("ugv2", 11.5, 99.0)], "refuted"),  # to make way
        ([("ugv1", 11.5, 11.55)], "holds"),  # its motion is over
        ([("ugv1", 11.5, 99.0), ("ugv1", 11.55, 11.6)], "holds"),  # replaced
        ([("ugv1", 15.3, 99.0)], "holds"),  # released at 15.36 s
        ([("ugv2", 15.3, 99.0)], "holds"),
    ],
)
def test_what_is_taken_back_within_two_periods_needs_no_decision(
    run: Callable[[str, str], Trace], sent: list[tuple[str, float, float]], status: str
) -> None:
    """Proposals more, (to whom, when, end of the motion), while ugv1 is intervened on and nothing is in force."""
    trace = run("case_b", "d")
    first = trace.proposals.iloc[0].to_dict()
    rows = [
        {**first, "number": 90 + k, "robot": robot, "issued_s": t, "times_s": [t, end], "positions_m": [0.0] * 6}
        for k, (robot, t, end) in enumerate(sent)
    ]
    events = [{"t_s": t, "robot": robot, "kind": "proposal", "policy": first["policy"]} for robot, t, _ in sent]
    meta = {**trace.meta, "events": [*trace.events, *events]}
    proposals = pd.concat([trace.proposals, pd.DataFrame(rows)], ignore_index=True)
    assert FEAS.judge(replace(trace, proposals=proposals, meta=meta)).status == status
