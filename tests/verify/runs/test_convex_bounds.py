"""Bounds of the relaxed optimum, on problems small enough to enumerate every binary plan."""

from __future__ import annotations

import numpy as np
import pytest
from builders.decisions import ALL_PLANS, STAGE_S, STAGES, GateData
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.base.arrays import Array
from airground_drake.verify.runs import convex_bounds
from airground_drake.verify.runs.convex_bounds import enclose
from airground_drake.verify.runs.gate_record import Row


@st.composite
def problems(draw: st.DrawFn) -> GateData:
    """Random problems, some without points, some with points on the way."""
    count, seed = draw(st.integers(0, 3)), draw(st.integers(0, 10**6))
    rng = np.random.default_rng(seed)
    slack_weight = draw(st.sampled_from([0.0, 10.0, 1000.0]))
    centres = np.tile(rng.uniform([-1.0, 0.0, 0.0], [2.0, 3.0, 0.0], (count, 3)), (STAGES, 1, 1))
    reference = np.array([0.0, 1.0, 0.0]) + np.outer(
        STAGE_S * np.arange(1, STAGES + 1), rng.uniform(-2.0, 2.0, 3) * [1, 1, 0]
    )
    distances, terminal_weight = rng.uniform(0.5, 2.0, count), draw(st.sampled_from([0.0, 1.0]))
    return GateData(seed, np.zeros(3), reference, centres, distances, slack_weight, terminal_weight)


def row_of(data: GateData, plan: Array) -> Row:
    arrays = {
        "initial_m": data.initial, "accept_m_s": data.accept, "refuse_m_s": data.refuse, "plan": plan,
        "reference_m": data.reference, "centres_m": data.centres, "distances_m": data.distances,
        "normals": data.normals,
    }  # fmt: skip
    weights = data.error_weight, data.slack_weight, data.terminal_weight
    return Row({"robot": "ugv1", "t_s": 0.0}, STAGE_S, *weights, dict(arrays))


@examples(25, fuzz=300)
@given(st.lists(problems(), min_size=1, max_size=3))
def test_the_enclosure_contains_the_relaxed_optimum_and_is_below_every_binary_plan(several: list[GateData]) -> None:
    rows = [row_of(data, np.zeros(STAGES)) for data in several]
    for row, data, found in zip(rows, several, enclose(rows), strict=True):
        costs = row.cost(row.positions(ALL_PLANS), data.normals)
        np.testing.assert_allclose(
            costs[::37], [data.plan_cost(plan, along=True) for plan in ALL_PLANS[::37]], rtol=1e-12
        )
        assert found.lower <= costs.min() + 1e-12
        assert found.other_first <= costs[ALL_PLANS[:, 0] == 1.0].min() + 1e-12
        assert 0.0 <= found.upper - found.lower + 1e-12 <= 1e-6 * row.scale
        optimum = data.relaxed()[1]
        assert found.lower <= optimum + 1e-12  # any feasible plan's cost is above
        assert found.upper <= optimum + 1e-6 * row.scale


@examples(25, fuzz=2000)
@given(problems(), st.integers(0, 10**6))
def test_the_bound_holds_whatever_the_solver_returns(data: GateData, seed: int) -> None:
    rng = np.random.default_rng(seed)
    row = row_of(data, np.zeros(STAGES))
    rubbish = [rng.uniform(0.0, 1.0, STAGES)], [rng.exponential(1.0, (STAGES, len(data.distances)))]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(convex_bounds, "_solve", lambda rows: rubbish)
        (found,) = enclose([row])
    costs = row.cost(row.positions(ALL_PLANS), data.normals)
    assert found.lower <= costs.min() + 1e-12
    assert found.other_first <= costs[ALL_PLANS[:, 0] == 1.0].min() + 1e-12
    assert found.upper >= data.relaxed()[1] - 1e-9


@examples(25, fuzz=300)
@given(st.integers(0, 10**6), st.sampled_from([1e-4, 1e-5]), st.integers(0, 2))
def test_it_is_narrow_where_the_solver_stops_early_because_costs_are_tiny(seed: int, off: float, count: int) -> None:
    rng = np.random.default_rng(seed)
    far = np.full((STAGES, count, 3), 50.0)
    data = GateData(seed, np.zeros(3), np.zeros((STAGES, 3)), far, np.ones(count))
    data.reference = data.positions(np.ones(STAGES)) + off * rng.uniform(-1.0, 1.0, (STAGES, 3)) * [1, 1, 0]
    row = row_of(data, np.ones(STAGES))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            convex_bounds, "_solve", lambda rows: ([rng.uniform(0.9, 1.0, STAGES)], [np.zeros((STAGES, count))])
        )
        (found,) = enclose([row])
    assert found.lower <= data.relaxed()[1] + 1e-12
    assert found.upper - found.lower <= convex_bounds.WIDE * row.scale
