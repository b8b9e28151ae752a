"""The relaxation without a solver: costs, bounds, half-planes, weak duality, sum-up rounding."""

from dataclasses import replace

import numpy as np
import pytest
from builders.problems import random_problem
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from ugv.oracles import cost

from airground_drake.ugv.binary_program import block_of_stage
from airground_drake.ugv.relaxation import (
    dual_bound,
    normals_along,
    rounding_deviation,
    sum_up_rounding,
    unavoidable_cost,
    within_reach,
)

SEEDS, PLANS = st.integers(0, 10**6), arrays(np.float64, 24, elements=st.floats(0.0, 1.0))


@given(SEEDS, PLANS, PLANS)
def test_costs_bounds_and_half_planes(seed: int, guide: np.ndarray, omega: np.ndarray) -> None:
    """(25) is that of the formulas; half-planes never cost less, and none is in the way of what cannot come near."""
    problem = random_problem(seed)
    normals, positions = normals_along(problem, problem.positions(guide)), problem.positions(omega)
    exact, along = problem.evaluate(omega).objective, problem.evaluate_half_planes(positions, normals)
    assert [exact, along] == pytest.approx([float(cost(problem, omega, each)) for each in (None, normals)])
    assert unavoidable_cost(problem) <= exact <= along + 1e-9
    away, idle = positions[:, None] - problem.centres, ~within_reach(problem)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=2), 1.0, atol=1e-12)
    assert ((away * normals).sum(axis=2) >= problem.distances - 1e-9)[idle].all()


@given(SEEDS)
def test_the_unavoidable_cost_is_reached_where_both_modes_are_the_same(seed: int) -> None:
    problem = random_problem(seed, points=0)
    only = replace(problem, accept=problem.refuse)
    assert unavoidable_cost(only) == pytest.approx(cost(only, np.zeros(24)), rel=1e-8)


@given(SEEDS, PLANS, PLANS)
def test_the_dual_bound_holds_for_any_multipliers(seed: int, at: np.ndarray, omega: np.ndarray) -> None:
    """The bound linearised at one plan is below the cost, in half-planes, of another, from any stage on."""
    problem, rng = random_problem(seed), np.random.default_rng(seed)
    normals = normals_along(problem, problem.positions(rng.random(problem.stages)))
    multipliers = rng.exponential(3.0, normals.shape[:2]) * (rng.random(normals.shape[:2]) < 0.3)
    positions = problem.positions(omega)
    for k in range(0, problem.stages, 5):
        rest = replace(
            problem, initial=positions[k - 1] if k else problem.initial, accept=problem.accept[k:],
            refuse=problem.refuse[k:], reference=problem.reference[k:], centres=problem.centres[k:],
        )  # fmt: skip
        for any_of_them in (multipliers[k:], None):
            bound = dual_bound(rest, normals[k:], at[k:], any_of_them)
            assert bound <= cost(rest, omega[k:], normals[k:]) + 1e-9 * (1.0 + abs(bound))


@given(arrays(np.int64, st.integers(1, 60), elements=st.integers(0, 8)))
def test_sum_up_rounding_follows_28_and_29_literally(eighths: np.ndarray) -> None:
    relaxed = eighths / 8.0  # sums are exact, and ties occur
    both = np.column_stack([relaxed, 1.0 - relaxed])
    chosen = np.zeros_like(both)
    for k in range(len(relaxed)):
        h = both[: k + 1].sum(axis=0) - chosen[:k].sum(axis=0)
        chosen[k, 0 if h[0] >= h[1] else 1] = 1.0
    np.testing.assert_array_equal(sum_up_rounding(relaxed), chosen[:, 0])
    assert rounding_deviation(relaxed, chosen[:, 0], 0.05) <= 0.025 + 1e-12


def test_blocks_cover_all_stages() -> None:
    for stages in range(1, 70):
        block = block_of_stage(stages, 10)
        counts = np.bincount(block)
        assert (len(block), len(counts)) == (stages, min(10, stages))
        assert counts.max() - counts.min() <= 1
        assert (np.diff(block) >= 0).all()
