"""The search over the plans of the closed loop, its budget, and what it says of case B."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from builders.closed_loop import AVOIDANCE, H, Instance, run_controller
from gatekeeper.formulas import cost_through
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.gatekeeper.blocks import block_of_stage
from airground_drake.gatekeeper.budget import UNLIMITED, Budget
from airground_drake.gatekeeper.cost import plan_cost
from airground_drake.gatekeeper.problem import Problem
from airground_drake.gatekeeper.routes import closed_loop_enumeration
from airground_drake.gatekeeper.routes.closed_loop_enumeration import ClosedLoopEnumerationRoute
from airground_drake.gatekeeper.routes.enumeration import EnumerationRoute
from airground_drake.gatekeeper.solution import Solution
from airground_drake.registry import ROUTES
from airground_drake.scenarios.load import load
from airground_drake.simulation import Recorder

BY_BLOCKS = {blocks: ClosedLoopEnumerationRoute(blocks) for blocks in (1, 2, 3, 4, 5, 6, 10)}


def brute_force(case: Instance, problem: Problem, substeps: int, blocks: int) -> dict[float, float]:
    """Least cost (25) of the plans by their first answer: every plan, by the running controller and the formulas."""
    sensed = np.linalg.norm(case.scene.centres - case.scene.position, axis=1) <= AVOIDANCE.sensing_range
    after = substeps * H * np.arange(1.0, problem.stages + 1.0)
    best = {0.0: np.inf, 1.0: np.inf}
    for modes in product((0.0, 1.0), repeat=blocks):
        positions = run_controller(case, sensed, np.array(modes)[block_of_stage(problem.stages, blocks)], substeps)
        centres = case.scene.centres[sensed] + after[:, None, None] * case.scene.velocities[sensed]
        gaps = np.linalg.norm(positions[:, None] - centres, axis=2) - case.scene.distances[sensed]
        slack = np.maximum(0.0, -gaps.min(axis=1, initial=np.inf))
        errors = np.square(case.preset.sample(after) - positions).sum(axis=1)
        cost = substeps * H * (problem.error_weight * errors.sum() + problem.slack_weight * np.square(slack).sum())
        cost += problem.terminal_weight * problem.error_weight * errors[-1]
        best[modes[0]] = min(best[modes[0]], cost)
    return best


@examples(60, fuzz=3000)
@given(st.integers(0, 10**6), st.booleans(), st.integers(1, 2), st.integers(1, 5), st.sampled_from([1.0, 100.0]))
def test_the_search_finds_the_optimum_of_all_plans(
    seed: int, on_top: bool, substeps: int, blocks: int, error_weight: float
) -> None:
    case = Instance(seed, on_top=on_top)
    problem = replace(case.problem(9, substeps, error_weight), terminal_weight=0.5 * (seed % 2))
    solution = BY_BLOCKS[blocks].solve(problem, UNLIMITED)
    best = brute_force(case, problem, substeps, blocks)
    assert solution.status == "optimal"
    assert solution.objective_refuse == pytest.approx(best[0.0], rel=1e-9, abs=1e-12)
    assert solution.objective_accept == pytest.approx(best[1.0], rel=1e-9, abs=1e-12)
    assert solution.accept_first == (solution.objective_accept <= solution.objective_refuse)


def test_what_is_predicted_runs_the_search_that_was_compiled(proposals_of_case_b: dict[str, Problem]) -> None:
    """Another layout or type of one array would compile it again, for seconds, in the middle of a run."""
    for problem in (*proposals_of_case_b.values(), Instance(0).problem(24, 2), Instance(0, obstacles=0).problem(1)):
        BY_BLOCKS[6].solve(problem)
    for kernel in (closed_loop_enumeration._search, plan_cost):
        assert len(kernel.signatures) == 1


@examples(60)
@given(st.integers(0, 10**6), st.booleans(), st.integers(1, 70))
def test_every_decision_carries_its_evidence(seed: int, on_top: bool, stages: int) -> None:
    problem = Instance(seed, on_top=on_top).problem(stages)
    solution = BY_BLOCKS[6].solve(problem)
    assert solution.status == "optimal"
    assert solution.plan is not None
    assert solution.positions is not None
    assert solution.accept_first == (solution.plan[0] == 1.0)
    assert solution.objective == min(solution.objective_accept, solution.objective_refuse)
    assert solution.route_bound == pytest.approx(solution.objective, rel=1e-12)
    assert solution.gap == pytest.approx(0.0, abs=1e-12)
    again = problem.evaluate_closed_loop(solution.plan)
    np.testing.assert_array_equal(solution.positions, again.positions)
    assert solution.objective == again.objective
    assert solution.clearance == min(again.clearance, 1e9)
    assert solution.objective == pytest.approx(cost_through(problem, again.positions))
    assert solution.objective_refuse <= problem.evaluate_closed_loop(np.zeros(stages)).objective
    assert solution.objective_accept <= problem.evaluate_closed_loop(np.ones(stages)).objective
    for block in range(6):
        assert len(set(solution.plan[block_of_stage(stages, 6) == block])) <= 1


@given(st.integers(0, 10**6))
def test_finer_blocks_never_cost_more(seed: int) -> None:
    problem = Instance(seed).problem(24)
    costs = [BY_BLOCKS[blocks].solve(problem).objective for blocks in (1, 2, 4)]
    assert costs[2] <= costs[1] <= costs[0]


def test_a_problem_of_mode_velocities_is_searched_as_such() -> None:
    problem = replace(Instance(5).problem(24), loop=None)
    ours, theirs = BY_BLOCKS[6].solve(problem), EnumerationRoute(6).solve(problem, Budget())
    assert (ours.objective_accept, ours.objective_refuse) == (theirs.objective_accept, theirs.objective_refuse)


def broken() -> Iterator[tuple[str, Problem]]:
    problem = Instance(1).problem(12)
    loop = problem.loop
    assert loop is not None
    yield "mode velocities", replace(problem, accept=np.full((12, 3), np.nan))
    yield "start", replace(problem, loop=loop._replace(start=np.full(3, np.inf)))
    yield "proposal", replace(problem, loop=loop._replace(wanted=np.full_like(loop.wanted, np.nan)))
    yield "distances", replace(problem, loop=loop._replace(distances=np.full_like(loop.distances, np.nan)))
    yield "overflow", replace(problem, reference=np.full((12, 3), 1e200))


@pytest.mark.parametrize("what", [name for name, _ in broken()])
def test_numbers_that_are_not_finite_are_refused(what: str) -> None:
    solution = BY_BLOCKS[6].solve(dict(broken())[what])
    assert not solution.accept_first
    assert solution.status == "refused_not_finite"


@pytest.mark.parametrize("blocks", [0, 21])
def test_blocks_out_of_range(blocks: int) -> None:
    with pytest.raises(ValueError, match="1 to 20"):
        ClosedLoopEnumerationRoute(blocks)


@pytest.fixture
def visited(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Blocks rolled out by each call of the search."""
    counts: list[int] = []
    search = closed_loop_enumeration._search

    def counting(*arguments: object) -> int:
        counts.append(search(*arguments))
        return counts[-1]

    monkeypatch.setattr(closed_loop_enumeration, "_search", counting)
    return counts


@examples(30)
@given(st.integers(0, 10**6), st.integers(1, 200))
def test_a_spent_budget_leaves_valid_bounds(seed: int, nodes: int) -> None:
    problem = Instance(seed).problem(24)
    best, solution = BY_BLOCKS[6].solve(problem, UNLIMITED), BY_BLOCKS[6].solve(problem, Budget(nodes=nodes))
    assert solution.has_plan
    assert solution.route_bound <= best.objective * (1.0 + 1e-12)
    assert solution.objective >= best.objective
    assert 0.0 <= solution.gap <= 1.0
    assert solution.route_bound == pytest.approx(solution.objective * (1.0 - solution.gap), rel=1e-9, abs=1e-9)
    for half, mode in (("objective_accept", 1.0), ("objective_refuse", 0.0)):
        constant = problem.evaluate_closed_loop(np.full(24, mode)).objective
        assert getattr(best, half) <= getattr(solution, half) <= constant
    if nodes >= 2**7 - 2:
        assert solution.status == "optimal"
    if solution.status == "optimal":
        assert solution.objective == best.objective


def test_nodes_are_counted(visited: list[int]) -> None:
    problem = Instance(11).problem(60)
    BY_BLOCKS[10].solve(problem, UNLIMITED)
    total = sum(visited)
    assert 20 < total <= 2**11 - 2
    for nodes in (1, 7, 64, 65, total - 1):
        visited.clear()
        assert BY_BLOCKS[10].solve(problem, Budget(nodes=nodes)).status == "budget_spent"
        assert sum(visited) == nodes
    visited.clear()
    assert BY_BLOCKS[10].solve(problem, Budget(nodes=total)).status == "optimal"


def ticking(deadline: int) -> Budget:
    """A budget whose clock advances by 1 s at every look, and ends at the look of that number."""
    looks = iter(range(1, 10**6))
    return Budget(deadline_s=float(deadline), clock=lambda: float(next(looks)))


def test_the_clock_ends_the_search(visited: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    problem = Instance(11).problem(60)
    best = BY_BLOCKS[10].solve(problem, UNLIMITED)
    monkeypatch.setattr(closed_loop_enumeration, "_CHUNK", 8)
    objectives, gaps = [], []
    for deadline in range(1, 5):
        visited.clear()
        solution = BY_BLOCKS[10].solve(problem, ticking(deadline))
        assert 16 * (deadline - 2) < sum(visited) <= 16 * (deadline - 1)
        assert solution.status == "budget_spent"
        objectives.append(solution.objective)
        gaps.append(solution.gap)
    constants = [problem.evaluate_closed_loop(np.full(60, w)).objective for w in (0.0, 1.0)]
    assert (objectives[0], gaps[0]) == (min(constants), 1.0)  # only the constant plans were known, and no bound
    assert objectives == sorted(objectives, reverse=True)
    assert gaps == sorted(gaps, reverse=True)
    assert BY_BLOCKS[10].solve(problem, ticking(1000)).objective == best.objective


@pytest.fixture(scope="module")
def proposals_of_case_b() -> dict[str, Problem]:
    """The first problem that UGV1's gatekeeper has with the wrong proposal, and with the detour, executed as in (d)."""
    seen: list[Problem] = []

    class Listening(ClosedLoopEnumerationRoute):
        def solve(self, problem: Problem, budget: Budget = UNLIMITED) -> Solution:
            if problem.reference.any():  # not the one that the constructor compiles the search with
                seen.append(problem)
            return super().solve(problem, budget)

    scenario = load("case_b")[0]
    scenario.gatekeeper.route = "listening"
    with ROUTES.adding("listening", Listening):
        trace = Recorder(scenario, "c").simulate(duration=13.3)
    first: dict[str, Problem] = {}
    for policy, problem in zip(trace.decisions["policy"], seen, strict=True):
        assert problem.loop is not None
        below = problem.loop._replace(intervention_on_top=False)
        accept, refuse = below.constant_plans()
        first.setdefault(policy, replace(problem, accept=accept, refuse=refuse, loop=below))
    return first


@pytest.mark.parametrize("error_weight", [1.0, 30.0, 100.0])
def test_heavy_errors_do_not_make_the_detour_look_bad(
    proposals_of_case_b: dict[str, Problem], error_weight: float
) -> None:
    """By mode velocities, a plan that waits first and drives later goes through obstacles at no cost."""
    problem = replace(proposals_of_case_b["detour"], error_weight=error_weight)
    solution = BY_BLOCKS[10].solve(problem)
    assert solution.accept_first
    assert solution.objective_accept < 0.9 * solution.objective_refuse
    by_velocities = EnumerationRoute(10).solve(replace(problem, loop=None))
    assert by_velocities.accept_first == (error_weight < 30.0)
    assert not BY_BLOCKS[10].solve(replace(proposals_of_case_b["towards"], error_weight=error_weight)).accept_first
