"""The closed loop under switching answers, the search over its plans, and how much avoidance bends a proposal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, Integrator, Multiplexer, TrajectorySource

from airground_drake import diagram
from airground_drake.gatekeeper.budget import UNLIMITED, Budget
from airground_drake.gatekeeper.closed_loop import ClosedLoop
from airground_drake.gatekeeper.prediction import Horizon, Scene, UgvLaw, closed_loop, predicted_problem
from airground_drake.gatekeeper.problem import DECIDED, Problem, Solution
from airground_drake.gatekeeper.routes import closed_loop_enumeration as rollout
from airground_drake.gatekeeper.routes.closed_loop_enumeration import ClosedLoopEnumerationRoute, evaluate
from airground_drake.gatekeeper.routes.enumeration import EnumerationRoute
from airground_drake.gatekeeper.solution import block_of_stage
from airground_drake.intervention.messages import ACCEPT, REFUSE
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.motion import Motion
from airground_drake.nsbc.team import Team
from airground_drake.scenarios.load import load
from airground_drake.simulation import Recorder
from airground_drake.systems.controllers import UgvController

H = 0.0625
"""Control period, s: a binary fraction, so that vertices of motions can lie exactly on control samples."""

AVOIDANCE = Avoidance(3.0, H, 4.0)
FAR = np.array([-30.0, 0.0, 2.0])


class Instance:
    """A UGV among random discs, and another robot passing: its scene, law and controller."""

    def __init__(self, seed: int, *, on_top: bool = False, obstacles: int | None = None, moving: bool = True) -> None:
        rng = np.random.default_rng(seed)
        count = int(rng.integers(0, 5)) if obstacles is None else obstacles
        angle = rng.uniform(-np.pi, np.pi, count)
        discs = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)]) * rng.uniform(2.1, 3.5, (count, 1))
        self.other = np.array([*rng.uniform(2.0, 3.0, 2), 0.0])
        self.drift = np.array([*rng.uniform(-2.0, 0.5, 2), 0.0]) if moving else np.zeros(3)
        self.team = Team(("ugv1", "ugv2"), "uav", discs, 2.0, 1.0, 1.0, np.array([3.0, 3.0, 9.0]))
        self.law = UgvLaw(AVOIDANCE, 2.0, 1.5, on_top)

        def travel(vertices: int, speed: float) -> Motion:
            times = np.concatenate([[-1.0], np.sort(rng.choice(np.arange(1, 64), vertices - 1, replace=False)) * H])
            steps = rng.normal(size=(vertices, 3)) * [1, 1, 0]
            steps *= speed * np.diff(times, prepend=-1.0)[:, None] / np.linalg.norm(steps, axis=1)[:, None]
            return Motion(times, np.cumsum(steps, axis=0))

        self.preset = travel(2, 0.8)
        selection = np.eye(3) if rng.random() < 0.7 else np.array([[rng.normal(), rng.normal(), 0.0]])
        self.proposal = Proposal("way", 0.0, travel(4, 2.8), selection)
        around = self.team.neighbourhood(slice(0, 1))
        self.scene = Scene(
            0.0, np.zeros(3), self.preset, np.vstack([discs, self.other, FAR]),
            np.vstack([np.zeros_like(discs), self.drift, np.zeros(3)]), around.distance[0], around.share[0], 3.0,
        )  # fmt: skip

    @property
    def controller(self) -> UgvController:
        return UgvController(
            self.team, AVOIDANCE, motion_gain=2.0, intervention_gain=1.5,
            intervention_on_top=self.law.intervention_on_top,
        )  # fmt: skip

    def problem(self, stages: int, substeps: int = 1, error_weight: float = 1.0) -> Problem:
        return predicted_problem(self.scene, self.law, self.proposal, Horizon(stages, substeps, error_weight, 200.0))

    def loop(self, stages: int, substeps: int = 1) -> ClosedLoop:
        return closed_loop(self.scene, self.law, self.proposal, stages, substeps)


def run_controller(case: Instance, sensed: np.ndarray, answers: np.ndarray, substeps: int) -> np.ndarray:
    """Positions at the ends of the stages by calling the running controller's law step by step."""
    team = replace(case.team, obstacles=case.team.obstacles[sensed[:-2]])
    controller = UgvController(
        team, AVOIDANCE, motion_gain=2.0, intervention_gain=1.5, intervention_on_top=case.law.intervention_on_top
    )
    position, ends = np.zeros(3), []
    for k in range(len(answers) * substeps):
        t = k * H
        other = case.other + t * case.drift if sensed[-2] else FAR
        at, rate = case.preset.at(t)
        velocity = controller.velocity(
            t, np.array([position, other, FAR]), np.array([at, other]), np.array([rate, np.zeros(3)]),
            [case.proposal if answers[k // substeps] else None, None],
        )  # fmt: skip
        position = position + H * velocity[0]
        if (k + 1) % substeps == 0:
            ends.append(position)
    return np.array(ends)


# --- the closed loop ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("on_top", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_switching_plans_are_those_of_the_running_controller_in_a_diagram(seed: int, on_top: bool) -> None:
    """UgvController and the plants under Drake's Simulator, the answers changed from stage to stage."""
    case = Instance(seed, on_top=on_top, obstacles=3, moving=False)
    builder = DiagramBuilder()
    controller = builder.AddNamedSystem("controller", case.controller)
    plant = builder.AddNamedSystem("plant", Integrator(6))
    others = builder.AddNamedSystem("uav", ConstantVectorSource(FAR))
    position = builder.AddNamedSystem("team_position", Multiplexer([6, 3]))
    builder.Connect(controller.GetOutputPort("command"), plant.get_input_port())
    builder.Connect(plant.get_output_port(), position.get_input_port(0))
    builder.Connect(others.get_output_port(), position.get_input_port(1))
    builder.Connect(position.get_output_port(), controller.GetInputPort("team_position"))
    reference = builder.AddNamedSystem(
        "reference",
        TrajectorySource(
            diagram.stack_presets([case.preset, Motion(np.zeros(1), case.other[None])]), output_derivative_order=1
        ),
    )
    builder.Connect(reference.get_output_port(), controller.GetInputPort("reference"))
    for name in ("proposals", "answers"):
        builder.ExportInput(controller.GetInputPort(name), name)
    built = builder.Build()
    simulator = Simulator(built)
    loop = case.loop(30)
    rng = np.random.default_rng(seed)
    for omega in (rng.integers(0, 2, 30), np.repeat(rng.integers(0, 2, 6), 5)):
        context = simulator.get_mutable_context()
        context.SetTime(0.0)
        plant.set_integral_value(plant.GetMyMutableContextFromRoot(context), np.concatenate([np.zeros(3), case.other]))
        proposals: Value[object] = Value(object())
        proposals.set_value((case.proposal, None))
        built.GetInputPort("proposals").FixValue(context, proposals)
        simulator.Initialize()
        driven = []
        for k, accepted in enumerate(omega):
            answer = [ACCEPT if accepted else REFUSE, case.proposal.issued, REFUSE, -1.0]
            built.GetInputPort("answers").FixValue(context, answer)
            simulator.AdvanceTo((k + 1) * H)  # the update that is due at its end waits for the next answer
            driven.append(plant.get_output_port().Eval(plant.GetMyContextFromRoot(context))[:3])
        np.testing.assert_allclose(loop.positions(omega), driven, atol=1e-9)


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.booleans(), st.integers(1, 3))
def test_switching_plans_among_moving_robots_and_with_long_stages(seed: int, on_top: bool, substeps: int) -> None:
    case = Instance(seed, on_top=on_top)
    omega = np.random.default_rng(seed).integers(0, 2, 12)
    every = np.ones(len(case.scene.distances), dtype=bool)
    expected = run_controller(case, every, omega, substeps)
    np.testing.assert_allclose(case.loop(12, substeps).positions(omega), expected, atol=1e-9)


@settings(max_examples=40)
@given(st.integers(0, 10**6), st.booleans(), st.integers(1, 3))
def test_the_constant_plans_are_those_of_the_mode_velocities(seed: int, on_top: bool, substeps: int) -> None:
    problem = Instance(seed, on_top=on_top).problem(12, substeps)
    assert problem.loop is not None
    for omega in (np.zeros(12), np.ones(12)):
        np.testing.assert_allclose(problem.loop.positions(omega), problem.positions(omega), atol=1e-12)
        by_velocities, rolled_out = problem.evaluate(omega), evaluate(problem, omega)
        assert rolled_out.objective == pytest.approx(by_velocities.objective, rel=1e-9, abs=1e-12)
        assert rolled_out.clearance == pytest.approx(by_velocities.clearance, abs=1e-9)


@pytest.mark.parametrize(("max_speed", "kept"), [(3.0, 1), (0.9, 0)])
def test_points_are_kept_that_any_plan_might_reach(max_speed: float, kept: int) -> None:
    """A disc 1.5 m away, 1.5 s, and both constant plans at rest."""
    one, rest = np.ones(1), Motion(np.zeros(1), np.zeros((1, 3)))
    scene = Scene(0.0, np.zeros(3), rest, np.array([[3.5, 0.0, 0.0]]), np.zeros((1, 3)), 2 * one, one, max_speed)
    law = UgvLaw(AVOIDANCE, 2.0, 1.5, intervention_on_top=False)
    problem = predicted_problem(scene, law, Proposal("stay", 0.0, rest), Horizon(24, 1, 1.0, 200.0))
    assert len(problem.distances) == kept


@pytest.mark.parametrize("omega", [np.ones(11), np.ones((12, 1)), np.full(12, 0.5), np.full(12, np.nan)])
def test_what_is_no_plan_is_an_error(omega: np.ndarray) -> None:
    problem = Instance(0).problem(12)
    with pytest.raises(ValueError, match="12 answers that are 0 or 1"):
        evaluate(problem, omega)
    with pytest.raises(ValueError, match="no closed loop"):
        evaluate(replace(problem, loop=None), np.ones(12))


# --- the search --------------------------------------------------------------------------------------------------


ROUTES = {blocks: ClosedLoopEnumerationRoute(blocks) for blocks in (1, 2, 3, 4, 5, 6, 10)}


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
        errors = np.square(case.preset.sample(after) - positions).sum()
        cost = substeps * H * (problem.error_weight * errors + problem.slack_weight * np.square(slack).sum())
        best[modes[0]] = min(best[modes[0]], cost)
    return best


@settings(max_examples=60)
@given(st.integers(0, 10**6), st.booleans(), st.integers(1, 2), st.integers(1, 5), st.sampled_from([1.0, 100.0]))
def test_the_search_finds_the_optimum_of_all_plans(
    seed: int, on_top: bool, substeps: int, blocks: int, error_weight: float
) -> None:
    case = Instance(seed, on_top=on_top)
    problem = case.problem(9, substeps, error_weight)
    solution = ROUTES[blocks].solve(problem, UNLIMITED)
    best = brute_force(case, problem, substeps, blocks)
    assert solution.status == "optimal"
    assert solution.objective_refuse == pytest.approx(best[0.0], rel=1e-9, abs=1e-12)
    assert solution.objective_accept == pytest.approx(best[1.0], rel=1e-9, abs=1e-12)
    assert solution.accept_first == (solution.objective_accept <= solution.objective_refuse)


def test_what_is_predicted_runs_the_search_that_was_compiled(proposals_of_case_b: dict[str, Problem]) -> None:
    """Another layout or type of one array would compile it again, for seconds, in the middle of a run."""
    for problem in (*proposals_of_case_b.values(), Instance(0).problem(24, 2), Instance(0, obstacles=0).problem(1)):
        ROUTES[6].solve(problem)
    for kernel in (rollout._search, rollout._evaluate):
        assert len(kernel.signatures) == 1


@settings(max_examples=60)
@given(st.integers(0, 10**6), st.booleans(), st.integers(1, 70))
def test_every_decision_carries_its_evidence(seed: int, on_top: bool, stages: int) -> None:
    problem = Instance(seed, on_top=on_top).problem(stages)
    solution = ROUTES[6].solve(problem)
    assert solution.status == "optimal"
    assert solution.plan is not None
    assert solution.positions is not None
    assert solution.accept_first == (solution.plan[0] == 1.0)
    assert solution.objective == min(solution.objective_accept, solution.objective_refuse)
    assert solution.lower_bound == pytest.approx(solution.objective, rel=1e-12)
    assert solution.gap == pytest.approx(0.0, abs=1e-12)
    again = evaluate(problem, solution.plan)
    np.testing.assert_array_equal(solution.positions, again.positions)
    assert solution.objective == again.objective
    assert solution.clearance == min(again.clearance, 1e9)
    gaps = np.linalg.norm(again.positions[:, None] - problem.centres, axis=2) - problem.distances
    assert solution.objective == pytest.approx(problem.cost(again.positions, gaps.min(axis=1, initial=np.inf)))
    assert solution.objective_refuse <= evaluate(problem, np.zeros(stages)).objective
    assert solution.objective_accept <= evaluate(problem, np.ones(stages)).objective
    for block in range(6):
        assert len(set(solution.plan[block_of_stage(stages, 6) == block])) <= 1


@given(st.integers(0, 10**6))
def test_finer_blocks_never_cost_more(seed: int) -> None:
    problem = Instance(seed).problem(24)
    costs = [ROUTES[blocks].solve(problem).objective for blocks in (1, 2, 4)]
    assert costs[2] <= costs[1] <= costs[0]


def test_a_problem_of_mode_velocities_is_searched_as_such() -> None:
    problem = replace(Instance(5).problem(24), loop=None)
    ours, theirs = ROUTES[6].solve(problem), EnumerationRoute(6).solve(problem, Budget())
    assert (ours.objective_accept, ours.objective_refuse) == (theirs.objective_accept, theirs.objective_refuse)


def broken() -> Iterator[tuple[str, Problem]]:
    problem = Instance(1).problem(12)
    loop = problem.loop
    assert loop is not None
    yield "mode velocities", replace(problem, accept=np.full((12, 3), np.nan))
    yield "bend", replace(problem, bend=np.nan)
    yield "start", replace(problem, loop=loop._replace(start=np.full(3, np.inf)))
    yield "proposal", replace(problem, loop=loop._replace(wanted=np.full_like(loop.wanted, np.nan)))
    yield "distances", replace(problem, loop=loop._replace(distances=np.full_like(loop.distances, np.nan)))
    yield "overflow", replace(problem, reference=np.full((12, 3), 1e200))


@pytest.mark.parametrize("what", [name for name, _ in broken()])
def test_numbers_that_are_not_finite_are_refused(what: str) -> None:
    solution = ROUTES[6].solve(dict(broken())[what])
    assert not solution.accept_first
    assert solution.status == "refused_not_finite"


@pytest.mark.parametrize("blocks", [0, 21])
def test_blocks_out_of_range(blocks: int) -> None:
    with pytest.raises(ValueError, match="1 to 20"):
        ClosedLoopEnumerationRoute(blocks)


# --- its budget --------------------------------------------------------------------------------------------------


@pytest.fixture
def visited(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Blocks rolled out by each call of the search."""
    counts: list[int] = []
    search = rollout._search

    def counting(*arguments: object) -> int:
        counts.append(search(*arguments))
        return counts[-1]

    monkeypatch.setattr(rollout, "_search", counting)
    return counts


@settings(max_examples=30)
@given(st.integers(0, 10**6), st.integers(1, 200))
def test_a_spent_budget_leaves_valid_bounds(seed: int, nodes: int) -> None:
    problem = Instance(seed).problem(24)
    best, solution = ROUTES[6].solve(problem, UNLIMITED), ROUTES[6].solve(problem, Budget(nodes=nodes))
    assert solution.status in DECIDED
    assert solution.lower_bound <= best.objective * (1.0 + 1e-12)
    assert solution.objective >= best.objective
    assert 0.0 <= solution.gap <= 1.0
    assert solution.lower_bound == pytest.approx(solution.objective * (1.0 - solution.gap), rel=1e-9, abs=1e-9)
    for half, mode in (("objective_accept", 1.0), ("objective_refuse", 0.0)):
        assert getattr(best, half) <= getattr(solution, half) <= evaluate(problem, np.full(24, mode)).objective
    if nodes >= 2**7 - 2:
        assert solution.status == "optimal"
    if solution.status == "optimal":
        assert solution.objective == best.objective


def test_nodes_are_counted(visited: list[int]) -> None:
    problem = Instance(11).problem(60)
    ROUTES[10].solve(problem, UNLIMITED)
    total = sum(visited)
    assert 20 < total <= 2**11 - 2
    for nodes in (1, 7, 64, 65, total - 1):
        visited.clear()
        assert ROUTES[10].solve(problem, Budget(nodes=nodes)).status == "budget_spent"
        assert sum(visited) == nodes
    visited.clear()
    assert ROUTES[10].solve(problem, Budget(nodes=total)).status == "optimal"


def ticking(deadline: int) -> Budget:
    """A budget whose clock advances by 1 s at every look, and ends at the look of that number."""
    looks = iter(range(1, 10**6))
    return Budget(deadline_s=float(deadline), clock=lambda: float(next(looks)))


def test_the_clock_ends_the_search(visited: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    problem = Instance(11).problem(60)
    best = ROUTES[10].solve(problem, UNLIMITED)
    visited.clear()
    late = ROUTES[10].solve(problem, ticking(1))
    assert (late.status, late.accept_first, late.plan, visited) == ("refused_budget_spent", False, None, [])
    monkeypatch.setattr(rollout, "_CHUNK", 8)
    objectives, gaps = [], []
    for deadline in range(2, 6):
        visited.clear()
        solution = ROUTES[10].solve(problem, ticking(deadline))
        assert 16 * (deadline - 3) < sum(visited) <= 16 * (deadline - 2)
        assert solution.status == "budget_spent"
        objectives.append(solution.objective)
        gaps.append(solution.gap)
    constants = [evaluate(problem, np.full(60, w)).objective for w in (0.0, 1.0)]
    assert (objectives[0], gaps[0]) == (min(constants), 1.0)  # only the constant plans were known, and no bound
    assert objectives == sorted(objectives, reverse=True)
    assert gaps == sorted(gaps, reverse=True)
    assert ROUTES[10].solve(problem, ticking(1000)).objective == best.objective


# --- bend --------------------------------------------------------------------------------------------------------


def bend(case: Instance, problem: Problem) -> float:
    """`Problem.bend` from its formula, by the running controller's law with and without the inequalities."""
    loop = problem.loop
    assert loop is not None
    positions = np.vstack([loop.start, loop.positions(np.ones(problem.stages))])
    bent = wanted = 0.0
    for k in range(problem.stages):
        (at, rate), (way, pace) = case.preset.at(k * H), case.proposal.motion.at(k * H)
        own = (rate + 2.0 * (at - positions[k])) * [1, 1, 0]
        own *= min(1.0, 3.0 / max(np.linalg.norm(own), 1e-300))
        asked = (pace + 1.5 * (way - positions[k])) * [1, 1, 0]
        below = own + case.proposal.chosen @ (asked - own)
        below *= min(1.0, 3.0 / max(np.linalg.norm(below), 1e-300))
        bent += np.linalg.norm((positions[k + 1] - positions[k]) / H - below)
        wanted += np.linalg.norm(below)
    return float(bent / wanted)


@settings(max_examples=60)
@given(st.integers(0, 10**6))
def test_bend_follows_its_formula(seed: int) -> None:
    case = Instance(seed)
    problem = case.problem(20)
    assert np.isfinite(problem.bend)
    assert problem.bend >= 0.0
    assert problem.bend == pytest.approx(bend(case, problem), rel=1e-6, abs=1e-9)


@given(st.integers(0, 10**6))
def test_nothing_bends_without_points_or_with_the_intervention_on_top(seed: int) -> None:
    free, on_top = Instance(seed), Instance(seed, on_top=True)
    nothing = free.scene.restrict(np.zeros(len(free.scene.distances), dtype=bool))
    assert predicted_problem(nothing, free.law, free.proposal, Horizon(20, 1, 1.0, 200.0)).bend == 0.0
    assert on_top.problem(20).bend == 0.0


def towards_a_disc(gap: float, target: float = 3.0, speed: float = 2.0) -> Problem:
    """A proposal straight along x, a disc of radius 2 m around (2 + gap, 0), the UGV at rest at the origin."""
    motion = Motion.at_speed(np.array([np.zeros(3), [target, 0.0, 0.0]]), speed)
    rest = Motion(np.zeros(1), np.zeros((1, 3)))
    one = np.ones(1)
    scene = Scene(0.0, np.zeros(3), rest, np.array([[2.0 + gap, 0.0, 0.0]]), np.zeros((1, 3)), 2 * one, one, 3.0)
    law = UgvLaw(AVOIDANCE, 2.0, 1.5, intervention_on_top=False)
    return predicted_problem(scene, law, Proposal("in", 0.0, motion), Horizon(48, 1, 1.0, 200.0))


def test_a_proposal_straight_into_a_disc_is_bent_as_far_as_it_is_blocked() -> None:
    assert towards_a_disc(0.0).bend == pytest.approx(1.0, abs=1e-9)  # no motion at all
    near, half_way, beyond = (towards_a_disc(gap).bend for gap in (0.3, 1.5, 3.1))
    assert 0.9 < near < 1.0
    assert 0.3 < half_way < near
    assert beyond < 1e-9
    assert towards_a_disc(-0.5).bend > 1.0  # inside the safe distance: it retreats against what is wanted


def test_nothing_wanted_is_not_bent() -> None:
    one, rest = np.ones(1), Motion(np.zeros(1), np.zeros((1, 3)))
    scene = Scene(0.0, np.zeros(3), rest, np.array([[2.5, 0.0, 0.0]]), np.zeros((1, 3)), 2 * one, one, 3.0)
    law = UgvLaw(AVOIDANCE, 2.0, 1.5, intervention_on_top=False)
    assert predicted_problem(scene, law, Proposal("stay", 0.0, rest), Horizon(8, 1, 1.0, 200.0)).bend == 0.0


# --- the shipped scenario ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def proposals_of_case_b() -> dict[str, Problem]:
    """The first problem that UGV1's gatekeeper has with the wrong proposal, and with the detour, method (d)."""
    seen: list[Problem] = []

    class Listening(ClosedLoopEnumerationRoute):
        def solve(self, problem: Problem, budget: Budget = UNLIMITED) -> Solution:
            if problem.reference.any():  # not the one that the constructor compiles the search with
                seen.append(problem)
            return super().solve(problem, budget)

    scenario = load("case_b")[0]
    scenario.gatekeeper.route = "listening"
    known: dict[str, Callable[[], object]] = diagram.ROUTES  # type: ignore[assignment]
    known["listening"] = Listening
    try:
        trace = Recorder(scenario, "d", scenario.runs["d"]).simulate(duration=13.3)
    finally:
        del known["listening"]
    first: dict[str, Problem] = {}
    for policy, problem in zip(trace.decisions["policy"], seen, strict=True):
        first.setdefault(policy, problem)
    return first


def test_the_wrong_proposal_of_case_b_is_bent_and_the_detour_is_not(proposals_of_case_b: dict[str, Problem]) -> None:
    assert proposals_of_case_b["towards"].bend > 0.9
    assert proposals_of_case_b["detour"].bend < 0.05


@pytest.mark.parametrize("error_weight", [1.0, 30.0, 100.0])
def test_heavy_errors_do_not_make_the_detour_look_bad(
    proposals_of_case_b: dict[str, Problem], error_weight: float
) -> None:
    """By mode velocities, a plan that waits first and drives later goes through obstacles at no cost."""
    problem = replace(proposals_of_case_b["detour"], error_weight=error_weight)
    solution = ROUTES[10].solve(problem)
    assert solution.accept_first
    assert solution.objective_accept < 0.9 * solution.objective_refuse
    by_velocities = EnumerationRoute(10).solve(replace(problem, loop=None))
    assert by_velocities.accept_first == (error_weight < 30.0)
    assert not ROUTES[10].solve(replace(proposals_of_case_b["towards"], error_weight=error_weight)).accept_first
