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
from airground_drake.gatekeeper.active_set import Answer, Details, Limits, minimise
from airground_drake.gatekeeper.standard_form import StandardForm

SUPPORTED = frozenset(
    {
        ProgramAttribute.kLinearCost, ProgramAttribute.kQuadraticCost, ProgramAttribute.kLinearConstraint,
        ProgramAttribute.kLinearEqualityConstraint, ProgramAttribute.kBinaryVariable, ProgramAttribute.kCallback,
    }
)  # fmt: skip
"""What a program may have. Visualization callbacks are not called."""


_StandIns = dict[int, tuple[Variable, Variable]]
"""Binary variables, each with the continuous one in its place, by the identifier of the former."""


class DaqpResult(MathematicalProgramResult):  # type: ignore[misc]
    """A result that Python can fill, also for programs with binary variables.

    Python can set the solution of a result only if a solver of Drake has filled it before, and none that is free takes
    binary variables. So CLP fills it for a program that has a continuous variable in place of each binary one, and
    `GetSolution` looks them up.
    """

    def __init__(self) -> None:
        """An empty result."""
        super().__init__()
        self._for_binary: _StandIns = {}
        self._details = Details()

    def fill(self, program: MathematicalProgram, answer: Answer, cost: float) -> None:
        """Put in the answer to a program."""
        self._for_binary = _fill(self, program, answer, cost)
        self._details = answer.details

    def GetSolution(self, *what: Any) -> Any:  # noqa: N802
        """As `MathematicalProgramResult.GetSolution`: all values, or those of variables or expressions."""
        if not what or not self._for_binary:
            return super().GetSolution(*what)
        asked = np.asarray(what[0], dtype=object)
        replaced = np.array([self._without_binary(one) for one in asked.ravel()] or asked, dtype=object)
        return super().GetSolution(replaced.reshape(asked.shape) if asked.shape else replaced[0])

    def get_solver_id(self) -> SolverId:
        """DAQP."""
        return DaqpSolver.id()

    def get_solver_details(self) -> Details:
        """Iterations, nodes and multipliers."""
        return self._details

    def _without_binary(self, value: Any) -> Any:
        if isinstance(value, Variable):
            return self._for_binary.get(value.get_id(), (value, value))[1]
        if isinstance(value, Expression):
            for old, new in self._for_binary.values():
                value = value.Substitute(old, Expression(new))
        return value


class DaqpSolver(SolverInterface):  # type: ignore[misc]
    """DAQP for any `MathematicalProgram` that is a convex quadratic program, with binary variables or without.

    An initial guess that satisfies all constraints bounds the search: more expensive branches are cut. It is the
    solution if a limit is reached before anything cheaper was found.

    Its options in `SolverOptions` are those of `Limits`, under `DaqpSolver.id()`. Common options have no effect: it
    runs in one thread and prints nothing.
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

    def AreProgramAttributesSatisfied(self, prog: MathematicalProgram) -> bool:  # noqa: N802
        """Whether it solves programs of this kind."""
        return not self.ExplainUnsatisfiedProgramAttributes(prog)

    def ExplainUnsatisfiedProgramAttributes(self, prog: MathematicalProgram) -> str:  # noqa: N802
        """Why it does not solve programs of this kind; '' if it does."""
        if beyond := sorted(one.name.removeprefix("k") for one in prog.required_capabilities() - SUPPORTED):
            found = ", ".join(beyond)
            return f"DaqpSolver is unable to solve because a {found} was declared but is not supported."
        if not all(binding.evaluator().is_convex() for binding in prog.quadratic_costs()):
            return "DaqpSolver is unable to solve because a quadratic cost is not convex."
        return ""

    def Solve(  # noqa: N802
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
        form = StandardForm.of(prog)
        answer = minimise(form, guess, limits)
        filled = DaqpResult() if result is None else result
        cost = _COSTS.get(answer.ended) or form.cost(answer.x)
        if isinstance(filled, DaqpResult):
            filled.fill(prog, answer, cost)
        else:
            _fill(filled, prog, answer, cost)
        return filled if result is None else None


_COSTS = {SolutionResult.kInfeasibleConstraints: math.inf, SolutionResult.kUnbounded: -math.inf}


def _limits(*given: SolverOptions | None) -> Limits:
    """From options of Drake, the later ones counting more.

    Raises:
        ValueError: if there is an option that DAQP does not have.
    """
    chosen = {name: value for one in given if one for name, value in one.options.get(DaqpSolver.NAME, {}).items()}
    if unknown := sorted(set(chosen) - set(Limits._fields)):
        raise ValueError(f"{DaqpSolver.NAME}: no options {', '.join(unknown)}; allowed: {', '.join(Limits._fields)}")
    return Limits(**chosen)


def _fill(
    result: MathematicalProgramResult, program: MathematicalProgram, answer: Answer, cost: float
) -> _StandIns:
    """Put an answer into a result by way of CLP; returns the variables that stand for binary ones."""
    variables = program.decision_variables()
    binary = [x for x in variables if x.get_type() == Variable.Type.BINARY]
    stand_ins = {x.get_id(): (x, Variable(x.get_name())) for x in binary}
    shell = MathematicalProgram()
    shell.AddDecisionVariables(np.array([stand_ins.get(x.get_id(), (x, x))[1] for x in variables], dtype=object))
    shell.AddLinearCost(np.zeros(len(variables)), cost, shell.decision_variables())
    ClpSolver().Solve(shell, None, None, result)
    result.set_x_val(answer.x)
    result.set_solution_result(answer.ended)
    return stand_ins
