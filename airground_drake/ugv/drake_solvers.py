"""Solvers of Drake on a `BinaryProgram`, chosen by name."""

import math
import time
from dataclasses import dataclass
from typing import Any, Literal

from pydrake.solvers import CommonSolverOption, GurobiSolver, MosekSolver, SolutionResult, SolverOptions

from airground_drake.base.arrays import Array
from airground_drake.ugv.binary_program import BinaryProgram
from airground_drake.ugv.daqp_solver import DaqpSolver, SolverLimits

# Classes of solvers by the name in `gatekeeper.solver`.
SOLVERS: dict[str, Any] = {"daqp": DaqpSolver, "gurobi": GurobiSolver, "mosek": MosekSolver}

# Their options for a limit in time, s, and for a proven optimum: Gurobi and Mosek stop at a gap by default.
OPTIONS: dict[str, tuple[str, dict[str, float]]] = {
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
        if why := lacking(name):
            raise ValueError(why)
        self._solver = SOLVERS[name]()
        self._licence = self._solver.AcquireLicense() if hasattr(self._solver, "AcquireLicense") else None
        self._limit, self._exact = OPTIONS.get(name, ("", {}))

    def minimise(self, binary: BinaryProgram, guess: Array, seconds: float = math.inf) -> SolverResult:
        """The optimum of (26), searched for no longer than `seconds` by the clock; DAQP looks at it every 32 nodes."""
        if isinstance(self._solver, DaqpSolver):
            return _by_daqp(binary, guess, SolverLimits(max(seconds, 1e-6)))
        started, options = time.monotonic(), SolverOptions()
        options.SetOption(CommonSolverOption.kMaxThreads, 1)
        for option, value in (self._exact | ({self._limit: seconds} if seconds < math.inf else {})).items():
            options.SetOption(self._solver.solver_id(), option, value)
        result = self._solver.Solve(binary.program, guess, options)
        if result.is_success():
            return SolverResult(result.get_x_val()[: binary.count], "optimal")
        limited = result.get_solution_result() == SolutionResult.kIterationLimit
        late = time.monotonic() - started >= seconds
        return SolverResult(None, "budget_spent" if limited or late else "solver_failed")


def relax(binary: BinaryProgram, seconds: float = math.inf, iterations: int = 10_000) -> SolverResult:
    """The optimum of (27), by DAQP, within `iterations` of the active-set method and `seconds` by the clock."""
    return _by_daqp(binary, None, SolverLimits(max(seconds, 1e-6), iterations, relaxed=1))


def _by_daqp(binary: BinaryProgram, guess: Array | None, limits: SolverLimits) -> SolverResult:
    ended, x, details = binary.form.minimise(guess, limits)
    effort = details.iterations, details.multipliers
    if ended == SolutionResult.kSolutionFound:
        return SolverResult(x[: binary.count], "optimal", *effort)
    limited = ended == SolutionResult.kIterationLimit
    return SolverResult(None, "budget_spent" if limited else "solver_failed", *effort)
