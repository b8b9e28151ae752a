"""GATE-FEAS and GATE-OPT together: on good, malformed and missing records."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from builders.decisions import decided_run
from builders.edits import with_decision, with_meta, with_signals
from verify.judging import FEAS, OPT
from verify.runs.cases import refused_for_want_of_a_plan

from airground_drake.run.trace import Trace


@pytest.mark.parametrize(
    ("route", "expected"),
    [
        ("relaxed", ("holds", "holds")),
        ("nonlinear", ("holds", "inconclusive")),
        ("mixed_integer", ("holds", "holds")),
    ],
)
def test_good_decisions_pass_where_there_is_something_to_check(route: str, expected: tuple[str, ...]) -> None:
    trace = decided_run(route)
    for claim, status in zip((FEAS, OPT), expected, strict=True):
        finding = claim.judge(trace)
        assert finding.status == status, finding
        if status == "holds":
            assert finding.margin is not None
            assert finding.margin >= 0.0


def test_malformed_records_are_errors(relaxed: Trace) -> None:
    def nan(row: dict[str, Any], problem: dict[str, Any]) -> None:
        problem["accept_m_s"][0] = np.nan

    def nan_cost(row: dict[str, Any], problem: dict[str, Any]) -> None:
        row["objective"] = np.nan

    def cut(row: dict[str, Any], problem: dict[str, Any]) -> None:
        problem["positions_m"] = problem["positions_m"][:-1]

    def planless(row: dict[str, Any], problem: dict[str, Any]) -> None:
        problem["plan"] = []

    def other_route(row: dict[str, Any], problem: dict[str, Any]) -> None:
        row["route"] = "nonlinear"

    for claim in (FEAS, OPT):
        for edit in (nan, nan_cost, cut, planless, other_route):
            assert claim.judge(with_decision(relaxed, edit)).status == "error"
        assert claim.judge(replace(relaxed, problems=relaxed.problems.iloc[1:])).status == "error"
        assert claim.judge(replace(relaxed, problems=relaxed.problems.drop(columns="plan"))).status == "error"


def test_a_refusal_without_a_plan_is_in_order_but_an_acceptance_is_not(relaxed: Trace) -> None:
    last = len(relaxed.decisions) - 1
    trace = with_decision(relaxed, refused_for_want_of_a_plan, row=last)
    for claim in (FEAS, OPT):
        assert claim.judge(trace).status == "holds"
    assert len(FEAS.judge(trace).evidence["without_a_plan"]) == 1

    def accepted(row: dict[str, Any], problem: dict[str, Any]) -> None:
        refused_for_want_of_a_plan(row, problem)
        row["decision"] = "accept"

    assert FEAS.judge(with_decision(relaxed, accepted, row=last)).status == "refuted"


def test_without_a_single_plan_nothing_is_established(relaxed: Trace) -> None:
    trace = relaxed
    for row in range(len(relaxed.decisions)):
        trace = with_decision(trace, refused_for_want_of_a_plan, row=row)
    assert OPT.judge(trace).status == "inconclusive"


def test_no_decision_at_all() -> None:
    trace = decided_run()
    none = replace(trace, decisions=trace.decisions.iloc[:0], problems=trace.problems.iloc[:0])

    def intervening(signals: pd.DataFrame) -> None:
        signals.loc[signals["t_s"] > 0.2, "ugv2.mode"] = 1.0

    for claim in (FEAS, OPT):
        assert claim.judge(none).status == "holds"
        assert claim.judge(with_signals(none, intervening)).status == "not_run"
        others = claim.judge(with_signals(trace, intervening))  # those of ugv1 are judged all the same
        assert (others.status, others.evidence["without_decisions"]) == ("holds", ["ugv2"])
        assert claim.judge(replace(trace, problems=trace.problems.iloc[:0])).status == "not_run"
        assert not claim.applies(with_meta(trace, method="b"))
