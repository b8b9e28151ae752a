"""A MathematicalProgram as arrays: a convex quadratic program, some of whose variables are binary."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from pydrake.solvers import MathematicalProgram
from pydrake.symbolic import Variable

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit

Indices = npt.NDArray[np.intp]
Flags = npt.NDArray[np.bool_]


class Layout:
    """What stays while only coefficients of a program change: which variables it has, and which of them are in a cost.

    Attributes:
        index: place of each variable, by its identifier.
        variables: (n,).
        binary: (n,).
    """

    MOST = 256
    """Bindings that are remembered."""

    def __init__(self, program: MathematicalProgram) -> None:
        """Of a program as it is now."""
        self.index: dict[int, int] = program.decision_variable_index()
        self.variables = program.decision_variables()
        self.binary = np.array([x.get_type() == Variable.Type.BINARY for x in self.variables], dtype=bool)
        self._indices: dict[Any, Indices | slice] = {}

    def fits(self, program: MathematicalProgram) -> bool:
        """Whether the program has these variables in this order; a variable never changes its type."""
        return bool(self.index == program.decision_variable_index())

    def indices(self, program: MathematicalProgram, binding: Any) -> Indices | slice:
        """Places of the variables of a cost or constraint, in its order; a slice, which is quicker, if they are one."""
        if binding not in self._indices:
            if len(self._indices) >= self.MOST:
                self._indices.clear()
            found = np.asarray(program.FindDecisionVariableIndices(binding.variables()), dtype=np.intp)
            follow = len(found) and (np.diff(found) == 1).all()
            self._indices[binding] = slice(int(found[0]), int(found[-1]) + 1) if follow else found
        return self._indices[binding]


class StandardForm(NamedTuple):
    """min x' H x / 2 + f' x + constant  so that  lower <= A x <= upper,  least <= x <= most,  x[binary] in {0, 1}.

    Attributes:
        hessian: H, symmetric, (n, n).
        gradient: f, (n,).
        constant: added to the cost.
        rows: A, (m, n): the rows of all linear constraints, then those of all linear equality constraints.
        lower: bounds of the rows, (m,), -inf without one.
        upper: bounds of the rows, (m,), inf without one.
        least: bounds of the variables, (n,), -inf without one.
        most: bounds of the variables, (n,), inf without one.
        binary: (n,).
    """

    hessian: Array
    gradient: Array
    constant: float
    rows: Array
    lower: Array
    upper: Array
    least: Array
    most: Array
    binary: Flags

    @classmethod
    def of(cls, program: MathematicalProgram, layout: Layout) -> StandardForm:
        """Of a program with linear and quadratic costs and with linear constraints; others are not read."""
        return cls(*_cost(program, layout), *_rows(program, layout), *_bounds(program, layout), layout.binary)

    def cost(self, x: Array) -> float:
        """The cost at x, (n,)."""
        return float(_cost_at(self, x))

    def violation(self, x: Array) -> float:
        """Largest violation of a constraint at x, (n,), relative to the row where its entries are above 1."""
        return float(_violation(self, x))

    def relaxed(self) -> StandardForm:
        """The program with shares in [0, 1] for the binary variables."""
        return self._replace(binary=np.zeros_like(self.binary))

    def with_value(self, i: int, value: float) -> StandardForm:
        """The program with one of its variables fixed."""
        here = np.arange(len(self.gradient)) == i
        return self._replace(least=np.where(here, value, self.least), most=np.where(here, value, self.most))

    def without_cost(self) -> StandardForm:
        """The same constraints, with the squared distance from 0 for a cost."""
        return self._replace(hessian=np.eye(len(self.gradient)), gradient=np.zeros(len(self.gradient)))

    def contradicts_itself(self) -> bool:
        """Whether a lower bound is above an upper one, or a row without coefficients demands something."""
        return bool(_contradicts_itself(self))

    def separate(self) -> tuple[Flags, Indices]:
        """Continuous variables with a quadratic cost of their own and no other.

        Returns:
            Those that stand in no row, (n,).
            The one that is the slack of each row, (m,), -1 without one. Its cost is least at 0, it stands in no
            other row, and it may grow without bound in the direction that the one bound of its row needs.
        """
        unconstrained, slack = _separate(self)
        return unconstrained, slack

    def is_number(self) -> bool:
        """Whether all coefficients are finite and no bound is NaN."""
        finite = all(np.isfinite(one).all() for one in (self.hessian, self.gradient, self.rows, self.constant))
        bounds = (self.lower, self.upper, self.least, self.most)
        return finite and not any(np.isnan(one).any() for one in bounds)


@njit(cache=True)
def _cost_at(form: StandardForm, x: Array) -> float:
    """By loops, as all here: BLAS would start threads, which cost more than such small programs."""
    total = form.constant
    for i in range(len(x)):
        slope = form.gradient[i]
        for j in range(len(x)):
            slope += 0.5 * form.hessian[i, j] * x[j]
        total += slope * x[i]
    return total


@njit(cache=True)
def times(matrix: Array, which: Indices, x: Array) -> Array:
    """The products of some rows of a matrix with x, (p,)."""
    found = np.zeros(len(which))
    for r in range(len(which)):
        for i in range(len(x)):
            found[r] += matrix[which[r], i] * x[i]
    return found


@njit(cache=True)
def _violation(form: StandardForm, x: Array) -> float:
    largest, most = 1.0, 0.0
    rows, lower, upper = form.rows, form.lower, form.upper
    for i in range(len(x)):
        largest = max(largest, abs(x[i]))
        most = max(most, form.least[i] - x[i], x[i] - form.most[i])
        if form.binary[i]:
            most = max(most, min(abs(x[i]), abs(x[i] - 1.0)))
    for r in range(len(lower)):
        at, entry = 0.0, 0.0
        for i in range(len(x)):
            at += rows[r, i] * x[i]
            entry = max(entry, abs(rows[r, i]))
        most = max(most, max(lower[r] - at, at - upper[r]) / max(1.0, entry * largest))
    return most


@njit(cache=True)
def _contradicts_itself(form: StandardForm) -> bool:
    if (form.least > form.most).any() or (form.lower > form.upper).any():
        return True
    found = False
    for r in range(len(form.lower)):
        found |= (form.lower[r] > 0.0 or form.upper[r] < 0.0) and not form.rows[r].any()
    return found


@njit(cache=True)
def _separate(form: StandardForm) -> tuple[Flags, Indices]:
    hessian, rows = form.hessian, form.rows
    unconstrained, slack = np.zeros(len(hessian), dtype=np.bool_), np.full(len(rows), -1, dtype=np.intp)
    for j in range(len(hessian)):
        if form.binary[j] or hessian[j, j] <= 0.0 or np.count_nonzero(hessian[j]) > 1:
            continue
        uses, row = 0, -1
        for r in range(len(rows)):
            if rows[r, j] != 0.0:
                uses, row = uses + 1, r
        unconstrained[j] = uses == 0
        if uses == 1 and form.gradient[j] == 0.0:
            from_below = np.isfinite(form.lower[row])
            one_sided = from_below != np.isfinite(form.upper[row])
            grows = form.least[j] <= 0.0 and form.most[j] == np.inf
            falls = form.most[j] >= 0.0 and form.least[j] == -np.inf
            if one_sided and (grows if (rows[row, j] > 0.0) == from_below else falls):
                slack[row] = j
    return unconstrained, slack


def _cost(program: MathematicalProgram, layout: Layout) -> tuple[Array, Array, float]:
    n, constant = program.num_vars(), 0.0
    hessian, gradient = np.zeros((n, n)), np.zeros(n)
    for binding in program.quadratic_costs():
        quadratic, i = binding.evaluator(), layout.indices(program, binding)
        _add(hessian, (i, i) if isinstance(i, slice) else (i[:, None], i), quadratic.Q())
        _add(gradient, (i,), quadratic.b())
        constant += quadratic.c()
    for binding in program.linear_costs():
        linear, i = binding.evaluator(), layout.indices(program, binding)
        _add(gradient, (i,), linear.a())
        constant += linear.b()
    return hessian, gradient, constant


def _rows(program: MathematicalProgram, layout: Layout) -> tuple[Array, Array, Array]:
    """A and its bounds."""
    rows, lower, upper = [np.zeros((0, program.num_vars()))], [np.zeros(0)], [np.zeros(0)]
    for binding in (*program.linear_constraints(), *program.linear_equality_constraints()):
        constraint, i = binding.evaluator(), layout.indices(program, binding)
        matrix = np.zeros((constraint.num_constraints(), program.num_vars()))
        _add(matrix, (slice(None), i), constraint.GetDenseA())
        rows.append(matrix)
        lower.append(constraint.lower_bound())
        upper.append(constraint.upper_bound())
    return np.concatenate(rows), np.concatenate(lower), np.concatenate(upper)


def _bounds(program: MathematicalProgram, layout: Layout) -> tuple[Array, Array]:
    """Bounds of the variables, those of a binary one moved to the nearest of 0 and 1 inside them."""
    least, most = np.full(program.num_vars(), -np.inf), np.full(program.num_vars(), np.inf)
    for binding in program.bounding_box_constraints():
        box, i = binding.evaluator(), layout.indices(program, binding)
        if isinstance(i, slice):
            least[i], most[i] = np.maximum(least[i], box.lower_bound()), np.minimum(most[i], box.upper_bound())
        else:
            np.maximum.at(least, i, box.lower_bound())
            np.minimum.at(most, i, box.upper_bound())
    binary = layout.binary
    least[binary] = np.ceil(np.maximum(least[binary], 0.0))
    most[binary] = np.floor(np.minimum(most[binary], 1.0))
    return least, most


def _add(total: Array, where: Any, values: Array) -> None:
    """Add values at indices; indices, but not slices, may repeat."""
    if all(isinstance(one, slice) for one in where):
        total[where] += values
    else:
        np.add.at(total, where, values)
