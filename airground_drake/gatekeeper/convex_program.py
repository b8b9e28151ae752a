"""The relaxation (27) for a team of UGVs, with half-planes for (26d), as one `MathematicalProgram`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit
from pydrake.solvers import MathematicalProgram
from scipy.sparse import csc_matrix

from airground_drake.base.arrays import Array
from airground_drake.gatekeeper.cost import error_weights
from airground_drake.gatekeeper.half_planes import offsets
from airground_drake.gatekeeper.problem import Problem
from airground_drake.gatekeeper.reachable_box import within_reach

AXES = 2  # UGVs move in their plane


@dataclass(frozen=True)
class Shape:
    """What the program of one UGV is built for; everything else are coefficients, see `UgvProgram.update`.

    Attributes:
        stages: N.
        dt: length of a stage, s.
        error_weight: a of (25), in the program's unit of cost.
        slack_weight: b of (25), in the program's unit of cost.
        terminal_weight: of the terminal cost, s.
    """

    stages: int
    dt: float
    error_weight: float
    slack_weight: float
    terminal_weight: float

    @classmethod
    def of(cls, problem: Problem, *, scale: float = 1.0) -> Shape:
        """Of a problem; `scale` is the cost that counts as 1."""
        weights = problem.error_weight / scale, problem.slack_weight / scale, problem.terminal_weight
        return cls(problem.stages, problem.dt, *weights)


class UgvProgram:
    """The variables, costs and constraints of one UGV within a program.

    Variables: start (2,), the state (26b); task errors e = p - reference at the ends of the stages (2N,), in
    which the cost (25) is constant; omega (N,), the share of accepting, so that (24) is 1 - omega for the other
    mode; u (N,), the slack.

    Attributes:
        omega: Drake variables, (N,).
    """

    def __init__(self, program: MathematicalProgram, shape: Shape, name: str) -> None:
        """Add them to `program`; `name` of the UGV ends every description."""
        n, size = shape.stages, AXES * shape.stages
        self._dt = shape.dt
        start = program.NewContinuousVariables(AXES, f"start_{name}")
        e = program.NewContinuousVariables(size, f"e_{name}")
        self.omega: Any = program.NewContinuousVariables(n, f"omega_{name}")
        u = program.NewContinuousVariables(n, f"u_{name}")
        # rows 2k + axis of (23); the columns of omega come last, in the order of the stages
        before = np.hstack([-np.eye(size, AXES), np.eye(size) - np.eye(size, k=-AXES)])
        steps = np.arange(n + 1) * AXES
        fixed = csc_matrix(before)
        self._indices = np.concatenate([fixed.indices, np.arange(size)])
        self._indptr = np.concatenate([fixed.indptr, fixed.indptr[-1] + steps[1:]])
        self._data = np.concatenate([fixed.data, np.zeros(size)])
        self._width = AXES + size + n
        self._initial = program.AddLinearEqualityConstraint(np.eye(AXES), np.zeros(AXES), start)
        self._dynamics = program.AddLinearEqualityConstraint(
            np.zeros((size, self._width)), np.zeros(size), np.concatenate([start, e, self.omega])
        )
        self.avoidance = program.AddLinearConstraint(
            np.zeros((1, size + n)), np.full(1, -np.inf), np.full(1, np.inf), np.concatenate([e, u])
        )
        constraints = {
            "(27b) initial state": self._initial,
            "(23) dynamics": self._dynamics,
            "(27c) relaxed share of accepting": program.AddBoundingBoxConstraint(0.0, 1.0, self.omega),
            "(27d) as half-planes": self.avoidance,
            "(27e) slack": program.AddBoundingBoxConstraint(0.0, np.inf, u),
        }
        of_error = error_weights(n, shape.dt, shape.error_weight, shape.terminal_weight).repeat(AXES)
        of_slack = np.full(n, shape.slack_weight)
        for what, weights, variables in (("task error", of_error, e), ("slack", of_slack, u)):
            hessian = np.diag(2.0 * weights * shape.dt)
            constraints[f"(25) {what}"] = program.AddQuadraticCost(
                hessian, np.zeros(len(variables)), variables, is_convex=True
            )
        for description, binding in constraints.items():
            binding.evaluator().set_description(f"{description}, {name}")

    def update(self, problem: Problem, normals: Array) -> npt.NDArray[np.bool_]:
        """Put in the data of a problem of this shape; returns which half-planes have a row, (N, m).

        Half-planes that no plan can reach have none. Rows are in the order of the stages, then the points.
        """
        n, size = problem.stages, AXES * problem.stages
        self._initial.evaluator().UpdateCoefficients(np.eye(AXES), problem.initial[:AXES])
        self._data[-size:] = (self._dt * (problem.refuse - problem.accept))[:, :AXES].ravel()
        drift = self._dt * problem.refuse - problem.reference
        drift[1:] += problem.reference[:-1]
        matrix = csc_matrix((self._data, self._indices, self._indptr), shape=(size, self._width))
        self._dynamics.evaluator().UpdateCoefficients(matrix, drift[:, :AXES].ravel())
        within = within_reach(problem)
        data, indices, indptr = _rows(within, normals)
        lower = offsets(problem, normals)[within]
        if len(lower) == 0:
            self.avoidance.evaluator().UpdateCoefficients(
                np.zeros((1, size + n)), np.full(1, -np.inf), np.full(1, np.inf)
            )
        else:
            matrix = csc_matrix((data, indices, indptr), shape=(len(lower), size + n))
            self.avoidance.evaluator().UpdateCoefficients(matrix, lower, np.full(len(lower), np.inf))
        return within


@njit(cache=True)
def _rows(within: npt.NDArray[np.bool_], normals: Array) -> tuple[Array, npt.NDArray[np.int32], npt.NDArray[np.int32]]:
    """Columns of n.e + u >= ... for the pairs in `within`: values, rows and column starts over (e, u)."""
    stages, points = within.shape
    rows = np.sum(within)
    data, indices = np.ones(3 * rows), np.empty(3 * rows, dtype=np.int32)
    indptr = np.zeros(3 * stages + 1, dtype=np.int32)
    at, row = 0, 0
    for k in range(stages):
        for a in range(AXES):
            r = row
            for m in range(points):
                if within[k, m]:
                    data[at], indices[at] = normals[k, m, a], r
                    at, r = at + 1, r + 1
            indptr[AXES * k + a + 1] = at
        for m in range(points):
            row += within[k, m]
    row = 0
    for k in range(stages):
        for m in range(points):
            if within[k, m]:
                indices[at] = row
                at, row = at + 1, row + 1
        indptr[AXES * stages + k + 1] = at
    return data, indices, indptr


@dataclass(frozen=True, eq=False)
class TeamProgram:
    """The program and, per UGV, its part of it."""

    program: MathematicalProgram
    ugvs: tuple[UgvProgram, ...]


def empty_program(shapes: Sequence[Shape]) -> TeamProgram:
    """(27) of UGVs of these shapes, still without any problem's data."""
    program = MathematicalProgram()
    return TeamProgram(
        program,
        tuple(UgvProgram(program, shape, f"UGV {i + 1}") for i, shape in enumerate(shapes)),
    )


def team_program(
    problems: Sequence[Problem],
    normals: Sequence[Array],
    *,
    scale: float = 1.0,
) -> TeamProgram:
    """(27) of a team, every constraint named.

    The predicted motion of the others is data in each UGV's problem, so that the program separates: its optimum
    is the sum of the UGVs' optima. (27d) stands as n.(p - o) >= d - u, which implies it for unit n.

    Args:
        problems: one per UGV.
        normals: of each UGV's half-planes, (N, m, 3).
        scale: cost (25) that is 1 in the program.
    """
    team = empty_program([Shape.of(p, scale=scale) for p in problems])
    for ugv, problem, n in zip(team.ugvs, problems, normals, strict=True):
        ugv.update(problem, n)
    return team
