"""Problems (26) of the gatekeeper, made without a run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airground_drake.gatekeeper.problem import Horizon, Problem, predicted_problem
from airground_drake.gatekeeper.rollout import View
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.detour import Detour
from airground_drake.intervention.policy import Observation, Proposal
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.law import UgvLaw
from airground_drake.scenarios.load import load
from airground_drake.scenarios.world import make_world
from airground_drake.systems.components import make_presets

LAW = UgvLaw(Avoidance(3.0, 0.05, 4.0), 2.0, 1.5, intervention_on_top=False)


def random_problem(seed: int, stages: int = 24, points: int = 2) -> Problem:
    """Mode velocities and references without any structure, of both modes independent; odd: with a terminal cost."""
    rng = np.random.default_rng(seed)

    def plane(*shape: int) -> np.ndarray:
        return np.concatenate([rng.normal(size=(*shape, 2)) * 2, np.zeros((*shape, 1))], axis=-1)

    accept, refuse, reference = plane(stages), plane(stages), plane(stages)
    centres = np.repeat(rng.uniform(-3, 3, (1, points, 3)) * [1, 1, 0], stages, axis=0)
    distances = rng.uniform(0.2, 1.2, points)
    return Problem(0.05, np.zeros(3), accept, refuse, reference, centres, distances, 1.0, 200.0, 0.7 * (seed % 2))


def rolled_out(seed: int) -> Problem:
    """The closed loop of a UGV among discs, its straight way home against a proposed way round."""
    rng = np.random.default_rng(seed)
    points = int(rng.integers(1, 5))
    angle = rng.uniform(-np.pi, np.pi, points)
    centres = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(points)]) * rng.uniform(2.1, 3.5, (points, 1))
    away = rng.uniform(-4.0, 4.0, (2, 3)) * [1, 1, 0]
    home = Motion.at_speed(np.array([np.zeros(3), away[0]]), 0.6, start=-rng.uniform(0.0, 3.0))
    round_about = Motion.at_speed(np.array([np.zeros(3), away[1], away[0]]), 2.8, start=0.0)
    scene = View(
        0.0, np.zeros(3), home, centres, np.zeros((points, 3)), np.full(points, 2.0), np.ones(points), 3.0
    )  # fmt: skip
    return by_velocities(scene, LAW, Proposal("way round", 0.0, round_about))


def by_velocities(scene: View, law: UgvLaw, proposal: Proposal) -> Problem:
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
    scene = View(t, here, preset, centres, np.zeros((3, 3)), np.full(3, 2.0), np.ones(3), 3.0)
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
        "rolled out, a terminal cost": replace(rolled_out(1), terminal_weight=0.5),
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


def case_a_proposal() -> tuple[View, UgvLaw, Proposal, Horizon]:
    scenario = load("case_a")[0]
    preset, obstacles = make_presets(scenario)[0], make_world(scenario).around(slice(0, 1)).still
    t = 14.5
    seen = Observation(
        t=t, start=t + 0.05, robot="ugv1", position=STALL_POSITION, target=np.array([3.3, 13.0, 0.0]), preset=preset,
        obstacles=obstacles, mapped=obstacles, others=np.zeros((0, 3)), safe_distance=2.0, refusals=0,
    )  # fmt: skip
    motion = Detour(speed_m_s=2.85).propose(seen)
    assert motion is not None
    scene = View(t + 0.05, STALL_POSITION, preset, obstacles, np.zeros((3, 3)), np.full(3, 2.0), np.ones(3), 3.0)
    law = UgvLaw(Avoidance(3.0, 0.05, 4.0), 2.0, 1.5, intervention_on_top=False)
    return scene, law, Proposal("detour", t, motion), Horizon(60, 1, 1.0, 1000.0)


PLANS = arrays(np.float64, 24, elements=st.floats(0.0, 1.0))
