"""Every solution route of (26) keeps one contract, and the routes agree."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.closed_loop import Instance
from builders.problems import INSTANCES, random_problem, rolled_out
from gatekeeper.contract import DEFAULT, MAKERS, Recording, check_contract, same, used
from gatekeeper.formulas import blocked, cost
from gatekeeper.oracles import ClosedLoopEnumeration, Enumeration
from hypothesis import given
from hypothesis import strategies as st
from properties import examples
from pydrake.solvers import SolutionResult

from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.problem import Problem
from airground_drake.gatekeeper.relaxation import remaining_cost
from airground_drake.gatekeeper.solution import ConstantPlans, Solution

BROKEN = {"not a number", "infinite"}


ENOUGH = Budget(search_s=math.inf)
"""A busy machine needs more time for a search."""


@pytest.mark.parametrize("name", MAKERS)
def test_contract(name: str) -> None:
    for instance, problem in INSTANCES.items():
        solution = check_contract(used(name), problem, instance in BROKEN, ENOUGH)
        assert instance in BROKEN or solution.status == "optimal", instance
        assert same(solution, used(name).solve(problem, ENOUGH)), instance  # deterministic


@pytest.mark.parametrize("name", MAKERS)
def test_finite_data_whose_cost_overflows_are_refused(name: str) -> None:
    problem = random_problem(0)
    solution = used(name).solve(replace(problem, reference=problem.reference * 1e200))
    assert not solution.accept_first
    assert solution.status == "refused_not_finite"
    check_contract(used(name), problem)


class Ticking:
    """A clock that advances by 1 s each time that it is read."""

    def __init__(self) -> None:
        """Start at 0."""
        self.t = -1.0

    def __call__(self) -> float:
        self.t += 1.0
        return self.t


@examples(120, fuzz=2000)
@given(
    data=st.data(), name=st.sampled_from([*MAKERS]), iterations=st.sampled_from([1, 3, 100]), ticks=st.integers(0, 20)
)
def test_a_budget_that_is_spent_leaves_the_best_plan_so_far(
    data: st.DataObject, name: str, iterations: int, ticks: int
) -> None:
    instance, problem = data.draw(st.sampled_from([*INSTANCES.items()]))
    budget = Budget(iterations, deadline_s=float(ticks), clock=Ticking())
    solution = check_contract(used(name), problem, instance in BROKEN, budget)
    if ticks == 0 and instance not in BROKEN:
        assert solution.status == "budget_spent"
        assert solution.objective == ConstantPlans.of(problem).better.objective
        assert solution.route_bound == min(remaining_cost(problem)[0], solution.objective)
    if solution.status == "budget_spent":
        assert solution.route_bound >= 0.0
        assert solution.gap <= 1.0


@pytest.mark.parametrize("name", [name for name in MAKERS if name != "mixed_integer"])
def test_one_iteration_is_not_enough(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("airground_drake.gatekeeper.routes.relaxed.ACTIVE_SETS", 1)
    problem, budget = INSTANCES["rolled out 1"], Budget(1)
    solution = check_contract(used(name), problem, budget=budget)
    assert solution.status == "budget_spent"
    assert same(solution, used(name).solve(problem, budget))


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
    problem = INSTANCES["a point at the robot"]
    with pytest.raises(AssertionError):
        check_contract(IgnoresSlack(), problem)
    plans = blocked(24, 8)
    assert ChoosesWithoutSlack().solve(problem).objective > 1.01 * cost(problem, plans).min()
    assert Enumeration(8).solve(problem).objective == pytest.approx(cost(problem, plans).min(), rel=1e-12)


def test_routes_agree() -> None:
    """60 roll-outs and random ones: no route is below its own bound, or above a constant plan."""
    for make, count in ((rolled_out, 40), (random_problem, 20)):
        for seed in range(count):
            problem = make(seed)
            solutions = {name: used(name).solve(problem) for name in MAKERS}
            constants = ConstantPlans.of(problem)
            assert all(solution.objective <= constants.better.objective for solution in solutions.values())
            relaxed, proved = solutions["relaxed"], solutions["mixed_integer"]
            assert relaxed.route_bound <= proved.route_bound * (1.0 + 1e-6)
            assert relaxed.plan is not None
            assert relaxed.normals is not None
            along = problem.evaluate_half_planes(problem.positions(relaxed.plan), relaxed.normals)
            assert proved.route_bound <= along * (1.0 + 1e-9)


def test_the_closed_loop_makes_waiting_dearer_than_mode_velocities_say() -> None:
    """What plans that switch are worth: by (23), a plan that waits first goes through obstacles at no cost."""
    problem = Instance(11).problem(24)
    by_loop = ClosedLoopEnumeration(6).solve(problem)
    by_velocities = Enumeration(6).solve(problem)
    assert by_velocities.plan is not None
    assert problem.evaluate_closed_loop(by_velocities.plan).objective >= by_loop.objective
    for mode in (0.0, 1.0):
        constant = np.full(24, mode)
        assert problem.evaluate(constant).objective == pytest.approx(problem.evaluate_closed_loop(constant).objective)


class Failed:
    """A solver, and its result, without success."""

    def Solve(self, *arguments: object) -> Failed:
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


@pytest.mark.parametrize("solver", [Failed(), Raising()])
def test_a_failing_solver_leaves_the_better_constant_plan(solver: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    route = MAKERS["nonlinear"]()
    monkeypatch.setattr(route, "_solver", solver)
    solution = check_contract(route, random_problem(0))
    assert solution.status == "solver_failed"
    assert solution.objective == ConstantPlans.of(random_problem(0)).better.objective
