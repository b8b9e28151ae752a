"""A MathematicalProgram as arrays: a convex quadratic program, some of whose variables are binary."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from pydrake.solvers import MathematicalProgram
from pydrake.symbolic import Variable

from airground_drake.base.arrays import Array

Indices = npt.NDArray[np.intp]
Flags = npt.NDArray[np.bool_]


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
    def of(cls, program: MathematicalProgram) -> StandardForm:
        """Of a program with linear and quadratic costs and with linear constraints; others are not read."""
        binary = np.array([x.get_type() == Variable.Type.BINARY for x in program.decision_variables()], dtype=bool)
        return cls(*_cost(program), *_rows(program), *_bounds(program, binary), binary)

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

    def slack(self) -> Indices:
        """The variable that is the slack of each row and of nothing else, (m,); -1: there is none.

        It is continuous, has a quadratic cost of its own and no other, stands in no other row, and may grow without
        bound in the direction that the one bound of its row needs.
        """
        found = np.full(len(self.rows), -1, dtype=np.intp)
        diagonal = self.hessian.diagonal()
        alone = (diagonal > 0.0) & (np.count_nonzero(self.hessian, axis=0) == 1) & (self.gradient == 0.0)
        j = np.flatnonzero(alone & ~self.binary & (np.count_nonzero(self.rows, axis=0) == 1))
        if len(j) == 0:
            return found
        row = (self.rows[:, j] != 0.0).argmax(axis=0)
        from_below = np.isfinite(self.lower[row])
        one_sided = from_below != np.isfinite(self.upper[row])
        grows = (self.least[j] <= 0.0) & (self.most[j] == np.inf)
        falls = (self.most[j] >= 0.0) & (self.least[j] == -np.inf)
        fits = one_sided & np.where((self.rows[row, j] > 0.0) == from_below, grows, falls)
        found[row[fits]] = j[fits]
        return found

    def is_number(self) -> bool:
        """Whether all coefficients are finite and no bound is NaN."""
        finite = (self.hessian, self.gradient, np.array(self.constant), self.rows)
        bounds = (self.lower, self.upper, self.least, self.most)
        return all(np.isfinite(one).all() for one in finite) and not any(np.isnan(one).any() for one in bounds)


def _cost(program: MathematicalProgram) -> tuple[Array, Array, float]:
    n, constant = program.num_vars(), 0.0
    hessian, gradient = np.zeros((n, n)), np.zeros(n)
    for binding in program.quadratic_costs():
        quadratic, i = binding.evaluator(), _indices(program, binding)
        np.add.at(hessian, (i[:, None], i), quadratic.Q())
        np.add.at(gradient, i, quadratic.b())
        constant += quadratic.c()
    for binding in program.linear_costs():
        linear = binding.evaluator()
        np.add.at(gradient, _indices(program, binding), linear.a())
        constant += linear.b()
    return hessian, gradient, constant


def _rows(program: MathematicalProgram) -> tuple[Array, Array, Array]:
    """A and its bounds."""
    rows, lower, upper = [np.zeros((0, program.num_vars()))], [np.zeros(0)], [np.zeros(0)]
    for binding in (*program.linear_constraints(), *program.linear_equality_constraints()):
        constraint, i = binding.evaluator(), _indices(program, binding)
        matrix = np.zeros((constraint.num_constraints(), program.num_vars()))
        np.add.at(matrix, (slice(None), i), constraint.GetDenseA())
        rows.append(matrix)
        lower.append(constraint.lower_bound())
        upper.append(constraint.upper_bound())
    return np.concatenate(rows), np.concatenate(lower), np.concatenate(upper)


def _bounds(program: MathematicalProgram, binary: Flags) -> tuple[Array, Array]:
    """Bounds of the variables, those of a binary one moved to the nearest of 0 and 1 inside them."""
    least, most = np.full(program.num_vars(), -np.inf), np.full(program.num_vars(), np.inf)
    for binding in program.bounding_box_constraints():
        box, i = binding.evaluator(), _indices(program, binding)
        np.maximum.at(least, i, box.lower_bound())
        np.minimum.at(most, i, box.upper_bound())
    least[binary] = np.ceil(np.maximum(least[binary], 0.0))
    most[binary] = np.floor(np.minimum(most[binary], 1.0))
    return least, most


def _indices(program: MathematicalProgram, binding: object) -> Indices:
    found: Indices = np.asarray(program.FindDecisionVariableIndices(binding.variables()), dtype=np.intp)  # type: ignore[attr-defined]
    return found
