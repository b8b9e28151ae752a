"""DAQP, a dual active-set solver with branch and bound, as a solver of Drake.

It solves convex quadratic and linear programs, also with binary variables, to a proven optimum, and needs no licence:

    result = DaqpSolver().Solve(program)

A program may have linear costs, convex quadratic costs, linear constraints, bounds and binary variables. The result
says whether it is infeasible or unbounded, or whether a limit stopped the search. `active_set` has the method.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pydrake.solvers import (
    ClpSolver,
    MathematicalProgram,
    MathematicalProgramResult,
    ProgramAttribute,
    SolutionResult,
    SolverId,
    SolverInterface,
    SolverOptions,
)
from pydrake.symbolic import Expression, Variable

from airground_drake.base.arrays import Array
from airground_drake.gatekeeper.active_set import Details, ProgramSolution, SolverLimits, minimise
from airground_drake.gatekeeper.standard_form import Layout, StandardForm

SUPPORTED = frozenset(
    {
        ProgramAttribute.kLinearCost, ProgramAttribute.kQuadraticCost, ProgramAttribute.kLinearConstraint,
        ProgramAttribute.kLinearEqualityConstraint, ProgramAttribute.kBinaryVariable, ProgramAttribute.kCallback,
    }
)  # fmt: skip
"""What a program may have. Visualization callbacks are not called."""


class _Shell:
    """A program without constraints, by which CLP fills results: Python cannot set their variables, nor their cost.

    It has a continuous variable in place of each binary one, which CLP does not take.
    """

    def __init__(self, layout: Layout) -> None:
        """For programs with these variables."""
        self.layout = layout
        self._program, self._solver = MathematicalProgram(), ClpSolver()
        pairs = zip(layout.variables, layout.binary, strict=True)
        stand_ins = [Variable(x.get_name()) if binary else x for x, binary in pairs]
        self._program.AddDecisionVariables(np.array(stand_ins, dtype=object))
        self._cost = self._program.AddLinearCost(np.zeros(len(layout.index)), self._program.decision_variables())

    def fill(self, result: MathematicalProgramResult, answer: ProgramSolution, cost: float) -> None:
        """Put in an answer and its cost."""
        self._cost.evaluator().UpdateCoefficients(np.zeros(len(answer.x)), cost)
        self._solver.Solve(self._program, None, None, result)
        result.set_x_val(answer.x)
        result.set_solution_result(answer.ended)


class DaqpResult(MathematicalProgramResult):  # type: ignore[misc]
    """A result that also has the values of binary variables, and the details of the solution."""

    def __init__(self) -> None:
        """An empty result."""
        super().__init__()
        self._x, self._index, self._details = np.zeros(0), dict[int, int](), Details()

    def fill(self, shell: _Shell, answer: ProgramSolution, cost: float) -> None:
        """Put in an answer and its cost."""
        shell.fill(self, answer, cost)
        self._x, self._index, self._details = answer.x, shell.layout.index, answer.details

    def GetSolution(self, *what: Any) -> Any:
        """As `MathematicalProgramResult.GetSolution`: all values, or those of a variable, an expression, or arrays."""
        if not what:
            return super().GetSolution()
        if not isinstance(what[0], np.ndarray):
            return self._value(what[0])
        values = np.array([self._value(one) for one in what[0].ravel()])
        return values.reshape(what[0].shape)

    def _value(self, what: Any) -> Any:
        if isinstance(what, Variable) and what.get_id() in self._index:
            return self._x[self._index[what.get_id()]]
        if isinstance(what, Expression):
            for x in what.GetVariables():
                what = what.Substitute(x, self._value(x))
            return what
        return super().GetSolution(what)

    def get_solver_id(self) -> SolverId:
        """DAQP."""
        return DaqpSolver.id()

    def get_solver_details(self) -> Details:
        """Iterations, nodes and multipliers."""
        return self._details


class DaqpSolver(SolverInterface):  # type: ignore[misc]
    """DAQP for any `MathematicalProgram` that is a convex quadratic program, with binary variables or without.

    An initial guess that satisfies all constraints bounds the search: more expensive branches are cut. It is the
    solution if a limit is reached before anything cheaper was found.

    Scale the program: where coefficients differ by a factor of about 1e6, it may fail, or call a program unbounded
    that is not (on random programs of this kind, about once in a thousand).

    Its options in `SolverOptions` are those of `SolverLimits`, under `DaqpSolver.id()`. Common options have no effect:
    it runs in one thread and prints nothing.
    """

    NAME = "DAQP"
    _ID = SolverId(NAME)

    @classmethod
    def id(cls) -> SolverId:
        """What the options of this solver are stored under."""
        return cls._ID

    def solver_id(self) -> SolverId:
        """As `id`."""
        return self._ID

    def available(self) -> bool:
        """Always: it comes with this package."""
        return True

    def enabled(self) -> bool:
        """Always: it needs no licence."""
        return True

    def AreProgramAttributesSatisfied(self, prog: MathematicalProgram) -> bool:
        """Whether it solves programs of this kind."""
        return not self.ExplainUnsatisfiedProgramAttributes(prog)

    def ExplainUnsatisfiedProgramAttributes(self, prog: MathematicalProgram) -> str:
        """Why it does not solve programs of this kind; '' if it does."""
        if beyond := sorted(one.name.removeprefix("k") for one in prog.required_capabilities() - SUPPORTED):
            found = ", ".join(beyond)
            return f"DaqpSolver is unable to solve because a {found} was declared but is not supported."
        if not all(binding.evaluator().is_convex() for binding in prog.quadratic_costs()):
            return "DaqpSolver is unable to solve because a quadratic cost is not convex."
        return ""

    def Solve(
        self,
        prog: MathematicalProgram,
        initial_guess: Array | None = None,
        solver_options: SolverOptions | None = None,
        result: MathematicalProgramResult | None = None,
    ) -> DaqpResult | None:
        """Solve a program; as the two overloads of `SolverInterface.Solve`.

        Args:
            prog: the program.
            initial_guess: for all of its variables; by default, the program's own.
            solver_options: count more than those of the program.
            result: to be filled; None: a new one is returned. One that is not a `DaqpResult` has the values of binary
                variables in `get_x_val()` only.

        Raises:
            ValueError: if this solver does not solve such programs, or has no such options.
        """
        if why := self.ExplainUnsatisfiedProgramAttributes(prog):
            raise ValueError(why)
        limits = _limits(prog.solver_options(), solver_options)
        guess = prog.initial_guess() if initial_guess is None else np.asarray(initial_guess, dtype=np.float64)
        shell = _Shell(Layout(prog))  # nothing is kept: threads may share a solver
        form = StandardForm.of(prog, shell.layout)
        answer = minimise(form, guess, limits)
        filled = DaqpResult() if result is None else result
        cost = _COSTS.get(answer.ended) or form.cost(answer.x)
        if isinstance(filled, DaqpResult):
            filled.fill(shell, answer, cost)
        else:
            shell.fill(filled, answer, cost)
        return filled if result is None else None


_COSTS = {SolutionResult.kInfeasibleConstraints: math.inf, SolutionResult.kUnbounded: -math.inf}


def _limits(*given: SolverOptions | None) -> SolverLimits:
    """From options of Drake, the later ones counting more.

    Raises:
        ValueError: if there is an option that DAQP does not have.
    """
    chosen = {name: value for one in given if one for name, value in one.options.get(DaqpSolver.NAME, {}).items()}
    if unknown := sorted(set(chosen) - set(SolverLimits._fields)):
        raise ValueError(
            f"{DaqpSolver.NAME}: no options {', '.join(unknown)}; allowed: {', '.join(SolverLimits._fields)}"
        )
    return SolverLimits(**chosen)
