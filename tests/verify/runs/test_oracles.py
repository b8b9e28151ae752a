"""What claims about decisions compute, against enumeration, another method or the running code."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from builders.decisions import ALL_PLANS, STAGES, GateData
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from verify.judging import CLAIMS, judge
from verify.runs.cases import BINARY, RELAXED

from airground_drake.gatekeeper.answer import Rules, settle
from airground_drake.gatekeeper.solution import Solution
from airground_drake.intervention.messages import ACCEPT, REFUSE, SILENT
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Gatekeeper
from airground_drake.verify.runs import convex_bounds, gate_feas, gate_opt
from airground_drake.verify.runs.convex_bounds import enclose
from airground_drake.verify.runs.gate_record import DecisionRecord, rows_of
from airground_drake.verify.runs.way_left import bounds_of_way_left

COSTS = st.floats(0.1, 10.0)


@st.composite
def problems(draw: st.DrawFn) -> GateData:
    """Random problems, some without points, some with points on the way."""
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
    for row, data, found in zip(rows, several, enclose(rows), strict=True):
        costs = row.cost(row.positions(ALL_PLANS), data.normals)
        ours = [data.plan_cost(plan, along=True) for plan in ALL_PLANS[::37]]
        np.testing.assert_allclose(costs[::37], ours, rtol=1e-12)
        assert found.other_first <= costs[ALL_PLANS[:, 0] == 1.0].min() + 1e-12
        assert found.lower <= min(costs.min(), optimum := data.relaxed_optimum()) + 1e-12
        assert found.upper <= optimum + 1e-6 * row.scale
        assert 0.0 <= found.upper - found.lower + 1e-12 <= 1e-6 * row.scale


@examples(25, fuzz=2000)
@given(problems(), st.integers(0, 10**6))
def test_the_bound_holds_whatever_the_solver_returns(data: GateData, seed: int) -> None:
    rng, row = np.random.default_rng(seed), data.row(np.zeros(STAGES))
    rubbish = [rng.uniform(0.0, 1.0, STAGES)], [rng.exponential(1.0, (STAGES, len(data.distances_m)))]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(convex_bounds, "_solve", lambda rows: rubbish)
        (found,) = enclose([row])
    costs = row.cost(row.positions(ALL_PLANS), data.normals)
    assert found.lower <= costs.min() + 1e-12
    assert found.other_first <= costs[ALL_PLANS[:, 0] == 1.0].min() + 1e-12
    assert found.upper >= data.relaxed_optimum() - 1e-9


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
        patch.setattr(convex_bounds, "_solve", lambda rows: solved)
        (found,) = enclose([row])
    assert found.lower <= data.relaxed_optimum() + 1e-12
    assert found.upper - found.lower <= convex_bounds.WIDE * row.scale


def test_plans_of_blocks_are_enumerated(base: Callable[[str], Trace]) -> None:
    for row in rows_of(base(BINARY)):
        costs = [GateData.of(row).plan_cost(plan, along=True) for plan in ALL_PLANS]
        assert gate_opt.cheapest_of_blocks(row, STAGES).lower == pytest.approx(min(costs), rel=1e-12)


def test_a_bad_solution_decides_nothing(base: Callable[[str], Trace], monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(rows: list[DecisionRecord]) -> Any:
        return [np.full(STAGES, 0.5) for _ in rows], [np.zeros((STAGES, len(row["distances_m"]))) for row in rows]

    monkeypatch.setattr(convex_bounds, "_solve", nothing)
    monkeypatch.setattr(convex_bounds, "_minimiser", lambda row, _: np.full(STAGES, 0.5))
    assert judge("GATE-OPT", base(RELAXED)).status != "holds"


@pytest.mark.parametrize(("gap", "status"), [(0.0499, "holds"), (0.0501, "inconclusive"), (0.4, "inconclusive")])
def test_a_gap_is_too_wide_from_five_per_cent_on(
    base: Callable[[str], Trace], gap: float, status: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With nothing else wrong: blocks of stages show no cheaper plan."""
    assert "at most 5 %" in CLAIMS["GATE-OPT"].statement
    bounded = gate_opt.bound(rows_of(base(RELAXED)), 0)
    assert max(each.gap for each in bounded) < 0.0499
    bounded[1].__dict__["gap"] = gap  # a cached property
    monkeypatch.setattr(gate_opt, "bound", lambda rows, blocks: bounded)
    assert judge("GATE-OPT", base(RELAXED)).status == status


@given(
    st.tuples(COSTS, COSTS), st.tuples(COSTS, COSTS), st.sampled_from([SILENT, ACCEPT, REFUSE]),
    st.sampled_from([0.0, 0.1, 0.2, 0.3]), st.sampled_from([0.0, 0.05, 0.2]), st.booleans(), st.booleans(),
    st.booleans(), st.sampled_from([None, 0.0, 1.0]),
)  # fmt: skip
def test_the_rules_are_those_of_the_running_gatekeeper(
    costs: tuple[float, float], throughout: tuple[float, float], standing: float, stood: float, margin: float,
    equal: bool, planned: bool, literal: bool, rounded: float | None,
) -> None:  # fmt: skip
    accept, refuse = (costs[0], costs[0]) if equal else costs
    plan = np.array([float(accept <= refuse)]) if planned else None
    first = None if rounded is None else np.array([rounded])
    status: Any = "optimal" if planned else "refused_not_finite"
    decision = Solution(accept <= refuse, status, objective=min(costs), plan=plan, rounded=first)
    given = {"objective": min(costs), "accept_throughout": throughout[0], "refuse_throughout": throughout[1]}
    row = DecisionRecord(given, 1.0, 1.0, 1.0, 0.0, {"plan": plan, "rounded": first})
    gate = Gatekeeper(switching_margin=margin, min_dwell_s=0.2)
    stands = {SILENT: None, ACCEPT: "accept", REFUSE: "refuse"}[standing]
    rules = Rules(switching_margin=margin, min_dwell=0.2, first_stage=literal)
    ours = gate_feas.rule(row, stands, stood, gate, literal=literal)
    assert ours == settle(decision, throughout, standing, stood, rules)


def test_the_way_left_is_bounded_from_both_sides() -> None:
    least, most = bounds_of_way_left(np.zeros(3), np.array([8.0, 0.0, 0.0]), np.array([[4.0, 0.0, 0.0]]), 2.0)
    true = 2.0 * np.sqrt(12.0) + 2.0 * np.pi / 3.0
    assert least == 8.0
    assert true <= most <= 1.01 * true
