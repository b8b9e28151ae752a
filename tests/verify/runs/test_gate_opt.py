"""GATE-OPT."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from builders.decisions import ALL_PLANS, STAGES, decided_run, gate_data_at
from builders.edits import DecisionEdit, with_decision, with_scenario
from verify.judging import FEAS, OPT, assert_decision_refuted
from verify.runs.cases import inflate_loser, long_normals, worst_plan

from airground_drake.base.arrays import Array
from airground_drake.run.trace import Trace
from airground_drake.verify.runs import convex_bounds, gate_opt
from airground_drake.verify.runs.gate_record import Row, rows_of

MUTANTS: list[tuple[DecisionEdit, str]] = [  # numbers that are off: test_tolerances.py
    (inflate_loser, "throughout"),
    (worst_plan, "objective above"),
]


@pytest.mark.parametrize(("edit", "what"), MUTANTS, ids=[f"{what}-{i}" for i, (_, what) in enumerate(MUTANTS)])
def test_a_mutant_is_refuted(relaxed: Trace, edit: DecisionEdit, what: str) -> None:
    assert_decision_refuted(OPT, with_decision(relaxed, edit), what)


def test_the_example_is_not_trivial(relaxed: Trace) -> None:
    rows = rows_of(relaxed)
    assert {0.0, 1.0} <= {float(row["plan"][0]) for row in rows} | {float(row["plan"][-1]) for row in rows}
    assert any(0.0 < value < 1.0 for row in rows for value in row["relaxed"])
    assert any(row.clearance(row.constant).min() < 0.0 for row in rows)
    evidence = OPT.judge(relaxed).evidence
    assert evidence["bounded"] == len(rows)
    assert evidence["largest_gap"] > 1e-4
    assert evidence["widest_enclosure"] < 1e-6


def test_where_no_plan_can_come_near_a_half_plane_asks_for_nothing(relaxed: Trace) -> None:
    """Turned round, it would ask for metres; routes leave it out, and so does the claim."""
    row = rows_of(relaxed)[2]
    idle = ~row.half_planes.any(axis=2)
    assert idle.any()
    assert not idle.all()

    def turned(given: dict[str, Any], problem: dict[str, Any]) -> None:
        problem["normals"] = np.where(idle[..., None], -row["normals"], row["normals"]).ravel()

    trace = with_decision(relaxed, turned)
    found, before = OPT.judge(trace), OPT.judge(relaxed)
    assert found.status == "holds"
    assert found.evidence["largest_gap"] == pytest.approx(before.evidence["largest_gap"], abs=1e-8)
    again, plan = rows_of(trace)[2], row["positions_m"]
    assert again.cost(plan, again["normals"]) > 2.0 * again.cost(plan, again.half_planes)


def test_a_complete_decision_without_its_evidence_is_an_error(relaxed: Trace) -> None:
    def without(name: str) -> DecisionEdit:
        def edit(row: dict[str, Any], problem: dict[str, Any]) -> None:
            problem[name] = []

        return edit

    assert FEAS.judge(with_decision(relaxed, without("relaxed"))).status == "error"
    assert OPT.judge(with_decision(relaxed, without("normals"))).status == "error"


def test_a_decision_cut_short_by_its_budget_is_listed_and_never_passes_for_bounded(relaxed: Trace) -> None:
    def spent(row: dict[str, Any], problem: dict[str, Any]) -> None:
        row["status"] = "budget_spent"
        problem["relaxed"], problem["rounded"], problem["normals"] = [], [], []

    trace = with_decision(relaxed, spent)
    assert FEAS.judge(trace).evidence["rounded_plans"] == len(trace.decisions) - 1
    finding = OPT.judge(trace)
    assert finding.status == "inconclusive"
    assert len(finding.evidence["without_a_bound"]) == 1


def test_a_bad_solution_decides_nothing(relaxed: Trace, monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(rows: list[Row]) -> tuple[list[Array], list[Array]]:
        return [np.full(STAGES, 0.5) for _ in rows], [np.zeros((STAGES, 2)) for _ in rows]

    monkeypatch.setattr(convex_bounds, "_solve", nothing)
    assert OPT.judge(relaxed).status != "holds"


def test_blocks_are_enumerated_exactly() -> None:
    trace = decided_run("mixed_integer")
    for row in rows_of(trace):
        data = gate_data_at(trace, row.given["t_s"])
        best = min(data.plan_cost(plan, along=True) for plan in ALL_PLANS)
        assert gate_opt.cheapest_of_blocks(row, STAGES).lower == pytest.approx(best, rel=1e-12)


def test_blocks_that_are_few_need_no_relaxation(monkeypatch: pytest.MonkeyPatch) -> None:
    """With blocks the optimum is that of their plans: the relaxation over all stages may be far below."""
    trace = decided_run("mixed_integer")
    with_blocks = with_scenario(trace, gatekeeper__blocks=STAGES)
    monkeypatch.setattr(gate_opt, "enclose", None)
    finding = OPT.judge(with_blocks)
    assert finding.status == "holds"
    assert finding.evidence["widest_enclosure"] == 0.0


def not_the_optimum(row: dict[str, Any], problem: dict[str, Any]) -> None:
    """A bound above what another choice at one stage costs."""
    row["route_bound"] *= 1.0 + 1e-3
    row["gap"] = 0.0


def with_a_gap(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["route_bound"] *= 1.0 - 1e-4
    row["gap"] = 1e-4


@pytest.mark.parametrize(
    ("edit", "what"),
    [(not_the_optimum, "lower bound"), (with_a_gap, "optimal, but with a gap"), (long_normals, "length of a normal")],
)
def test_a_proof_that_is_none_is_refuted(edit: DecisionEdit, what: str) -> None:
    assert_decision_refuted(OPT, with_decision(decided_run("mixed_integer"), edit), what)


def test_a_plan_with_a_cheaper_neighbour_is_no_optimum() -> None:
    """The record is consistent in itself: only the bound is that of the worse plan."""
    trace = decided_run("mixed_integer")

    def second(row: dict[str, Any], problem: dict[str, Any]) -> None:
        data = gate_data_at(trace, row["t_s"])
        best = min(ALL_PLANS, key=lambda plan: data.plan_cost(plan, along=True))
        worse = np.where(np.arange(STAGES) == STAGES // 2, 1.0 - best, best)
        cost = data.plan_cost(worse, along=True)
        positions = data.positions(worse)
        problem["plan"], problem["positions_m"] = worse, positions.ravel()
        row |= {"objective": data.cost(positions), "route_bound": cost, "gap": 0.0}

    assert_decision_refuted(OPT, with_decision(trace, second), "lower bound overstated")


@pytest.mark.parametrize(("gap", "status"), [(0.0499, "holds"), (0.0501, "inconclusive"), (0.4, "inconclusive")])
def test_a_gap_is_too_wide_from_five_per_cent_on(
    relaxed: Trace, gap: float, status: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On either side of what the statement says, and what the independent checker allows."""
    assert "at most 5 %" in OPT.statement
    assert OPT.largest_gap == 0.05
    bounded = gate_opt.bound(rows_of(relaxed), 0)
    assert max(each.gap for each in bounded) < 0.0499
    bounded[1].__dict__["gap"] = gap  # a cached property
    assert OPT._finding(bounded, []).status == status
    # and through the claim, with nothing else wrong: blocks of stages show no cheaper plan
    monkeypatch.setattr(gate_opt, "bound", lambda rows, blocks: bounded)
    assert OPT.judge(relaxed).status == status
