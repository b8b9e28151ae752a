"""The paper's route."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cvxpy
import numpy as np
import pytest
from builders.problems import INSTANCES, case_a_proposal, random_problem
from gatekeeper.contract import check_contract
from gatekeeper.formulas import cost
from hypothesis import example, given
from hypothesis import strategies as st
from properties import examples

from airground_drake.gatekeeper.daqp_solver import Found
from airground_drake.gatekeeper.problem import Problem, predicted_problem
from airground_drake.gatekeeper.relaxation import normals_along
from airground_drake.gatekeeper.routes import relaxed
from airground_drake.gatekeeper.routes.relaxed import RelaxedRoute
from airground_drake.gatekeeper.solution import ConstantPlans


def in_reach(problem: Problem) -> np.ndarray:
    """(N, m): whether the box that all plans stay in comes within the safe distance of a point."""
    low, high = (
        problem.initial + problem.dt * np.cumsum(least(problem.accept, problem.refuse), axis=0)
        for least in (np.minimum, np.maximum)
    )
    nearest = np.clip(problem.centres, low[:, None], high[:, None])
    within: np.ndarray = np.linalg.norm(nearest - problem.centres, axis=2) < problem.distances
    return within


@examples(15, fuzz=1500)
@given(st.integers(0, 10**6))
@example(298986)  # the half-plane of a point out of reach would bind
def test_relaxation_agrees_with_an_independent_model(seed: int) -> None:
    """cvxpy builds (27) from the formulas, with the same half-planes of points in reach; the optima agree."""
    problem = random_problem(seed, 20)
    accept, refuse = problem.evaluate(np.ones(20)), problem.evaluate(np.zeros(20))
    guide = accept if accept.objective < refuse.objective else refuse
    normals = normals_along(problem, guide.positions)
    omega, u = cvxpy.Variable((20, 1)), cvxpy.Variable(20)
    velocity = problem.refuse + cvxpy.multiply(omega, problem.accept - problem.refuse)
    p = problem.initial[None] + problem.dt * cvxpy.cumsum(velocity, axis=0)
    constraints = [omega >= 0, omega <= 1, u >= 0]
    for m in range(2):
        reach = cvxpy.sum(cvxpy.multiply(normals[:, m], p - problem.centres[:, m]), axis=1)
        near = np.flatnonzero(in_reach(problem)[:, m])
        if near.size:
            constraints.append(reach[near] >= problem.distances[m] - u[near])
    cost = problem.dt * (cvxpy.sum_squares(problem.reference - p) + 200.0 * cvxpy.sum_squares(u))
    cost += problem.terminal_weight * cvxpy.sum_squares(problem.reference[-1] - p[-1])
    best = cvxpy.Problem(cvxpy.Minimize(cost), constraints).solve(solver="CLARABEL")
    solution = RelaxedRoute().solve(problem)
    assert solution.status == "optimal"
    assert solution.route_bound == pytest.approx(best, rel=1e-5, abs=1e-6)


@examples(50)
@given(st.integers(0, 10**6))
def test_every_decision_carries_its_evidence(seed: int) -> None:
    problem = random_problem(seed, 20)
    solution = RelaxedRoute().solve(problem)
    assert solution.objective == min(solution.objective_accept, solution.objective_refuse)
    assert solution.accept_first == (solution.objective_accept <= solution.objective_refuse)
    assert solution.gap >= -1e-6
    assert solution.rounding_deviation <= problem.dt / 2 + 1e-9
    constant = [problem.evaluate(np.full(20, w)).objective for w in (0.0, 1.0)]
    assert solution.objective <= min(constant)
    assert solution.rounded is not None
    other = np.append(1.0 - solution.rounded[0], solution.rounded[1:])
    assert solution.objective <= cost(problem, np.stack([solution.rounded, other])).min() * (1.0 + 1e-12) + 1e-15


@pytest.mark.parametrize("name", ["rolled out 0", "rolled out 2", "case A, stalled", "case A, on the way"])
def test_half_planes_face_the_cheaper_constant_plan(name: str) -> None:
    problem = INSTANCES[name]
    plans = np.stack([np.zeros(problem.stages), np.ones(problem.stages)])
    cheaper = plans[cost(problem, plans).argmin()]
    away = problem.positions(cheaper)[:, None] - problem.centres
    expected = away / np.linalg.norm(away, axis=2, keepdims=True)
    normals = RelaxedRoute().solve(problem).normals
    assert normals is not None
    near = in_reach(problem)
    assert near.any()
    np.testing.assert_allclose(normals[near], expected[near], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=2), 1.0, atol=1e-12)


def test_pruned_rows_do_not_change_the_optimum() -> None:
    """A far obstacle that no plan can reach leaves every number of the solution as it was."""
    problem = random_problem(3, 20)
    far = np.concatenate([problem.centres, np.full((20, 1, 3), [50.0, 0.0, 0.0])], axis=1)
    larger = replace(problem, centres=far, distances=np.append(problem.distances, 1.0))
    solution, more = (RelaxedRoute().solve(p) for p in (problem, larger))
    assert more.route_bound == pytest.approx(solution.route_bound, rel=1e-6)
    assert more.accept_first == solution.accept_first


def test_no_obstacle_at_all() -> None:
    solution = RelaxedRoute().solve(random_problem(1, points=0))
    assert solution.status == "optimal"
    assert np.isfinite(solution.clearance)


@pytest.mark.parametrize("field", ["accept", "refuse", "reference", "initial", "centres"])
def test_numbers_that_are_not_finite_are_refused(field: str) -> None:
    problem = random_problem(0)
    broken = getattr(problem, field).copy()
    broken.flat[1] = np.nan
    solution = RelaxedRoute().solve(replace(problem, **{field: broken}))
    assert not solution.accept_first
    assert solution.status == "refused_not_finite"


@pytest.mark.parametrize("ended", ["solver_failed", "budget_spent"])
def test_without_an_optimum_the_better_constant_plan_decides(ended: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = random_problem(0)
    with monkeypatch.context() as patch:
        patch.setattr(relaxed, "minimise", lambda *_, **__: Found(None, ended))
        solution = check_contract(RelaxedRoute(), problem)
    assert solution.status == ended
    assert solution.objective == ConstantPlans.of(problem).better.objective
    assert solution.rounded is None
    assert RelaxedRoute().solve(problem).status == "optimal"


def test_the_detour_of_case_a_is_accepted() -> None:
    scene, law, proposal, horizon = case_a_proposal()
    for on_top in (True, False):
        solution = RelaxedRoute().solve(
            predicted_problem(scene, replace(law, intervention_on_top=on_top), proposal, horizon)
        )
        assert solution.accept_first
        assert solution.objective_accept < 0.85 * solution.objective_refuse  # to wait one block and then accept
