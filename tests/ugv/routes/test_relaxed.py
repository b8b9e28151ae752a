"""The paper's route, and the nonlinear program of (27)."""

import cvxpy
import numpy as np
import pytest
from builders.problems import INSTANCES, random_problem
from hypothesis import example, given
from hypothesis import strategies as st
from properties import examples
from pydrake.solvers import SnoptSolver
from ugv.contract import check_contract
from ugv.oracles import cost

from airground_drake.ugv.routes import nonlinear
from airground_drake.ugv.routes.relaxed import RelaxedRoute
from airground_drake.ugv.solution import ConstantPlans


@examples(15, fuzz=1500)
@given(st.integers(0, 10**6))
@example(298986)  # the half-plane of a point out of reach would bind
def test_relaxation_agrees_with_an_independent_model(seed: int) -> None:
    """cvxpy builds (27), with half-planes that face the cheaper constant plan for the points in reach."""
    problem, constant = random_problem(seed, 20), np.array([np.ones(20), np.zeros(20)])
    low, high = (
        problem.initial + problem.dt * np.cumsum(least(problem.accept, problem.refuse), axis=0)
        for least in (np.minimum, np.maximum)
    )
    beside = np.clip(problem.centres, low[:, None], high[:, None]) - problem.centres
    near = np.linalg.norm(beside, axis=2) < problem.distances
    away = problem.positions(constant[cost(problem, constant).argmin()])[:, None] - problem.centres
    normals = away / np.linalg.norm(away, axis=2, keepdims=True)
    omega, u = cvxpy.Variable((20, 1)), cvxpy.Variable(20)
    velocity = problem.refuse + cvxpy.multiply(omega, problem.accept - problem.refuse)
    p = problem.initial[None] + problem.dt * cvxpy.cumsum(velocity, axis=0)
    constraints = [omega >= 0, omega <= 1, u >= 0]
    for m in range(2):
        reach = cvxpy.sum(cvxpy.multiply(normals[:, m], p - problem.centres[:, m]), axis=1)
        if near[:, m].any():
            constraints.append(reach[near[:, m]] >= problem.distances[m] - u[near[:, m]])
    error = problem.dt * (cvxpy.sum_squares(problem.reference - p) + 200.0 * cvxpy.sum_squares(u))
    error += problem.terminal_weight * cvxpy.sum_squares(problem.reference[-1] - p[-1])
    best = cvxpy.Problem(cvxpy.Minimize(error), constraints).solve(solver="CLARABEL")
    solution = check_contract(RelaxedRoute(), problem)
    assert solution.status == "optimal"
    assert solution.route_bound == pytest.approx(best, rel=1e-5, abs=1e-6)
    assert solution.rounded is not None
    other = np.append(1.0 - solution.rounded[0], solution.rounded[1:])
    assert solution.objective <= cost(problem, np.stack([solution.rounded, other])).min() * (1.0 + 1e-12) + 1e-15


@pytest.mark.parametrize("instance", ["random 24x2", "a point at the robot", "rolled out 0", "deep inside a large disc",
                                      "rolled out, a terminal cost"])  # fmt: skip
def test_the_nonlinear_program_is_27(instance: str) -> None:
    """The guess is feasible and, like the optimum, costs what (25) says with the exact slack."""
    problem = INSTANCES[instance]
    for start in ConstantPlans.of(problem).both:
        program, variables, guess = nonlinear.relaxation(problem, start)
        assert program.CheckSatisfied(program.GetAllConstraints(), guess, 1e-7)
        total = sum(float(program.EvalBinding(binding, guess)[0]) for binding in program.GetAllCosts())
        assert total == pytest.approx(start.objective, rel=1e-9)
        result = SnoptSolver().Solve(program, guess, None)
        assert result.is_success()
        omega = np.clip(result.GetSolution(variables), 0.0, 1.0)
        assert result.get_optimal_cost() == pytest.approx(float(cost(problem, omega)), rel=1e-3)
        assert result.get_optimal_cost() <= start.objective * (1.0 + 1e-6)
