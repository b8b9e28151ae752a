"""The convexified problem with binaries, by branch and bound: Drake's own, or a licensed solver's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from pydrake.solvers import (
    ClarabelSolver,
    GurobiSolver,
    MathematicalProgram,
    MixedIntegerBranchAndBound,
    MosekSolver,
    SolutionResult,
)

from airground_drake.gatekeeper.candidates import Constants, block_of_stage, choose
from airground_drake.gatekeeper.half_planes import normals_along, reachable
from airground_drake.gatekeeper.problem import Decision, Problem
from airground_drake.nsbc.task import Array

_SCALE = 10.0
"""Cost of the cheaper constant plan in the program: Drake's absolute tolerance is then 0.1 % of it.

At 1000 Clarabel fails twice as often."""

_GAP = 0.01 + 1e-5
"""Drake's branch and bound stops at this gap, relative or absolute; both are fixed there. And Clarabel's own."""


class BranchAndBoundRoute:
    """Mixed-integer quadratic program with the half-planes of `RelaxedRoute`, no rounding.

    With Gurobi or Mosek licensed for Drake, one binary per stage (their default gap 1e-4; not tested here,
    for want of a licence). Else `MixedIntegerBranchAndBound` with one binary per block of N / `blocks` stages
    and Clarabel for the relaxations. Drake's bound is not exposed in Python, but it stops within 1 % of the
    optimum, or 0.1 % of the cheaper constant plan's cost: `lower_bound` is the optimum found less that, for
    the same half-planes and dwell. Its "binaries" are binary to a tolerance only, so that the plan is rounded
    and evaluated exactly, and the cheapest of it and the constant plans is returned.

    Anything but a proven optimum refuses. Of roll-outs among random discs 4 to 7 % end so, because Clarabel
    reports insufficient progress in a node; Drake hands no options on to it. At worst 2^(blocks + 1)
    relaxations are solved.
    """

    def __init__(self, blocks: int = 10) -> None:
        """Look for a licensed solver.

        Raises:
            ValueError: if `blocks` is not from 1 to 20.
        """
        if not 1 <= blocks <= 20:
            raise ValueError(f"blocks: {blocks}, allowed: 1 to 20")
        self._blocks = blocks
        self._licensed = licensed_solver()

    def decide(self, problem: Problem) -> Decision:
        """Accept or refuse: never raises for a hard or broken problem, but refuses and says why."""
        if not problem.is_finite():
            return Decision(False, "refused_not_finite")
        constants = Constants.of(problem)
        if not constants.are_finite():
            return Decision(False, "refused_not_finite")
        normals = normals_along(problem, constants.better.positions)
        blocks = self._blocks if self._licensed is None else problem.stages
        block = block_of_stage(problem.stages, blocks)
        scale = max(problem.evaluate_half_planes(constants.better.positions, normals), 1e-9) / _SCALE
        try:
            integer = integer_program(problem, normals, block, scale)
            values, bound = _branch(integer) if self._licensed is None else _delegate(self._licensed, integer)
        except (RuntimeError, ValueError):  # Drake: "Unknown result", or a failing sub-solver
            return constants.failed()
        if values is None or not np.isfinite(values).all() or not np.isfinite(bound):
            return constants.failed()
        plan = problem.evaluate((values[block] > 0.5).astype(float))
        return choose(
            problem, (plan, constants.accept, constants.refuse), lower_bound=max(0.0, scale * bound), normals=normals
        )


def licensed_solver() -> Any:
    """Gurobi or Mosek if Drake has it and a licence is there, else None."""
    for solver in (GurobiSolver(), MosekSolver()):
        if solver.available() and solver.enabled():
            return solver
    return None


@dataclass(frozen=True, eq=False)
class IntegerProgram:
    """The program and its binaries, one per block."""

    program: MathematicalProgram
    binaries: Any


def integer_program(problem: Problem, normals: Array, block: npt.NDArray[np.int64], scale: float) -> IntegerProgram:
    """Condensed: positions are affine in the binaries z, p = start + M z, so that only z and u are variables.

    Args:
        problem: data of (26).
        normals: of the half-planes, (N, m, 3).
        block: of each stage, (N,).
        scale: cost (25) that is 1 in the program.
    """
    stages, count = problem.stages, int(block[-1]) + 1
    member = np.zeros((stages, count))
    member[np.arange(stages), block] = 1.0
    change = (problem.accept - problem.refuse)[:, :, None] * member[:, None, :]
    sensitivity = problem.dt * np.cumsum(change, axis=0)  # M, (N, 3, B)
    error = problem.positions(np.zeros(stages)) - problem.reference
    program = MathematicalProgram()
    z = program.NewBinaryVariables(count, "z")
    weight = 2.0 * problem.dt / scale
    flat = sensitivity.reshape(-1, count)
    program.AddQuadraticCost(
        weight * problem.error_weight * flat.T @ flat,
        weight * problem.error_weight * flat.T @ error.ravel(),
        0.5 * weight * problem.error_weight * float(np.sum(error**2)),
        z,
        is_convex=True,
    ).evaluator().set_description("(25) task error")
    stage, point = np.nonzero(reachable(problem))
    if len(stage):
        used, row = np.unique(stage, return_inverse=True)
        u = program.NewContinuousVariables(len(used), "u")
        hessian = weight * problem.slack_weight * np.eye(len(used))
        program.AddQuadraticCost(hessian, np.zeros(len(used)), u, is_convex=True).evaluator().set_description(
            "(25) slack"
        )
        program.AddBoundingBoxConstraint(0.0, np.inf, u).evaluator().set_description("(26e)")
        normal = normals[stage, point]
        slope = np.einsum("ri,rib->rb", normal, sensitivity[stage])
        away = problem.reference[stage] + error[stage] - problem.centres[stage, point]
        lower = problem.distances[point] - np.einsum("ri,ri->r", normal, away)
        picks = np.zeros((len(stage), len(used)))
        picks[np.arange(len(stage)), row] = 1.0
        program.AddLinearConstraint(
            np.hstack([slope, picks]), lower, np.full(len(lower), np.inf), np.concatenate([z, u])
        ).evaluator().set_description("(26d) as half-planes")
    return IntegerProgram(program, z)


def _branch(integer: IntegerProgram) -> tuple[Array | None, float]:
    """Binaries (B,) and a lower bound by Drake's branch and bound; None without a proven optimum."""
    search = MixedIntegerBranchAndBound(integer.program, ClarabelSolver.id())
    if search.Solve() != SolutionResult.kSolutionFound:
        return None, -1.0
    optimum = float(search.GetOptimalCost())
    return np.asarray(search.GetSolution(integer.binaries), dtype=float), optimum - _GAP * max(1.0, abs(optimum))


def _delegate(solver: Any, integer: IntegerProgram) -> tuple[Array | None, float]:
    """The same by a solver of mixed-integer programs, at its default relative gap of 1e-4."""
    result = solver.Solve(integer.program)
    if not result.is_success():
        return None, -1.0
    optimum = float(result.get_optimal_cost())
    return np.asarray(result.GetSolution(integer.binaries), dtype=float), optimum - 1e-4 * abs(optimum)
