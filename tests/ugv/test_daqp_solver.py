"""DAQP as a solver of Drake: programs with known answers, random ones, and what it refuses."""

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from pydrake.solvers import (
    ClarabelSolver,
    MathematicalProgram,
    MathematicalProgramResult,
    OsqpSolver,
    SolutionResult,
    SolverInterface,
    SolverOptions,
)

from airground_drake.ugv.daqp_solver import DaqpResult, DaqpSolver

SOLVER = DaqpSolver()
FOUND, INFEASIBLE, UNBOUNDED, LIMIT = (
    SolutionResult.kSolutionFound, SolutionResult.kInfeasibleConstraints, SolutionResult.kUnbounded,
    SolutionResult.kIterationLimit,
)  # fmt: skip

Made = tuple[MathematicalProgram, Any]
"""A program and its variables."""


def solved(made: MathematicalProgram, *given: Any) -> MathematicalProgramResult:
    """Its result; a guess and options may be given."""
    result = SOLVER.Solve(made, *given)
    assert result is not None
    return result


def program(count: int, binaries: int = 0) -> Made:
    made = MathematicalProgram()
    parts = [made.NewBinaryVariables(binaries, "b")] if binaries else []
    parts += [made.NewContinuousVariables(count - binaries, "x")] if count > binaries else []
    return made, np.concatenate(parts) if parts else np.zeros(0, dtype=object)


def linear() -> Made:
    made, x = program(2)
    made.AddLinearCost([-1.0, -1.0], 5.0, x)
    made.AddLinearConstraint([[1.0, 2.0]], [-np.inf], [1.5], x)
    made.AddBoundingBoxConstraint(0.0, 1.0, x)
    return made, x


def repeated() -> Made:
    """(x + y)^2 + (x - 2)^2 as costs in which a variable occurs twice and several on the same; x + y = 1, twice."""
    made, x = program(2)
    made.AddQuadraticCost(2.0 * np.eye(2), [0.0, -4.0], 4.0, [x[0], x[0]], is_convex=True)
    made.AddQuadraticCost(np.array([[0.0, 2.0], [2.0, 2.0]]), [0.0, 0.0], x, is_convex=True)
    for factor in (1.0, 2.0):
        made.AddLinearEqualityConstraint([[factor, factor]], [factor], x)
    return made, x


def slack() -> Made:
    """Slack that stands in one row, slack that two rows share, and a row that can always be met."""
    made, x = program(4)
    made.AddQuadraticCost(np.diag([2.0, 4.0, 6.0, 1.0]), np.zeros(4), x, is_convex=True)
    made.AddLinearConstraint([[1.0, 2.0, 0.0, 0.0]], [3.0], [np.inf], x)
    made.AddLinearConstraint([[1.0, 0.0, -1.0, 0.0], [-1.0, 0.0, -1.0, 0.0]], [-np.inf] * 2, [-1.0, 2.0], x)
    made.AddBoundingBoxConstraint(0.0, np.inf, x[1:])
    return made, x


def knapsack() -> Made:
    made, x = program(4, 4)
    made.AddLinearCost([-5.0, -4.0, -3.0, -6.0], 0.0, x)
    made.AddLinearConstraint([[2.0, 3.0, 1.0, 4.0]], [-np.inf], [6.5], x)
    return made, x


def nearest_corner() -> Made:
    made, x = program(3, 2)
    made.AddQuadraticErrorCost(np.eye(3), [0.4, 0.7, 0.2], x)
    made.AddLinearEqualityConstraint([[1.0, 1.0, 1.0]], [1.0], x)
    return made, x


def idle() -> Made:
    """A binary variable that occurs nowhere, one that is fixed, and one of two that are alike."""
    made, x = program(4, 4)
    made.AddQuadraticErrorCost(np.eye(1), [0.3], x[1:2])
    made.AddQuadraticCost(np.ones((2, 2)), [-1.0, -1.0], x[2:], is_convex=True)
    made.AddBoundingBoxConstraint(0.5, 2.0, x[1:2])
    return made, x


def rows_without_variables() -> Made:
    made, x = program(2)
    made.AddQuadraticErrorCost(np.eye(2), [1.0, 2.0], x)
    made.AddLinearConstraint([[0.0, 0.0]], [-1.0], [1.0], x)
    made.AddLinearConstraint([[1.0, 0.0]], [-np.inf], [np.inf], x)
    return made, x


@pytest.mark.parametrize(
    ("make", "cost", "solution"),
    [
        (linear, 3.75, [1.0, 0.25]), (repeated, 1.0, [2.0, -1.0]),
        (slack, 7.0, [-1 / 3, 5 / 3, 2 / 3, 0.0]),
        (knapsack, -12.0, [1.0, 1.0, 1.0, 0.0]), (nearest_corner, 0.29, [0.0, 1.0, 0.0]),
        (idle, 0.49 - 0.5, None), (rows_without_variables, 0.0, [1.0, 2.0]), (lambda: program(0), 0.0, []),
    ],
)  # fmt: skip
def test_known_answers(make: Callable[[], Made], cost: float, solution: list[float] | None) -> None:
    made, x = make()
    result = solved(made)
    assert result.get_solution_result() == FOUND
    assert result.is_success()
    assert result.get_optimal_cost() == pytest.approx(cost, abs=1e-7)
    values = result.get_x_val()
    assert result.get_solver_id().name() == "DAQP"
    if len(x):
        np.testing.assert_array_equal(result.GetSolution(x), values)
        assert result.GetSolution(x[0] + 1.0).Evaluate() == values[0] + 1.0
        assert made.CheckSatisfied(made.GetAllConstraints(), values, 1e-6)
        assert sum(float(made.EvalBinding(each, values)[0]) for each in made.GetAllCosts()) == pytest.approx(cost)
    if solution is not None:
        np.testing.assert_allclose(values, solution, atol=1e-6)


def infeasible(make: Callable[[], Made]) -> Made:
    made, x = make()
    made.AddLinearConstraint(np.ones((1, len(x))), [100.0], [np.inf], x)
    return made, x


def with_bounds_that_cross() -> Made:
    made, x = linear()
    made.AddBoundingBoxConstraint(2.0, 3.0, x)
    return made, x


def between_the_integers() -> Made:
    made, x = knapsack()
    made.AddBoundingBoxConstraint(0.2, 0.8, x[:1])
    return made, x


def asking_nothing_to_be_one() -> Made:
    made, x = rows_without_variables()
    made.AddLinearConstraint([[0.0, 0.0]], [1.0], [1.0], x)
    return made, x


def downhill() -> Made:
    made, x = program(2)
    made.AddQuadraticCost(np.diag([1.0, 0.0]), [0.0, -1.0], x, is_convex=True)
    made.AddLinearConstraint([[1.0, 0.0]], [-1.0], [1.0], x)
    return made, x


def downhill_with_a_choice() -> Made:
    made, x = program(2, 1)
    made.AddLinearCost([1.0, -1.0], 0.0, x)
    return made, x


@pytest.mark.parametrize(
    ("make", "ended", "cost"),
    [
        *((lambda make=make: infeasible(make), INFEASIBLE, np.inf) for make in (linear, knapsack, nearest_corner)),
        (with_bounds_that_cross, INFEASIBLE, np.inf), (between_the_integers, INFEASIBLE, np.inf),
        (asking_nothing_to_be_one, INFEASIBLE, np.inf), (downhill, UNBOUNDED, -np.inf),
        (downhill_with_a_choice, UNBOUNDED, -np.inf),
    ],
)  # fmt: skip
def test_no_solution(make: Callable[[], Made], ended: SolutionResult, cost: float) -> None:
    result = solved(make()[0])
    assert (result.get_solution_result(), result.get_optimal_cost()) == (ended, cost)
    assert not result.is_success()


def hard(count: int = 40) -> Made:
    """So many nodes that a limit comes first."""
    rng = np.random.default_rng(0)
    made, x = program(count, count)
    root = rng.normal(size=(count, count))
    made.AddQuadraticErrorCost(root.T @ root + np.eye(count), np.full(count, 0.5), x)
    return made, x


def options(**values: float) -> SolverOptions:
    made = SolverOptions()
    for name, value in values.items():
        made.SetOption(DaqpSolver.id(), name, value)
    return made


def test_limits() -> None:
    made, x = hard()
    guess = np.ones(len(x))
    stopped = solved(made, guess, options(time_limit=0.01))
    assert stopped.get_solution_result() == LIMIT
    at_guess = float(made.EvalBinding(made.quadratic_costs()[0], guess)[0])
    assert stopped.get_optimal_cost() <= at_guess  # the guess, or better
    assert made.CheckSatisfied(made.GetAllConstraints(), stopped.GetSolution(), 1e-9)
    smaller = infeasible(slack)[0]
    few = solved(smaller, None, options(iter_limit=1))
    assert few.get_solution_result() == LIMIT
    made.SetSolverOption(DaqpSolver.id(), "time_limit", 10.0)  # those of the call count more
    assert solved(made, guess, options(time_limit=0.01)).get_solution_result() == LIMIT


def test_a_guess_cuts_the_search_without_changing_its_end() -> None:
    made, x = hard(14)
    free = solved(made)
    best, guess = free.get_optimal_cost(), free.GetSolution()
    guided = solved(made, guess)
    assert guided.get_optimal_cost() == pytest.approx(best, rel=1e-9)
    assert guided.get_solver_details().nodes < free.get_solver_details().nodes
    made.SetInitialGuess(x, guess)  # the program's own
    assert solved(made).get_solver_details().nodes < free.get_solver_details().nodes
    wrong = solved(made, np.full(14, 0.5))  # no guess, as it is not binary
    assert wrong.get_optimal_cost() == pytest.approx(best, rel=1e-9)


def test_relaxed_binary_variables_have_shares() -> None:
    made, _ = hard(14)
    relaxed = solved(made, None, options(relaxed=1))
    np.testing.assert_allclose(relaxed.GetSolution(), 0.5, atol=1e-9)


def test_it_is_a_solver_interface_with_both_overloads() -> None:
    assert isinstance(SOLVER, SolverInterface)
    assert SOLVER.available()
    assert SOLVER.enabled()
    assert SOLVER.SolverName() == "DAQP"
    for result in (MathematicalProgramResult(), DaqpResult()):
        for make in (linear, knapsack):
            made, x = make()
            assert SOLVER.Solve(made, None, None, result) is None
            assert result.is_success()
            expected = solved(made)
            np.testing.assert_array_equal(result.get_x_val(), expected.get_x_val())
            assert result.get_optimal_cost() == expected.get_optimal_cost()
            if make is linear or isinstance(result, DaqpResult):
                np.testing.assert_array_equal(result.GetSolution(x), expected.get_x_val())


def test_what_it_does_not_solve_it_refuses() -> None:
    made, x = linear()
    assert SOLVER.AreProgramAttributesSatisfied(made)
    assert SOLVER.ExplainUnsatisfiedProgramAttributes(made) == ""
    made.AddQuadraticCost(-np.eye(2), np.zeros(2), x)
    assert SOLVER.ExplainUnsatisfiedProgramAttributes(made).endswith("a quadratic cost is not convex.")
    with pytest.raises(ValueError, match="not convex"):
        SOLVER.Solve(made)
    made, x = linear()
    made.AddLorentzConeConstraint(np.eye(2), np.zeros(2), x)
    assert not SOLVER.AreProgramAttributesSatisfied(made)
    with pytest.raises(ValueError, match="because a LorentzConeConstraint was declared but is not supported"):
        SOLVER.Solve(made)
    with pytest.raises(ValueError, match=r"DAQP: no options MIPGap; allowed: time_limit, iter_limit"):
        SOLVER.Solve(linear()[0], None, options(MIPGap=0.1))
    made, x = linear()
    made.AddLinearCost([np.nan, 0.0], 0.0, x)
    result = solved(made)
    assert result.get_solution_result() == SolutionResult.kInvalidInput


def drawn(rng: np.random.Generator, binaries: int, *, quadratic: bool) -> Made:
    """A random program with a point that satisfies it, as often singular as not, sometimes with slack or unbounded."""
    count = binaries + int(rng.integers(1, 6))
    made, x = program(count, binaries)
    if quadratic:
        root = rng.normal(size=(int(rng.integers(1, count + 1)), count))
        made.AddQuadraticCost(root.T @ root, rng.normal(size=count), float(rng.normal()), x, is_convex=True)
    made.AddLinearCost(rng.normal(size=count), x)
    inside = np.concatenate([rng.integers(0, 2, binaries), rng.normal(size=count - binaries)])
    for kind in rng.integers(0, 4, rng.integers(0, 6)):
        row = rng.normal(size=count) * (rng.random(count) < 0.6)
        at = float(row @ inside)
        low, high = [(at, at), (at - 0.5, np.inf), (-np.inf, at + 0.5), (at - 1.0, at + 1.0)][kind]
        made.AddLinearConstraint(row[None], [low], [high], x)
    if rng.random() < 0.7:
        made.AddBoundingBoxConstraint(inside[binaries:] - 3.0, inside[binaries:] + 2.0, x[binaries:])
    if rng.random() < 0.5:
        u = made.NewContinuousVariables(1, "u")
        made.AddQuadraticCost([[10.0 * rng.random()]], [0.0], u, is_convex=True)
        made.AddBoundingBoxConstraint(0.0, np.inf, u)
        made.AddLinearConstraint(np.append(rng.normal(size=count), 1.0)[None], [1.0], [np.inf], [*x, *u])
    return made, x


def best_of_all(made: MathematicalProgram, binary: Any) -> float:
    """The optimum by Clarabel with every choice of the binary variables; inf: infeasible, -inf: unbounded."""
    best = np.inf
    for values in itertools.product((0.0, 1.0), repeat=len(binary)):
        rest = MathematicalProgram()
        x = rest.NewContinuousVariables(made.num_vars())
        for cost in made.GetAllCosts():
            rest.AddCost(cost.evaluator(), x[made.FindDecisionVariableIndices(cost.variables())])
        for constraint in made.GetAllConstraints():
            rest.AddConstraint(constraint.evaluator(), x[made.FindDecisionVariableIndices(constraint.variables())])
        if len(binary):
            rest.AddBoundingBoxConstraint(values, values, x[made.FindDecisionVariableIndices(binary)])
        result = ClarabelSolver().Solve(rest)
        if result.is_success():
            best = min(best, result.get_optimal_cost())
        elif result.get_solution_result() != INFEASIBLE:
            return -np.inf
    return best


@pytest.mark.parametrize("quadratic", [False, True])
@pytest.mark.parametrize("binaries", [0, 4])
def test_random_programs_have_the_optimum_of_other_solvers(*, binaries: int, quadratic: bool) -> None:
    rng, seen = np.random.default_rng([binaries, quadratic]), set()
    for _ in range(60):
        made, x = drawn(rng, binaries, quadratic=quadratic)
        best = best_of_all(made, x[:binaries])
        result = solved(made)
        expected = FOUND if np.isfinite(best) else UNBOUNDED if best < 0.0 else INFEASIBLE
        assert result.get_solution_result() == expected
        assert result.get_optimal_cost() == pytest.approx(best, rel=1e-6, abs=1e-6)
        seen.add(expected)
    assert {FOUND, UNBOUNDED} <= seen


def test_multipliers_are_those_of_osqp() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        made, x = program(5)
        root = rng.normal(size=(5, 5))
        made.AddQuadraticCost(root.T @ root + np.eye(5), rng.normal(size=5), x, is_convex=True)
        rows = made.AddLinearConstraint(rng.normal(size=(4, 5)), [0.5, -np.inf, -1.0, 0.2], [np.inf, -0.5, 1.0, 0.2], x)
        accurate = SolverOptions()
        for name in ("eps_abs", "eps_rel"):
            accurate.SetOption(OsqpSolver.id(), name, 1e-9)
        result = solved(made)
        theirs = OsqpSolver().Solve(made, None, accurate).GetDualSolution(rows)
        np.testing.assert_allclose(result.get_solver_details().multipliers, theirs, atol=1e-5)
