"""Every solution route of (26) keeps one contract; enumeration has a brute-force oracle; the routes agree."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pydrake.solvers import ClarabelSolver, MixedIntegerBranchAndBound, SnoptSolver, SolutionResult, SolverOptions

from airground_drake.diagram import ROUTES
from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.convex_program import team_program
from airground_drake.gatekeeper.half_planes import normals_along, outlook
from airground_drake.gatekeeper.local_search import LocalSearch, best_known
from airground_drake.gatekeeper.prediction import Horizon, Scene, UgvLaw, predicted_problem
from airground_drake.gatekeeper.problem import DECIDED, Evaluation, Problem, Solution, Status
from airground_drake.gatekeeper.rounding import sum_up_rounding
from airground_drake.gatekeeper.routes import branch_and_bound as branch
from airground_drake.gatekeeper.routes import nonlinear
from airground_drake.gatekeeper.routes.branch_and_bound import BranchAndBoundRoute
from airground_drake.gatekeeper.routes.enumeration import EnumerationRoute
from airground_drake.gatekeeper.routes.nonlinear import NonlinearRoute
from airground_drake.gatekeeper.solution import ConstantPlans, block_of_stage, remaining_cost
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.motion import Motion
from airground_drake.systems.gatekeeper import Route

MAKERS = dict(ROUTES) | {"nonlinear_ipopt": lambda: NonlinearRoute("ipopt")}
LAW = UgvLaw(Avoidance(3.0, 0.05, 4.0), 2.0, 1.5, intervention_on_top=False)


DEFAULT = Budget()


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
    return by_velocities(scene, LAW, Proposal("way round", 0.0, round_about))


def by_velocities(scene: Scene, law: UgvLaw, proposal: Proposal) -> Problem:
    """The problem of (23): mode velocities, and nothing of the closed loop that they come from."""
    return replace(predicted_problem(scene, law, proposal, Horizon(60, 1, 1.0, 1000.0)), loop=None)


def case_a(position: tuple[float, float], t: float, ways: tuple[tuple[float, float], ...], on_top: bool) -> Problem:
    """Case A: UGV1 in the local minimum at 14.5 s, or on its way round the obstacles."""
    preset = Motion.at_speed(np.array([[3.3, 0.0, 0.0], [3.3, 13.0, 0.0]]), 0.5606, start=0.0)
    here = np.array([*position, 0.0])
    motion = Motion.at_speed(np.array([here, *([x, y, 0.0] for x, y in ways)]), 2.85, start=t)
    centres = np.array([[1.7, 4.0, 0.0], [4.0, 7.0, 0.0], [-0.5, 5.0, 0.0]])
    scene = Scene(t, here, preset, centres, np.zeros((3, 3)), np.full(3, 2.0), np.ones(3), 3.0)
    law = replace(LAW, intervention_on_top=on_top)
    return by_velocities(scene, law, Proposal("detour", t, motion))


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

ENOUGH = Budget(iterations=300)
"""IPOPT needs more iterations than the default."""


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


def check_contract(route: Route, problem: Problem, broken: bool = False, budget: Budget = DEFAULT) -> Solution:
    """What every route owes for every problem and every budget."""
    recording = Recording(**vars(problem))
    solution = route.solve(recording, budget)
    assert solution.status in get_args(Status)
    assert all(np.isfinite(v).all() for v in vars(solution).values() if v is not None and not isinstance(v, str))
    if broken:
        assert same(solution, Solution(False, "refused_not_finite"))
        return solution
    if solution.status not in DECIDED:
        assert solution.status == "refused_budget_spent"
        assert budget.deadline_s < np.inf
        assert same(solution, Solution(False, "refused_budget_spent"))
        return solution
    plans = [plan for plan in recording.plans if set(plan.omega.tolist()) <= {0.0, 1.0}]
    for first in (0.0, 1.0):
        claimed = solution.objective_accept if first else solution.objective_refuse
        own = [plan.omega for plan in plans if plan.omega[0] == first and plan.objective == claimed]
        assert own, "the cost is that of a binary plan"
        np.testing.assert_allclose(cost(problem, np.array(own)), claimed, rtol=1e-9, atol=1e-12)
    assert solution.objective == min(solution.objective_accept, solution.objective_refuse)
    if solution.objective_accept != solution.objective_refuse:
        assert solution.accept_first == (solution.objective_accept < solution.objective_refuse)
    constant = cost(problem, np.array([np.zeros(problem.stages), np.ones(problem.stages)]))
    assert solution.objective <= constant.min() + 1e-9
    if solution.gap != -1.0 and solution.objective > 1e-6:  # relative: means nothing at a cost of 0
        assert -1e-5 <= solution.gap <= 1.0
    check_arrays(solution, problem)
    return solution


def check_arrays(solution: Solution, problem: Problem) -> None:
    """The plan is the one that is claimed, rounding is (28)-(29), and no plan that is there beats the bound."""
    assert solution.plan is not None
    assert solution.positions is not None
    assert solution.plan.shape == (problem.stages,)
    assert set(solution.plan.tolist()) <= {0.0, 1.0}
    assert solution.accept_first == bool(solution.plan[0])
    assert cost(problem, solution.plan[None])[0] == pytest.approx(solution.objective, rel=1e-9, abs=1e-12)
    np.testing.assert_allclose(solution.positions, problem.positions(solution.plan), atol=1e-12)
    assert (solution.relaxed is None) == (solution.rounded is None)
    witnesses = [solution.plan]
    if solution.relaxed is not None and solution.rounded is not None:
        assert ((solution.relaxed >= 0.0) & (solution.relaxed <= 1.0)).all()
        np.testing.assert_array_equal(solution.rounded, sum_up_rounding(solution.relaxed))
        assert solution.relaxed_first_stage == solution.relaxed[0]
        assert 0.0 <= solution.rounding_deviation <= problem.dt / 2 + 1e-12
        witnesses += [solution.relaxed, solution.rounded] if solution.normals is not None else [solution.rounded]
    if solution.normals is None:
        # of the plans with a dwell, or of all plans: in both cases of the one returned
        assert solution.lower_bound <= solution.objective * (1.0 + 1e-12)
        return
    assert solution.normals.shape == problem.centres.shape
    np.testing.assert_allclose(np.linalg.norm(solution.normals, axis=2), 1.0, atol=1e-12)
    for omega in witnesses:
        assert solution.lower_bound <= half_plane_cost(problem, omega, solution.normals) * (1.0 + 1e-9) + 1e-12


def half_plane_cost(problem: Problem, omega: np.ndarray, normals: np.ndarray) -> float:
    """(25) from the formulas, with distances along normals."""
    p = problem.initial + problem.dt * np.cumsum(
        omega[:, None] * problem.accept + (1.0 - omega[:, None]) * problem.refuse, axis=0
    )
    lacking = problem.distances - np.sum(normals * (p[:, None] - problem.centres), axis=2)
    slack = np.maximum(0.0, lacking).max(axis=1, initial=0.0)
    error = problem.error_weight * np.square(problem.reference - p).sum()
    return float(problem.dt * (error + problem.slack_weight * np.square(slack).sum()))


def same(one: Solution, other: Solution) -> bool:
    """Equal to the last bit, arrays too."""
    return all(np.array_equal(a, b) for a, b in zip(vars(one).values(), vars(other).values(), strict=True))


@cache
def used(name: str) -> Route:
    """One route for all instances, so that what it keeps between calls is under test too."""
    return MAKERS[name]()


PAIRS = [(name, key) for name in MAKERS for key, p in INSTANCES.items() if name in ROUTES or p.stages <= SMALL]


@pytest.mark.parametrize(("name", "instance"), PAIRS)
def test_contract(name: str, instance: str) -> None:
    solution = check_contract(used(name), INSTANCES[instance], instance in BROKEN, ENOUGH)
    assert instance in BROKEN or solution.status == "optimal"
    assert same(solution, used(name).solve(INSTANCES[instance], ENOUGH))  # deterministic


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


SPENT = ("random 24x2", "rolled out 1", "case A, stalled, intervention on top", "deep inside a large disc", "no points",
         "identical modes", "random 1x1", "not a number")  # fmt: skip


@pytest.mark.parametrize("instance", SPENT)
@pytest.mark.parametrize("name", ROUTES)
def test_a_deadline_leaves_the_best_plan_so_far(name: str, instance: str) -> None:
    problem = INSTANCES[instance]
    for ticks in (0, 1, 2, 3, 4, 5, 6, 8, 12, 1000):
        budget = Budget(deadline_s=float(ticks), clock=Ticking())
        solution = check_contract(used(name), problem, instance in BROKEN, budget)
        if instance in BROKEN:
            continue
        if ticks == 0:
            assert solution.status == "refused_budget_spent"
        elif ticks == 1:
            assert solution.status == "budget_spent"
            assert solution.objective == ConstantPlans.of(problem).better.objective
            assert solution.lower_bound == min(remaining_cost(problem)[0], solution.objective)
        elif ticks == 1000:
            assert solution.status == "optimal"
        if solution.status == "budget_spent":
            assert solution.lower_bound >= 0.0
            assert solution.gap <= 1.0


@pytest.mark.parametrize("instance", SPENT)
@pytest.mark.parametrize("name", MAKERS)
@pytest.mark.parametrize(("iterations", "nodes"), [(1, 1), (3, 7), (100, 50), (1, 20_000)])
def test_tiny_counts_leave_the_best_plan_so_far(name: str, instance: str, iterations: int, nodes: int) -> None:
    problem, budget = INSTANCES[instance], Budget(iterations, nodes)
    solution = check_contract(used(name), problem, instance in BROKEN, budget)
    assert same(solution, used(name).solve(problem, budget))
    if (iterations, nodes) == (1, 1) and instance == "rolled out 1":
        assert solution.status == "budget_spent"


def test_more_budget_is_never_dearer_for_enumeration() -> None:
    for seed in range(5):
        costs = [used("enumeration").solve(rolled_out(seed), Budget(nodes=n)) for n in (1, 10, 100, 1000)]
        assert all(a.objective >= b.objective for a, b in pairwise(costs))
        assert all(a.lower_bound <= costs[-1].objective for a in costs)


class IgnoresSlack:
    """A mutant: chooses, and says what it costs, without (26d)."""

    def solve(self, problem: Problem, budget: Budget = DEFAULT) -> Solution:
        return EnumerationRoute(8).solve(replace(problem, slack_weight=0.0))


class ChoosesWithoutSlack:
    """A subtler mutant: chooses without (26d), but says what the choice costs."""

    def solve(self, problem: Problem, budget: Budget = DEFAULT) -> Solution:
        wrong = Recording(**vars(replace(problem, slack_weight=0.0)))
        solution = EnumerationRoute(8).solve(wrong)
        plan = next(plan.omega for plan in wrong.plans if plan.objective == solution.objective)
        true = problem.evaluate(plan).objective
        return replace(solution, objective=true, lower_bound=true)


def test_the_contract_and_the_oracle_refute_mutants() -> None:
    problem = INSTANCES["a point at the robot"]
    with pytest.raises(AssertionError):
        check_contract(IgnoresSlack(), problem)
    plans = blocked(24, 8)
    assert ChoosesWithoutSlack().solve(problem).objective > 1.01 * cost(problem, plans).min()
    assert EnumerationRoute(8).solve(problem).objective == pytest.approx(cost(problem, plans).min(), rel=1e-12)


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
        solution = route.solve(problem)
        assert solution.objective_accept == pytest.approx(costs[first == 1.0].min(), rel=1e-10)
        assert solution.objective_refuse == pytest.approx(costs[first == 0.0].min(), rel=1e-10)
        assert solution.lower_bound == solution.objective
        assert solution.gap == 0.0
        short = route.solve(problem, Budget(nodes=1 + seed))
        assert short.lower_bound <= costs.min() * (1.0 + 1e-12)
        assert short.objective >= costs.min() * (1.0 - 1e-12)


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


# --- bounds ------------------------------------------------------------------------------------------------------

PLANS = arrays(np.float64, 24, elements=st.floats(0.0, 1.0))


@given(st.integers(0, 10**6), PLANS)
def test_no_plan_costs_less_than_what_remains(seed: int, omega: np.ndarray) -> None:
    problem = random_problem(seed)
    positions = problem.positions(omega)
    stage = problem.dt * np.square(problem.reference - positions).sum(axis=1)  # no slack is cheapest
    to_come = np.append(np.cumsum(stage[::-1])[::-1], 0.0)
    assert (remaining_cost(problem) <= to_come + 1e-9).all()


def check_outlook(
    problem: Problem, seed: int, at: np.ndarray, omega: np.ndarray, *, twist: float = 1.0, loaded: bool = True
) -> None:
    """ConstantPlans and slopes bound the cost to come, in half-planes, of any plan from any stage on."""
    rng = np.random.default_rng(seed)
    normals = normals_along(problem, problem.positions(rng.random(problem.stages)))
    multipliers = rng.exponential(3.0, normals.shape[:2]) * (rng.random(normals.shape[:2]) < 0.3) * loaded
    ahead = outlook(problem, normals, at, multipliers)
    positions = problem.positions(omega)
    stages = [
        half_plane_cost(
            replace(
                problem, initial=positions[k - 1] if k else problem.initial, accept=problem.accept[k:],
                refuse=problem.refuse[k:], reference=problem.reference[k:], centres=problem.centres[k:],
            ), omega[k:], normals[k:],
        )
        for k in range(problem.stages)
    ]  # fmt: skip
    moved = positions[:-1] - ahead.at[:-1]
    bounds = ahead.constants[:-1].copy()
    bounds[1:] += twist * np.sum(ahead.slopes[1:-1] * moved, axis=1)
    assert (bounds <= np.array(stages) + 1e-9 * (1.0 + np.abs(bounds))).all()
    assert ahead.bound == ahead.constants[0]


@given(st.integers(0, 10**6), PLANS, PLANS)
def test_the_outlook_is_a_bound_for_any_multipliers(seed: int, at: np.ndarray, omega: np.ndarray) -> None:
    check_outlook(random_problem(seed), seed, at, omega)


def test_a_wrong_slope_is_refuted() -> None:
    rng = np.random.default_rng(0)
    for seed in range(5):
        problem = random_problem(seed)
        at = used("relaxed").solve(problem).relaxed
        assert at is not None
        omega = np.clip(at + 0.2 * rng.normal(size=24), 0.0, 1.0)  # near the optimum, where bounds are tight
        check_outlook(problem, seed, at, omega, loaded=False)
        with pytest.raises(AssertionError):
            check_outlook(problem, seed, at, omega, twist=-1.0, loaded=False)


def test_the_bound_of_the_relaxation_is_tight() -> None:
    """The optimum of the same program, solved to a tenth of the route's tolerance, is not above the bound."""
    options = SolverOptions()
    for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
        options.SetOption(ClarabelSolver.id(), name, 1e-9)
    for problem in [*(random_problem(s, 24, 1 + s % 3) for s in range(8)), *(rolled_out(s) for s in range(8))]:
        solution = used("relaxed").solve(problem)
        program = team_program([problem], [solution.normals], relaxed=True).program
        optimum = ClarabelSolver().Solve(program, None, options).get_optimal_cost()
        assert solution.lower_bound == pytest.approx(optimum, rel=2e-5, abs=1e-8)
        assert solution.lower_bound <= optimum * (1.0 + 1e-7) + 1e-9


# --- the program of a team ---------------------------------------------------------------------------------------

TEAM = (
    rolled_out(0),
    replace(random_problem(5, 12, 3), distances=np.full(3, 2.0)),
    random_problem(6, 24, 0),
)


def team_normals() -> list[np.ndarray]:
    return [normals_along(p, ConstantPlans.of(p).better.positions) for p in TEAM]


def test_the_optimum_of_a_team_is_the_sum_of_the_optima() -> None:
    together = ClarabelSolver().Solve(team_program(TEAM, team_normals(), relaxed=True).program)
    assert together.is_success()
    alone = [
        ClarabelSolver().Solve(team_program([p], [n], relaxed=True).program).get_optimal_cost()
        for p, n in zip(TEAM, team_normals(), strict=True)
    ]
    assert together.get_optimal_cost() == pytest.approx(sum(alone), rel=1e-6)


def test_the_binary_optimum_of_a_team_is_the_sum_of_the_optima() -> None:
    """Drake's branch and bound, within its gap, against brute force over the blocks of each UGV."""
    problems = [random_problem(5, 12, 2), random_problem(6, 24, 1)]
    normals = [normals_along(p, ConstantPlans.of(p).better.positions) for p in problems]
    team = team_program(problems, normals, relaxed=False, blocks=3)
    search = MixedIntegerBranchAndBound(team.program, ClarabelSolver.id())
    assert search.Solve() == SolutionResult.kSolutionFound
    best = 0.0
    for problem, n, ugv in zip(problems, normals, team.ugvs, strict=True):
        costs = {tuple(w): half_plane_cost(problem, w, n) for w in blocked(problem.stages, 3)}
        best += min(costs.values())
        plan = ugv.plan(np.round(search.GetSolution(ugv.omega)))
        assert costs[tuple(plan)] <= 1.02 * min(costs.values())
    assert search.GetOptimalCost() == pytest.approx(best, rel=0.011)


def total(program: Any, values: np.ndarray) -> float:
    """Sum of all costs of a program."""
    return sum(float(program.EvalBinding(binding, values)[0]) for binding in program.GetAllCosts())


def check_program(team: Any, problems: tuple[Problem, ...], normals: list[np.ndarray]) -> None:
    """With the true states of a plan and its slack, all constraints hold and the cost is (25); with less, not."""
    program, rng = team.program, np.random.default_rng(0)
    values, claimed = np.zeros(program.num_vars()), 0.0

    def put(prefix: str, name: str, numbers: np.ndarray) -> None:
        for i, number in enumerate(np.ravel(numbers)):
            values[index[f"{prefix}_{name}({i})"]] = number

    index = {variable.get_name(): i for i, variable in enumerate(program.decision_variables())}
    for i, (problem, n) in enumerate(zip(problems, normals, strict=True)):
        omega = rng.integers(0, 2, problem.stages).astype(float)
        p = problem.positions(omega)
        lacking = problem.distances - np.sum(n * (p[:, None] - problem.centres), axis=2)
        put("start", f"UGV {i + 1}", problem.initial[:2])
        put("e", f"UGV {i + 1}", (p - problem.reference)[:, :2])
        put("omega", f"UGV {i + 1}", omega)
        put("u", f"UGV {i + 1}", np.maximum(0.0, lacking).max(axis=1, initial=0.0))
        claimed += half_plane_cost(problem, omega, n)
    bindings = program.GetAllConstraints()
    assert program.CheckSatisfied(bindings, values, 1e-9)
    assert total(program, values) == pytest.approx(claimed, rel=1e-12)
    for name, binding in ((b.evaluator().get_description(), b) for b in bindings):
        spoilt = values.copy()
        spoilt[[index[v.get_name()] for v in binding.variables()]] -= 2.0 if "half" in name or "slack" in name else 1.5
        if "half" not in name:
            assert not program.CheckSatisfied(binding, spoilt, 1e-9), f"{name} constrains nothing"


@pytest.mark.parametrize("relaxed", [True, False])
def test_the_program_is_the_problem(relaxed: bool) -> None:
    check_program(team_program(TEAM, team_normals(), relaxed=relaxed), TEAM, team_normals())


@pytest.mark.parametrize("relaxed", [True, False])
def test_every_constraint_says_which_equation_and_whose(relaxed: bool) -> None:
    program = team_program(TEAM, team_normals(), relaxed=relaxed).program
    names = [b.evaluator().get_description() for b in [*program.GetAllConstraints(), *program.GetAllCosts()]]
    assert all(re.fullmatch(r"\(2\d[a-e]?\).*, UGV [123]", name) for name in names), names
    assert len(set(names)) == len(names) == 3 * 7


def test_a_program_of_other_data_is_refuted() -> None:
    normals = team_normals()
    for wrong in (
        (replace(TEAM[0], reference=TEAM[0].reference + 0.01), *TEAM[1:]),
        (replace(TEAM[0], initial=TEAM[0].initial + 0.01), *TEAM[1:]),
        (TEAM[0], replace(TEAM[1], accept=TEAM[1].refuse), TEAM[2]),
        (TEAM[0], replace(TEAM[1], distances=TEAM[1].distances + 0.5), TEAM[2]),
        (TEAM[0], replace(TEAM[1], slack_weight=1.0), TEAM[2]),
    ):
        with pytest.raises(AssertionError):
            check_program(team_program(wrong, normals, relaxed=True), TEAM, normals)
    with pytest.raises(AssertionError):
        check_program(team_program(TEAM, [-n for n in normals], relaxed=True), TEAM, normals)


# --- search ------------------------------------------------------------------------------------------------------


def test_the_search_finds_what_brute_force_finds() -> None:
    plans = blocked(10, 10)
    for seed in range(40):
        problem = random_problem(seed, 10, seed % 4)
        costs = cost(problem, plans)
        refuse, accept = best_known(problem, 2048)
        assert refuse == pytest.approx(costs[plans[:, 0] == 0.0].min(), rel=1e-10)
        assert accept == pytest.approx(costs[plans[:, 0] == 1.0].min(), rel=1e-10)


@given(st.integers(0, 10**6), st.integers(2, 40), st.integers(0, 3), st.integers(1, 5000))
@settings(max_examples=50)
def test_the_search_never_makes_a_plan_dearer(seed: int, width: int, reach: int, nodes: int) -> None:
    problem = random_problem(seed)
    constants = ConstantPlans.of(problem)
    polish = LocalSearch(problem, constants, remaining_cost(problem), Budget(nodes=nodes))
    known = [constants.refuse.objective, constants.accept.objective]
    for step in (lambda: polish.labels(width), lambda: polish.exchanges(reach), lambda: polish.labels(width, 0.1)):
        step()
        for first, plan in enumerate(polish.plans):
            assert plan.omega[0] == first
            assert plan.objective <= known[first]
            assert cost(problem, plan.omega[None])[0] == pytest.approx(plan.objective, rel=1e-9)
            known[first] = plan.objective
        assert polish.best.objective == min(known)


def test_exchanges_leave_no_better_neighbour() -> None:
    for seed in range(10):
        problem = random_problem(seed)
        polish = LocalSearch(problem, ConstantPlans.of(problem), remaining_cost(problem), Budget())
        polish.exchanges(2)
        for plan in polish.plans:
            around = []
            for i in range(1, 24):
                for j in range(i, min(i + 3, 24)):
                    other = plan.omega.copy()
                    other[i] = 1.0 - other[i]
                    if j > i and plan.omega[i] != plan.omega[j]:
                        other[j] = 1.0 - other[j]
                    around.append(other)
            assert plan.objective <= cost(problem, np.array(around)).min() * (1.0 + 1e-9)


def test_nodes_that_do_not_last_are_admitted() -> None:
    problem = rolled_out(1)
    for nodes, lasts in ((1, False), (100, False), (20_000, True)):
        polish = LocalSearch(problem, ConstantPlans.of(problem), remaining_cost(problem), Budget(nodes=nodes))
        polish.labels(64)
        assert polish.complete == lasts


# --- agreement ---------------------------------------------------------------------------------------------------

WORSE: dict[str, float] = {}
"""Instances where the default route is more than 0.1 % above the best known, and by how much."""


def test_routes_agree() -> None:
    """60 roll-outs and random ones: the default route finds the best plan known, and starts like it."""
    worse = {}
    for kind, make, count in (("rolled out", rolled_out, 40), ("random", random_problem, 20)):
        for seed in range(count):
            problem = make(seed)
            solutions = {name: used(name).solve(problem) for name in ROUTES}
            assert all(solution.status in DECIDED for solution in solutions.values())
            constants = ConstantPlans.of(problem)
            assert solutions["enumeration"].objective <= constants.better.objective
            for other in (constants.accept, constants.refuse):
                half = solutions["enumeration"]
                assert (half.objective_accept if other.omega[0] else half.objective_refuse) <= other.objective
            assert solutions["branch_and_bound"].objective >= solutions["enumeration"].objective * (1.0 - 1e-9)
            plans = [d.plan for d in solutions.values() if d.plan is not None]
            refuse, accept = best_known(problem, 2048, plans)
            best = min(refuse, accept)
            excess = (solutions["relaxed"].objective - best) / max(best, 0.01 * constants.better.objective, 1e-12)
            if excess > 1e-3:
                worse[f"{kind} {seed}"] = round(excess, 4)
            if abs(accept - refuse) > 1e-3 * best:
                assert solutions["relaxed"].accept_first == (accept < refuse)
    assert worse == WORSE


# --- nonlinear ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("instance", ["random 24x2", "a point at the robot", "case A, stalled",
                                      "deep inside a large disc"])  # fmt: skip
def test_the_nonlinear_program_is_27(instance: str) -> None:
    """The guess is feasible and, like the optimum, costs what (25) says with the exact slack."""
    problem = INSTANCES[instance]
    for start in (ConstantPlans.of(problem).accept, ConstantPlans.of(problem).refuse):
        nlp = nonlinear.relaxation(problem, start)
        program = nlp.program
        bindings = program.GetAllConstraints()
        assert program.CheckSatisfied(bindings, nlp.guess, 1e-7)
        assert total(program, nlp.guess) == pytest.approx(start.objective, rel=1e-9)
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

    def get_solution_result(self) -> SolutionResult:
        return SolutionResult.kSolverSpecificError

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
    solution = route.solve(random_problem(0))
    assert not solution.accept_first
    assert solution.status == "refused_solver_failed"
    assert solution.objective_accept > 0.0


def test_unknown_nonlinear_solvers_are_named() -> None:
    with pytest.raises(ValueError, match="'knitro'"):
        NonlinearRoute("knitro")  # type: ignore[arg-type]


# --- branch and bound --------------------------------------------------------------------------------------------


def test_branch_and_bound_bounds_the_convexified_problem() -> None:
    for seed in range(12):
        problem = random_problem(seed, 24, 1 + seed % 3)
        normals = normals_along(problem, ConstantPlans.of(problem).better.positions)
        best = min(problem.evaluate_half_planes(problem.positions(w), normals) for w in blocked(24, 8))
        solution = BranchAndBoundRoute(8).solve(problem)
        assert 0.975 * best <= solution.lower_bound <= best * (1.0 + 1e-6)
        assert solution.gap <= 0.0105


@pytest.mark.parametrize("how", ["RuntimeError", "infeasible"])
def test_a_failing_branch_and_bound_refuses(how: str, monkeypatch: pytest.MonkeyPatch) -> None:
    class Search:
        Options = MixedIntegerBranchAndBound.Options

        def __init__(self, *arguments: object) -> None:
            """Take whatever the route gives."""

        def Solve(self) -> SolutionResult:
            if how == "RuntimeError":
                raise RuntimeError("Unknown result")
            return SolutionResult.kInfeasibleConstraints

    monkeypatch.setattr(branch, "MixedIntegerBranchAndBound", Search)
    solution = BranchAndBoundRoute().solve(random_problem(0))
    assert not solution.accept_first
    assert solution.status == "refused_solver_failed"


def test_a_licensed_solver_gets_one_binary_per_stage(monkeypatch: pytest.MonkeyPatch) -> None:
    class Licensed:
        """Stands in for Gurobi or Mosek: Drake's own search behind a solver's interface."""

        def Solve(self, program: Any, guess: None, options: SolverOptions) -> Any:
            search = MixedIntegerBranchAndBound(program, ClarabelSolver.id())
            found = search.Solve() == SolutionResult.kSolutionFound
            return SimpleNamespace(
                is_success=lambda: found, get_optimal_cost=search.GetOptimalCost, GetSolution=search.GetSolution
            )

    problem = random_problem(3, 12, 1)
    blocks = BranchAndBoundRoute(4).solve(problem)
    monkeypatch.setattr(branch, "licensed_solver", Licensed)
    stages = check_contract(BranchAndBoundRoute(4), problem)
    assert stages.objective < blocks.objective
