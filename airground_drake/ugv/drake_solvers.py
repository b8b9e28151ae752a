"""Solvers of Drake on a `BinaryProgram`, chosen by name."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any, Literal

from pydrake.solvers import CommonSolverOption, GurobiSolver, MosekSolver, SolutionResult, SolverOptions

from airground_drake.base.arrays import Array
from airground_drake.ugv.binary_program import BinaryProgram
from airground_drake.ugv.daqp_solver import DaqpSolver, Details

# Classes of solvers by the name in `gatekeeper.solver`.
SOLVERS: dict[str, Any] = {"daqp": DaqpSolver, "gurobi": GurobiSolver, "mosek": MosekSolver}

# Their options for a limit in time, s, and for a proven optimum: Gurobi and Mosek stop at a gap by default.
OPTIONS: dict[str, tuple[str, dict[str, float]]] = {
    "daqp": ("time_limit", {}),
    "gurobi": ("TimeLimit", {"MIPGap": 0.0, "MIPGapAbs": 0.0}),
    "mosek": ("MSK_DPAR_MIO_MAX_TIME", {"MSK_DPAR_MIO_TOL_REL_GAP": 0.0, "MSK_DPAR_MIO_TOL_ABS_GAP": 0.0}),
}


def lacking(name: str) -> str:
    """Why a solver cannot be used here; '' if it can."""
    solver = SOLVERS[name]()
    if not solver.available():
        return "this build of Drake does not have it"
    return "" if solver.enabled() else "Drake found no licence for it"


@dataclass(frozen=True, eq=False)
class SolverResult:
    """A solver's result."""

    omega: Array | None  # values of the accept variables, or shares, (B,); None without a solution
    ended: Literal["optimal", "budget_spent", "solver_failed"]  # 'optimal' only with a proof
    iterations: int = 0  # of the active-set method over all nodes; 0 if the solver does not say
    multipliers: Array | None = None  # of the half-planes, 1/m, one per row; none if the solver does not say


class Minimiser:
    """The search for the optimum by one solver, with one thread; it holds the licence, if the solver needs one."""

    def __init__(self, name: str) -> None:
        """Take the licence."""
        if why := lacking(name):
            raise ValueError(why)
        self._solver = SOLVERS[name]()
        self._licence = self._solver.AcquireLicense() if hasattr(self._solver, "AcquireLicense") else None
        self._limit, self._exact = OPTIONS[name]

    def minimise(self, binary: BinaryProgram, guess: Array, seconds: float = math.inf) -> SolverResult:
        """The optimum of (26), searched for no longer than `seconds` by the clock; DAQP looks at it every 32 nodes."""
        options = SolverOptions()
        options.SetOption(CommonSolverOption.kMaxThreads, 1)
        for option, value in self._exact.items():
            options.SetOption(self._solver.solver_id(), option, value)
        if seconds < math.inf:
            options.SetOption(self._solver.solver_id(), self._limit, max(seconds, 1e-6))
        started = time.monotonic()
        found = _found(self._solver.Solve(binary.program, guess, options), len(binary.omega))
        late = found.ended == "solver_failed" and time.monotonic() - started >= seconds
        return SolverResult(None, "budget_spent") if late else found


_RELAXING = DaqpSolver()


def relax(binary: BinaryProgram, seconds: float = math.inf, iterations: int = 10_000) -> SolverResult:
    """The optimum of (27), by DAQP, within `iterations` of the active-set method and `seconds` by the clock."""
    options = SolverOptions()
    options.SetOption(DaqpSolver.id(), "relaxed", 1)
    options.SetOption(DaqpSolver.id(), "iter_limit", iterations)
    if seconds < math.inf:
        options.SetOption(DaqpSolver.id(), "time_limit", max(seconds, 1e-6))
    return _found(_RELAXING.Solve(binary.program, None, options), len(binary.omega))


def _found(result: Any, count: int) -> SolverResult:
    """A result; the accept variables, or shares, are the first `count` variables of their program."""
    details = result.get_solver_details()
    more = (details.iterations, details.multipliers) if isinstance(details, Details) else (0, None)
    if result.is_success():
        return SolverResult(result.get_x_val()[:count], "optimal", *more)
    limited = result.get_solution_result() == SolutionResult.kIterationLimit
    return SolverResult(None, "budget_spent" if limited else "solver_failed", *more)
