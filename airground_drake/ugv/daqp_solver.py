"""DAQP, a dual active-set solver with branch and bound, as a solver of Drake.

It solves convex quadratic and linear programs, also with binary variables, to a proven optimum, and needs no licence:

    result = DaqpSolver().Solve(program)

A program may have linear costs, convex quadratic costs, linear constraints, bounds and binary variables. The result
says whether it is infeasible or unbounded, or whether a limit stopped the search.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import daqp
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

from airground_drake.base.arrays import Array, Flags, Indices

# Features that a program may have. Visualization callbacks are not called.
SUPPORTED = frozenset({
    ProgramAttribute.kLinearCost, ProgramAttribute.kQuadraticCost, ProgramAttribute.kLinearConstraint,
    ProgramAttribute.kLinearEqualityConstraint, ProgramAttribute.kBinaryVariable, ProgramAttribute.kCallback,
})  # fmt: skip
FOUND, INFEASIBLE, UNBOUNDED, STOPPED, INVALID, FAILED = (
    SolutionResult.kSolutionFound, SolutionResult.kInfeasibleConstraints, SolutionResult.kUnbounded,
    SolutionResult.kIterationLimit, SolutionResult.kInvalidInput, SolutionResult.kSolverSpecificError,
)  # fmt: skip
# What DAQP's flags mean; 4: solved, inexactly; 5: stopped with a solution, -7: without one. Others are failures.
_ENDED = {1: FOUND, 2: FOUND, 4: FOUND, 5: STOPPED, -4: STOPPED, -7: STOPPED, -1: INFEASIBLE, -3: UNBOUNDED}
_SOFT, _BINARY, _NO_BOUND = 8, 16, 1e30
_FLAT = 1e-24  # a variable counts as linear if its curvature is below this share of the largest
# Curvature that binary variables get, in units of the largest, and weight of DAQP's proximal point method. A negative
# weight counts only where the Hessian is singular. Where DAQP fails, the next is tried. More curvature makes a search
# longer: it weakens the bounds.
_APPROACHES = (0.0, 0.0), (1e-6, -1e-6), (1e-4, -1e-6)
_APPROACH = ((0.0, -1e-4),)  # without binary variables
_TIGHT = 1e-9  # DAQP's tolerance of constraints, in the scaled variables
_FEASIBLE = 1e-6  # largest violation of a constraint, in its own units, of a guess or a solution
# A search finds the guess again if nothing is cheaper: its cost may be this much above that of the guess, relative.
_AGAIN = 1e-7


class SolverLimits(NamedTuple):
    """Options of a solution; the first two are DAQP's own.

    Attributes:
        time_limit: s; DAQP looks at the clock every 32 nodes. 0 or infinite: none.
        iter_limit: iterations of the active-set method, at each node.
        relaxed: 1: binary variables may have any value in [0, 1].
    """

    time_limit: float = 0.0
    iter_limit: int = 10_000
    relaxed: int = 0


class Details(NamedTuple):
    """DAQP's results besides the solution.

    Attributes:
        iterations: of the active-set method, over all nodes.
        nodes: of branch and bound.
        multipliers: of the rows of all linear constraints, then of those of all linear equality constraints: the
            derivative of the optimal cost in the bound that is active, (m,). With binary variables, of the last node.
    """

    iterations: int = 0
    nodes: int = 0
    multipliers: Array = np.zeros(0)


class Optimum(NamedTuple):
    """How a search ended, x (n,), NaN without a solution, and details."""

    ended: SolutionResult
    x: Array
    details: Details = Details()


@dataclass(frozen=True, eq=False)
class Form:
    """min x' H x / 2 + f' x + constant  so that  lower <= A x <= upper,  least <= x <= most,  x[binary] in {0, 1}."""

    # H is (n, n), f, least, most and binary are (n,), A is (m, n), lower and upper are (m,); inf: no bound. Sums are by
    # `einsum`: BLAS would start threads, which cost more than such sizes.

    constant: float
    hessian: Array
    gradient: Array
    rows: Array
    lower: Array
    upper: Array
    least: Array
    most: Array
    binary: Flags

    @classmethod
    def of(cls, program: MathematicalProgram) -> Form:
        """Read the evaluators; pydrake has no bindings for `AggregateQuadraticCosts` and the like."""

        def places(binding: Any) -> Indices:
            return np.array(program.FindDecisionVariableIndices(binding.variables()), dtype=np.intp)

        n, kinds = program.num_vars(), [x.get_type() for x in program.decision_variables()]
        constant, hessian, gradient = 0.0, np.zeros((n, n)), np.zeros(n)
        for binding in program.quadratic_costs():
            i, cost = places(binding), binding.evaluator()
            np.add.at(hessian, (i[:, None], i), cost.Q())
            np.add.at(gradient, i, cost.b())
            constant += cost.c()
        for binding in program.linear_costs():
            np.add.at(gradient, places(binding), binding.evaluator().a())
            constant += binding.evaluator().b()
        rows, lower, upper = [np.zeros((0, n))], [np.zeros(0)], [np.zeros(0)]
        for binding in (*program.linear_constraints(), *program.linear_equality_constraints()):
            constraint = binding.evaluator()
            rows.append(np.zeros((constraint.num_constraints(), n)))
            np.add.at(rows[-1].T, places(binding), constraint.GetDenseA().T)
            lower.append(constraint.lower_bound())
            upper.append(constraint.upper_bound())
        binary = np.array([kind == Variable.Type.BINARY for kind in kinds], dtype=bool)
        least, most = np.where(binary, 0.0, -np.inf), np.where(binary, 1.0, np.inf)
        for binding in program.bounding_box_constraints():
            np.maximum.at(least, places(binding), binding.evaluator().lower_bound())
            np.minimum.at(most, places(binding), binding.evaluator().upper_bound())
        least, most = np.where(binary, np.ceil(least), least), np.where(binary, np.floor(most), most)
        bounds = np.concatenate(lower), np.concatenate(upper), least, most
        return cls(constant, hessian, gradient, np.concatenate(rows), *bounds, binary)

    @cached_property
    def fault(self) -> SolutionResult | None:
        """INVALID or INFEASIBLE, if that shows at sight."""
        bounds = np.concatenate([self.lower, self.upper, self.least, self.most])
        coefficients = self.constant, self.hessian, self.gradient, self.rows
        if np.isnan(bounds).any() or not all(np.isfinite(values).all() for values in coefficients):
            return INVALID
        crossed = (self.least > self.most).any() or (self.lower > self.upper).any()
        empty = ~self.rows.any(axis=1)
        return INFEASIBLE if crossed or ((self.lower > 0.0) | (self.upper < 0.0))[empty].any() else None

    @cached_property
    def own(self) -> Flags:
        """Variables with a quadratic cost that involves no other variable, (n,)."""
        return np.asarray(((self.hessian != 0.0).sum(axis=0) == 1) & (self.hessian.diagonal() > 0.0))

    @cached_property
    def scaled(self) -> _Scaled:
        """The scaled problem for DAQP."""
        return _Scaled(self)

    def cost(self, x: Array) -> float:
        """The cost at x, (n,)."""
        return self.constant + float((self.gradient + 0.5 * np.einsum("ij,j->i", self.hessian, x)) @ x)

    def is_met(self, x: Array, *, relaxed: bool) -> bool:
        """Whether x, (n,), satisfies all constraints, and binary variables are binary, or `relaxed`."""
        if not np.isfinite(x).all():
            return False
        at, off = np.einsum("ij,j->i", self.rows, x), np.abs(x - x.round())[self.binary & (not relaxed)]
        sides = (self.lower - at, at - self.upper, self.least - x, x - self.most, off)
        return bool(np.concatenate(sides).max(initial=0.0) <= _FEASIBLE)

    def is_feasible(self, limits: SolverLimits) -> SolutionResult:
        """FOUND if DAQP finds any x: the nearest to 0."""
        n = len(self.gradient)
        return replace(self, constant=0.0, hessian=np.eye(n), gradient=np.zeros(n)).scaled.solve(limits).ended

    def minimise(self, guess: Array | None, limits: SolverLimits) -> Optimum:
        """The optimum, checked: a solver may be wrong. `guess` (n,): where to start; None or not finite: nowhere."""
        nowhere, relaxed = np.full(len(self.gradient), np.nan), bool(limits.relaxed)
        if self.fault is not None:
            return Optimum(self.fault, nowhere)
        # besides binary variables there are directions without curvature: the cost may fall for ever
        recedes = not relaxed and self.binary.any() and not self.own[~self.binary].all()
        if recedes and self.scaled.solve(limits._replace(relaxed=1)).ended == UNBOUNDED:
            feasible = self.is_feasible(limits)
            return Optimum(UNBOUNDED if feasible == FOUND else feasible, nowhere)
        start = guess if guess is not None and self.is_met(guess, relaxed=relaxed) else None
        cost = math.inf if start is None else self.cost(start)
        optimum = self.scaled.solve(limits, cost + _AGAIN * abs(cost))
        if optimum.ended == STOPPED and start is not None and not self.cost(optimum.x) < cost:
            return optimum._replace(x=start)
        wrong = optimum.ended == FOUND and not self.is_met(optimum.x, relaxed=relaxed)
        if optimum.ended == INFEASIBLE:
            wrong = start is not None or self.is_feasible(limits) == FOUND
        return optimum._replace(ended=FAILED) if wrong else optimum


class _Scaled:
    """A `Form` scaled for DAQP to a unit diagonal of the Hessian, without variables that are solved separately."""

    def __init__(self, form: Form) -> None:
        self.form, diagonal, used = form, form.hessian.diagonal(), form.rows != 0.0
        # A variable with a quadratic cost of its own that is in no row gets its best value here; with slack, which is
        # in one row and only helps to meet it, its row is a soft one. DAQP would be slower with them.
        self.base = np.zeros(len(diagonal))
        free = form.own & ~form.binary & ~used.any(axis=0)
        self.base[free] = np.clip(-form.gradient[free] / diagonal[free], form.least[free], form.most[free])
        self.rows = np.flatnonzero((np.isfinite(form.lower) | np.isfinite(form.upper)) & used.any(axis=1))
        self.slack = self._slack(used)[self.rows]  # variable of each row, or -1
        seen = ~free
        seen[self.slack[self.slack >= 0]] = False
        k = self.kept = np.flatnonzero(seen)
        self.largest = diagonal[k].max(initial=0.0) or np.abs(form.gradient[k]).max(initial=0.0) or 1.0
        self.scale = np.sqrt(np.where(diagonal[k] > _FLAT * self.largest, diagonal[k] / self.largest, 1.0))
        self.hessian = form.hessian[np.ix_(k, k)] / (self.scale[:, None] * self.scale) / self.largest
        self.gradient = form.gradient[k] / self.scale / self.largest
        self.matrix = form.rows[np.ix_(self.rows, k)] / self.scale
        self.lower = np.append(form.least[k] * self.scale, form.lower[self.rows]).clip(-_NO_BOUND, _NO_BOUND)
        self.upper = np.append(form.most[k] * self.scale, form.upper[self.rows]).clip(-_NO_BOUND, _NO_BOUND)

    def _slack(self, used: Flags) -> Indices:
        form = self.form
        bounds = (form.gradient == 0.0) & (form.least == 0.0) & (form.most == np.inf)
        j = np.flatnonzero(form.own & ~form.binary & bounds & (used.sum(axis=0) == 1))
        row, slack = np.nonzero(used[:, j].T)[1], np.full(len(used), -1)
        helps = (form.rows[row, j] > 0.0) & (form.upper[row] == np.inf)
        slack[row[helps]] = j[helps]
        return slack

    def solve(self, limits: SolverLimits, known: float = math.inf) -> Optimum:
        """The optimum, unless it costs more than `known`."""
        # Where the Hessian is singular, DAQP approaches the solution by proximal points. Where it fails, each binary
        # variable x gets the cost c (x^2 - x) / 2, which is 0 at 0 and 1.
        form, k, x, multipliers = self.form, len(self.kept), self.base.copy(), np.zeros(len(self.form.rows))
        if k == 0:
            return Optimum(FOUND, x, Details(multipliers=multipliers))
        binary, soft = form.binary[self.kept] & (not limits.relaxed), self.slack >= 0
        rows, j = self.rows[soft], self.slack[soft]
        entering, softness = form.rows[rows, j], np.ones(len(self.lower))
        softness[k:][soft] = self.largest * entering**2 / form.hessian[j, j]  # reciprocal weights
        sense = np.append(np.where(binary, _BINARY, 0), np.where(soft, _SOFT, 0)).astype(np.intc)
        info = dict[str, Any]()
        for curvature, proximal in _APPROACHES if binary.any() else _APPROACH:
            model = daqp.Model()
            model.settings = {
                "presolve": 0, "primal_tol": _TIGHT, "iter_limit": int(limits.iter_limit), "eps_prox": proximal,
                "fval_bound": min((known - form.cost(self.base)) / self.largest, _NO_BOUND),
                "time_limit": max(limits.time_limit, 1e-6) if 0.0 < limits.time_limit < math.inf else 0.0,
            }  # fmt: skip
            added = np.where(binary, curvature, 0.0)
            hessian = self.hessian + np.diag(added) if curvature else self.hessian
            gradient = self.gradient - 0.5 * added * self.scale
            flag, _ = model.setup(hessian, gradient, self.matrix, self.upper, self.lower, sense)
            if flag >= 0:
                model.soft_weights(rho_l=softness, rho_u=softness)
                scaled, _, flag, info = model.solve()
            if flag in _ENDED:
                break
        if flag > 0:
            x[self.kept] = scaled / self.scale
            if not limits.relaxed:
                x[form.binary] = x[form.binary].round()
            x = np.clip(x, form.least, form.most)
            x[j] = np.maximum(0.0, form.lower[rows] - np.einsum("ij,j->i", form.rows[rows], x)) / entering
            multipliers[self.rows] = -self.largest * info["lam"][k:]
        details = Details(info.get("iterations", 0), info.get("nodes", 0), multipliers)
        return Optimum(_ENDED.get(flag, FAILED), x if flag > 0 else np.full(len(x), np.nan), details)


def _fill(result: MathematicalProgramResult, variables: Array, optimum: Optimum, cost: float) -> None:
    """Put a solution into a result of Drake."""
    # Python can set neither its variables nor its cost: CLP does, for a program without constraints. It takes no binary
    # variables, so continuous ones stand in for them.
    shell, binary = MathematicalProgram(), Variable.Type.BINARY
    stand_ins = [Variable(x.get_name()) if x.get_type() == binary else x for x in variables]
    shell.AddDecisionVariables(np.array(stand_ins, dtype=object))
    shell.AddLinearCost(np.zeros(len(variables)), cost, shell.decision_variables())
    ClpSolver().Solve(shell, None, None, result)
    result.set_x_val(optimum.x)
    result.set_solution_result(optimum.ended)


class DaqpResult(MathematicalProgramResult):  # type: ignore[misc]
    """A result that also has the values of binary variables, and the details of the solution."""

    def __init__(self) -> None:
        super().__init__()
        self._index, self._details = dict[int, int](), Details()

    def GetSolution(self, *what: Any) -> Any:
        """As `MathematicalProgramResult.GetSolution`: all values, or those of a variable, an expression, or arrays."""
        if not what:
            return self.get_x_val()
        if isinstance(what[0], np.ndarray):
            return np.array([self.GetSolution(entry) for entry in what[0].ravel()]).reshape(what[0].shape)
        if isinstance(what[0], Variable) and what[0].get_id() in self._index:
            return self.get_x_val()[self._index[what[0].get_id()]]
        if isinstance(what[0], Expression):
            return what[0].EvaluatePartial({x: self.GetSolution(x) for x in what[0].GetVariables()})
        return super().GetSolution(*what)

    def get_solver_id(self) -> SolverId:
        """DAQP."""
        return DaqpSolver.id()

    def get_solver_details(self) -> Details:
        """Iterations, nodes and multipliers."""
        return self._details


class DaqpSolver(SolverInterface):  # type: ignore[misc]
    """DAQP for any `MathematicalProgram` that is a convex quadratic program, with binary variables or without.

    An initial guess that satisfies all constraints bounds the search: more expensive branches are cut. It is the
    solution if a limit is reached before anything cheaper was found. Threads may share a solver.

    Scale the program: where coefficients differ by a factor of about 1e6, it may fail, or call a program unbounded
    that is not (on random programs of this kind, about once in a thousand).

    Its options in `SolverOptions` are those of `SolverLimits`, under `DaqpSolver.id()`. Common options have no effect:
    it runs in one thread and prints nothing.
    """

    NAME = "DAQP"
    _ID = SolverId(NAME)

    @classmethod
    def id(cls) -> SolverId:
        """The identifier of this solver's options."""
        return cls._ID

    def solver_id(self) -> SolverId:
        """The identifier under which options of this solver are stored."""
        return self._ID

    def available(self) -> bool:
        """True: it comes with this package."""
        return True

    def enabled(self) -> bool:
        """True: it needs no licence."""
        return True

    def AreProgramAttributesSatisfied(self, prog: MathematicalProgram) -> bool:
        """Whether it solves programs of this kind."""
        return not self.ExplainUnsatisfiedProgramAttributes(prog)

    def ExplainUnsatisfiedProgramAttributes(self, prog: MathematicalProgram) -> str:
        """Why it does not solve programs of this kind; '' if it does."""
        if beyond := prog.required_capabilities() - SUPPORTED:
            names = ", ".join(sorted(attribute.name.removeprefix("k") for attribute in beyond))
            return f"DaqpSolver is unable to solve because a {names} was declared but is not supported."
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
        form = Form.of(prog)
        optimum = form.minimise(guess, limits)
        filled = DaqpResult() if result is None else result
        _fill(filled, prog.decision_variables(), optimum, _COSTS.get(optimum.ended) or form.cost(optimum.x))
        if isinstance(filled, DaqpResult):
            filled._index, filled._details = prog.decision_variable_index(), optimum.details
        return filled if result is None else None


_COSTS = {INFEASIBLE: math.inf, UNBOUNDED: -math.inf}


def _limits(*given: SolverOptions | None) -> SolverLimits:
    """From options of Drake, the later ones counting more."""
    chosen = dict[str, Any]()
    for options in filter(None, given):
        chosen |= options.options.get(DaqpSolver.NAME, {})
    if unknown := sorted(chosen.keys() - set(SolverLimits._fields)):
        raise ValueError(
            f"{DaqpSolver.NAME}: no options {', '.join(unknown)}; allowed: {', '.join(SolverLimits._fields)}"
        )
    return SolverLimits(**chosen)
