"""DAQP, a dual active-set solver with branch and bound, on the numbers of a `BinaryProgram`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import daqp
import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.gatekeeper.binary_program import BinaryProgram

_BINARY, _SOFT, _NO_BOUND = 16, 8, 1e30
_OPTIMAL, _SPENT = (1, 2), (5, -7, -4)
"""Flags of DAQP; 5: stopped with a solution, -7: stopped without one, -4: too many iterations."""
_ITERATIONS = 10_000
"""DAQP's own limit."""

_IDLE = 1e-7
"""A stage whose choice moves the later positions by less than this share of the largest move is left out: it would make
the Hessian singular, and DAQP may then say "infeasible"."""

_TOLERANCE = 1e-9
"""Of constraints, in the scaled variables."""


@dataclass(frozen=True, eq=False)
class Found:
    """The solver's result.

    Attributes:
        omega: values of the accept variables, (B,); None without a solution.
        ended: 'optimal' only with a proof.
        iterations: of the active-set method over all nodes; 0 if the solver does not say.
        multipliers: of the relaxation's half-planes, one per row, 1/m.
    """

    omega: Array | None
    ended: Literal["optimal", "budget_spent", "solver_failed"]
    iterations: int = 0
    multipliers: Array | None = None


def minimise(
    binary: BinaryProgram,
    *,
    relaxed: bool = False,
    known: float = math.inf,
    seconds: float = math.inf,
    iterations: int = _ITERATIONS,
) -> Found:
    """The optimum of the program, or of its relaxation.

    DAQP sees each accept variable scaled to a unit diagonal of the Hessian. The slack of a stage with one half-plane
    is a soft row, which is exact; only slack that several rows share stays a variable.

    Args:
        binary: the program, with data.
        relaxed: shares of accepting in [0, 1] in place of binaries.
        known: cost that can be reached; branches above it are cut.
        seconds: how long the search may take by the clock; DAQP looks at it every 32 nodes.
        iterations: of the active-set method at each node, at most.
    """
    error, soft, rows = (one.evaluator() for one in (binary.error, binary.slack, binary.half_planes))
    hessian, gradient, lower, matrix = error.Q(), error.b(), rows.lower_bound(), rows.GetDenseA()
    asked = np.isfinite(lower)
    matrix, lower, weights = matrix[asked], lower[asked], soft.Q().diagonal()
    blocks, diagonal = len(gradient), hessian.diagonal()
    largest = diagonal.max(initial=0.0)
    live = np.flatnonzero(diagonal > _IDLE**2 * largest)
    omega = np.zeros(blocks)
    if len(live) == 0:
        return Found(omega, "optimal")
    of_omega, of_u = matrix[:, live], matrix[:, blocks:]
    shared = np.flatnonzero((of_u != 0.0).sum(axis=0) > 1)
    stage = of_u.argmax(axis=1) if len(lower) else np.zeros(0, dtype=np.intp)
    is_soft = ~np.isin(stage, shared)
    scale, count = np.sqrt(diagonal[live] / largest), len(live)
    root = np.sqrt(weights[shared] / largest)
    cost = np.eye(count + len(shared))
    cost[:count, :count] = hessian[np.ix_(live, live)] / np.outer(scale, scale) / largest
    slope = np.concatenate([gradient[live] / scale / largest, np.zeros(len(shared))])
    constraints = np.ascontiguousarray(np.hstack([of_omega / scale, of_u[:, shared] / root]))
    sense = np.concatenate([np.full(count, 0 if relaxed else _BINARY), np.where(is_soft, _SOFT, 0)])
    solver = daqp.Model()
    solver.settings = {
        "presolve": 0,
        "primal_tol": _TOLERANCE,
        "iter_limit": min(iterations, _ITERATIONS),
        "time_limit": 0.0 if seconds == math.inf else max(seconds, 1e-6),
        "fval_bound": _NO_BOUND if known == math.inf else (known * (1.0 + 1e-7) - error.c()) / largest,
    }
    upper = np.concatenate([scale, np.full(len(lower), _NO_BOUND)])
    least = np.concatenate([np.zeros(count), lower])
    solver.setup(cost, slope, constraints, upper, least, sense.astype(np.intc))
    if is_soft.any():
        reciprocal = np.concatenate([np.ones(count), largest / weights[stage]])
        solver.soft_weights(rho_l=reciprocal, rho_u=reciprocal)
    x, _, flag, info = solver.solve()
    if flag not in _OPTIMAL:
        return Found(None, "budget_spent" if flag in _SPENT else "solver_failed")
    omega[live] = np.clip(x[:count] / scale, 0.0, 1.0)
    omega = _with_idle(omega, live)
    multipliers = largest * np.abs(info["lam"][count:])
    return Found(omega if relaxed else np.round(omega), "optimal", int(info["iterations"]), multipliers)


def _with_idle(omega: Array, live: npt.NDArray[np.intp]) -> Array:
    """Each idle entry (B,) with the value of the next live one, or of the last, so that it is no switch."""
    following = np.minimum(np.searchsorted(live, np.arange(len(omega))), len(live) - 1)
    filled: Array = omega[live[following]]
    return filled
