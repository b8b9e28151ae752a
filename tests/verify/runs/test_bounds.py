"""What claims about decisions compute, against enumeration, another method or the running code."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from builders.decisions import ALL_PLANS, STAGES, GateData
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from verify.judging import decided
from verify.runs.cases import B_D, BINARY, LOCAL, RELAXED, SIXTH, Edit, decision, problem

from airground_drake.sim.trace import Trace
from airground_drake.verify.claims import gate_plan
from airground_drake.verify.claims.gate_plan import enclose
from airground_drake.verify.runs.gate_record import DecisionRecord, rows_of


@st.composite
def problems(draw: st.DrawFn) -> GateData:
    count, rng, flat = draw(st.integers(0, 3)), np.random.default_rng(draw(st.integers(0, 10**6))), [1.0, 1.0, 0.0]
    accept = (np.array([2.0, 3.0, 0.0]) + rng.uniform(-1.0, 1.0, (STAGES, 3))) * flat
    refuse = (np.array([0.0, 0.5, 0.0]) + rng.uniform(-0.4, 0.4, (STAGES, 3))) * flat
    reference = np.array([0.0, 1.0, 0.0]) + np.outer(0.05 * np.arange(1, STAGES + 1), rng.uniform(-2.0, 2.0, 3) * flat)
    centres = np.tile(rng.uniform([-1.0, 0.0, 0.0], [2.0, 3.0, 0.0], (count, 3)), (STAGES, 1, 1))
    normals = (0.05 * np.cumsum(accept, axis=0))[:, None] - centres
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    weights = 0.05, 1.0, draw(st.sampled_from([0.0, 10.0, 1000.0])), draw(st.sampled_from([0.0, 1.0]))
    distances = rng.uniform(0.5, 2.0, count)
    data = GateData(np.zeros(3), accept, refuse, reference, centres, distances, normals, *weights)
    return GateData.of(data.row(np.zeros(STAGES)))


@examples(25, fuzz=300)
@given(st.lists(problems(), min_size=1, max_size=3))
def test_the_enclosure_contains_the_relaxed_optimum_and_is_below_every_plan(several: list[GateData]) -> None:
    rows = [data.row(np.zeros(STAGES)) for data in several]
    for row, data, enclosure in zip(rows, several, enclose(rows), strict=True):
        costs = row.cost(row.positions(ALL_PLANS), data.normals)
        ours = [data.plan_cost(plan, along=True) for plan in ALL_PLANS[::37]]
        np.testing.assert_allclose(costs[::37], ours, rtol=1e-12)
        assert enclosure.other_first <= costs[ALL_PLANS[:, 0] == 1.0].min() + 1e-12
        assert enclosure.lower <= min(costs.min(), optimum := data.relaxed_optimum()) + 1e-12
        assert enclosure.upper <= optimum + 1e-6 * row.scale
        assert 0.0 <= enclosure.upper - enclosure.lower + 1e-12 <= 1e-6 * row.scale


@examples(25, fuzz=2000)
@given(problems(), st.integers(0, 10**6))
def test_the_bound_holds_whatever_the_solver_returns(data: GateData, seed: int) -> None:
    rng, row = np.random.default_rng(seed), data.row(np.zeros(STAGES))
    rubbish = [rng.uniform(0.0, 1.0, STAGES)], [rng.exponential(1.0, (STAGES, len(data.distances_m)))]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gate_plan, "_solve", lambda rows: rubbish)
        (enclosure,) = enclose([row])
    costs = row.cost(row.positions(ALL_PLANS), data.normals)
    assert enclosure.lower <= costs.min() + 1e-12
    assert enclosure.other_first <= costs[ALL_PLANS[:, 0] == 1.0].min() + 1e-12
    assert enclosure.upper >= data.relaxed_optimum() - 1e-9


@examples(25, fuzz=300)
@given(problems(), st.integers(0, 10**6), st.sampled_from([1e-4, 1e-5]))
def test_it_is_narrow_where_the_solver_stops_early_because_costs_are_tiny(
    data: GateData, seed: int, off: float
) -> None:
    rng, m = np.random.default_rng(seed), len(data.distances_m)
    data.centres_m, data.normals = data.centres_m + 50.0, 0.0 * data.normals
    data.reference_m = data.positions(np.ones(STAGES)) + off * rng.uniform(-1.0, 1.0, (STAGES, 3)) * [1, 1, 0]
    row = data.row(np.ones(STAGES))
    with pytest.MonkeyPatch.context() as patch:
        solved = [rng.uniform(0.9, 1.0, STAGES)], [np.zeros((STAGES, m))]
        patch.setattr(gate_plan, "_solve", lambda rows: solved)
        (enclosure,) = enclose([row])
    assert enclosure.lower <= data.relaxed_optimum() + 1e-12
    assert enclosure.upper - enclosure.lower <= gate_plan.WIDE * row.scale


def test_plans_of_blocks_are_enumerated(base: Callable[[str], Trace]) -> None:
    for row in rows_of(base(BINARY)):
        costs = [GateData.of(row).plan_cost(plan, along=True) for plan in ALL_PLANS]
        assert gate_plan.cheapest_of_blocks(row, STAGES).lower == pytest.approx(min(costs), rel=1e-12)


def test_a_bad_solution_gives_no_margin(base: Callable[[str], Trace], monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(rows: list[DecisionRecord]) -> Any:
        return [np.full(STAGES, 0.5) for _ in rows], [np.zeros((STAGES, len(row["distances_m"]))) for row in rows]

    monkeypatch.setattr(gate_plan, "_solve", nothing)
    monkeypatch.setattr(gate_plan, "_minimiser", lambda row, _: np.full(STAGES, 0.5))
    finding = decided("GATE-PLAN", base(RELAXED))
    assert (finding.status, finding.margin) == ("holds", None)
    assert finding.evidence["optimum"].startswith("unknown: the bounds of an optimum are")


def test_the_margin_is_the_largest_gap_and_refutes_nothing(
    base: Callable[[str], Trace], monkeypatch: pytest.MonkeyPatch
) -> None:
    bounded = gate_plan.bound(rows_of(base(RELAXED)), 0)
    bounded[1].__dict__["gap"] = 0.4  # a cached property
    monkeypatch.setattr(gate_plan, "bound", lambda rows, blocks: bounded)
    finding = decided("GATE-PLAN", base(RELAXED))
    assert (finding.status, finding.margin, finding.where["t_s"]) == ("holds", 0.4, bounded[1].row.t_s)


@pytest.mark.parametrize(
    ("name", "edit", "why"),
    [
        (LOCAL, lambda t: t, "unknown: 11 of 11 plans have no half-planes"),
        (RELAXED, decision(lambda _, given: given.update(normals=[])), "unknown: 1 of 11 plans have no half-planes"),
        (RELAXED, problem(normals=lambda v: 2.0 * v), "unknown: 1 of 11 plans have no half-planes"),
        (B_D, lambda t: t, "unknown: method (d) compares two predicted outcomes and solves no problem (26)"),
    ],
)  # fmt: skip
def test_where_the_optimum_is_unknown_there_is_no_margin(
    base: Callable[[str], Trace], name: str, edit: Edit, why: str
) -> None:
    finding = decided("GATE-PLAN", edit(base(name)))
    assert (finding.status, finding.margin, finding.evidence["optimum"]) == ("holds", None, why)


def test_the_gap_to_the_best_of_all_plans_is_evidence(base: Callable[[str], Trace]) -> None:
    """A plan that is dearer than another one, but written down at its cost, is feasible."""
    data = GateData.of(rows_of(base(BINARY))[SIXTH])
    costs = [data.plan_cost(plan) for plan in ALL_PLANS]
    plan = ALL_PLANS[int(np.argmax(costs))]

    def other(row: dict[str, Any], given: dict[str, Any]) -> None:
        given |= {"plan": plan, "positions_m": data.positions(plan).ravel()}
        row |= dict.fromkeys(("objective", "objective_accept", "objective_refuse"), max(costs))
        row |= {"plan_first_stage": "accept" if plan[0] == 1.0 else "refuse"}
        row |= {"predicted_clearance_m": float(rows_of(base(BINARY))[SIXTH].clearance(data.positions(plan)).min())}

    finding = decided("GATE-PLAN", decision(other)(base(BINARY)))
    assert finding.status == "holds", finding.counterexample
    assert finding.evidence["largest_gap_to_enumeration"] == pytest.approx(max(costs) / min(costs) - 1.0)
