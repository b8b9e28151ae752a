"""GATE-FEAS, GATE-SUR and GATE-OPT together: on good, broken and missing records, and on real runs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import builders
import numpy as np
import pandas as pd
import pytest
from builders import ALL_PLANS, STAGE_S, STAGES, DecisionEdit, decided_run, with_decision
from verify.judging import FEAS, OPT, SUR, comparisons

from airground_drake.arrays import Array
from airground_drake.scenarios.load import load
from airground_drake.simulation import simulate
from airground_drake.trace import Trace, save
from airground_drake.trace import load as load_trace
from airground_drake.verify.claim import TraceClaim


@pytest.mark.parametrize(
    ("route", "expected"),
    [
        ("relaxed", ("holds", "holds", "holds")),
        ("nonlinear", ("holds", "holds", "inconclusive")),
        ("enumeration", ("holds", None, "holds")),
        ("branch_and_bound", ("holds", None, "holds")),
        ("rollout", ("holds", None, "inconclusive")),
    ],
)
def test_good_decisions_pass_where_there_is_something_to_check(route: str, expected: tuple[str | None, ...]) -> None:
    trace = decided_run(route)
    for claim, status in zip((FEAS, SUR, OPT), expected, strict=True):
        assert claim.applies(trace) == (status is not None)
        finding = claim.judge(trace)
        if status is not None:
            assert finding.status == status, finding
        if status == "holds":
            assert finding.margin is not None
            assert finding.margin >= 0.0


def flip_plan(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["plan"] = 1.0 - problem["plan"]


def fractional_plan(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["plan"][3] = 0.5


def shift_position(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["positions_m"][3] += 1e-6


def shift_initial(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["initial_m"][0] += 1e-6


def shift_reference(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["reference_m"][-2] -= 1e-6


def understate_cost(row: dict[str, Any], problem: dict[str, Any]) -> None:
    chosen = f"objective_{row['first_stage']}"
    row["objective"] *= 1.0 - 1e-6
    row[chosen] = row["objective"]


def inflate_loser(row: dict[str, Any], problem: dict[str, Any]) -> None:
    other = {"accept": "refuse", "refuse": "accept"}[row["first_stage"]]
    row[f"objective_{other}"] *= 10.0


def overstate_clearance(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["predicted_clearance_m"] += 1e-3


def wrong_first_stage(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["first_stage"] = {"accept": "refuse", "refuse": "accept"}[row["first_stage"]]


def without_point(index: int) -> DecisionEdit:
    def edit(row: dict[str, Any], problem: dict[str, Any]) -> None:
        keep = 1 - index
        problem["centres_m"] = problem["centres_m"].reshape(STAGES, 2, 3)[:, keep : keep + 1].ravel()
        problem["normals"] = problem["normals"].reshape(STAGES, 2, 3)[:, keep : keep + 1].ravel()
        problem["distances_m"] = problem["distances_m"][keep : keep + 1]

    return edit


def smaller_distance(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["distances_m"][0] = 1.9


def standing_robot(row: dict[str, Any], problem: dict[str, Any]) -> None:
    centres = problem["centres_m"].reshape(STAGES, 2, 3)
    centres[:, 1] = centres[0, 1]


def lighter_slack(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["slack_weight_1_m2_s"] = 1.0


def too_fast(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["refuse_m_s"][:3] = [0.0, -6.1, 0.0]


def contrary_answer(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["decision"] = {"accept": "refuse", "refuse": "accept"}[row["decision"]]


def wrong_reason(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["reason"] = "dwell"


def round_otherwise(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["rounded"][4] = 1.0 - problem["rounded"][4]


def fractional_rounding(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["rounded"] = problem["relaxed"].copy()
    row["rounding_deviation_s"] = 0.0


def relaxed_outside(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["relaxed"][0] = 1.0 + 1e-6


def understate_rounding(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["rounding_deviation_s"] *= 0.5


def overstate_bound(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["lower_bound"] *= 1.001
    row["gap"] = 1.0 - (1.0 - row["gap"]) * 1.001


def understate_bound(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["lower_bound"] *= 0.99
    row["gap"] = 1.0 - (1.0 - row["gap"]) * 0.99


def understate_gap(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["gap"] *= 0.5


def long_normals(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["normals"] *= 1.01


def worst_plan(row: dict[str, Any], problem: dict[str, Any]) -> None:
    """A consistent record of a plan that is worse than both constant ones."""
    accept, refuse = (problem[name].reshape(STAGES, 3) for name in ("accept_m_s", "refuse_m_s"))
    shape = (STAGES, len(problem["distances_m"]), 3)

    def cost(plan: Array) -> float:
        positions = problem["initial_m"] + STAGE_S * np.cumsum(np.where(plan[:, None] == 1.0, accept, refuse), axis=0)
        gap = problem["distances_m"] - np.linalg.norm(positions[:, None] - problem["centres_m"].reshape(shape), axis=2)
        error = positions - problem["reference_m"].reshape(STAGES, 3)
        return float(STAGE_S * (np.sum(error**2) + 10.0 * np.sum(np.maximum(0.0, gap.max(axis=1)) ** 2)))

    plan = max(ALL_PLANS, key=cost)
    problem["plan"] = plan
    problem["positions_m"] = (
        problem["initial_m"] + STAGE_S * np.cumsum(np.where(plan[:, None] == 1.0, accept, refuse), axis=0)
    ).ravel()
    row["objective"] = cost(plan)


MUTANTS: list[tuple[TraceClaim, DecisionEdit, str]] = [
    (FEAS, flip_plan, "positions are not those of (23)"),
    (FEAS, fractional_plan, "omega is not binary"),
    (FEAS, shift_position, "positions are not those of (23)"),
    (FEAS, shift_initial, "initial position"),
    (FEAS, shift_reference, "reference"),
    (FEAS, understate_cost, "objective"),
    (FEAS, overstate_clearance, "predicted clearance"),
    (FEAS, wrong_first_stage, "first stage"),
    (FEAS, without_point(0), "rock is left out"),
    (FEAS, without_point(1), "ugv2 is left out"),
    (FEAS, smaller_distance, "nothing that the UGV senses"),
    (FEAS, standing_robot, "nothing that the UGV senses"),
    (FEAS, lighter_slack, "weight of slack"),
    (FEAS, too_fast, "faster than the speed limit"),
    (FEAS, contrary_answer, "answer or reason"),
    (FEAS, wrong_reason, "answer or reason"),
    (SUR, round_otherwise, "rounded against the rule"),
    (SUR, fractional_rounding, "rounded omega is not binary"),
    (SUR, relaxed_outside, "outside [0, 1]"),
    (SUR, understate_rounding, "recorded rounding error"),
    (OPT, overstate_bound, "lower bound overstated"),
    (OPT, understate_bound, "lower bound understated"),
    (OPT, understate_gap, "recorded gap"),
    (OPT, long_normals, "length of a normal"),
    (OPT, inflate_loser, "throughout"),
    (OPT, worst_plan, "objective above"),
]


@pytest.mark.parametrize(
    ("claim", "edit", "what"), MUTANTS, ids=[f"{m[0].id}-{m[2]}-{i}" for i, m in enumerate(MUTANTS)]
)
def test_a_mutant_is_refuted(relaxed: Trace, claim: TraceClaim, edit: DecisionEdit, what: str) -> None:
    trace = with_decision(relaxed, edit)
    finding = claim.judge(trace)
    assert finding.status == "refuted", finding
    assert finding.counterexample is not None
    assert finding.counterexample["robot"] == "ugv1"
    assert finding.counterexample["t_s"] <= 0.2 + 1e-9  # the edited row, or the one that has to follow from it
    found = {one.what for one in comparisons(claim, trace) if one.wrong}
    assert any(what in text for text in found), found


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
        row["route"] = "enumeration"

    for claim in (FEAS, SUR, OPT):
        for edit in (nan, nan_cost, cut, planless, other_route):
            assert claim.judge(with_decision(relaxed, edit)).status == "error"
        assert claim.judge(replace(relaxed, problems=relaxed.problems.iloc[1:])).status == "error"
        assert claim.judge(replace(relaxed, problems=relaxed.problems.drop(columns="plan"))).status == "error"


def refused_for_want_of_a_plan(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row |= {"status": "refused_solver_failed", "decision": "refuse", "reason": "no_plan"}
    for name in ("plan", "positions_m", "relaxed", "rounded", "normals"):
        problem[name] = []


def test_a_refusal_without_a_plan_is_in_order_but_an_acceptance_is_not(relaxed: Trace) -> None:
    last = len(relaxed.decisions) - 1
    trace = with_decision(relaxed, refused_for_want_of_a_plan, row=last)
    for claim in (FEAS, SUR, OPT):
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
    assert SUR.judge(trace).status == "not_run"
    assert OPT.judge(trace).status == "inconclusive"


def test_no_decision_at_all() -> None:
    trace = decided_run()
    none = replace(trace, decisions=trace.decisions.iloc[:0], problems=trace.problems.iloc[:0])

    def intervening(signals: pd.DataFrame) -> None:
        signals.loc[signals["t_s"] > 0.2, "ugv2.mode"] = 1.0

    for claim in (FEAS, SUR, OPT):
        assert claim.judge(none).status == "holds"
        assert claim.judge(builders.with_signals(none, intervening)).status == "not_run"
        assert claim.judge(builders.with_signals(trace, intervening)).status == "not_run"
        assert claim.judge(replace(trace, problems=trace.problems.iloc[:0])).status == "not_run"
        assert not claim.applies(builders.with_meta(trace, method="b"))


def record_of(name: str, run: str, route: str = "relaxed") -> Trace:
    described = load(name)[0]
    described.gatekeeper.route = route
    return simulate(described, run)


@pytest.mark.parametrize(("name", "run"), [("case_b", "c"), ("case_a", "d"), ("soft_gate", "c"), ("soft_gate", "d")])
def test_real_runs_pass(name: str, run: str) -> None:
    trace = record_of(name, run)
    assert len(trace.decisions) > 5
    for claim in (FEAS, SUR, OPT):
        finding = claim.judge(trace)
        assert finding.status == "holds", finding


@pytest.mark.parametrize("route", ["enumeration", "branch_and_bound", "nonlinear", "rollout"])
def test_real_runs_of_other_routes(route: str) -> None:
    trace = record_of("case_b", "d", route)
    assert FEAS.judge(trace).status == "holds"
    bounded = route in ("enumeration", "branch_and_bound")
    assert OPT.judge(trace).status == ("holds" if bounded else "inconclusive")
    assert not SUR.applies(trace) or SUR.judge(trace).status == "holds"


def test_a_real_run_saved_and_broken(tmp_path: Any) -> None:
    trace = record_of("case_b", "d")
    save(trace, tmp_path)
    for claim in (FEAS, SUR, OPT):
        assert claim.judge(load_trace(tmp_path)) == claim.judge(trace)
    for claim, edit in (
        (FEAS, flip_plan), (FEAS, shift_position), (FEAS, shift_initial), (FEAS, shift_reference), (FEAS, too_fast),
        (FEAS, understate_cost), (FEAS, smaller_distance), (FEAS, overstate_clearance), (FEAS, contrary_answer),
        (SUR, round_otherwise), (SUR, understate_rounding), (OPT, overstate_bound), (OPT, understate_bound),
        (OPT, understate_gap), (OPT, long_normals), (OPT, inflate_loser),
    ):  # fmt: skip
        assert claim.judge(with_decision(trace, edit)).status == "refuted", edit


def test_a_run_that_hides_an_intervention_is_refuted() -> None:
    """What was executed is not the UGV's own task, whatever the `accepted` column says."""
    trace = record_of("case_b", "d")
    assert FEAS.judge(trace).status == "holds"
    hidden = replace(trace, signals=trace.signals.assign(**{"ugv1.accepted": 0.0}))
    finding = FEAS.judge(hidden)
    assert finding.status == "refuted"
    assert "own task" in str(finding.counterexample)
