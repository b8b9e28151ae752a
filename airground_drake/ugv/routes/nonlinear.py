"""The paper's route literally: (27) by multiple shooting, solved as a nonlinear program, then (28)-(29)."""

import math
from typing import Any

import numpy as np
from pydrake.solvers import MathematicalProgram, QuadraticConstraint, SnoptSolver, SolutionResult, SolverOptions

from airground_drake.base.arrays import Array
from airground_drake.ugv.binary_program import AXES
from airground_drake.ugv.budget import Budget
from airground_drake.ugv.problem import Evaluation, Problem
from airground_drake.ugv.relaxation import sum_up_rounding, unavoidable_cost, within_reach
from airground_drake.ugv.routes.guard import Guarded, without_optimum
from airground_drake.ugv.solution import ConstantPlans, Solution, Status, cheapest, cut_short

_OPTIONS = {"Major optimality tolerance": 1e-5, "Major feasibility tolerance": 1e-6}  # of SNOPT
# Its options that are this multiple of the budget's iterations.
_LIMITS = {"Major iterations limit": 1, "Iterations limit": 100}


class NonlinearRoute(Guarded):
    """Relax, solve to a local optimum by sequential quadratic programming, round.

    Positions are variables, and the dynamics (23) are constraints between the stages.

    (26d), ||p - o|| >= d - u, is not ||p - o||^2 >= (d - u)^2: squared, a slack u > d would push the robot
    away again, and u > d is needed where the points of a stage have different d. So each pair of stage and
    point gets a radius r >= 0:

        r >= d - u,    ||p - o||^2 >= r^2.

    Such an r exists exactly if ||p - o|| >= max(0, d - u), which is (26d); all functions are smooth, also at
    p = o. Only pairs that some plan can bring within d are in the program.

    The search starts at the cheaper constant plan; the paper does not say where. (27) takes the velocities of (23) from
    the problem, where they do not depend on the plan (`problem.predicted_problem`). The audit computes what these two
    choices decide (finding 25).

    The plan returned is the cheapest, by the exact cost (25), of the rounded one and the two constant ones. A local
    optimum bounds nothing: `route_bound` and `gap` are -1.

    Budget: major iterations and the time left go to the solver. If it stops early, its iterate is rounded like an
    optimum; the status is then 'budget_spent' and the bound `unavoidable_cost`.
    """

    def __init__(self) -> None:
        """Take SNOPT, which comes with Drake and needs no licence."""
        self._solver = SnoptSolver()

    def _solve(self, problem: Problem, constants: ConstantPlans, budget: Budget) -> Solution:
        relaxed, status = self.relax(problem, constants.better, budget)
        if relaxed is None:
            return without_optimum(problem, constants, budget)
        rounded = sum_up_rounding(relaxed)
        plans = (problem.evaluate(rounded), *constants.both)
        if status != "optimal":
            return cut_short(problem, plans, unavoidable_cost(problem), status, relaxed=relaxed, rounded=rounded)
        return cheapest(problem, plans, relaxed=relaxed, rounded=rounded)

    def relax(self, problem: Problem, start: Evaluation, budget: Budget) -> tuple[Array | None, Status]:
        """A local optimum of (27): omega (N,), None if that is not a number; how the solver ended."""
        # Which local optimum it is depends on the plan from which the search starts.
        program, omega, guess = relaxation(problem, start)
        try:
            result = self._solver.Solve(program, guess, _options(budget))
        except RuntimeError:
            return None, "solver_failed"
        relaxed = np.clip(result.GetSolution(omega), 0.0, 1.0)
        stopped = budget.spent() or result.get_solution_result() == SolutionResult.kIterationLimit
        ended: Status = "optimal" if result.is_success() else "budget_spent" if stopped else "solver_failed"
        return relaxed if np.isfinite(relaxed).all() else None, ended


def _options(budget: Budget) -> SolverOptions:
    options = SolverOptions()
    values: dict[str, float | int] = {name: factor * budget.iterations for name, factor in _LIMITS.items()}
    if budget.left_s() < math.inf:
        values["Time limit"] = max(budget.left_s(), 1e-3)
    for name, value in {**_OPTIONS, **values}.items():
        options.SetOption(SnoptSolver.id(), name, value)
    return options


def relaxation(problem: Problem, start: Evaluation) -> tuple[MathematicalProgram, Any, Array]:
    """Multiple shooting in the task errors e = p - reference, (2N,), omega (N,), u (N,) and one r per pair."""
    # `start` is the plan whose states are the initial guess. Returns the program, its variables omega (N,), and an
    # initial guess for all of its variables.
    stages, dt = problem.stages, problem.dt
    size = AXES * stages
    stage, point = np.nonzero(within_reach(problem))
    program = MathematicalProgram()
    e = program.NewContinuousVariables(size, "e")
    omega = program.NewContinuousVariables(stages, "omega")
    u = program.NewContinuousVariables(stages, "u")
    r = program.NewContinuousVariables(len(stage), "r")

    of_error, of_slack = problem.terms.error_weights.repeat(AXES), np.full(stages, problem.slack_weight)
    for weights, variables in ((of_error, e), (of_slack, u)):  # (25)
        hessian = np.diag(2.0 * weights * dt)
        program.AddQuadraticCost(hessian, np.zeros(len(variables)), variables, is_convex=True)
    program.AddBoundingBoxConstraint(0.0, 1.0, omega)  # (27c)
    program.AddBoundingBoxConstraint(0.0, np.inf, u)  # (27e)

    before = np.vstack([problem.initial, problem.reference[:-1]])
    drift = (dt * problem.refuse + before - problem.reference)[:, :AXES]
    change = np.zeros((size, stages))
    for axis in range(AXES):
        change[AXES * np.arange(stages) + axis, np.arange(stages)] = dt * (problem.accept - problem.refuse)[:, axis]
    dynamics = np.hstack([np.eye(size) - np.eye(size, k=-AXES), -change])
    program.AddLinearEqualityConstraint(dynamics, drift.ravel(), np.concatenate([e, omega]))  # (23), (27b)

    distance = problem.distances[point]
    offset = start.positions[stage] - problem.centres[stage, point]
    if len(stage):
        program.AddBoundingBoxConstraint(0.0, np.inf, r)
        picks = np.zeros((len(stage), stages))
        picks[np.arange(len(stage)), stage] = 1.0
        program.AddLinearConstraint(
            np.hstack([np.eye(len(stage)), picks]), distance, np.full(len(stage), np.inf), np.concatenate([r, u])
        )
    away = problem.reference[stage] - problem.centres[stage, point]
    away[:, 2] = offset[:, 2]  # the height does not change
    hessian = np.diag([2.0, 2.0, -2.0])
    for i, k in enumerate(stage.tolist()):
        # (27d): ||e + away||^2 >= r^2
        program.AddQuadraticConstraint(
            hessian, np.array([2.0 * away[i, 0], 2.0 * away[i, 1], 0.0]), -float(away[i] @ away[i]), np.inf,
            np.array([e[AXES * k], e[AXES * k + 1], r[i]]), QuadraticConstraint.HessianType.kIndefinite,
        )  # fmt: skip

    lacking = np.maximum(0.0, distance - np.linalg.norm(offset, axis=1))
    slack = np.zeros(stages)
    np.maximum.at(slack, stage, lacking)
    errors = (start.positions - problem.reference)[:, :AXES].ravel()
    guess = np.concatenate([errors, start.omega, slack, np.maximum(0.0, distance - slack[stage])])
    return program, omega, guess
