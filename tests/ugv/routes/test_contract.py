"""Every solution route of (26) keeps one contract, and the routes agree."""

import itertools
import math
from dataclasses import replace
from typing import Any, Self

import numpy as np
import pytest
from builders.problems import BROKEN, INSTANCES, random_problem, rolled_out
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from pydrake.solvers import SolutionResult
from ugv.contract import DEFAULT, MAKERS, USED, Recording, check_contract, same
from ugv.oracles import Enumeration, cost, every_plan

from airground_drake.ugv.budget import Budget
from airground_drake.ugv.drake_solvers import SolverResult
from airground_drake.ugv.problem import Problem
from airground_drake.ugv.relaxation import unavoidable_cost
from airground_drake.ugv.routes import relaxed
from airground_drake.ugv.solution import ConstantPlans, Solution

ENOUGH = Budget(search_iterations=100_000, search_s=math.inf)
"""For every search; a busy machine needs more time."""


@pytest.mark.parametrize("name", USED)
def test_contract(name: str) -> None:
    for instance, problem in INSTANCES.items():
        solution = check_contract(USED[name], problem, ENOUGH)
        assert solution.status == "optimal", instance
        assert same(solution, USED[name].solve(problem, ENOUGH)), instance  # deterministic
    for instance, problem in BROKEN.items():
        assert same(USED[name].solve(problem, ENOUGH), Solution(False, "refused_not_finite")), instance
    with pytest.raises(ValueError, match="accept_first is False, but the plan begins with 1"):
        Solution(False, "optimal", plan=np.ones(2))


@examples(120, fuzz=2000)
@given(
    name=st.sampled_from([*USED]), instance=st.sampled_from([*INSTANCES]), iterations=st.sampled_from([1, 3, 100]),
    ticks=st.integers(0, 20),
)  # fmt: skip
def test_a_budget_that_is_spent_leaves_the_best_plan_so_far(
    name: str, instance: str, iterations: int, ticks: int
) -> None:
    """The clock goes on by 1 s each time that it is read."""
    problem, clock = INSTANCES[instance], itertools.count()
    budget = Budget(iterations, deadline_s=float(ticks), clock=lambda: float(next(clock)))
    solution = check_contract(USED[name], problem, budget)
    if ticks == 0:
        assert solution.status == "budget_spent"
        assert solution.objective == ConstantPlans.of(problem).better.objective
        assert solution.route_bound == min(unavoidable_cost(problem), solution.objective)
    if solution.status == "budget_spent":
        assert solution.route_bound >= 0.0
        assert solution.gap <= 1.0


@pytest.mark.parametrize("name", ["relaxed", "nonlinear"])
def test_one_iteration_is_not_enough(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(relaxed, "ACTIVE_SETS", 1)
    problem, budget = INSTANCES["rolled out 1"], Budget(1)
    solution = check_contract(USED[name], problem, budget)
    assert solution.status == "budget_spent"
    assert same(solution, USED[name].solve(problem, budget))


class IgnoresSlack:
    """A mutant: chooses, and says what it costs, without (26d)."""

    def solve(self, problem: Problem, budget: Budget = DEFAULT) -> Solution:
        return Enumeration(8).solve(replace(problem, slack_weight=0.0))


class ChoosesWithoutSlack:
    """A subtler mutant: chooses without (26d), but says what the choice costs."""

    def solve(self, problem: Problem, budget: Budget = DEFAULT) -> Solution:
        wrong = Recording.of(replace(problem, slack_weight=0.0))
        solution = Enumeration(8).solve(wrong)
        plan = next(plan.omega for plan in wrong.plans if plan.objective == solution.objective)
        true = problem.evaluate(plan).objective
        return replace(solution, objective=true, route_bound=true)


def test_the_contract_and_the_oracle_refute_mutants() -> None:
    problem, least = INSTANCES["a point at the robot"], cost(INSTANCES["a point at the robot"], every_plan(24, 8)).min()
    with pytest.raises(AssertionError):
        check_contract(IgnoresSlack(), problem)
    assert ChoosesWithoutSlack().solve(problem).objective > 1.01 * least
    assert Enumeration(8).solve(problem).objective == pytest.approx(least, rel=1e-12)


def test_no_route_finds_a_plan_below_the_bound_of_another() -> None:
    """Each bound along its own half-planes."""
    for problem in (*map(rolled_out, range(20)), *map(random_problem, range(20))):
        found, proved = (USED[name].solve(problem) for name in ("relaxed", "mixed_integer"))
        for bound, other in ((found, proved), (proved, found)):
            assert other.plan is not None
            assert bound.route_bound <= cost(problem, other.plan, bound.normals) * (1.0 + 1e-9)
        assert proved.objective <= found.objective * (1.0 + 1e-9)


class Failed:
    def Solve(self, *arguments: object) -> Self:
        return self

    def is_success(self) -> bool:
        return False

    def get_solution_result(self) -> SolutionResult:
        return SolutionResult.kSolverSpecificError

    def GetSolution(self, variables: np.ndarray) -> np.ndarray:
        return np.full(len(variables), np.nan)


class Raising:
    def Solve(self, *arguments: object) -> None:
        raise RuntimeError("Unknown result")


@pytest.mark.parametrize(
    ("name", "solver", "status"),
    [
        ("nonlinear", Failed(), "solver_failed"),
        ("nonlinear", Raising(), "solver_failed"),
        ("relaxed", "solver_failed", "solver_failed"),
        ("relaxed", "budget_spent", "budget_spent"),
    ],
)
def test_without_an_optimum_the_better_constant_plan_decides(
    name: str, solver: Any, status: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    route, problem = MAKERS[name](), random_problem(0)
    if name == "relaxed":
        monkeypatch.setattr(relaxed, "relax", lambda *_, **__: SolverResult(None, solver))
    else:
        monkeypatch.setattr(route, "_solver", solver)
    solution = check_contract(route, problem)
    assert (solution.status, solution.rounded) == (status, None)
    assert solution.objective == ConstantPlans.of(problem).better.objective
