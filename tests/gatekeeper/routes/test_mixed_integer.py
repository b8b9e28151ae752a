"""The default route: (26) with binaries, solved to a proven optimum."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, ClassVar

import daqp
import numpy as np
import pytest
from builders.problems import INSTANCES, random_problem, rolled_out
from gatekeeper.contract import check_contract
from gatekeeper.formulas import cost, half_plane_cost
from gatekeeper.oracles import every_plan
from pydrake.solvers import MathematicalProgram

from airground_drake.gatekeeper import daqp_solver
from airground_drake.gatekeeper.binary_program import BinaryProgram, block_of_stage
from airground_drake.gatekeeper.budget import UNLIMITED, Budget
from airground_drake.gatekeeper.daqp_solver import minimise
from airground_drake.gatekeeper.problem import Problem
from airground_drake.gatekeeper.relaxation import normals_along
from airground_drake.gatekeeper.routes.mixed_integer import MixedIntegerRoute
from airground_drake.gatekeeper.solution import ConstantPlans
from airground_drake.run.simulation import simulate, warm_up
from airground_drake.scenarios.load import load


def along_half_planes(problem: Problem, plans: np.ndarray, normals: np.ndarray) -> np.ndarray:
    return np.array([half_plane_cost(problem, plan, normals) for plan in plans])


@pytest.mark.parametrize("seed", range(30))
def test_the_optimum_is_that_of_every_plan(seed: int) -> None:
    """Twelve stages, one to three points, with and without a terminal cost; one binary per stage."""
    problem = random_problem(seed, 12, 1 + seed % 3)
    solution = check_contract(MixedIntegerRoute(), problem, budget=UNLIMITED)
    assert solution.status == "optimal"
    assert solution.normals is not None
    least = along_half_planes(problem, every_plan(12, 12), solution.normals).min()
    assert solution.route_bound == pytest.approx(least, rel=1e-9)
    assert solution.gap == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("blocks", [7, 10])
def test_the_optimum_of_blocks_is_that_of_all_their_plans(seed: int, blocks: int) -> None:
    """Seven blocks do not divide the sixty stages."""
    problem = rolled_out(seed)
    solution = check_contract(MixedIntegerRoute(blocks), problem, budget=UNLIMITED)
    plans = every_plan(problem.stages, blocks)
    assert solution.plan is not None
    assert solution.normals is not None
    assert (plans == solution.plan).all(axis=1).any()
    assert solution.route_bound == pytest.approx(along_half_planes(problem, plans, solution.normals).min(), rel=1e-9)
    assert solution.objective <= cost(problem, solution.plan[None])[0] * (1.0 + 1e-12)


def test_more_blocks_than_stages_are_one_per_stage() -> None:
    problem = random_problem(3, 12)
    assert MixedIntegerRoute(50).solve(problem).objective == MixedIntegerRoute().solve(problem).objective


def test_no_block_is_an_error() -> None:
    with pytest.raises(ValueError, match="blocks: 0"):
        MixedIntegerRoute(0)


@pytest.mark.parametrize("blocks", [12, 5])
def test_the_program_is_the_problem(blocks: int) -> None:
    """Costs and rows of the program at random plans, with the slack that they need, against the formulas."""
    binary, rng = BinaryProgram(12, blocks), np.random.default_rng(0)
    for seed in range(8):
        problem = random_problem(seed, 12, 2)
        normals = normals_along(problem, ConstantPlans.of(problem).better.positions)
        binary.update(problem, normals)
        values = rng.integers(0, 2, blocks).astype(float)
        plan = values[block_of_stage(12, blocks)]
        lacking = problem.distances - np.sum(normals * (problem.positions(plan)[:, None] - problem.centres), axis=2)
        slack = np.maximum(0.0, lacking).max(axis=1)
        every = np.zeros(binary.program.num_vars())
        every[binary.program.FindDecisionVariableIndices(binary.omega)] = values
        every[binary.program.FindDecisionVariableIndices(binary.u)] = slack
        claimed = sum(float(binary.program.EvalBinding(each, every)[0]) for each in binary.program.GetAllCosts())
        assert claimed == pytest.approx(half_plane_cost(problem, plan, normals), rel=1e-12)
        assert binary.program.CheckSatisfied(binary.program.GetAllConstraints(), every, 1e-9)
        if slack.any():
            every[binary.program.FindDecisionVariableIndices(binary.u)] = slack - 1e-3
            assert not binary.program.CheckSatisfied(binary.half_planes, every, 1e-9)
    names = [
        each.evaluator().get_description()
        for each in (*binary.program.GetAllConstraints(), *binary.program.GetAllCosts())
    ]
    assert all(name.startswith("(2") for name in names if name), names


DAQP = daqp.Model


class Ends:
    """DAQP, but its search ends with a flag, and with every choice the same if `accepts` says which."""

    def __init__(self, flag: int, accepts: float | None = None) -> None:
        self.flag, self.accepts = flag, accepts

    def __call__(self) -> Any:
        outer, inner = self, DAQP()

        class Model:
            settings: ClassVar[dict[str, float]] = {}

            def setup(self, *data: Any) -> None:
                inner.settings, self.searched = self.settings, bool((data[-1] == 16).any())
                self.upper = data[3]
                inner.setup(*data)

            def soft_weights(self, **weights: Any) -> None:
                inner.soft_weights(**weights)

            def solve(self) -> Any:
                x, value, flag, info = inner.solve()
                if not self.searched:
                    return x, value, flag, info
                if outer.accepts is not None:
                    x = self.upper[: len(x)] * outer.accepts
                return x, value, outer.flag, info

        return Model()


@pytest.mark.parametrize(
    ("flag", "status"), [(-7, "budget_spent"), (5, "budget_spent"), (-1, "solver_failed"), (4, "solver_failed")]
)
@pytest.mark.parametrize("name", ["random 24x2", "rolled out 1", "a point at the robot"])
def test_without_a_proof_the_incumbent_decides(
    name: str, flag: int, status: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It costs no more than sum-up rounding and the constant plans, and has the relaxation for a bound."""
    problem = INSTANCES[name]
    optimal = MixedIntegerRoute().solve(problem)
    monkeypatch.setattr(daqp_solver.daqp, "Model", Ends(flag))
    solution = check_contract(MixedIntegerRoute(), problem)
    assert solution.status == status
    assert 0.0 <= solution.route_bound <= optimal.route_bound * (1.0 + 1e-9)
    assert solution.gap >= 0.0
    again = MixedIntegerRoute().solve(problem)
    assert (again.objective, again.route_bound) == (solution.objective, solution.route_bound)


def test_a_search_of_too_many_iterations_is_not_used() -> None:
    """So it does not matter which machine came to its end."""
    problem = rolled_out(1)
    binary = BinaryProgram(problem.stages, problem.stages)
    binary.update(problem, normals_along(problem, ConstantPlans.of(problem).better.positions))
    count = minimise(binary).iterations
    assert count > 1
    solutions = [MixedIntegerRoute().solve(problem, Budget(search_iterations=most)) for most in (1, count)]
    assert [solution.status for solution in solutions] == ["budget_spent", "optimal"]
    assert solutions[0].objective >= solutions[1].objective


def test_an_optimum_that_a_known_plan_beats_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = INSTANCES["a point at the robot"]
    monkeypatch.setattr(daqp_solver.daqp, "Model", Ends(1, accepts=1.0))
    assert MixedIntegerRoute().solve(problem).status == "solver_failed"


def test_what_is_left_of_the_plan_before_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = rolled_out(1)
    best = MixedIntegerRoute().solve(problem)
    monkeypatch.setattr(daqp_solver.daqp, "Model", Ends(-7))
    without = MixedIntegerRoute().solve(problem)
    with_it = MixedIntegerRoute().solve(replace(problem, previous=best.plan))
    assert best.objective == with_it.objective <= without.objective


@pytest.mark.parametrize("name", ["case_a", "case_b"])
def test_runs_of_c_solve_a_program_with_binaries(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """One program for all decisions of a run; each is proved optimal."""
    calls: list[int] = []

    class Counting(MathematicalProgram):
        def NewBinaryVariables(self, rows: int, name: str) -> Any:
            calls.append(rows)
            return super().NewBinaryVariables(rows, name)

    warm_up()  # once per process, with a small program
    monkeypatch.setattr("airground_drake.gatekeeper.binary_program.MathematicalProgram", Counting)
    scenario = load(name)[0]
    decisions = simulate(scenario, "c").decisions
    assert calls == [scenario.gatekeeper.stages]
    assert len(decisions) > 20
    assert set(decisions["route"]) == {"mixed_integer"}
    assert set(decisions["status"]) <= {"optimal", "budget_spent"}  # the latter on a machine that is overloaded
    proved = decisions[decisions["status"] == "optimal"]
    assert proved["gap"].to_numpy() == pytest.approx(0.0, abs=1e-9)
