"""(26) of one UGV as a mixed-integer quadratic program, positions eliminated; with shares of accepting it is (27)."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt
from pydrake.solvers import MathematicalProgram

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit
from airground_drake.ugv.daqp_solver import Form
from airground_drake.ugv.problem import Evaluation, Problem
from airground_drake.ugv.relaxation import offsets, within_reach

AXES = 2  # UGVs move in their plane
_IDLE = 1e-7  # a block whose choice moves the later positions by less than this share of the largest move is idle


def block_of_stage(stages: int, blocks: int) -> npt.NDArray[np.int64]:
    """Block (N,) that each stage belongs to: lengths differ by one stage at most, none is empty."""
    used = min(blocks, stages)
    block: npt.NDArray[np.int64] = np.arange(stages, dtype=np.int64) * used // stages
    return block


class BinaryProgram:
    """(21)-(26) with half-planes for (26d), in the accept variables and the slack alone.

    By (23) the positions are affine in omega. So (25) is a quadratic cost in omega, and (26d) as half-planes are rows
    over omega and u: n.(rho(omega) - o) >= d - u. As constraints, the positions would make a solver ten times slower.
    """

    def __init__(self, problem: Problem, normals: Array, blocks: int | None = None) -> None:
        """Of a problem with N stages, along unit normals (N, m, 3), with B accept variables, at most one per stage."""
        n = problem.stages
        self.problem, self.normals = problem, normals
        self.block = block_of_stage(n, blocks or n)  # of each stage, (N,)
        self.count = int(self.block[-1]) + 1  # B
        self._of_block = np.equal.outer(self.block, np.arange(self.count)).astype(np.float64)
        steps = (problem.dt * (problem.accept - problem.refuse))[:, :AXES]
        refused = problem.positions(np.zeros(n))
        away = (refused - problem.reference)[:, :AXES]
        weights = 2.0 * problem.dt * problem.terms.error_weights
        # a stage's choice moves all later ends: column j of d rho_k / d omega_j is steps[j] for k >= j
        remaining = np.cumsum(weights[::-1])[::-1]
        later = np.maximum.outer(np.arange(n), np.arange(n))
        of_omega = self._of_block.T @ (steps @ steps.T * remaining[later]) @ self._of_block
        force = np.cumsum((weights[:, None] * away)[::-1], axis=0)[::-1]
        gradient = self._of_block.T @ (steps * force).sum(axis=1)
        height = refused[:, 2] - problem.reference[:, 2]  # no choice changes it
        constant = 0.5 * float(weights @ (np.square(away).sum(axis=1) + np.square(height)))
        hessian = np.diag(np.full(self.count + n, 2.0 * problem.dt * problem.slack_weight))
        hessian[: self.count, : self.count] = of_omega
        # 1 is allowed only where the choice moves the UGV, so that no solver need try both
        self._live = of_omega.diagonal() > _IDLE**2 * of_omega.diagonal().max()
        # which half-planes are rows: those that can bind, (N, m)
        self.within = within_reach(problem) & (problem.slack_weight > 0.0)
        rows, lower = self._rows(steps, refused - problem.reference)
        # Binary variables (24), (26c), (B,): 1 accepts. Then slack (26e), (N,), m.
        self.form = Form(
            constant, hessian, np.append(gradient, np.zeros(n)), rows, lower, np.full(len(lower), np.inf),
            np.zeros(self.count + n), np.append(self._live, np.full(n, np.inf)), np.arange(self.count + n) < self.count,
        )  # fmt: skip

    @cached_property
    def program(self) -> MathematicalProgram:
        """For any solver of Drake; with shares in place of binary values it is (27)."""
        made, form = MathematicalProgram(), self.form
        omega = made.NewBinaryVariables(self.count, "omega")
        x = np.append(omega, made.NewContinuousVariables(self.problem.stages, "u"))
        made.AddQuadraticCost(form.hessian, form.gradient, form.constant, x, is_convex=True)  # (25)
        if len(form.rows):
            made.AddLinearConstraint(form.rows, form.lower, form.upper, x)  # (26d)
        made.AddBoundingBoxConstraint(form.least, form.most, x)  # (26c), (26e)
        return made

    def _rows(self, steps: Array, away: Array) -> tuple[Array, Array]:
        """Coefficients (rows, B + N) and lower bounds of the half-planes that can bind."""
        # `steps` is what accepting at a stage adds to the position, (N, 2), m, and `away` are the task errors of
        # refusing throughout, (N, 3), m.
        n = self.problem.stages
        stage, point = map(np.ascontiguousarray, np.nonzero(self.within))  # the layout that is compiled for
        normal = self.normals[stage, point]
        before = np.arange(n) <= stage[:, None]
        of_omega = (normal[:, :AXES] @ steps.T * before) @ self._of_block
        lower = offsets(self.problem, self.normals)[stage, point] - (normal[:, :AXES] * away[stage, :AXES]).sum(axis=1)
        binding = _may_bind(stage, of_omega, lower)
        self.within[stage[~binding], point[~binding]] = False
        of_u = np.equal.outer(stage[binding], np.arange(n)).astype(np.float64)
        return np.hstack([of_omega[binding], of_u]), lower[binding]

    def guess(self, plan: Evaluation) -> Array:
        """Values of the program's variables for a plan: a solution that satisfies all constraints, (B + N,)."""
        away = plan.positions[:, None] - self.problem.centres
        lacking = self.problem.distances - np.einsum("kmi,kmi->km", self.normals, away)
        slack = np.where(self.within, lacking, 0.0).max(axis=1, initial=0.0)
        return np.concatenate([np.where(self._live, self.blocked(plan.omega), 0.0), slack])

    def plan(self, values: Array) -> Array:
        """The value of each stage, (N,), from those of the blocks, (B,)."""
        # Idle blocks get the value of the next one that is not, or of the last, so that they are no switch.
        live = np.flatnonzero(self._live)
        if len(live) == 0:
            return np.take(values, self.block)
        following = np.minimum(np.searchsorted(live, np.arange(len(values))), len(live) - 1)
        return values[live[following]][self.block]

    def blocked(self, plan: Array) -> Array:
        """The mode that a plan (N,) has in most stages of each block, (B,), 0 or 1; accepting on a tie."""
        share = self._of_block.T @ plan / self._of_block.sum(axis=0)
        return (share >= 0.5).astype(np.float64)


@njit(cache=True)
def _may_bind(stage: npt.NDArray[np.intp], of_omega: Array, lower: Array) -> npt.NDArray[np.bool_]:
    """For which half-planes some plan, relaxed or not, needs more slack than for any other of the stage, and than 0."""
    # A row asks for the slack lower - of_omega . omega, (rows,). Over omega in [0, 1] the least difference of two rows
    # is found term by term.
    kept = np.ones(len(lower), dtype=np.bool_)
    for j in range(len(lower)):
        most = lower[j]
        for b in range(of_omega.shape[1]):
            most -= min(0.0, of_omega[j, b])
        kept[j] = most > 0.0
        for i in range(len(lower)):
            if i == j or not kept[i] or not kept[j] or stage[i] != stage[j]:
                continue
            more = lower[i] - lower[j]
            for b in range(of_omega.shape[1]):
                more += min(0.0, of_omega[j, b] - of_omega[i, b])
            kept[j] = more < 0.0
    return kept
