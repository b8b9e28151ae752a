"""Problems (26) of the gatekeeper, made without a run."""

from dataclasses import replace

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.model.geometry import outline
from airground_drake.model.geometry.motion import Motion
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.law.ugv_law import UgvLaw
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.problem import Horizon, Problem, predicted_problem
from airground_drake.ugv.rollout import View

NOBODY = np.empty((0, 3))
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


def view(
    position: Array,
    preset: Motion,
    discs: Array,
    safe: float,
    max_speed: float,
    *,
    t: float = 0.0,
    places: Array = NOBODY,
    velocities: Array = NOBODY,
    share: float = 0.5,
) -> View:
    """What a UGV sees of discs at rest, (m, 3), m, and of points that move, (n, 3), m, m/s; one safe distance, m."""
    m, n = len(discs), len(places)
    still, parts = outline.balls(discs), outline.balls(np.zeros((n, 3)))
    shares = np.repeat([1.0, share], [m, n])
    return View(
        t, position, preset, still, parts, places, velocities, np.full(m + n, safe), shares, max_speed, (None,) * n
    )


def rolled_out(seed: int) -> Problem:
    """The closed loop of a UGV among discs, its straight way home against a proposed way round."""
    rng = np.random.default_rng(seed)
    points = int(rng.integers(1, 5))
    angle = rng.uniform(-np.pi, np.pi, points)
    centres = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(points)]) * rng.uniform(2.1, 3.5, (points, 1))
    away = rng.uniform(-4.0, 4.0, (2, 3)) * [1, 1, 0]
    home = Motion.at_speed(np.array([np.zeros(3), away[0]]), 0.6, start=-rng.uniform(0.0, 3.0))
    round_about = Motion.at_speed(np.array([np.zeros(3), away[1], away[0]]), 2.8, start=0.0)
    scene = view(np.zeros(3), home, centres, 2.0, 3.0)
    return predicted_problem(scene, LAW, Proposal("way round", 0.0, round_about), Horizon(60, 1, 1.0, 1000.0))


def _instances() -> dict[str, Problem]:
    plain, still = random_problem(100), np.zeros((24, 3))
    centres = np.repeat(np.array([[[0.1, 0.0, 0.0], [0.3, 0.0, 0.0]]]), 24, axis=0)
    return {
        **{f"random {n}x{m}": random_problem(n + m, n, m) for n, m in ((24, 2), (1, 1), (30, 4), (20, 0))},
        **{f"rolled out {seed}": rolled_out(seed) for seed in range(4)},
        "rolled out, a terminal cost": replace(rolled_out(1), terminal_weight=0.5),
        "a point at the robot": replace(plain, centres=0.0 * centres[:, :1], distances=np.array([0.8])),
        "deep inside a large disc": replace(plain, centres=centres, distances=np.array([5.0, 0.1])),
        "identical modes": replace(plain, accept=plain.refuse),
        "at rest on the reference": replace(plain, accept=still, refuse=still, reference=still),
    }


def _broken() -> dict[str, Problem]:
    plain = random_problem(0)
    found = {"overflows": replace(plain, reference=plain.reference * 1e200)}
    for field, value in (("accept", np.nan), ("refuse", np.inf), ("reference", np.nan), ("initial", np.inf),
                         ("centres", np.nan)):  # fmt: skip
        array = getattr(plain, field).copy()
        array.flat[1] = value
        found[f"{field}: {value}"] = replace(plain, **{field: array})
    return found


INSTANCES, BROKEN = _instances(), _broken()
