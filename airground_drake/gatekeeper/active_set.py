"""Convex quadratic programs with binary variables, by DAQP: a dual active-set method with branch and bound.

Before DAQP sees a program, four things change it without changing its solutions:

- *Constants.* A variable whose bounds are equal is one; so is one with a quadratic cost of its own and no constraint.
- *Slack.* DAQP has soft rows, which are far quicker than variables. A continuous variable becomes one if it has a
  quadratic cost of its own, and no other, and stands in a single one-sided constraint that it can always meet.
- *Scale.* Variables are scaled to a unit diagonal of the Hessian.
- *Curvature.* DAQP needs a positive definite Hessian. Where it is singular, each binary variable x gets the cost
  c (x^2 - x) / 2, which is 0 at 0 and at 1. If that is not enough, continuous variables x get c (x - y)^2 / 2, and y is
  moved to the solution until both agree (proximal point method); branch and bound is then done here, not by DAQP.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import daqp
import numpy as np
from pydrake.solvers import SolutionResult

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit
from airground_drake.gatekeeper.standard_form import Flags, Indices, StandardForm, times

_BINARY, _SOFT, _NO_BOUND = 16, 8, 1e30
_ENDED = {
    1: SolutionResult.kSolutionFound, 2: SolutionResult.kSolutionFound,
    5: SolutionResult.kIterationLimit, -4: SolutionResult.kIterationLimit, -7: SolutionResult.kIterationLimit,
    -1: SolutionResult.kInfeasibleConstraints, -3: SolutionResult.kUnbounded, -5: SolutionResult.kInvalidInput,
}  # fmt: skip
"""What DAQP's flags mean; 5: stopped with a solution, -7: stopped without one. Others are failures."""

_FLAT = 1e-24
"""A variable counts as linear if its curvature is below this share of the largest."""
_SINGULAR = 1e-10
"""Least square of a pivot in a Cholesky factorisation, with a unit diagonal, of a Hessian that is taken as it is."""
_BINARY_CURVATURE = 1e-6
"""Curvature c that binary variables get where the Hessian is singular, in units of the largest: more makes a search
longer, as it weakens the bounds."""
_CURVATURES = (1e-3, 1e-5, 1e-7, 1e-9)
"""Curvature c that continuous variables get where it is still singular; the less, the fewer steps."""
_STEPS = 60
"""Steps of the proximal point method, with each curvature."""
_STILL = 1e-9
"""It ends when no variable moves by more than this, relative."""
_ALONG = 1e-9
"""Rates along a direction, relative, up to this count as 0."""
_FEASIBLE = 1e-6
"""Largest violation of a constraint, relative to its row, of a guess or a solution."""
_AGAIN = 1e-7
"""A search finds the guess again if nothing is cheaper: its cost may be this much above that of the guess, relative."""


class SolverLimits(NamedTuple):
    """Limits of a solution, by the names of DAQP's own settings.

    Attributes:
        time_limit: s; DAQP looks at the clock every 32 nodes. 0: none.
        iter_limit: iterations of the active-set method, at each node.
        fval_bound: a cost. Solutions that cost more are not looked for: if all do, the program counts as infeasible.
        primal_tol: of constraints, in the scaled variables.
    """

    time_limit: float = 0.0
    iter_limit: int = 10_000
    fval_bound: float = math.inf
    primal_tol: float = 1e-9


@dataclass(frozen=True, eq=False)
class Details:
    """What DAQP says besides the solution.

    Attributes:
        iterations: of the active-set method, over all nodes.
        nodes: of branch and bound.
        multipliers: of the rows of the standard form: the derivative of the optimal cost in the bound that is active,
            (m,). With binary variables, those of the last node.
    """

    iterations: int = 0
    nodes: int = 0
    multipliers: Array = field(default_factory=lambda: np.zeros(0))

    def after(self, before: Details) -> Details:
        """With the iterations and nodes of a solution before it."""
        return replace(self, iterations=before.iterations + self.iterations, nodes=before.nodes + self.nodes)


class ProgramSolution(NamedTuple):
    """The answer to a program: x (n,), NaN without a solution."""

    ended: SolutionResult
    x: Array
    details: Details


def minimise(form: StandardForm, guess: Array, limits: SolverLimits) -> ProgramSolution:
    """The optimum of a program in standard form.

    Args:
        form: the program.
        guess: where to start, (n,); not finite: nowhere.
        limits: limits and tolerances.
    """
    nothing = np.full(len(form.gradient), np.nan)
    if not form.is_number():
        return ProgramSolution(SolutionResult.kInvalidInput, nothing, Details())
    if form.contradicts_itself():
        return ProgramSolution(SolutionResult.kInfeasibleConstraints, nothing, Details())
    if not np.isfinite(guess).all() or form.violation(guess) > _FEASIBLE:
        answer = _search(form, limits)
        doubtful = answer.ended == SolutionResult.kInfeasibleConstraints and limits.fval_bound == math.inf
        if doubtful and _search(form.without_cost(), limits).ended == SolutionResult.kSolutionFound:
            return answer._replace(ended=SolutionResult.kSolverSpecificError)
        return answer
    known = form.cost(guess)
    answer = _search(form, limits._replace(fval_bound=min(limits.fval_bound, known + _AGAIN * abs(known))))
    if answer.ended == SolutionResult.kIterationLimit and not form.cost(answer.x) < known:
        return answer._replace(x=guess)
    if answer.ended == SolutionResult.kInfeasibleConstraints and known <= limits.fval_bound:  # the guess disproves it
        return answer._replace(ended=SolutionResult.kSolverSpecificError)
    return answer


def _search(form: StandardForm, limits: SolverLimits) -> ProgramSolution:
    """The optimum, with a check that it satisfies the constraints."""
    scaled = _Scaled.of(form)
    if not scaled.branches:
        answer = _approach(form, limits)
    else:
        answer = _branch(form, limits) if scaled.curvature else scaled.branch(limits)
    if len(scaled.kept) == 0 and answer.ended == SolutionResult.kSolutionFound and form.violation(answer.x) > _FEASIBLE:
        return ProgramSolution(SolutionResult.kInfeasibleConstraints, np.full(len(answer.x), np.nan), answer.details)
    if answer.ended == SolutionResult.kSolutionFound and not form.violation(answer.x) <= _FEASIBLE:
        return answer._replace(ended=SolutionResult.kSolverSpecificError)
    return answer


def _branch(form: StandardForm, limits: SolverLimits) -> ProgramSolution:
    """The optimum by depth-first branch and bound, with the proximal point method at each node."""
    until = time.monotonic() + (limits.time_limit or math.inf)
    best = ProgramSolution(SolutionResult.kInfeasibleConstraints, np.full(len(form.gradient), np.nan), Details())
    known, nodes, counted = limits.fval_bound, [form.relaxed()], Details()
    while nodes:
        if time.monotonic() > until:
            return best._replace(ended=SolutionResult.kIterationLimit, details=counted)
        node = nodes.pop()
        found = _approach(node, limits)
        counted = found.details.after(counted)
        if found.ended == SolutionResult.kInfeasibleConstraints:
            continue
        bounded = found.ended == SolutionResult.kSolutionFound
        if bounded and form.cost(found.x) > known - _AGAIN * abs(known):
            continue
        between = np.minimum(found.x, 1.0 - found.x) if bounded else np.full(len(found.x), 1.0)
        between = np.where(form.binary & (node.least < node.most), between, 0.0)
        if between.max() > _FEASIBLE:
            first = int(found.x[between.argmax()] >= 0.5)
            nodes += [node.with_value(int(between.argmax()), value) for value in (1 - first, first)]
        elif bounded:
            best = found._replace(x=np.where(form.binary, found.x.round(), found.x))
            known = form.cost(best.x)
        else:
            return found._replace(details=counted)
    return best._replace(details=counted)


def _approach(form: StandardForm, limits: SolverLimits) -> ProgramSolution:
    """The optimum of a program without binary variables."""
    until = time.monotonic() + (limits.time_limit or math.inf)
    for curvature in _CURVATURES:
        answer = _Scaled.of(form, curvature).approach(limits, until)
        if answer.ended != SolutionResult.kIterationLimit or time.monotonic() > until:
            break
    return answer


@dataclass(frozen=True, eq=False)
class _Scaled:
    """A program as DAQP sees it: k variables, those with bounds first, scaled; then p rows, some of them soft.

    Attributes:
        form: the program.
        kept: its variables that DAQP sees, (k,).
        rows: its rows that DAQP sees, (p,).
        slack: the variable that a soft row stands for, (p,), -1: the row is hard.
        free: which of the k variables are binary, (k,).
        bounded: how many variables have bounds.
        base: values of the variables that are fixed or found without DAQP, 0 for others, (n,).
        scale: of the variables, (k,).
        largest: scale of the cost.
        hessian: with added curvature, (k, k).
        gradient: at the base, with what added curvature of binary variables needs, (k,).
        matrix: coefficients of the rows, (p, k).
        curvature: that continuous variables have got.
    """

    form: StandardForm
    kept: Indices
    rows: Indices
    slack: Indices
    free: Flags
    bounded: int
    base: Array
    scale: Array
    largest: float
    hessian: Array
    gradient: Array
    matrix: Array
    curvature: float

    @classmethod
    def of(cls, form: StandardForm, curvature: float = _CURVATURES[0]) -> _Scaled:
        """Find fixed variables and slack, scale, and add curvature."""
        unconstrained, of_rows = form.separate()
        rows, kept, bounded, base = _kept(form, unconstrained, of_rows)
        largest, scale, hessian, gradient, matrix = _scaled(form, rows, kept, base)
        free, added, slack = form.binary[kept], 0.0, of_rows[rows]
        if not _is_definite(hessian):
            hessian[np.diag_indices(len(kept))] += np.where(free, _BINARY_CURVATURE, 0.0)
            gradient = gradient - np.where(free, 0.5 * _BINARY_CURVATURE * scale, 0.0)
            if not (free.any() and _is_definite(hessian)):
                hessian[np.diag_indices(len(kept))] += np.where(free, 0.0, curvature)
                added = curvature
        return cls(form, kept, rows, slack, free, bounded, base, scale, largest, hessian, gradient, matrix, added)

    @property
    def branches(self) -> bool:
        """Whether there are binary variables to branch on."""
        return bool(self.free.any())

    def branch(self, limits: SolverLimits) -> ProgramSolution:
        """The optimum by branch and bound."""
        known = (limits.fval_bound - self.form.cost(self.base)) / self.largest
        return self._answer(*self._solved(limits, self.gradient, min(known, _NO_BOUND)))

    def approach(self, limits: SolverLimits, until: float) -> ProgramSolution:
        """The optimum without binary variables, by the proximal point method where curvature was added."""
        centre, before = np.zeros(len(self.kept)), Details()
        for _ in range(_STEPS):
            flag, x, info = self._solved(limits, self.gradient - self.curvature * centre)
            answer = self._answer(flag, x, info, before)
            step = x - centre
            if flag <= 0 or not self.curvature or np.abs(step).max() <= _STILL * (1.0 + np.abs(x).max()):
                return answer
            if self._recedes(step):
                return answer._replace(ended=SolutionResult.kUnbounded)
            if time.monotonic() > until:
                break
            centre, before = x, answer.details
        return answer._replace(ended=SolutionResult.kIterationLimit)

    def _solved(
        self, limits: SolverLimits, gradient: Array, known: float = _NO_BOUND
    ) -> tuple[int, Array, dict[str, Any]]:
        """DAQP's flag, x (k,), and information."""
        if len(self.kept) == 0:
            return 1, np.zeros(0), {"lam": np.zeros(len(self.rows))}
        form, k, soft = self.form, self.kept[: self.bounded], self.slack >= 0
        scale, sense = self.scale[: self.bounded], np.where(self.free, _BINARY, 0)[: self.bounded]
        at = times(form.rows, self.rows, self.base)
        bounds = [
            np.concatenate([form_bounds[k] * scale, of_rows[self.rows] - at]).clip(-_NO_BOUND, _NO_BOUND)
            for form_bounds, of_rows in ((form.most, form.upper), (form.least, form.lower))
        ]
        model = daqp.Model()
        model.settings = {
            "presolve": 0, "primal_tol": limits.primal_tol, "iter_limit": int(limits.iter_limit), "fval_bound": known,
            "time_limit": max(limits.time_limit, 1e-6) if 0.0 < limits.time_limit < math.inf else 0.0,
        }  # fmt: skip
        senses = np.concatenate([sense, np.where(soft, _SOFT, 0)]).astype(np.intc)
        flag, _ = model.setup(self.hessian, gradient, self.matrix, *bounds, senses)
        if flag < 0:
            return flag, np.zeros(len(self.kept)), {}
        if soft.any():
            weights = self._reciprocal_weights()
            model.soft_weights(rho_l=weights, rho_u=weights)
        x, _, flag, info = model.solve()
        return flag, x, info

    def _reciprocal_weights(self) -> Array:
        """Reciprocal weights of bounds and rows: slack x that enters its row as c x, at a cost w x^2 / 2, has c^2/w."""
        soft = np.flatnonzero(self.slack >= 0)
        j, weights = self.slack[soft], np.ones(self.bounded + len(self.rows))
        weights[self.bounded + soft] = self.largest * self.form.rows[self.rows[soft], j] ** 2 / self.form.hessian[j, j]
        return weights

    def _recedes(self, step: Array) -> bool:
        """Whether the cost falls without end along a step, (k,), and no constraint ever stops it."""
        direction = step / np.abs(step).max()
        curved = np.abs(self.hessian @ direction - self.curvature * direction).max() > _ALONG
        falls = self.gradient @ direction < -_ALONG * np.abs(self.gradient).max()
        form, moved = self.form, np.zeros(len(self.form.gradient))
        moved[self.kept] = direction / self.scale
        rates = np.concatenate([moved, form.rows @ moved]) / np.abs(moved).max()
        lower, upper = np.concatenate([form.least, form.lower]), np.concatenate([form.most, form.upper])
        stopped = (rates[np.isfinite(upper)] > _ALONG).any() or (rates[np.isfinite(lower)] < -_ALONG).any()
        return bool(falls and not curved and not stopped)

    def _answer(
        self,
        flag: int,
        scaled: Array,
        info: dict[str, Any],
        before: Details = Details(),
    ) -> ProgramSolution:
        """The answer by DAQP's flag and solution; `before`: what it took until then."""
        form = self.form
        multipliers, x = np.zeros(len(form.rows)), np.full(len(form.gradient), np.nan)
        if flag > 0:
            x = self.base.copy()
            x[self.kept] = scaled / self.scale
            x[form.binary] = x[form.binary].round()
            x = np.clip(x, form.least, form.most)
            self._take_up_slack(x)
            multipliers[self.rows] = -self.largest * info["lam"][self.bounded :]
        details = Details(int(info.get("iterations", 0)), int(info.get("nodes", 0)), multipliers)
        return ProgramSolution(_ENDED.get(flag, SolutionResult.kSolverSpecificError), x, details.after(before))

    def _take_up_slack(self, x: Array) -> None:
        """Give slack variables the least values with which their rows hold."""
        soft = self.slack >= 0
        j, r = self.slack[soft], self.rows[soft]
        x[j] = 0.0
        at, of_slack = times(self.form.rows, r, x), self.form.rows[r, j]
        x[j] = (np.maximum(0.0, self.form.lower[r] - at) - np.maximum(0.0, at - self.form.upper[r])) / of_slack


@njit(cache=True)
def _kept(form: StandardForm, unconstrained: Flags, slack: Indices) -> tuple[Indices, Indices, int, Array]:
    """Rows (p,) and variables (k,) that DAQP sees, how many of these have bounds, and the base (n,): see `_Scaled`."""
    count, base = len(form.gradient), np.zeros(len(form.gradient))
    seen = np.ones(count, dtype=np.bool_)
    for row in range(len(slack)):
        if slack[row] >= 0:
            seen[slack[row]] = False
    for j in range(count):
        if form.least[j] == form.most[j]:
            seen[j], base[j] = False, form.least[j]
        elif unconstrained[j]:
            best = -form.gradient[j] / form.hessian[j, j]
            seen[j], base[j] = False, min(max(best, form.least[j]), form.most[j])
    with_bounds = np.isfinite(form.least) | np.isfinite(form.most)
    first = np.flatnonzero(seen & with_bounds)
    wanted = np.isfinite(form.lower) | np.isfinite(form.upper)
    for row in range(len(wanted)):
        wanted[row] = wanted[row] and form.rows[row].any()
    kept = np.concatenate((first, np.flatnonzero(seen & ~with_bounds)))
    return np.flatnonzero(wanted), kept, len(first), base


@njit(cache=True)
def _scaled(form: StandardForm, rows: Indices, kept: Indices, base: Array) -> tuple[float, Array, Array, Array, Array]:
    """Scale of the cost and of the variables (k,); Hessian (k, k), gradient (k,), coefficients of rows (p, k)."""
    k, largest = len(kept), 0.0
    gradient, scale = np.empty(k), np.ones(k)
    for i in range(k):
        gradient[i] = form.gradient[kept[i]]
        for j in range(len(base)):
            if base[j] != 0.0:
                gradient[i] += form.hessian[kept[i], j] * base[j]
        largest = max(largest, form.hessian[kept[i], kept[i]])
    if largest == 0.0:
        largest = np.abs(gradient).max() if k and gradient.any() else 1.0
    for i in range(k):
        diagonal = form.hessian[kept[i], kept[i]]
        if diagonal > _FLAT * largest:
            scale[i] = np.sqrt(diagonal / largest)
    hessian, matrix = np.empty((k, k)), np.empty((len(rows), k))
    for i in range(k):
        gradient[i] = gradient[i] / scale[i] / largest
        for j in range(k):
            hessian[i, j] = form.hessian[kept[i], kept[j]] / (scale[i] * scale[j]) / largest
        for r in range(len(rows)):
            matrix[r, i] = form.rows[rows[r], kept[i]] / scale[i]
    return largest, scale, hessian, gradient, matrix


@njit(cache=True)
def _is_definite(hessian: Array) -> bool:
    """Whether a matrix (k, k) is positive definite by a margin, by its Cholesky factor."""
    factor = hessian.copy()
    for j in range(len(factor)):
        for i in range(j, len(factor)):
            for k in range(j):
                factor[i, j] -= factor[i, k] * factor[j, k]
            if i == j:
                if factor[j, j] <= _SINGULAR:
                    return False
                factor[j, j] = np.sqrt(factor[j, j])
            else:
                factor[i, j] /= factor[j, j]
    return True
