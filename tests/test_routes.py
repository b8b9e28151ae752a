"""Every solution route of (26) keeps one contract; enumeration has a brute-force oracle; the routes agree."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache
from types import SimpleNamespace
from typing import Any, get_args

import numpy as np
import pytest
from pydrake.solvers import ClarabelSolver, MixedIntegerBranchAndBound, SnoptSolver, SolutionResult

from airground_drake.diagram import ROUTES
from airground_drake.gatekeeper import branch, nonlinear
from airground_drake.gatekeeper.branch import BranchAndBoundRoute
from airground_drake.gatekeeper.candidates import Constants, block_of_stage
from airground_drake.gatekeeper.enumeration import EnumerationRoute
from airground_drake.gatekeeper.half_planes import normals_along
from airground_drake.gatekeeper.nonlinear import NonlinearRoute
from airground_drake.gatekeeper.prediction import Horizon, Scene, UgvLaw, predicted_problem
from airground_drake.gatekeeper.problem import Decision, Evaluation, Problem, Status
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.motion import Motion
from airground_drake.systems.gatekeeper import Route

MAKERS = dict(ROUTES) | {"nonlinear_ipopt": lambda: NonlinearRoute("ipopt")}
LAW = UgvLaw(Avoidance(3.0, 0.05, 4.0), 2.0, 1.5, intervention_on_top=False)


# --- instances ---------------------------------------------------------------------------------------------------


def random_problem(seed: int, stages: int = 24, points: int = 2) -> Problem:
    """Mode velocities and references without any structure, of both modes independent."""
    rng = np.random.default_rng(seed)

    def plane(*shape: int) -> np.ndarray:
        return np.concatenate([rng.normal(size=(*shape, 2)) * 2, np.zeros((*shape, 1))], axis=-1)

    accept, refuse, reference = plane(stages), plane(stages), plane(stages)
    centres = np.repeat(rng.uniform(-3, 3, (1, points, 3)) * [1, 1, 0], stages, axis=0)
    distances = rng.uniform(0.2, 1.2, points)
    return Problem(0.05, np.zeros(3), accept, refuse, reference, centres, distances, 1.0, 200.0)


def rolled_out(seed: int) -> Problem:
    """The closed loop of a UGV among discs, its straight way home against a proposed way round."""
    rng = np.random.default_rng(seed)
    points = int(rng.integers(1, 5))
    angle = rng.uniform(-np.pi, np.pi, points)
    centres = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(points)]) * rng.uniform(2.1, 3.5, (points, 1))
    away = rng.uniform(-4.0, 4.0, (2, 3)) * [1, 1, 0]
    home = Motion.at_speed(np.array([np.zeros(3), away[0]]), 0.6, start=-rng.uniform(0.0, 3.0))
    round_about = Motion.at_speed(np.array([np.zeros(3), away[1], away[0]]), 2.8, start=0.0)
    scene = Scene(
        0.0, np.zeros(3), home, centres, np.zeros((points, 3)), np.full(points, 2.0), np.ones(points), 3.0
    )  # fmt: skip
    return predicted_problem(scene, LAW, Proposal("way round", 0.0, round_about), Horizon(60, 1, 1.0, 1000.0))


def case_a(position: tuple[float, float], t: float, ways: tuple[tuple[float, float], ...], on_top: bool) -> Problem:
    """Case A: UGV1 in the local minimum at 14.5 s, or on its way round the obstacles."""
    preset = Motion.at_speed(np.array([[3.3, 0.0, 0.0], [3.3, 13.0, 0.0]]), 0.5606, start=0.0)
    here = np.array([*position, 0.0])
    motion = Motion.at_speed(np.array([here, *([x, y, 0.0] for x, y in ways)]), 2.85, start=t)
    centres = np.array([[1.7, 4.0, 0.0], [4.0, 7.0, 0.0], [-0.5, 5.0, 0.0]])
    scene = Scene(t, here, preset, centres, np.zeros((3, 3)), np.full(3, 2.0), np.ones(3), 3.0)
    law = replace(LAW, intervention_on_top=on_top)
    return predicted_problem(scene, law, Proposal("detour", t, motion), Horizon(60, 1, 1.0, 1000.0))


STALL, ROUND = (3.36888, 5.10219), ((6.2, 5.4), (6.3, 8.0), (4.5, 9.2), (3.3, 13.0))


def with_points(problem: Problem, centres: np.ndarray, distances: list[float]) -> Problem:
    return replace(
        problem,
        centres=np.repeat(np.reshape(centres, (1, -1, 3)), problem.stages, axis=0).astype(float),
        distances=np.array(distances),
    )


def instances() -> dict[str, Problem]:
    plain = random_problem(100)
    still = np.zeros((24, 3))
    nan = plain.refuse.copy()
    nan[3, 1] = np.nan
    return {
        **{f"random {n}x{m}": random_problem(n + m, n, m) for n, m in ((24, 2), (7, 1), (1, 1), (30, 4), (20, 0))},
        **{f"rolled out {seed}": rolled_out(seed) for seed in range(4)},
        "case A, stalled": case_a(STALL, 14.55, ROUND, False),
        "case A, stalled, intervention on top": case_a(STALL, 14.55, ROUND, True),
        "case A, on the way": case_a((5.2, 5.3), 15.2, ROUND, False),
        "case A, into the obstacle": case_a(STALL, 14.55, ((4.0, 7.0),), True),
        "no points": with_points(plain, np.zeros((0, 3)), []),
        "a point at the robot": with_points(plain, np.zeros(3), [0.8]),
        "deep inside a large disc": with_points(plain, np.array([[0.1, 0, 0], [0.3, 0, 0]]), [5.0, 0.1]),
        "identical modes": replace(plain, accept=plain.refuse),
        "at rest on the reference": replace(plain, accept=still, refuse=still, reference=still),
        "not a number": replace(plain, refuse=nan),
        "infinite": replace(plain, initial=np.array([np.inf, 0.0, 0.0])),
    }  # fmt: skip


INSTANCES = instances()
SMALL = 30
"""Stages that IPOPT is tried with: Drake gives it no Hessians, it needs seconds for 60, and gives up on some."""

BROKEN = {"not a number", "infinite"}


# --- the contract ------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Recording(Problem):
    """A problem that remembers which plans were evaluated."""

    plans: list[Evaluation] = field(default_factory=list)

    def evaluate(self, omega: np.ndarray) -> Evaluation:
        self.plans.append(super().evaluate(omega))
        return self.plans[-1]


def cost(problem: Problem, omega: np.ndarray) -> np.ndarray:
    """(25) with (26d) from the formulas: plans (P, N) to costs (P,)."""
    velocity = omega[..., None] * problem.accept + (1.0 - omega[..., None]) * problem.refuse
    p = problem.initial + problem.dt * np.cumsum(velocity, axis=1)
    distance = np.linalg.norm(p[:, :, None] - problem.centres, axis=3)
    slack = np.maximum(0.0, problem.distances - distance).max(axis=2, initial=0.0)
    error = np.square(problem.reference - p).sum(axis=(1, 2))
    return problem.dt * (problem.error_weight * error + problem.slack_weight * np.square(slack).sum(axis=1))


def check_contract(route: Route, problem: Problem, broken: bool = False) -> Decision:
    """What every route owes for every problem."""
    recording = Recording(**vars(problem))
    decision = route.decide(recording)
    assert decision.status in get_args(Status)
    assert all(np.isfinite(value) for value in vars(decision).values() if not isinstance(value, str))
    if broken:
        assert decision == Decision(False, "refused_not_finite")
        return decision
    assert decision.status == "optimal"
    plans = [plan for plan in recording.plans if set(plan.omega.tolist()) <= {0.0, 1.0}]
    for first in (0.0, 1.0):
        claimed = decision.objective_accept if first else decision.objective_refuse
        own = [plan.omega for plan in plans if plan.omega[0] == first and plan.objective == claimed]
        assert own, "the cost is that of a binary plan"
        np.testing.assert_allclose(cost(problem, np.array(own)), claimed, rtol=1e-9, atol=1e-12)
    assert decision.objective == min(decision.objective_accept, decision.objective_refuse)
    if decision.objective_accept != decision.objective_refuse:
        assert decision.accept == (decision.objective_accept < decision.objective_refuse)
    constant = cost(problem, np.array([np.zeros(problem.stages), np.ones(problem.stages)]))
    assert decision.objective <= constant.min() + 1e-9
    if decision.gap != -1.0 and decision.objective > 1e-6:  # relative: means nothing at a cost of 0
        assert -1e-5 <= decision.gap <= 1.0
    return decision


@cache
def used(name: str) -> Route:
    """One route for all instances, so that what it keeps between calls is under test too."""
    return MAKERS[name]()


PAIRS = [(name, key) for name in MAKERS for key, p in INSTANCES.items() if name in ROUTES or p.stages <= SMALL]


@pytest.mark.parametrize(("name", "instance"), PAIRS)
def test_contract(name: str, instance: str) -> None:
    decision = check_contract(used(name), INSTANCES[instance], instance in BROKEN)
    assert decision == used(name).decide(INSTANCES[instance])  # deterministic


@pytest.mark.parametrize("name", MAKERS)
def test_finite_data_whose_cost_overflows_are_refused(name: str) -> None:
    problem = random_problem(0)
    decision = used(name).decide(replace(problem, reference=problem.reference * 1e200))
    assert not decision.accept
    assert decision.status != "optimal"
    check_contract(used(name), problem)


class IgnoresSlack:
    """A mutant: chooses, and says what it costs, without (26d)."""

    def decide(self, problem: Problem) -> Decision:
        return EnumerationRoute(8).decide(replace(problem, slack_weight=0.0))


class ChoosesWithoutSlack:
    """A subtler mutant: chooses without (26d), but says what the choice costs."""

    def decide(self, problem: Problem) -> Decision:
        wrong = Recording(**vars(replace(problem, slack_weight=0.0)))
        decision = EnumerationRoute(8).decide(wrong)
        plan = next(plan.omega for plan in wrong.plans if plan.objective == decision.objective)
        true = problem.evaluate(plan).objective
        return replace(decision, objective=true, lower_bound=true)


def test_the_contract_and_the_oracle_refute_mutants() -> None:
    problem = INSTANCES["a point at the robot"]
    with pytest.raises(AssertionError):
        check_contract(IgnoresSlack(), problem)
    plans = blocked(24, 8)
    assert ChoosesWithoutSlack().decide(problem).objective > 1.01 * cost(problem, plans).min()
    assert EnumerationRoute(8).decide(problem).objective == pytest.approx(cost(problem, plans).min(), rel=1e-12)


# --- enumeration -------------------------------------------------------------------------------------------------


def blocked(stages: int, blocks: int) -> np.ndarray:
    """All binary plans (2^blocks, stages) that are constant on blocks of equal length."""
    bits = np.arange(2**blocks)[:, None] >> np.arange(blocks) & 1
    return np.repeat(bits, stages // blocks, axis=1).astype(float)


@pytest.mark.parametrize("make", [lambda s: random_problem(s, 24, s % 5), lambda s: random_problem(s, 8, 2)])
def test_enumeration_agrees_with_brute_force(make: Any) -> None:
    route = EnumerationRoute(8)
    for seed in range(30):
        problem = make(seed)
        plans = blocked(problem.stages, 8)
        costs, first = cost(problem, plans), plans[:, 0]
        decision = route.decide(problem)
        assert decision.objective_accept == pytest.approx(costs[first == 1.0].min(), rel=1e-10)
        assert decision.objective_refuse == pytest.approx(costs[first == 0.0].min(), rel=1e-10)
        assert decision.lower_bound == decision.objective
        assert decision.gap == 0.0


def test_blocks_cover_all_stages() -> None:
    for stages in range(1, 70):
        block = block_of_stage(stages, 10)
        counts = np.bincount(block)
        assert len(block) == stages
        assert len(counts) == min(10, stages)
        assert counts.max() - counts.min() <= 1
        assert (np.diff(block) >= 0).all()


@pytest.mark.parametrize("make", [EnumerationRoute, BranchAndBoundRoute])
@pytest.mark.parametrize("blocks", [0, -1, 21])
def test_impossible_blocks_are_named(make: Any, blocks: int) -> None:
    with pytest.raises(ValueError, match=f"blocks: {blocks}"):
        make(blocks)


# --- agreement ---------------------------------------------------------------------------------------------------

WORSE: dict[str, float] = {}
"""Instances where sum-up rounding of the convex relaxation is more than 2 % above the best known, and by how much."""


def test_routes_agree() -> None:
    """60 roll-outs and random ones: nobody beats a claimed bound; the relaxed route stays near the best known."""
    worse = {}
    for kind, make, count in (("rolled out", rolled_out, 40), ("random", random_problem, 20)):
        for seed in range(count):
            problem = make(seed)
            decisions = {name: used(name).decide(problem) for name in ROUTES}
            assert all(decision.status == "optimal" for decision in decisions.values())
            constants = Constants.of(problem)
            assert decisions["enumeration"].objective <= constants.better.objective
            for other in (constants.accept, constants.refuse):
                half = decisions["enumeration"]
                assert (half.objective_accept if other.omega[0] else half.objective_refuse) <= other.objective
            assert decisions["branch_and_bound"].objective >= decisions["enumeration"].objective * (1.0 - 1e-9)
            best = min(decision.objective for decision in decisions.values())
            excess = decisions["relaxed"].objective / max(best, 1e-12) - 1.0
            if excess > 0.02:
                worse[f"{kind} {seed}"] = round(excess, 3)
    assert worse == WORSE


# --- nonlinear ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("instance", ["random 24x2", "a point at the robot", "case A, stalled",
                                      "deep inside a large disc"])  # fmt: skip
def test_the_nonlinear_program_is_27(instance: str) -> None:
    """The guess is feasible and, like the optimum, costs what (25) says with the exact slack."""
    problem = INSTANCES[instance]
    for start in (Constants.of(problem).accept, Constants.of(problem).refuse):
        nlp = nonlinear.relaxation(problem, start)
        program = nlp.program
        bindings = program.GetAllConstraints()
        assert program.CheckSatisfied(bindings, nlp.guess, 1e-7)

        def total(values: np.ndarray, program: Any = program) -> float:
            return sum(float(program.EvalBinding(binding, values)[0]) for binding in program.GetAllCosts())

        assert total(nlp.guess) == pytest.approx(start.objective, rel=1e-9)
        result = SnoptSolver().Solve(program, nlp.guess, None)
        assert result.is_success()
        omega = np.clip(result.GetSolution(nlp.omega), 0.0, 1.0)
        assert result.get_optimal_cost() == pytest.approx(cost(problem, omega[None])[0], rel=1e-3)
        assert result.get_optimal_cost() <= start.objective * (1.0 + 1e-6)


class Failed:
    """A solver, and its result, without success."""

    def Solve(self, *arguments: object) -> Failed:
        return self

    def is_success(self) -> bool:
        return False

    def GetSolution(self, variables: np.ndarray) -> np.ndarray:
        return np.full(len(variables), np.nan)


class Raising:
    def Solve(self, *arguments: object) -> None:
        raise RuntimeError("Unknown result")


@pytest.mark.parametrize("solver", [Failed(), Raising()])
@pytest.mark.parametrize("name", ["nonlinear", "branch_and_bound"])
def test_a_failing_solver_refuses(name: str, solver: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    route = MAKERS[name]()
    monkeypatch.setattr(route, "_solver" if name == "nonlinear" else "_licensed", solver)
    decision = route.decide(random_problem(0))
    assert not decision.accept
    assert decision.status == "refused_solver_failed"
    assert decision.objective_accept > 0.0


def test_unknown_nonlinear_solvers_are_named() -> None:
    with pytest.raises(ValueError, match="'knitro'"):
        NonlinearRoute("knitro")  # type: ignore[arg-type]


# --- branch and bound --------------------------------------------------------------------------------------------


def test_branch_and_bound_bounds_the_convexified_problem() -> None:
    for seed in range(12):
        problem = random_problem(seed, 24, 1 + seed % 3)
        normals = normals_along(problem, Constants.of(problem).better.positions)
        best = min(problem.evaluate_half_planes(problem.positions(w), normals) for w in blocked(24, 8))
        decision = BranchAndBoundRoute(8).decide(problem)
        assert 0.975 * best <= decision.lower_bound <= best * (1.0 + 1e-6)
        assert decision.gap <= 0.0105


@pytest.mark.parametrize("how", ["RuntimeError", "infeasible"])
def test_a_failing_branch_and_bound_refuses(how: str, monkeypatch: pytest.MonkeyPatch) -> None:
    class Search:
        def __init__(self, *arguments: object) -> None:
            """Take whatever the route gives."""

        def Solve(self) -> SolutionResult:
            if how == "RuntimeError":
                raise RuntimeError("Unknown result")
            return SolutionResult.kInfeasibleConstraints

    monkeypatch.setattr(branch, "MixedIntegerBranchAndBound", Search)
    decision = BranchAndBoundRoute().decide(random_problem(0))
    assert not decision.accept
    assert decision.status == "refused_solver_failed"


def test_a_licensed_solver_gets_one_binary_per_stage(monkeypatch: pytest.MonkeyPatch) -> None:
    class Licensed:
        """Stands in for Gurobi or Mosek: Drake's own search behind a solver's interface."""

        def Solve(self, program: Any) -> Any:
            search = MixedIntegerBranchAndBound(program, ClarabelSolver.id())
            found = search.Solve() == SolutionResult.kSolutionFound
            return SimpleNamespace(
                is_success=lambda: found, get_optimal_cost=search.GetOptimalCost, GetSolution=search.GetSolution
            )

    problem = random_problem(3, 12, 1)
    blocks = BranchAndBoundRoute(4).decide(problem)
    monkeypatch.setattr(branch, "licensed_solver", Licensed)
    stages = check_contract(BranchAndBoundRoute(4), problem)
    assert stages.objective < blocks.objective
