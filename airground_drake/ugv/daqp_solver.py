"""DAQP, a dual active-set solver with branch and bound, as a solver of Drake.

It solves convex quadratic and linear programs, also with binary variables, to a proven optimum, and needs no licence:

    result = DaqpSolver().Solve(program)

A program may have linear costs, convex quadratic costs, linear constraints, bounds and binary variables. The result
says whether it is infeasible or unbounded, or whether a limit stopped the search.
"""

from __future__ import annotations

import functools
import math
import threading
from typing import Any, NamedTuple

import daqp
import numpy as np
import numpy.typing as npt
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

# What a program may have. Visualization callbacks are not called.
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
_BINARY, _NO_BOUND = 16, 1e30
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
        time_limit: s; DAQP looks at the clock every 32 nodes. 0: none.
        iter_limit: iterations of the active-set method, at each node.
        relaxed: 1: binary variables may have any value in [0, 1].
    """

    time_limit: float = 0.0
    iter_limit: int = 10_000
    relaxed: int = 0


class Details(NamedTuple):
    """What DAQP says besides the solution.

    Attributes:
        iterations: of the active-set method, over all nodes.
        nodes: of branch and bound.
        multipliers: of the rows of all linear constraints, then of those of all linear equality constraints: the
            derivative of the optimal cost in the bound that is active, (m,). With binary variables, of the last node.
    """

    iterations: int = 0
    nodes: int = 0
    multipliers: Array = np.zeros(0)


class _Layout:
    """What stays while only coefficients of a program change."""

    # It includes a program without constraints by which CLP fills results: Python cannot set their variables, nor their
    # cost. CLP takes no binary variables, so continuous ones stand in for them.

    def __init__(self, program: MathematicalProgram) -> None:
        self.index: dict[int, int] = program.decision_variable_index()
        variables = program.decision_variables()
        self.binary = np.array([x.get_type() == Variable.Type.BINARY for x in variables], dtype=bool)
        self.places = functools.lru_cache(256)(self._places)
        self._shell, self._clp = MathematicalProgram(), ClpSolver()
        stand_ins = [Variable(x.get_name()) if binary else x for x, binary in zip(variables, self.binary, strict=True)]
        self._shell.AddDecisionVariables(np.array(stand_ins, dtype=object))
        self._cost = self._shell.AddLinearCost(np.zeros(len(variables)), self._shell.decision_variables())

    def fits(self, program: MathematicalProgram) -> bool:
        """Whether the program has these variables in this order; a variable never changes its type."""
        return bool(self.index == program.decision_variable_index())

    def _places(self, binding: Any) -> Any:
        """Indices of the variables of a cost or constraint, in its order; a slice, which is quicker, if possible."""
        indices = np.array([self.index[x.get_id()] for x in binding.variables()], dtype=np.intp)
        follow = len(indices) and (np.diff(indices) == 1).all()
        return slice(int(indices[0]), int(indices[-1]) + 1) if follow else indices

    def fill(self, result: MathematicalProgramResult, ended: SolutionResult, x: Array, cost: float) -> None:
        """Put a solution into a result of Drake."""
        self._cost.evaluator().UpdateCoefficients(np.zeros(len(x)), cost)
        self._clp.Solve(self._shell, None, None, result)
        result.set_x_val(x)
        result.set_solution_result(ended)


class _Form(NamedTuple):
    """min x' H x / 2 + f' x + constant  so that  lower <= A x <= upper,  least <= x <= most,  x[binary] in {0, 1}."""

    # H is (n, n), f, least, most and binary are (n,), A is (m, n), lower and upper are (m,); inf: no bound.

    constant: float
    hessian: Array
    gradient: Array
    rows: Array
    lower: Array
    upper: Array
    least: Array
    most: Array
    binary: npt.NDArray[np.bool_]

    @classmethod
    def of(cls, program: MathematicalProgram, layout: _Layout) -> _Form:
        """Read the evaluators; pydrake has no bindings for `AggregateQuadraticCosts` and the like."""
        n = program.num_vars()
        constant, hessian, gradient = 0.0, np.zeros((n, n)), np.zeros(n)
        for binding in program.quadratic_costs():
            i, cost = layout.places(binding), binding.evaluator()
            _add(hessian, (i, i) if isinstance(i, slice) else (i[:, None], i), cost.Q())
            _add(gradient, (i,), cost.b())
            constant += cost.c()
        for binding in program.linear_costs():
            _add(gradient, (layout.places(binding),), binding.evaluator().a())
            constant += binding.evaluator().b()
        rows, lower, upper = [np.zeros((0, n))], [np.zeros(0)], [np.zeros(0)]
        for binding in (*program.linear_constraints(), *program.linear_equality_constraints()):
            constraint = binding.evaluator()
            rows.append(np.zeros((constraint.num_constraints(), n)))
            _add(rows[-1], (slice(None), layout.places(binding)), constraint.GetDenseA())
            lower.append(constraint.lower_bound())
            upper.append(constraint.upper_bound())
        least = np.where(layout.binary, 0.0, -np.inf)
        most = np.where(layout.binary, 1.0, np.inf)
        for binding in program.bounding_box_constraints():
            np.maximum.at(least, layout.places(binding), binding.evaluator().lower_bound())
            np.minimum.at(most, layout.places(binding), binding.evaluator().upper_bound())
        least = np.where(layout.binary, np.ceil(least), least)
        most = np.where(layout.binary, np.floor(most), most)
        bounds = np.concatenate(lower), np.concatenate(upper), least, most
        return cls(constant, hessian, gradient, np.concatenate(rows), *bounds, layout.binary)

    def fault(self) -> SolutionResult | None:
        """INVALID or INFEASIBLE, if that shows at sight."""
        bounds = np.concatenate([self.lower, self.upper, self.least, self.most])
        if np.isnan(bounds).any() or not all(np.isfinite(coefficients).all() for coefficients in self[:4]):
            return INVALID
        crossed = (self.least > self.most).any() or (self.lower > self.upper).any()
        empty = ~self.rows.any(axis=1)
        return INFEASIBLE if crossed or ((self.lower > 0.0) | (self.upper < 0.0))[empty].any() else None

    def cost(self, x: Array) -> float:
        """The cost at x, (n,). By `einsum`, as all here: BLAS would start threads, which cost more than such sizes."""
        return self.constant + float((self.gradient + 0.5 * np.einsum("ij,j->i", self.hessian, x)) @ x)

    def is_met(self, x: Array) -> bool:
        """Whether x, (n,), satisfies all constraints, and binary variables are binary."""
        at, off = np.einsum("ij,j->i", self.rows, x), np.abs(x - x.round())[self.binary]
        sides = (self.lower - at, at - self.upper, self.least - x, x - self.most, off)
        return bool(np.isfinite(x).all() and np.concatenate(sides).max(initial=0.0) <= _FEASIBLE)

    def relaxed(self) -> _Form:
        """With shares in [0, 1] for the binary variables."""
        return self._replace(binary=np.zeros_like(self.binary))

    def without_cost(self) -> _Form:
        """The same constraints, with the squared distance from 0 for a cost."""
        n = len(self.gradient)
        return self._replace(constant=0.0, hessian=np.eye(n), gradient=np.zeros(n))

    def own(self) -> npt.NDArray[np.bool_]:
        """Variables with a quadratic cost that involves no other variable, (n,)."""
        return np.asarray(((self.hessian != 0.0).sum(axis=0) == 1) & (self.hessian.diagonal() > 0.0))

    def may_recede(self) -> bool:
        """Whether, besides binary variables, there are directions without curvature: the cost may fall for ever."""
        return bool(self.binary.any() and not self.own()[~self.binary].all())

    def solve(self, limits: SolverLimits, known: float = math.inf) -> tuple[SolutionResult, Array, Details]:
        """How it ended, x (n,), NaN without a solution, and details; what costs more than `known` is not looked for."""
        # A variable with a quadratic cost of its own that is in no row needs no solver: DAQP would be slower with it.
        free = self.own() & ~self.binary & ~self.rows.any(axis=0)
        x, k = np.zeros(len(free)), np.flatnonzero(~free)
        x[free] = np.clip(-self.gradient[free] / self.hessian.diagonal()[free], self.least[free], self.most[free])
        rest = self._replace(
            constant=self.cost(x), hessian=self.hessian[np.ix_(k, k)], gradient=self.gradient[k], rows=self.rows[:, k],
            least=self.least[k], most=self.most[k], binary=self.binary[k],
        )  # fmt: skip
        ended, x[k], details = rest._by_daqp(limits, known)
        return ended, x if np.isfinite(x).all() else np.full(len(x), np.nan), details

    def _by_daqp(self, limits: SolverLimits, known: float) -> tuple[SolutionResult, Array, Details]:
        # Variables are scaled to a unit diagonal of the Hessian. Where it is singular, DAQP approaches the solution by
        # proximal points. Where it fails, each binary variable x gets the cost c (x^2 - x) / 2, which is 0 at 0 and 1.
        n, multipliers = len(self.gradient), np.zeros(len(self.rows))
        if n == 0:
            return FOUND, np.zeros(0), Details(multipliers=multipliers)
        diagonal = self.hessian.diagonal()
        largest = diagonal.max() or np.abs(self.gradient).max() or 1.0
        scale = np.sqrt(np.where(diagonal > _FLAT * largest, diagonal / largest, 1.0))
        hessian = self.hessian / (scale[:, None] * scale) / largest
        gradient = self.gradient / scale / largest
        rows = np.flatnonzero((np.isfinite(self.lower) | np.isfinite(self.upper)) & self.rows.any(axis=1))
        upper = np.concatenate([self.most * scale, self.upper[rows]]).clip(-_NO_BOUND, _NO_BOUND)
        lower = np.concatenate([self.least * scale, self.lower[rows]]).clip(-_NO_BOUND, _NO_BOUND)
        sense = np.zeros(len(upper), dtype=np.intc)
        sense[:n][self.binary] = _BINARY
        x, info = np.full(n, np.nan), dict[str, Any]()
        for curvature, proximal in _APPROACHES if self.binary.any() else _APPROACH:
            added = np.where(self.binary, curvature, 0.0)
            model = daqp.Model()
            model.settings = {
                "presolve": 0, "primal_tol": _TIGHT, "iter_limit": int(limits.iter_limit), "eps_prox": proximal,
                "fval_bound": min((known - self.constant) / largest, _NO_BOUND),
                "time_limit": max(limits.time_limit, 1e-6) if 0.0 < limits.time_limit < math.inf else 0.0,
            }  # fmt: skip
            linear = gradient - 0.5 * added * scale
            flag, _ = model.setup(hessian + np.diag(added), linear, self.rows[rows] / scale, upper, lower, sense)
            if flag >= 0:
                scaled, _, flag, info = model.solve()
            if flag in _ENDED:
                break
        if flag > 0:
            x = scaled / scale
            x[self.binary] = x[self.binary].round()
            x = np.clip(x, self.least, self.most)
            multipliers[rows] = -largest * info["lam"][n:]
        return _ENDED.get(flag, FAILED), x, Details(info.get("iterations", 0), info.get("nodes", 0), multipliers)


def _add(total: Array, where: Any, values: Array) -> None:
    """Add values at indices; indices, but not slices, may repeat."""
    if all(isinstance(axis, slice) for axis in where):
        total[where] += values
    else:
        np.add.at(total, where, values)


def _minimise(form: _Form, guess: Array, limits: SolverLimits) -> tuple[SolutionResult, Array, Details]:
    """The optimum, checked: a solver may be wrong. `guess` (n,): where to start; not finite: nowhere."""
    nothing = np.full(len(guess), np.nan), Details()
    if (fault := form.fault()) is not None:
        return fault, *nothing
    if form.may_recede() and form.relaxed().solve(limits)[0] == UNBOUNDED:
        feasible = form.without_cost().solve(limits)[0]
        return UNBOUNDED if feasible == FOUND else feasible, *nothing
    guessed = form.is_met(guess)
    cost = form.cost(guess) if guessed else math.inf
    ended, x, details = form.solve(limits, cost + _AGAIN * abs(cost))
    if ended == STOPPED and guessed and not form.cost(x) < cost:
        x = guess
    wrong = ended == FOUND and not form.is_met(x)
    if ended == INFEASIBLE:
        wrong = guessed or form.without_cost().solve(limits)[0] == FOUND
    return FAILED if wrong else ended, x, details


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

    def __init__(self) -> None:
        """Each thread keeps the layout of its last program: with other coefficients it is solved sooner."""
        super().__init__()
        self._of_thread = threading.local()

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
        layout: _Layout | None = getattr(self._of_thread, "layout", None)
        if layout is None or not layout.fits(prog):
            layout = self._of_thread.layout = _Layout(prog)
        form = _Form.of(prog, layout)
        ended, x, details = _minimise(form.relaxed() if limits.relaxed else form, guess, limits)
        filled = DaqpResult() if result is None else result
        layout.fill(filled, ended, x, _COSTS.get(ended) or form.cost(x))
        if isinstance(filled, DaqpResult):
            filled._index, filled._details = layout.index, details
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
