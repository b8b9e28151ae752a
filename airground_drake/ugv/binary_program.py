"""(26) of one UGV as a mixed-integer quadratic program, positions eliminated; with shares of accepting it is (27)."""

import functools
import threading

import numpy as np
import numpy.typing as npt
from pydrake.solvers import MathematicalProgram

from airground_drake.base.arrays import Array, Flags, Indices
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

    def __init__(self, stages: int, blocks: int) -> None:
        """A program without any problem's data, for N stages and B <= N accept variables, one per block of stages."""
        n, b = stages, blocks
        self.program, self.count = MathematicalProgram(), b  # (26); with shares in place of binary values it is (27)
        self.block = block_of_stage(n, b)  # of each stage, (N,)
        self._of_block = np.equal.outer(self.block, np.arange(b)).astype(np.float64)
        # Binary variables (24), (26c), (B,): 1 accepts. Then slack (26e), (N,), m.
        x = np.append(self.program.NewBinaryVariables(b, "omega"), self.program.NewContinuousVariables(n, "u"))
        cost = self.program.AddQuadraticCost(np.zeros((b + n, b + n)), np.zeros(b + n), x, is_convex=True)  # (25)
        # (26d): one row per half-plane that can bind, or an empty one
        rows = self.program.AddLinearConstraint(np.zeros((1, b + n)), np.full(1, -np.inf), np.full(1, np.inf), x)
        choices = self.program.AddBoundingBoxConstraint(np.zeros(b + n), np.full(b + n, np.inf), x)  # (26c), (26e)
        self._cost, self._rows, self._choices = cost.evaluator(), rows.evaluator(), choices.evaluator()

    def update(self, problem: Problem, normals: Array) -> None:
        """Put in the data of a problem of this size, with half-planes along unit normals (N, m, 3)."""
        self.problem, self.normals, n, b = problem, normals, problem.stages, self.count
        steps = (problem.dt * (problem.accept - problem.refuse))[:, :AXES]
        refused = problem.positions(np.zeros(n))
        away = (refused - problem.reference)[:, :AXES]
        weights = 2.0 * problem.dt * problem.terms.error_weights
        # a stage's choice moves all later ends: column j of d rho_k / d omega_j is steps[j] for k >= j
        remaining = np.cumsum(weights[::-1])[::-1]
        later = np.maximum.outer(np.arange(n), np.arange(n))
        hessian = np.diag(np.full(b + n, 2.0 * problem.dt * problem.slack_weight))
        hessian[:b, :b] = self._of_block.T @ (steps @ steps.T * remaining[later]) @ self._of_block
        force = np.cumsum((weights[:, None] * away)[::-1], axis=0)[::-1]
        gradient = np.append(self._of_block.T @ (steps * force).sum(axis=1), np.zeros(n))
        height = refused[:, 2] - problem.reference[:, 2]  # no choice changes it
        constant = 0.5 * float(weights @ (np.square(away).sum(axis=1) + np.square(height)))
        self._cost.UpdateCoefficients(hessian, gradient, constant, is_convex=True)
        # 1 is allowed only where the choice moves the UGV, so that no solver need try both
        self._live = hessian.diagonal()[:b] > _IDLE**2 * hessian.diagonal()[:b].max()
        self._choices.UpdateUpperBound(np.append(self._live, np.full(n, np.inf)))
        # which half-planes are rows, (N, m)
        self.within = within_reach(problem) & (problem.slack_weight > 0.0)
        rows, lower = self._half_planes(steps, refused - problem.reference)
        self._rows.UpdateCoefficients(rows, lower, np.full(len(lower), np.inf))
        # the program as DAQP takes it: all costs and constraints are on all variables, in their order
        self.form = Form(
            self._cost.c(), self._cost.Q(), self._cost.b(), self._rows.GetDenseA(), self._rows.lower_bound(),
            self._rows.upper_bound(), self._choices.lower_bound(), self._choices.upper_bound(), np.arange(b + n) < b,
        )  # fmt: skip

    def _half_planes(self, steps: Array, away: Array) -> tuple[Array, Array]:
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
        if not binding.any():
            return np.zeros((1, self.count + n)), np.full(1, -np.inf)
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
        """The majority mode of a plan (N,) in each block, (B,), 0 or 1; accepting on a tie."""
        share = self._of_block.T @ plan / self._of_block.sum(axis=0)
        return (share >= 0.5).astype(np.float64)


@njit(cache=True)
def _may_bind(stage: Indices, of_omega: Array, lower: Array) -> Flags:
    """Which half-planes can determine the slack of their stage for some plan, relaxed or not."""
    # A row asks for the slack lower - of_omega . omega, (rows,). Over omega in [0, 1] the least difference of two rows
    # is found term by term, none of which adds to it.
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
                if more < 0.0:
                    break
                more += min(0.0, of_omega[j, b] - of_omega[i, b])
            kept[j] = more < 0.0
    return kept


class Programs(threading.local):
    """The programs of one thread by their sizes: to build one takes longer than to put in the data of a problem."""

    def __init__(self) -> None:
        self.of = functools.cache(BinaryProgram)  # of a number of stages and of blocks, to be updated
