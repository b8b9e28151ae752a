"""Gurobi and Mosek on a `BinaryProgram`, through Drake, where it was built with them and there is a licence."""

from __future__ import annotations

import math
import time
from typing import Any

from pydrake.solvers import CommonSolverOption, GurobiSolver, MosekSolver, SolverOptions

from airground_drake.gatekeeper.binary_program import BinaryProgram
from airground_drake.gatekeeper.daqp_solver import Found

SOLVERS: dict[str, Any] = {"gurobi": GurobiSolver, "mosek": MosekSolver}
"""Drake's classes by the name in `gatekeeper.solver`."""

OPTIONS: dict[str, tuple[str, dict[str, float]]] = {
    "gurobi": ("TimeLimit", {"MIPGap": 0.0, "MIPGapAbs": 0.0}),
    "mosek": ("MSK_DPAR_MIO_MAX_TIME", {"MSK_DPAR_MIO_TOL_REL_GAP": 0.0, "MSK_DPAR_MIO_TOL_ABS_GAP": 0.0}),
}
"""Their options for a limit in time, s, and for a proven optimum: by default they stop at a gap."""


def lacking(name: str) -> str:
    """Why a solver cannot be used here; '' if it can."""
    solver = SOLVERS[name]()
    if not solver.available():
        return "this build of Drake does not have it"
    return "" if solver.enabled() else "Drake found no licence for it"


class DrakeSearch:
    """The search for the optimum by a solver of Drake, with one thread; it holds the licence."""

    def __init__(self, name: str) -> None:
        """Take the licence.

        Args:
            name: of `SOLVERS`.

        Raises:
            ValueError: if the solver cannot be used here; says why.
        """
        if why := lacking(name):
            raise ValueError(why)
        self._solver, self._licence = SOLVERS[name](), SOLVERS[name].AcquireLicense()
        self._limit, self._exact = OPTIONS[name]

    def minimise(self, binary: BinaryProgram, *, known: float = math.inf, seconds: float = math.inf) -> Found:
        """The optimum of the program; arguments as of `daqp_solver.minimise`, but these solvers ignore `known`."""
        options = SolverOptions()
        options.SetOption(CommonSolverOption.kMaxThreads, 1)
        for option, value in self._exact.items():
            options.SetOption(self._solver.solver_id(), option, value)
        if seconds < math.inf:
            options.SetOption(self._solver.solver_id(), self._limit, max(seconds, 1e-6))
        started = time.monotonic()
        result = self._solver.Solve(binary.program, None, options)
        if result.is_success():
            return Found(result.GetSolution(binary.omega).round(), "optimal")
        return Found(None, "budget_spent" if time.monotonic() - started >= seconds else "solver_failed")
