"""Set-based avoidance: safe distances under any lower-priority velocity, and what breaks them."""

import numpy as np
import pytest
from builders.worlds import among_points, world
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.model.bodies.kinds import ROBOTS
from airground_drake.model.bodies.world import Neighbours, World
from airground_drake.model.geometry.outline import BASE, MIDDLE
from airground_drake.model.law.avoidance import Avoidance, Composition

D = 2.0
SEEDS = st.integers(0, 2**31)


def scene(
    seed: int, robots: int = 3, obstacles: int = 6, spread: float = 8.0, *, largest: float = 0.0
) -> tuple[World, np.ndarray]:
    """A team at safe random positions, UAV included; many pairs at exactly the safe distance; radii up to `largest`."""
    rng = np.random.default_rng(seed)
    centres = np.column_stack([rng.uniform(-spread, spread, (obstacles, 2)), rng.choice([0.0, 0.5], obstacles)])
    own, fixed = (largest * np.random.default_rng([seed, k]).random(n) for k, n in enumerate((robots + 1, obstacles)))
    positions: list[np.ndarray] = []
    while len(positions) < robots:
        i, spread = len(positions), spread + largest
        trial = np.array([*rng.uniform(-spread, spread, 2), 0.0])
        if rng.random() < 0.5:  # onto the safe circle of an obstacle
            k = rng.integers(obstacles)
            o = centres[k]
            radius = np.sqrt((D + own[i] + fixed[k]) ** 2 - o[2] ** 2)
            angle = rng.uniform(0, 2 * np.pi)
            trial = np.array([o[0] + radius * np.cos(angle), o[1] + radius * np.sin(angle), 0.0])
        bodies = zip([*centres, *positions], [*fixed, *own[:i]], strict=True)
        if all(np.linalg.norm(trial - place) >= D + own[i] + radius for place, radius in bodies):
            positions.append(trial)
    positions.append(np.array([*rng.uniform(-spread, spread, 2), 3.0 + 3.0 * largest]))
    found = world(robots, centres, D, D, max_speed=6.0, radius=own, obstacle_radius=fixed)
    return found, np.array(positions)


@pytest.mark.parametrize("given", [(np.nan, 0.05), (-1.0, 0.05), (3.0, 0.0), (3.0, np.inf), (3.0, 0.05, -1.0)])
def test_numbers_that_mean_nothing_are_refused(given: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="wanted: finite gain >= 0 and period > 0, sensing_range >= 0"):
        Avoidance(*given)


def closest(position: np.ndarray, velocity: np.ndarray, centre: np.ndarray, other: np.ndarray, h: float) -> float:
    x, v = position - centre, (velocity - other) * h
    s = 0.0 if v @ v == 0 else float(np.clip(-(x @ v) / (v @ v), 0, 1))
    return float(np.linalg.norm(x + s * v))


def worst_margin(near: Neighbours, positions: np.ndarray, velocities: np.ndarray, h: float) -> float:
    m = len(near.still)
    centres = np.vstack([near.still[:, [MIDDLE, MIDDLE + 1, BASE]], positions])
    moving = np.vstack([np.zeros((m, 3)), velocities])
    return min(
        closest(positions[i], velocities[i], centres[k], moving[k], h) - near.distance[i, column]
        for i in near.members
        for column, k in enumerate([*range(m), *(m + near.others[i])])
    )


def attack(seed: int, steps: int, avoidance: Avoidance, *, share: float | None = None, largest: float = 0.0) -> float:
    """Drive a team by hostile velocities through the avoidance layer; the worst continuous-time margin, m."""
    team, positions = scene(seed, largest=largest)
    rng = np.random.default_rng(seed + 1)
    near = team.around(team.select(*ROBOTS))
    if share is not None:
        near = near._replace(share=np.where(near.share < 1.0, share, 1.0))
    worst = np.inf
    for _ in range(steps):
        still = np.tile(near.still[:, [MIDDLE, MIDDLE + 1, BASE]], (len(positions), 1, 1))
        points = np.concatenate([still, positions[near.others]], axis=1)
        nearest = points[np.arange(len(positions)), rng.integers(points.shape[1], size=len(positions))]
        towards = nearest - positions if rng.random() < 0.7 else rng.normal(size=positions.shape)
        velocities = avoidance.command(100.0 * towards * near.mobility, positions, near)
        worst = min(worst, worst_margin(near, positions, velocities, avoidance.period))
        positions = positions + avoidance.period * velocities
    return worst


@examples(60, fuzz=2000)
@given(SEEDS, st.sampled_from([0.01, 0.05, 0.2]), st.sampled_from([0.0, 0.01, 1.0, 5.0]))
def test_no_velocity_breaks_the_safe_distance_in_continuous_time(seed: int, h: float, largest: float) -> None:
    assert attack(seed, 50, Avoidance(gain=3.0, period=h), largest=largest) >= (-1e-9 if largest else -1e-12)


@pytest.mark.parametrize(
    ("composition", "share"), [("recursion_nearest", None), ("recursion_listed", None), ("augmented", 1.0)]
)
def test_recursion_as_printed_and_robots_that_each_take_the_whole_share_are_refuted(
    composition: Composition, share: float | None
) -> None:
    avoidance = Avoidance(3.0, 0.05, composition=composition)
    assert min(attack(seed, 60, avoidance, share=share) for seed in range(20)) < -0.01


@pytest.mark.parametrize("speed", [1.0, 10.0, 1e4, 1e8])
def test_inequalities_hold_in_floating_point_from_any_safe_state(speed: float) -> None:
    """However fast what is asked for: rounding of the projection grows with it, and what is left over is cut off."""
    avoidance = Avoidance(3.0, 0.05)
    for seed in range(60):
        team, positions = scene(seed)
        near = team.around(team.select(*ROBOTS))
        spaces = avoidance.half_spaces(positions, near)
        lower = np.random.default_rng(seed).normal(size=positions.shape) * speed * near.mobility
        for v, normal, bound in zip(avoidance.apply(lower, spaces), spaces.normal, spaces.bound, strict=True):
            for (x, y, z), least in zip(normal.tolist(), bound.tolist(), strict=True):
                assert x * v[0] + y * v[1] + z * v[2] >= min(least, 0.0)


@pytest.mark.parametrize(
    ("x", "share", "bound"), [(1.5, 1.0, 1.5), (1.5, 0.5, 0.75), (3.0, 0.5, -10.0), (4.5, 1.0, -np.inf)]
)
def test_inequalities(x: float, share: float, bound: float) -> None:
    """Out at A (d - D), eq (8); no further than the safe distance in a period; out of range, nothing."""
    robot, safe = np.array([[x, 0.0, 0.0]]), np.full((1, 1), D)
    around = among_points(robot, np.zeros((1, 1, 3)), safe, np.full((1, 1), share), np.ones((1, 3)))
    found = Avoidance(3.0, 0.05, 4.0).half_spaces(*around)
    assert found.bound[0, 0] == pytest.approx(bound)
    assert found.normal[0, 0].tolist() == [1.0 if x <= 4.0 else 0.0, 0.0, 0.0]


def test_a_robot_between_two_obstacles_is_not_driven_into_either() -> None:
    """Inside both safe distances, with a hostile velocity: it is held where it violates both alike."""
    avoidance = Avoidance(3.0, 0.05)
    position, obstacles = np.array([[0.1, 0.0, 0.0]]), np.array([[[-1.5, 0.0, 0.0], [1.5, 0.0, 0.0]]])
    safe, share, plane = np.full((1, 2), 2.0), np.ones((1, 2)), np.array([[1.0, 1.0, 0.0]])
    for _ in range(200):
        spaces = avoidance.half_spaces(*among_points(position, obstacles, safe, share, plane))
        position = position + 0.05 * avoidance.apply(np.array([[10.0, 0.0, 0.0]]), spaces)
        assert np.linalg.norm(position - obstacles[0], axis=1).min() >= 1.4 - 1e-9
    assert abs(position[0, 0]) < 1e-3


@pytest.mark.parametrize("value", [np.nan, -np.inf, -1e300])
def test_a_velocity_that_is_no_number_does_not_lead_inside(value: float) -> None:
    layer = Avoidance(3.0, 0.05, 5.0)
    one, robot = np.ones((1, 1)), np.array([[2.0, 0.0, 0.0]])
    spaces = layer.half_spaces(*among_points(robot, np.zeros((1, 1, 3)), D * one, one, np.ones((1, 3))))
    velocity = layer.apply(np.array([[value, 0.0, 0.0]]), spaces)
    assert not np.isfinite(velocity).all() or spaces.normal[0, 0] @ velocity[0] >= spaces.bound[0, 0]
