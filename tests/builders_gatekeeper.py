"""Hand-made problems of the gatekeeper, and its formulas written again."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cache
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airground_drake.components import make_presets, make_team
from airground_drake.gatekeeper.budget import Budget
from airground_drake.gatekeeper.closed_loop import ClosedLoop
from airground_drake.gatekeeper.prediction import Horizon, Scene, closed_loop, predicted_problem
from airground_drake.gatekeeper.problem import Evaluation, Problem
from airground_drake.gatekeeper.rounding import sum_up_rounding
from airground_drake.gatekeeper.routes.nonlinear import NonlinearRoute
from airground_drake.gatekeeper.routes.route import Route
from airground_drake.gatekeeper.solution import Solution, Status
from airground_drake.intervention.detour import Detour
from airground_drake.intervention.policy import Observation, Proposal
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.law import UgvLaw
from airground_drake.nsbc.motion import Motion
from airground_drake.nsbc.team import Team
from airground_drake.registry import ROUTES
from airground_drake.scenarios.load import load
from airground_drake.systems.controllers import UgvController

LAW = UgvLaw(Avoidance(3.0, 0.05, 4.0), 2.0, 1.5, intervention_on_top=False)


DEFAULT = Budget()


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


def case_a_problem(
    position: tuple[float, float], t: float, ways: tuple[tuple[float, float], ...], on_top: bool
) -> Problem:
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
        "case A, stalled": case_a_problem(STALL, 14.55, ROUND, False),
        "case A, stalled, intervention on top": case_a_problem(STALL, 14.55, ROUND, True),
        "case A, on the way": case_a_problem((5.2, 5.3), 15.2, ROUND, False),
        "case A, into the obstacle": case_a_problem(STALL, 14.55, ((4.0, 7.0),), True),
        "no points": with_points(plain, np.zeros((0, 3)), []),
        "a point at the robot": with_points(plain, np.zeros(3), [0.8]),
        "deep inside a large disc": with_points(plain, np.array([[0.1, 0, 0], [0.3, 0, 0]]), [5.0, 0.1]),
        "identical modes": replace(plain, accept=plain.refuse),
        "at rest on the reference": replace(plain, accept=still, refuse=still, reference=still),
        "not a number": replace(plain, refuse=nan),
        "infinite": replace(plain, initial=np.array([np.inf, 0.0, 0.0])),
    }  # fmt: skip


INSTANCES = instances()


STALL_POSITION = np.array([3.36888, 5.10219, 0.0])


def case_a_proposal() -> tuple[Scene, UgvLaw, Proposal, Horizon]:
    scenario = load("case_a")[0]
    team, preset = make_team(scenario), make_presets(scenario)[0]
    t = 14.5
    seen = Observation(
        t=t, start=t + 0.05, robot="ugv1", position=STALL_POSITION, target=np.array([3.3, 13.0, 0.0]), preset=preset,
        obstacles=team.obstacles, mapped=team.obstacles, others=np.zeros((0, 3)), safe_distance=2.0, refusals=0,
    )  # fmt: skip
    motion = Detour(speed_m_s=2.85).propose(seen)
    assert motion is not None
    scene = Scene(t + 0.05, STALL_POSITION, preset, team.obstacles, np.zeros((3, 3)), np.full(3, 2.0), np.ones(3), 3.0)
    law = UgvLaw(Avoidance(3.0, 0.05, 4.0), 2.0, 1.5, intervention_on_top=False)
    return scene, law, Proposal("detour", t, motion), Horizon(60, 1, 1.0, 1000.0)


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
        return UgvController(self.team, self.law)

    def problem(self, stages: int, substeps: int = 1, error_weight: float = 1.0) -> Problem:
        return predicted_problem(self.scene, self.law, self.proposal, Horizon(stages, substeps, error_weight, 200.0))

    def loop(self, stages: int, substeps: int = 1) -> ClosedLoop:
        return closed_loop(self.scene, self.law, self.proposal, stages, substeps)


def run_controller(case: Instance, sensed: np.ndarray, answers: np.ndarray, substeps: int) -> np.ndarray:
    """Positions at the ends of the stages by calling the running controller's law step by step."""
    team = replace(case.team, obstacles=case.team.obstacles[sensed[:-2]])
    controller = UgvController(team, case.law)
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


@dataclass(frozen=True, eq=False)
class Recording(Problem):
    """A problem that remembers which plans were evaluated."""

    plans: list[Evaluation] = field(default_factory=list)

    @classmethod
    def of(cls, problem: Problem) -> Recording:
        return cls(**{f.name: getattr(problem, f.name) for f in fields(Problem)})

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


def blocked(stages: int, blocks: int) -> np.ndarray:
    """All binary plans (2^blocks, stages) that are constant on blocks of equal length."""
    bits = np.arange(2**blocks)[:, None] >> np.arange(blocks) & 1
    return np.repeat(bits, stages // blocks, axis=1).astype(float)


def total(program: Any, values: np.ndarray) -> float:
    """Sum of all costs of a program."""
    return sum(float(program.EvalBinding(binding, values)[0]) for binding in program.GetAllCosts())


PLANS = arrays(np.float64, 24, elements=st.floats(0.0, 1.0))


MAKERS = {name: ROUTES.load(name, of=Route) for name in ROUTES.own} | {
    "nonlinear_ipopt": lambda: NonlinearRoute("ipopt")
}


@cache
def used(name: str) -> Route:
    """One route for all instances, so that what it keeps between calls is under test too."""
    return MAKERS[name]()


def check_contract(route: Route, problem: Problem, broken: bool = False, budget: Budget = DEFAULT) -> Solution:
    """What every route owes for every problem and every budget."""
    recording = Recording.of(problem)
    solution = route.solve(recording, budget)
    assert solution.status in get_args(Status)
    assert all(np.isfinite(v).all() for v in vars(solution).values() if v is not None and not isinstance(v, str))
    if broken:
        assert same(solution, Solution(False, "refused_not_finite"))
        return solution
    if not solution.has_plan:
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
        assert solution.route_bound <= solution.objective * (1.0 + 1e-12)
        return
    assert solution.normals.shape == problem.centres.shape
    np.testing.assert_allclose(np.linalg.norm(solution.normals, axis=2), 1.0, atol=1e-12)
    for omega in witnesses:
        assert solution.route_bound <= half_plane_cost(problem, omega, solution.normals) * (1.0 + 1e-9) + 1e-12


def cost_through(problem: Problem, positions: np.ndarray) -> float:
    """(25) with (26d) from the formulas, through positions (N, 3)."""
    gaps = np.linalg.norm(positions[:, None] - problem.centres, axis=2) - problem.distances
    slack = np.maximum(0.0, -gaps.min(axis=1, initial=np.inf))
    error = np.square(problem.reference - positions).sum()
    return problem.dt * float(problem.error_weight * error + problem.slack_weight * np.square(slack).sum())
