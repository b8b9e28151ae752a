"""The default route: (26) with binaries, solved to a proven optimum, by DAQP or by a solver of Drake."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.problems import INSTANCES, random_problem, rolled_out
from pydrake.solvers import MixedIntegerBranchAndBound, SnoptSolver, SolutionResult
from pydrake.symbolic import Variable
from ugv.contract import check_contract
from ugv.oracles import cost, every_plan

from airground_drake.base.errors import ScenarioError
from airground_drake.scenario.load import load
from airground_drake.sim.simulation import simulate
from airground_drake.ugv import drake_solvers
from airground_drake.ugv.binary_program import BinaryProgram, block_of_stage
from airground_drake.ugv.budget import Budget
from airground_drake.ugv.daqp_solver import Form
from airground_drake.ugv.drake_solvers import SOLVERS, Minimiser, SolverResult, lacking, relax
from airground_drake.ugv.problem import Problem
from airground_drake.ugv.relaxation import normals_along
from airground_drake.ugv.routes.mixed_integer import MixedIntegerRoute
from airground_drake.ugv.solution import ConstantPlans

UNLIMITED = Budget(iterations=10_000, search_iterations=10**9, search_s=np.inf)


def program(problem: Problem, blocks: int | None = None) -> tuple[BinaryProgram, np.ndarray]:
    binary = BinaryProgram(problem.stages, blocks or problem.stages)
    normals = normals_along(problem, ConstantPlans.of(problem).better.positions)
    binary.update(problem, normals)
    return binary, normals


@pytest.mark.parametrize(
    ("problem", "blocks"),
    [*((random_problem(seed, 12, 1 + seed % 3), None) for seed in range(12)), (random_problem(3, 12), 50),
     *((rolled_out(seed), blocks) for seed in range(3) for blocks in (7, 10))],
)  # fmt: skip
def test_the_optimum_is_that_of_every_plan(problem: Problem, blocks: int | None) -> None:
    """One binary per stage, also where there are fewer stages than blocks; seven blocks do not divide the stages."""
    solution = check_contract(MixedIntegerRoute(blocks), problem, UNLIMITED)
    plans = every_plan(problem.stages, min(blocks or 12, problem.stages))
    assert solution.status == "optimal"
    assert (plans == solution.plan).all(axis=1).any()
    assert solution.route_bound == pytest.approx(cost(problem, plans, solution.normals).min(), rel=1e-9)
    assert solution.gap == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("blocks", [12, 5])
def test_the_program_is_the_problem(blocks: int) -> None:
    """Costs and rows of the program at random plans, with the slack that they need, against the formulas."""
    rng = np.random.default_rng(0)
    for seed in range(8):
        problem = random_problem(seed, 12, 2)
        binary, normals = program(problem, blocks)
        values = rng.integers(0, 2, blocks).astype(float)
        plan = values[block_of_stage(12, blocks)]
        lacking = problem.distances - np.sum(normals * (problem.positions(plan)[:, None] - problem.centres), axis=2)
        slack = np.maximum(0.0, lacking).max(axis=1)
        made, every = binary.program, np.append(values, slack)
        claimed = sum(float(made.EvalBinding(each, every)[0]) for each in made.GetAllCosts())
        assert claimed == pytest.approx(float(cost(problem, plan, normals)), rel=1e-12)
        assert made.CheckSatisfied(made.GetAllConstraints(), every, 1e-9)
        assert {omega.get_type() for omega in made.decision_variables()[:blocks]} == {Variable.Type.BINARY}
        read = Form.of(made)
        assert all(np.array_equal(value, getattr(binary.form, name)) for name, value in vars(read).items())
        demanded = np.zeros(12)
        for row, lower in zip(read.rows, read.lower, strict=True):
            stage = row[blocks:].argmax()
            demanded[stage] = max(demanded[stage], lower - row[:blocks] @ values)
        np.testing.assert_allclose(demanded, slack, atol=1e-12)  # by the half-planes that are not left out


def ending(found: SolverResult) -> MixedIntegerRoute:
    route = MixedIntegerRoute()
    route._search.minimise = lambda *_: found  # type: ignore[method-assign]
    return route


@pytest.mark.parametrize("name", ["random 24x2", "rolled out 1", "a point at the robot"])
@pytest.mark.parametrize(
    ("found", "status"),
    [
        (SolverResult(None, "budget_spent"), "budget_spent"),
        (SolverResult(None, "solver_failed"), "solver_failed"),
        (SolverResult(np.ones(60), "optimal", 10**9), "budget_spent"),  # a machine that came to its end does not matter
    ],
)
def test_without_a_proof_the_incumbent_decides(name: str, found: SolverResult, status: str) -> None:
    """It costs no more than sum-up rounding and the constant plans, and has the relaxation for a bound."""
    problem, optimal = INSTANCES[name], MixedIntegerRoute().solve(INSTANCES[name])
    solution = check_contract(ending(found), problem)
    assert solution.status == status
    assert optimal.plan is not None
    assert 0.0 <= solution.route_bound <= cost(problem, optimal.plan, solution.normals) * (1.0 + 1e-9)
    assert solution.gap >= 0.0
    with_it = ending(found).solve(replace(problem, previous=optimal.plan))
    assert optimal.objective <= with_it.objective <= solution.objective


def test_an_optimum_that_a_known_plan_beats_is_a_failure() -> None:
    assert (
        ending(SolverResult(np.ones(24), "optimal")).solve(INSTANCES["a point at the robot"]).status == "solver_failed"
    )


def test_searches_and_relaxations_stop_at_their_limits() -> None:
    binary, _ = program(rolled_out(1))
    nowhere, search = np.full(binary.program.num_vars(), np.nan), Minimiser("daqp")
    assert search.minimise(binary, nowhere, 1e-9).ended == "budget_spent"
    assert relax(binary, iterations=1).ended == "budget_spent"
    route, counts = MixedIntegerRoute(), []
    minimise = route._search.minimise

    def counting(*given: Any) -> SolverResult:
        found = minimise(*given)
        counts.append(found.iterations)
        return found

    route._search.minimise = counting  # type: ignore[method-assign]
    route.solve(rolled_out(1))
    count = sum(counts)
    ended = [MixedIntegerRoute().solve(rolled_out(1), Budget(search_iterations=n)).status for n in (count - 1, count)]
    assert ended == ["budget_spent", "optimal"]


def ten_stages(seed: int, count: int, points: int) -> Iterator[Problem]:
    """A UGV that drives straight past points, with two random motions; it starts outside the safe distances."""
    rng, n = np.random.default_rng(seed), 10
    for _ in range(count):
        reference = np.column_stack([np.linspace(0.2, 2.0, n), np.zeros(n), np.zeros(n)])
        accept = np.column_stack([rng.normal(1.0, 0.5, n), rng.normal(0.0, 0.6, n), np.zeros(n)])
        refuse = np.column_stack([rng.normal(0.8, 0.5, n), rng.normal(0.0, 0.3, n), np.zeros(n)])
        at = np.column_stack([rng.uniform(0.7, 2.0, points), rng.uniform(-0.5, 0.5, points), np.zeros(points)])
        centres = np.tile(at, (n, 1, 1))
        yield Problem(0.2, np.zeros(3), accept, refuse, reference, centres, np.full(points, 0.4), 1.0, 1000.0)


@pytest.mark.parametrize(("seed", "points"), [(1, 1), (5, 2)])
def test_plans_are_near_the_best_of_all_by_exact_distances(seed: int, points: int) -> None:
    """At most 1 % above it in 57 of 60 problems."""
    over = 0
    for problem in ten_stages(seed, 60, points):
        solution = check_contract(MixedIntegerRoute(), problem)
        assert solution.gap <= 1e-6
        over += solution.objective > 1.01 * cost(problem, every_plan(10, 10)).min()
    assert over <= 3


class BranchAndBound:
    """Drake's own branch and bound with SNOPT, in the shape of a solver of Drake; it stops at a gap of 1 %."""

    there, licensed = True, True

    def available(self) -> bool:
        return self.there

    def enabled(self) -> bool:
        return self.licensed

    def solver_id(self) -> Any:
        return SnoptSolver.id()

    @staticmethod
    def AcquireLicense() -> object:
        return object()

    def Solve(self, program: Any, guess: Any, options: Any) -> Any:
        self.variables = program.decision_variables()
        self.search = MixedIntegerBranchAndBound(program, SnoptSolver.id())
        self.ended = self.search.Solve()
        return self

    def is_success(self) -> bool:
        return self.ended == SolutionResult.kSolutionFound

    def get_solution_result(self) -> SolutionResult:
        return self.ended if self.is_success() else SolutionResult.kSolverSpecificError

    def get_solver_details(self) -> None:
        return None

    def get_x_val(self) -> Any:
        return self.search.GetSolution(self.variables)


@pytest.fixture
def gurobi(monkeypatch: pytest.MonkeyPatch) -> type[BranchAndBound]:
    stand_in = type("StandIn", (BranchAndBound,), {})
    monkeypatch.setitem(drake_solvers.SOLVERS, "gurobi", stand_in)
    return stand_in


def test_a_solver_of_drake_takes_the_program_as_it_is(
    gurobi: type[BranchAndBound], monkeypatch: pytest.MonkeyPatch
) -> None:
    for seed in range(3):
        problem = random_problem(seed, 12, 1 + seed % 3)
        binary, normals = program(problem)
        nowhere = np.full(binary.program.num_vars(), np.nan)
        omegas = [Minimiser(name).minimise(binary, nowhere).omega for name in ("daqp", "gurobi")]
        ours, its = (float(cost(problem, binary.plan(omega), normals)) for omega in omegas if omega is not None)
        assert ours * (1.0 - 1e-9) <= its <= 1.011 * ours + 0.011
    found, ours = (check_contract(MixedIntegerRoute(solver=name), random_problem(0, 12)) for name in ("gurobi", "daqp"))
    assert (found.status, found.objective) == ("optimal", ours.objective)
    monkeypatch.setattr(gurobi, "is_success", lambda _: False)
    assert check_contract(MixedIntegerRoute(6, "gurobi"), INSTANCES["rolled out 1"]).status == "solver_failed"


@pytest.mark.parametrize(
    ("there", "why"), [(False, "this build of Drake does not have it"), (True, "Drake found no licence for it")]
)
def test_a_solver_that_is_not_here_is_refused(
    *, there: bool, why: str, gurobi: type[BranchAndBound], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gurobi, "there", there)
    monkeypatch.setattr(gurobi, "licensed", False)
    scenario = load("swap", {"gatekeeper.solver": "gurobi"})  # the file itself is good, and so are its reports
    with pytest.raises(ScenarioError, match=f"solver: 'gurobi' is not allowed; .*{why}; allowed here: daqp"):
        simulate(scenario, "c")


@pytest.mark.parametrize("name", SOLVERS)
def test_a_licensed_solver_finds_the_optimum(name: str) -> None:
    if why := lacking(name):
        pytest.skip(f"{name}: {why}")
    for problem in (INSTANCES["rolled out 1"], INSTANCES["a point at the robot"], INSTANCES["random 1x1"]):
        found, ours = (check_contract(MixedIntegerRoute(solver=each), problem) for each in (name, "daqp"))
        assert found.status == "optimal"
        assert found.objective == pytest.approx(ours.objective, rel=1e-6)
