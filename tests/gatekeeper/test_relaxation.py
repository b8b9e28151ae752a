"""The relaxation without a solver: what no plan can avoid, half-planes, weak duality, sum-up rounding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders.problems import PLANS, random_problem, rolled_out
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airground_drake.gatekeeper.binary_program import block_of_stage
from airground_drake.gatekeeper.relaxation import (
    dual_bound,
    normals_along,
    remaining_cost,
    rounding_deviation,
    sum_up_rounding,
    within_reach,
)
from gatekeeper.contract import used
from gatekeeper.formulas import half_plane_cost


@given(st.integers(0, 10**6), PLANS)
def test_no_plan_costs_less_than_what_remains(seed: int, omega: np.ndarray) -> None:
    problem = random_problem(seed)
    positions = problem.positions(omega)
    stage = problem.dt * np.square(problem.reference - positions).sum(axis=1)  # no slack is cheapest
    stage[-1] *= 1.0 + problem.terminal_weight / problem.dt
    to_come = np.append(np.cumsum(stage[::-1])[::-1], 0.0)
    assert (remaining_cost(problem) <= to_come + 1e-9).all()


@given(st.integers(0, 10**6), PLANS, PLANS)
def test_where_nothing_can_come_near_no_half_plane_is_in_the_way(seed: int, guide: np.ndarray, w: np.ndarray) -> None:
    problem = random_problem(seed)
    normals = normals_along(problem, problem.positions(guide))
    away = problem.positions(w)[:, None] - problem.centres
    idle = ~within_reach(problem)
    assert (np.linalg.norm(away, axis=2) >= problem.distances - 1e-9)[idle].all()
    assert (np.einsum("kmi,kmi->km", away, normals) >= problem.distances - 1e-9)[idle].all()


@given(st.integers(0, 10**6), PLANS, PLANS)
def test_the_dual_bound_holds_for_any_multipliers(seed: int, at: np.ndarray, omega: np.ndarray) -> None:
    """The bound linearised at one plan is below the cost, in half-planes, of another, from any stage on."""
    problem, rng = random_problem(seed), np.random.default_rng(seed)
    normals = normals_along(problem, problem.positions(rng.random(problem.stages)))
    multipliers = rng.exponential(3.0, normals.shape[:2]) * (rng.random(normals.shape[:2]) < 0.3)
    positions = problem.positions(omega)
    for k in range(problem.stages):
        rest = replace(
            problem, initial=positions[k - 1] if k else problem.initial, accept=problem.accept[k:],
            refuse=problem.refuse[k:], reference=problem.reference[k:], centres=problem.centres[k:],
        )  # fmt: skip
        bound = dual_bound(rest, normals[k:], at[k:], multipliers[k:])
        assert bound <= half_plane_cost(rest, omega[k:], normals[k:]) + 1e-9 * (1.0 + abs(bound))


def test_the_bound_of_the_relaxation_is_tight() -> None:
    """The relaxed plan costs, along the half-planes, no more than the bound: so it is the optimum."""
    for problem in [*(random_problem(s, 24, 1 + s % 3) for s in range(8)), *(rolled_out(s) for s in range(8))]:
        solution = used("relaxed").solve(problem)
        assert solution.relaxed is not None
        reached = half_plane_cost(problem, solution.relaxed, solution.normals)
        assert solution.route_bound == pytest.approx(reached, rel=1e-7, abs=1e-9)


@given(arrays(np.float64, st.integers(1, 120), elements=st.floats(0.0, 1.0)))
def test_sum_up_rounding_stays_within_half_a_stage(relaxed: np.ndarray) -> None:
    binary = sum_up_rounding(relaxed)
    assert set(binary.tolist()) <= {0.0, 1.0}
    assert rounding_deviation(relaxed, binary, 0.05) <= 0.025 + 1e-12


def test_sum_up_rounding_follows_28_and_29_literally() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        relaxed = rng.integers(0, 9, 30) / 8.0  # sums are exact, and ties occur
        both = np.column_stack([relaxed, 1.0 - relaxed])
        chosen = np.zeros_like(both)
        for k in range(30):
            h = both[: k + 1].sum(axis=0) - chosen[:k].sum(axis=0)
            chosen[k, 0 if h[0] >= h[1] else 1] = 1.0
        np.testing.assert_array_equal(sum_up_rounding(relaxed), chosen[:, 0])


def test_blocks_cover_all_stages() -> None:
    for stages in range(1, 70):
        block = block_of_stage(stages, 10)
        counts = np.bincount(block)
        assert len(block) == stages
        assert len(counts) == min(10, stages)
        assert counts.max() - counts.min() <= 1
        assert (np.diff(block) >= 0).all()
