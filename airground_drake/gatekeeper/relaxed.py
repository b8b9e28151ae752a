"""The paper's route: relaxation (27) as a convex quadratic program, then sum-up rounding (28)-(29)."""

from __future__ import annotations

import numpy as np
from pydrake.solvers import Binding, ClarabelSolver, MathematicalProgram, QuadraticCost, SolverOptions

from airground_drake.gatekeeper.candidates import Constants, choose
from airground_drake.gatekeeper.half_planes import normals_along, offsets, reachable
from airground_drake.gatekeeper.problem import Decision, Problem
from airground_drake.gatekeeper.rounding import rounding_deviation, sum_up_rounding
from airground_drake.nsbc.task import Array

_AXES = 2  # UGVs move in their plane

_OPTIONS = {"tol_gap_abs": 1e-6, "tol_gap_rel": 1e-6, "tol_feas": 1e-6, "iterative_refinement_enable": 0}
"""Of Clarabel: optima to 1e-6 in two thirds of the time that its defaults take."""


class RelaxedRoute:
    """Relax, solve, round; every decision carries its optimality gap.

    The obstacle constraint (26d) is replaced by supporting half-planes n_k.(p_k - o) >= d - u_k with unit n_k.
    As ||p_k - o|| >= n_k.(p_k - o), they imply (26d) for any n_k: conservative, never optimistic. The n_k are
    taken along the better of the two constant plans. The plan returned is the cheapest, by the exact cost
    (25), of the rounded one and the two constant ones.

    The program is built once for a number of stages, points and the weights, then only its coefficients change.
    Rows that no plan can reach are left unbounded, which the solver's interface drops.
    """

    def __init__(self) -> None:
        """Start without any program."""
        self._programs: dict[tuple[int, int, float, float, float], _Program] = {}
        self._solver = ClarabelSolver()
        self._options = SolverOptions()
        for name, value in _OPTIONS.items():
            self._options.SetOption(ClarabelSolver.id(), name, value)

    def decide(self, problem: Problem) -> Decision:
        """Accept or refuse: never raises for a hard or broken problem, but refuses and says why."""
        if not problem.is_finite():
            return Decision(False, "refused_not_finite")
        constants = Constants.of(problem)
        normals = normals_along(problem, constants.better.positions)
        relaxed, bound = self._solve(problem, normals)
        if relaxed is None:
            return constants.failed()
        rounded = sum_up_rounding(relaxed)
        return choose(
            problem,
            (problem.evaluate(rounded), constants.accept, constants.refuse),
            lower_bound=bound,
            normals=normals,
            relaxed_first_stage=float(relaxed[0]),
            deviation=rounding_deviation(relaxed, rounded, problem.dt),
        )

    def _solve(self, problem: Problem, normals: Array) -> tuple[Array | None, float]:
        key = (problem.stages, len(problem.distances), problem.dt, problem.error_weight, problem.slack_weight)
        if key not in self._programs:
            self._programs[key] = _Program(*key)
        program = self._programs[key]
        program.update(problem, normals)
        result = self._solver.Solve(program.program, None, self._options)
        omega = result.GetSolution(program.omega)
        cost = result.get_optimal_cost()
        if not result.is_success() or not np.isfinite(omega).all() or not np.isfinite(cost):
            del self._programs[key]  # a fresh workspace after a failure
            return None, -1.0
        return np.clip(omega, 0.0, 1.0), float(cost)


class _Program:
    """MathematicalProgram of the relaxation; coefficients change, not shape.

    Variables: task errors e = p - reference (2N), omega (N), u (N). Written in the errors, the cost (25) is
    constant.
    """

    def __init__(self, stages: int, points: int, dt: float, error_weight: float, slack_weight: float) -> None:
        size = _AXES * stages
        self.program = MathematicalProgram()
        e = self.program.NewContinuousVariables(size, "e")
        self.omega = self.program.NewContinuousVariables(stages, "omega")
        u = self.program.NewContinuousVariables(stages, "u")
        self._dynamics_matrix = np.hstack([np.eye(size) - np.eye(size, k=-_AXES), np.zeros((size, stages))])
        self._avoidance_matrix = np.zeros((stages * points, size + stages))
        self._row = np.arange(stages * points).reshape(stages, points)
        self._stage = np.arange(stages)
        self._avoidance_matrix[self._row, size + self._stage[:, None]] = 1.0
        self._unbounded = np.full(stages * points, np.inf)

        def square(weight: float, variables: Array) -> Binding[QuadraticCost]:
            hessian = 2.0 * weight * dt * np.eye(len(variables))
            return self.program.AddQuadraticCost(hessian, np.zeros(len(variables)), variables, is_convex=True)

        self._dynamics = self.program.AddLinearEqualityConstraint(
            self._dynamics_matrix, np.zeros(size), np.concatenate([e, self.omega])
        )
        names = {
            "(25) task error": square(error_weight, e),
            "(25) slack": square(slack_weight, u),
            "(27c) relaxed": self.program.AddBoundingBoxConstraint(0.0, 1.0, self.omega),
            "(27e)": self.program.AddBoundingBoxConstraint(0.0, np.inf, u),
            "(23), (27b)": self._dynamics,
        }
        if points:
            self._avoidance = self.program.AddLinearConstraint(
                self._avoidance_matrix, -self._unbounded, self._unbounded, np.concatenate([e, u])
            )
            names["(27d) as half-planes"] = self._avoidance
        for name, binding in names.items():
            binding.evaluator().set_description(name)

    def update(self, problem: Problem, normals: Array) -> None:
        """Put in the data of a problem of this size."""
        size = _AXES * problem.stages
        before = np.vstack([problem.initial, problem.reference[:-1]])
        drift = problem.dt * problem.refuse + before - problem.reference
        for axis in range(_AXES):
            change = problem.dt * (problem.accept - problem.refuse)[:, axis]
            self._dynamics_matrix[_AXES * self._stage + axis, size + self._stage] = -change
            self._avoidance_matrix[self._row, _AXES * self._stage[:, None] + axis] = normals[:, :, axis]
        self._dynamics.evaluator().UpdateCoefficients(self._dynamics_matrix, drift[:, :_AXES].ravel())
        if self._row.size:
            lower = np.where(reachable(problem), offsets(problem, normals), -np.inf).ravel()
            self._avoidance.evaluator().UpdateCoefficients(self._avoidance_matrix, lower, self._unbounded)
