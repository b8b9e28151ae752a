"""The gatekeeper: prediction, relaxation, rounding, solution."""

from __future__ import annotations

from dataclasses import replace

import cvxpy
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airground_drake.diagram import make_presets, make_team
from airground_drake.gatekeeper.half_planes import normals_along
from airground_drake.gatekeeper.prediction import Horizon, Scene, UgvLaw, closed_loop, predicted_problem
from airground_drake.gatekeeper.problem import Problem
from airground_drake.gatekeeper.rounding import rounding_deviation, sum_up_rounding
from airground_drake.gatekeeper.routes.relaxed import RelaxedRoute
from airground_drake.intervention.detour import Detour
from airground_drake.intervention.messages import SILENT
from airground_drake.intervention.policy import Observation, Proposal
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.motion import Motion
from airground_drake.scenarios.load import load
from airground_drake.systems.controllers import UgvController
from airground_drake.systems.gatekeeper import Rules, settle

STALL = np.array([3.36888, 5.10219, 0.0])


def random_problem(seed: int, stages: int = 20, points: int = 2) -> Problem:
    rng = np.random.default_rng(seed)
    initial = np.array([0.0, 0.0, 0.0])
    velocities = [np.column_stack([rng.normal(size=(stages, 2)) * 2, np.zeros(stages)]) for _ in range(2)]
    reference = np.column_stack([rng.normal(size=(stages, 2)) * 2, np.zeros(stages)])
    centres = np.repeat(rng.uniform(-3, 3, (1, points, 3)) * [1, 1, 0], stages, axis=0)
    return Problem(0.05, initial, *velocities, reference, centres, np.full(points, 1.0), 1.0, 200.0)


def case_a_proposal() -> tuple[Scene, UgvLaw, Proposal, Horizon]:
    scenario = load("case_a")[0]
    team, preset = make_team(scenario), make_presets(scenario)[0]
    t = 14.5
    seen = Observation(
        t=t, start=t + 0.05, robot="ugv1", position=STALL, target=np.array([3.3, 13.0, 0.0]), preset=preset,
        obstacles=team.obstacles, mapped=team.obstacles, others=np.zeros((0, 3)), safe_distance=2.0, refusals=0,
    )  # fmt: skip
    motion = Detour(speed_m_s=2.85).propose(seen)
    assert motion is not None
    scene = Scene(t + 0.05, STALL, preset, team.obstacles, np.zeros((3, 3)), np.full(3, 2.0), np.ones(3), 3.0)
    law = UgvLaw(Avoidance(3.0, 0.05, 4.0), 2.0, 1.5, intervention_on_top=False)
    return scene, law, Proposal("detour", t, motion), Horizon(60, 1, 1.0, 1000.0)


@given(arrays(np.float64, st.integers(1, 120), elements=st.floats(0.0, 1.0)))
def test_sum_up_rounding_stays_within_half_a_stage(relaxed: np.ndarray) -> None:
    binary = sum_up_rounding(relaxed)
    assert set(binary.tolist()) <= {0.0, 1.0}
    assert rounding_deviation(relaxed, binary, 0.05) <= 0.025 + 1e-12


def test_sum_up_rounding_follows_28_and_29_literally() -> None:
    rng = np.random.default_rng(0)
    for _ in range(50):
        relaxed = rng.integers(0, 9, 30) / 8.0  # sums are exact, and ties occur
        both = np.column_stack([relaxed, 1.0 - relaxed])
        chosen = np.zeros_like(both)
        for k in range(30):
            h = both[: k + 1].sum(axis=0) - chosen[:k].sum(axis=0)
            chosen[k, 0 if h[0] >= h[1] else 1] = 1.0
        np.testing.assert_array_equal(sum_up_rounding(relaxed), chosen[:, 0])


@settings(max_examples=15)
@given(st.integers(0, 10**6))
def test_relaxation_agrees_with_an_independent_model(seed: int) -> None:
    """cvxpy builds (27) from the formulas, with the same half-planes; the optima agree."""
    problem = random_problem(seed)
    accept, refuse = problem.evaluate(np.ones(20)), problem.evaluate(np.zeros(20))
    guide = accept if accept.objective < refuse.objective else refuse
    normals = normals_along(problem, guide.positions)
    omega, u = cvxpy.Variable((20, 1)), cvxpy.Variable(20)
    velocity = problem.refuse + cvxpy.multiply(omega, problem.accept - problem.refuse)
    p = problem.initial[None] + problem.dt * cvxpy.cumsum(velocity, axis=0)
    constraints = [omega >= 0, omega <= 1, u >= 0]
    for m in range(2):
        reach = cvxpy.sum(cvxpy.multiply(normals[:, m], p - problem.centres[:, m]), axis=1)
        constraints.append(reach >= problem.distances[m] - u)
    cost = problem.dt * (cvxpy.sum_squares(problem.reference - p) + 200.0 * cvxpy.sum_squares(u))
    best = cvxpy.Problem(cvxpy.Minimize(cost), constraints).solve(solver="CLARABEL")
    solution = RelaxedRoute().solve(problem)
    assert solution.status == "optimal"
    assert solution.lower_bound == pytest.approx(best, rel=1e-5, abs=1e-6)


@settings(max_examples=50)
@given(st.integers(0, 10**6))
def test_every_decision_carries_its_evidence(seed: int) -> None:
    problem = random_problem(seed)
    solution = RelaxedRoute().solve(problem)
    assert solution.objective == min(solution.objective_accept, solution.objective_refuse)
    assert solution.accept_first == (solution.objective_accept <= solution.objective_refuse)
    assert solution.gap >= -1e-6
    assert solution.rounding_deviation <= problem.dt / 2 + 1e-9
    constant = [problem.evaluate(np.full(20, w)).objective for w in (0.0, 1.0)]
    assert solution.objective <= min(constant)


@given(st.integers(0, 10**6), arrays(np.float64, 20, elements=st.floats(0.0, 1.0)))
def test_half_planes_are_conservative(seed: int, omega: np.ndarray) -> None:
    """||p - o|| >= n.(p - o) for the unit n: slack to the half-planes covers the slack to the discs."""
    problem = random_problem(seed)
    positions = problem.positions(omega)
    normals = normals_along(problem, problem.positions(np.ones(20)))
    np.testing.assert_allclose(np.linalg.norm(normals, axis=2), 1.0, atol=1e-12)
    offset = positions[:, None] - problem.centres
    to_planes = np.einsum("kmi,kmi->km", normals, offset) - problem.distances
    assert (np.linalg.norm(offset, axis=2) - problem.distances >= to_planes - 1e-12).all()
    assert problem.evaluate(omega).objective <= problem.evaluate_half_planes(positions, normals) + 1e-9


@given(st.integers(0, 10**6), arrays(np.float64, 20, elements=st.floats(0.0, 1.0)))
def test_costs_follow_25(seed: int, omega: np.ndarray) -> None:
    problem = random_problem(seed)
    positions = problem.initial + problem.dt * np.cumsum(
        omega[:, None] * problem.accept + (1 - omega[:, None]) * problem.refuse, axis=0
    )
    distance = np.linalg.norm(positions[:, None] - problem.centres, axis=2) - problem.distances
    slack = np.maximum(0.0, -distance.min(axis=1))
    cost = problem.dt * (((problem.reference - positions) ** 2).sum() + 200.0 * (slack**2).sum())
    ours = problem.evaluate(omega)
    assert ours.objective == pytest.approx(cost)
    assert ours.clearance == pytest.approx(distance.min())


def test_pruned_rows_do_not_change_the_optimum() -> None:
    """A far obstacle that no plan can reach leaves every number of the solution as it was."""
    problem = random_problem(3)
    far = np.concatenate([problem.centres, np.full((20, 1, 3), [50.0, 0.0, 0.0])], axis=1)
    solution, more = (
        RelaxedRoute().solve(p) for p in (problem, replace(problem, centres=far, distances=np.full(3, 1.0)))
    )
    assert more.lower_bound == pytest.approx(solution.lower_bound, rel=1e-6)
    assert more.accept_first == solution.accept_first


def test_no_obstacle_at_all() -> None:
    solution = RelaxedRoute().solve(random_problem(1, points=0))
    assert solution.status == "optimal"
    assert np.isfinite(solution.clearance)


@pytest.mark.parametrize("field", ["accept", "refuse", "reference", "initial", "centres"])
def test_numbers_that_are_not_finite_are_refused(field: str) -> None:
    problem = random_problem(0)
    broken = getattr(problem, field).copy()
    broken.flat[1] = np.nan
    solution = RelaxedRoute().solve(replace(problem, **{field: broken}))
    assert not solution.accept_first
    assert solution.status == "refused_not_finite"


def test_a_failing_solver_refuses(monkeypatch: pytest.MonkeyPatch) -> None:
    class Failed:
        def is_success(self) -> bool:
            return False

        def GetSolution(self, variables: np.ndarray) -> np.ndarray:
            return np.full(len(variables), np.nan)

        def get_optimal_cost(self) -> float:
            return float("inf")

    class Solver:
        def Solve(self, *arguments: object) -> Failed:
            return Failed()

    route = RelaxedRoute()
    monkeypatch.setattr(route, "_solver", Solver())
    solution = route.solve(random_problem(0))
    assert not solution.accept_first
    assert solution.status == "refused_solver_failed"
    assert RelaxedRoute().solve(random_problem(0)).status == "optimal"


def test_the_detour_of_case_a_is_accepted() -> None:
    scene, law, proposal, horizon = case_a_proposal()
    for on_top in (True, False):
        solution = RelaxedRoute().solve(
            predicted_problem(scene, replace(law, intervention_on_top=on_top), proposal, horizon)
        )
        assert solution.accept_first
        assert solution.objective_accept < 0.85 * solution.objective_refuse  # to wait one block and then accept


def test_a_proposal_into_an_obstacle_is_refused() -> None:
    scene, law, _, horizon = case_a_proposal()
    motion = Motion.at_speed(np.array([STALL, [4.0, 7.0, 0.0]]), 2.0, start=scene.t)
    for on_top in (True, False):
        problem = predicted_problem(
            scene, replace(law, intervention_on_top=on_top), Proposal("bad", scene.t, motion), horizon
        )
        throughout = tuple(problem.evaluate(np.full(problem.stages, answer)).objective for answer in (1.0, 0.0))
        solution = RelaxedRoute().solve(problem)
        assert not settle(solution, throughout, problem.bend, SILENT, 0.0, Rules(max_bend=0.5))[0]
        assert (problem.bend > 0.5) == (not on_top)


@pytest.mark.parametrize("on_top", [True, False])
@pytest.mark.parametrize("selection", [np.eye(3), np.array([[0.0, 1.0, 0.0]])])
def test_prediction_is_the_running_controller(on_top: bool, selection: np.ndarray) -> None:
    """The rolled-out velocities are those of `UgvController`, step by step, under both choices."""
    scenario = load("case_a")[0]
    scene, law, proposal, _ = case_a_proposal()
    law = replace(law, intervention_on_top=on_top)
    proposal = replace(proposal, selection=selection)
    team, presets = make_team(scenario), make_presets(scenario)
    controller = UgvController(team, law.avoidance, motion_gain=2.0, intervention_gain=1.5, intervention_on_top=on_top)
    h = law.avoidance.period
    loop = closed_loop(scene, law, proposal, 60, 1)
    for accepted, predicted in zip((True, False), loop.constant_plans()[:2], strict=True):
        positions = np.array([STALL, [-30.0, 0.0, 0.0], [-30.0, 0.0, 2.0]])
        for k in range(60):
            t = scene.t + k * h
            at = [presets[0].sample(np.array([t, t + h])), np.zeros((2, 3))]
            reference = np.array([rows[0] for rows in at])
            rate = np.array([(rows[1] - rows[0]) / h for rows in at])
            held = proposal.motion.sample(np.array([t, t + h]))
            step = Motion(np.array([t, t + h]), held)  # the rate that the sampled motion has over this step
            answer = [replace(proposal, motion=step) if accepted else None, None]
            velocity = controller.velocity(t, positions, reference, rate, answer)
            np.testing.assert_allclose(predicted[k], velocity[0], atol=1e-9)
            positions[0] += h * velocity[0]
