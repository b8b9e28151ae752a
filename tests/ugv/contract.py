"""What every route owes for every problem and every budget."""

from dataclasses import dataclass, field, fields
from typing import Self, get_args

import numpy as np
import pytest
from ugv.oracles import cost

from airground_drake.base.registry import ROUTES
from airground_drake.ugv.budget import Budget
from airground_drake.ugv.problem import Evaluation, Problem
from airground_drake.ugv.relaxation import sum_up_rounding
from airground_drake.ugv.routes.route import Route
from airground_drake.ugv.solution import Solution, Status

DEFAULT = Budget()
MAKERS = {name: ROUTES.load(name, of=Route) for name in ROUTES.own}
USED = {name: make() for name, make in MAKERS.items()}
"""One of each route for all instances, so that what it keeps between calls is under test too."""


@dataclass(frozen=True, eq=False)
class Recording(Problem):
    plans: list[Evaluation] = field(default_factory=list)

    @classmethod
    def of(cls, problem: Problem) -> Self:
        return cls(**{f.name: getattr(problem, f.name) for f in fields(Problem)})

    def evaluate(self, omega: np.ndarray) -> Evaluation:
        self.plans.append(super().evaluate(omega))
        return self.plans[-1]


def same(one: Solution, other: Solution) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(vars(one).values(), vars(other).values(), strict=True))


def check_contract(route: Route, problem: Problem, budget: Budget = DEFAULT) -> Solution:
    recording = Recording.of(problem)
    solution = route.solve(recording, budget)
    assert solution.status in get_args(Status)
    assert all(np.isfinite(v).all() for v in vars(solution).values() if v is not None and not isinstance(v, str))
    assert solution.has_plan
    for first, claimed in ((0.0, solution.objective_refuse), (1.0, solution.objective_accept)):
        own = [p.omega for p in recording.plans if p.omega[0] == first and p.objective == claimed]
        assert any(set(plan.tolist()) <= {0.0, 1.0} for plan in own), "the cost is that of a binary plan"
        np.testing.assert_allclose(cost(problem, np.array(own)), claimed, rtol=1e-9, atol=1e-12)
    assert solution.objective == min(solution.objective_accept, solution.objective_refuse)
    if solution.objective_accept != solution.objective_refuse:
        assert solution.accept_first == (solution.objective_accept < solution.objective_refuse)
    constant = cost(problem, np.array([np.zeros(problem.stages), np.ones(problem.stages)]))
    assert solution.objective <= constant.min() + 1e-9
    if solution.gap != -1.0 and solution.objective > 1e-6:  # relative: means nothing at a cost of 0
        assert -1e-5 <= solution.gap <= 1.0
    _check_arrays(solution, problem)
    return solution


def _check_arrays(solution: Solution, problem: Problem) -> None:
    """The plan costs what is claimed, rounding is (28)-(29), and no plan found here beats the bound."""
    assert solution.plan is not None
    assert solution.positions is not None
    assert solution.plan.shape == (problem.stages,)
    assert set(solution.plan.tolist()) <= {0.0, 1.0}
    assert solution.accept_first == bool(solution.plan[0])
    assert cost(problem, solution.plan) == pytest.approx(solution.objective, rel=1e-9, abs=1e-12)
    np.testing.assert_allclose(solution.positions, problem.positions(solution.plan), atol=1e-12)
    gaps = np.linalg.norm(solution.positions[:, None] - problem.centres, axis=2) - problem.distances
    assert solution.clearance == pytest.approx(gaps.min(initial=1e9))
    assert (solution.relaxed is None) == (solution.rounded is None)
    witnesses = [solution.plan]
    if solution.relaxed is not None and solution.rounded is not None:
        assert ((solution.relaxed >= 0.0) & (solution.relaxed <= 1.0)).all()
        np.testing.assert_array_equal(solution.rounded, sum_up_rounding(solution.relaxed))
        assert solution.relaxed_first_stage == solution.relaxed[0]
        assert 0.0 <= solution.rounding_deviation <= problem.dt / 2 + 1e-12
        witnesses += [solution.relaxed, solution.rounded]
    if solution.normals is None:
        assert solution.route_bound <= solution.objective * (1.0 + 1e-12)
        return
    assert solution.normals.shape == problem.centres.shape
    np.testing.assert_allclose(np.linalg.norm(solution.normals, axis=2), 1.0, atol=1e-12)
    for omega in witnesses:
        assert solution.route_bound <= cost(problem, omega, solution.normals) * (1.0 + 1e-9) + 1e-12
