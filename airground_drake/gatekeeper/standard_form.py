"""A MathematicalProgram as arrays: a convex quadratic program, some of whose variables are binary."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from pydrake.solvers import MathematicalProgram
from pydrake.symbolic import Variable

from airground_drake.base.arrays import Array

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
        lower: (m,), -inf where there is none.
        upper: (m,), inf where there is none.
        least: (n,), -inf where there is none.
        most: (n,), inf where there is none.
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
        return float(0.5 * x @ self.hessian @ x + self.gradient @ x + self.constant)

    def violation(self, x: Array) -> float:
        """Largest violation of a constraint at x, (n,), relative to the row where its entries are above 1."""
        size = np.maximum(1.0, np.abs(self.rows).max(axis=1, initial=0.0) * max(1.0, np.abs(x).max(initial=0.0)))
        at = self.rows @ x
        of_rows = (np.maximum(self.lower - at, at - self.upper) / size).max(initial=0.0)
        of_bounds = np.maximum(self.least - x, x - self.most).max(initial=0.0)
        own = x[self.binary]
        return float(max(of_rows, of_bounds, np.minimum(np.abs(own), np.abs(own - 1.0)).max(initial=0.0)))

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
        empty = ~self.rows.any(axis=1)
        lower, upper = (
            np.where(empty, np.maximum(self.lower, 0.0), self.lower),
            np.where(empty, np.minimum(self.upper, 0.0), self.upper),
        )
        return bool((self.least > self.most).any() or (lower > upper).any())

    def separate(self) -> tuple[Flags, Indices]:
        """Continuous variables with a quadratic cost of their own and no other.

        Returns:
            Those that stand in no row, (n,).
            The one that is the slack of each row, (m,), -1 where there is none. Its cost is least at 0, it stands in no
            other row, and it may grow without bound in the direction that the one bound of its row needs.
        """
        diagonal, slack = self.hessian.diagonal(), np.full(len(self.rows), -1, dtype=np.intp)
        alone = (diagonal > 0.0) & (np.count_nonzero(self.hessian, axis=0) == 1) & ~self.binary
        uses = np.count_nonzero(self.rows, axis=0)
        j = np.flatnonzero(alone & (uses == 1) & (self.gradient == 0.0))
        if len(j):
            row = (self.rows[:, j] != 0.0).argmax(axis=0)
            from_below = np.isfinite(self.lower[row])
            one_sided = from_below != np.isfinite(self.upper[row])
            grows = (self.least[j] <= 0.0) & (self.most[j] == np.inf)
            falls = (self.most[j] >= 0.0) & (self.least[j] == -np.inf)
            fits = one_sided & np.where((self.rows[row, j] > 0.0) == from_below, grows, falls)
            slack[row[fits]] = j[fits]
        return alone & (uses == 0), slack

    def is_number(self) -> bool:
        """Whether all coefficients are finite and no bound is NaN."""
        finite = (self.hessian, self.gradient, np.array(self.constant), self.rows)
        bounds = (self.lower, self.upper, self.least, self.most)
        return all(np.isfinite(one).all() for one in finite) and not any(np.isnan(one).any() for one in bounds)


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
    """Add values at indices, some of which may be equal unless they are slices."""
    if all(isinstance(one, slice) for one in where):
        total[where] += values
    else:
        np.add.at(total, where, values)
