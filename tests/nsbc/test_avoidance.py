"""Set-based avoidance: exact projection, invariance under any lower-priority velocity, and what breaks it."""

from __future__ import annotations

import cvxpy
import numpy as np
import pytest
from builders.worlds import world
from hypothesis import given
from hypothesis import strategies as st
from nsbc.composition import augmented
from properties import examples
from scipy.optimize import linprog

from airground_drake.nsbc.avoidance import Avoidance, HalfSpaces, Surroundings
from airground_drake.world.world import ROBOTS, Neighbours, World

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


def closest(position: np.ndarray, velocity: np.ndarray, centre: np.ndarray, other: np.ndarray, h: float) -> float:
    """Exact minimum distance between two points in uniform motion over one period."""
    x, v = position - centre, (velocity - other) * h
    s = 0.0 if v @ v == 0 else float(np.clip(-(x @ v) / (v @ v), 0, 1))
    return float(np.linalg.norm(x + s * v))


def worst_margin(near: Neighbours, positions: np.ndarray, velocities: np.ndarray, h: float) -> float:
    centres = np.vstack([near.still, positions])
    moving = np.vstack([np.zeros_like(near.still), velocities])
    m = len(near.still)
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
        around = Surroundings.of(near, positions)
        nearest = around.centre[np.arange(len(positions)), rng.integers(around.centre.shape[1], size=len(positions))]
        towards = nearest - positions if rng.random() < 0.7 else rng.normal(size=positions.shape)
        velocities = avoidance.command(100.0 * towards * near.mobility, positions, near)
        worst = min(worst, worst_margin(near, positions, velocities, avoidance.period))
        positions = positions + avoidance.period * velocities
    return worst


@examples(40, fuzz=2000)
@given(SEEDS, st.sampled_from([0.01, 0.05, 0.2]))
def test_no_velocity_breaks_the_safe_distance_in_continuous_time(seed: int, h: float) -> None:
    assert attack(seed, 60, Avoidance(gain=3.0, period=h)) >= -1e-12


@examples(20, fuzz=2000)
@given(SEEDS, st.sampled_from([0.05, 0.2]), st.sampled_from([0.01, 1.0, 5.0]))
def test_bodies_of_any_size_keep_both_radii_more(seed: int, h: float, largest: float) -> None:
    assert attack(seed, 40, Avoidance(gain=3.0, period=h), largest=largest) >= -1e-9


@pytest.mark.parametrize("composition", ["recursion_nearest", "recursion_listed"])
def test_recursion_as_printed_is_refuted(composition: str) -> None:
    assert min(attack(seed, 60, Avoidance(3.0, 0.05, composition=composition)) for seed in range(20)) < -0.01  # type: ignore[arg-type]


def test_robots_that_each_take_the_whole_share_are_refuted() -> None:
    assert min(attack(seed, 60, Avoidance(3.0, 0.05), share=1.0) for seed in range(20)) < -0.01


@given(SEEDS)
def test_inequalities_hold_in_floating_point_from_any_safe_state(seed: int) -> None:
    team, positions = scene(seed)
    avoidance = Avoidance(3.0, 0.05)
    near = team.around(team.select(*ROBOTS))
    spaces = avoidance.half_spaces(positions, near.mobility, Surroundings.of(near, positions))
    lower = np.random.default_rng(seed).normal(size=positions.shape) * 10 * near.mobility
    slack = spaces.slack(avoidance.apply(lower, spaces))
    assert (slack[spaces.bound <= 0.0] >= -1e-15).all()
    assert (slack >= -1e-9).all()


@pytest.mark.parametrize("speed", [1.0, 1e4, 1e8])
def test_a_velocity_is_scaled_back_until_no_inequality_is_missed_by_rounding(speed: float) -> None:
    """However fast what is asked for: rounding of the projection grows with it, and what is left over is cut off."""
    avoidance = Avoidance(3.0, 0.05)
    for seed in range(60):
        team, positions = scene(seed)
        near = team.around(team.select(*ROBOTS))
        spaces = avoidance.half_spaces(positions, near.mobility, Surroundings.of(near, positions))
        lower = np.random.default_rng(seed).normal(size=positions.shape) * speed * near.mobility
        for v, normal, bound in zip(avoidance.apply(lower, spaces), spaces.normal, spaces.bound, strict=True):
            for (x, y, z), least in zip(normal.tolist(), bound.tolist(), strict=True):
                assert x * v[0] + y * v[1] + z * v[2] >= min(least, 0.0)


@examples(60)
@given(SEEDS, st.booleans())
def test_projection_is_the_exact_minimiser(seed: int, planar: bool) -> None:
    """Against an interior-point solver, which shares nothing with the enumeration of active sets."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 6))
    normal = rng.normal(size=(count, 3))
    if planar:
        normal[:, 2] = 0.0
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    bound = -rng.uniform(0, 2, count) * rng.choice([0.0, 1.0], count)
    lower = rng.normal(size=3) * 3 * ([1, 1, 0] if planar else [1, 1, 1])
    ours = Avoidance(1.0, 1.0).apply(lower[None], HalfSpaces(normal[None], bound[None]))[0]
    v = cvxpy.Variable(3)
    cvxpy.Problem(cvxpy.Minimize(cvxpy.sum_squares(v - lower)), [normal @ v >= bound]).solve(solver="CLARABEL")
    assert np.linalg.norm(ours - lower) <= np.linalg.norm(v.value - lower) + 1e-6
    np.testing.assert_allclose(ours, v.value, atol=1e-4)


@given(SEEDS)
def test_projection_is_the_augmented_composition_over_its_active_set(seed: int) -> None:
    """v = J^+ b + (I - J^+ J) v_lower with J the stacked rows of the constraints that end up active."""
    team, positions = scene(seed, robots=2)
    avoidance = Avoidance(3.0, 0.05)
    near = team.around(team.select(*ROBOTS))
    spaces = avoidance.half_spaces(positions, near.mobility, Surroundings.of(near, positions))
    lower = np.random.default_rng(seed).normal(size=positions.shape) * 10 * near.mobility
    velocity = avoidance.apply(lower, spaces)
    for i in range(len(positions)):
        active = np.abs(spaces.slack(velocity)[i]) < 1e-9
        if not active.any() or np.linalg.matrix_rank(spaces.normal[i, active], tol=1e-6) < active.sum():
            continue
        rows = spaces.normal[i, active]
        equality = (np.linalg.pinv(rows) @ spaces.bound[i, active])[None], rows[None]
        expected = augmented([equality, (lower[i][None], np.eye(3)[None])])[0]
        np.testing.assert_allclose(velocity[i], expected, atol=1e-6)


def test_violated_distance_recovers_at_the_task_rate() -> None:
    """Inside the safe distance the robot moves out at A (d - D), eq (8), even against its other task."""
    avoidance = Avoidance(gain=3.0, period=0.05)
    around = Surroundings(np.zeros((1, 1, 3)), np.full((1, 1), D), np.ones((1, 1)))
    position = np.array([[1.5, 0.0, 0.0]])
    spaces = avoidance.half_spaces(position, np.ones((1, 3)), around)
    velocity = avoidance.apply(np.array([[-5.0, 1.0, 0.0]]), spaces)[0]
    np.testing.assert_allclose(velocity, [3.0 * 0.5, 1.0, 0.0], atol=1e-9)


def test_out_of_range_points_are_not_seen() -> None:
    avoidance = Avoidance(3.0, 0.05, sensing_range=1.0)
    around = Surroundings(np.zeros((1, 1, 3)), np.full((1, 1), D), np.ones((1, 1)))
    spaces = avoidance.half_spaces(np.array([[1.5, 0.0, 0.0]]), np.ones((1, 3)), around)
    assert spaces.bound[0, 0] == -np.inf


def test_infeasible_start_gives_a_finite_least_violation() -> None:
    """A robot squeezed between two points, inside both safe distances, still gets a finite velocity."""
    avoidance = Avoidance(3.0, 0.05)
    centre = np.array([[[-1.0, 0, 0], [1.0, 0, 0]]])
    around = Surroundings(centre, np.full((1, 2), D), np.ones((1, 2)))
    spaces = avoidance.half_spaces(np.zeros((1, 3)), np.array([[1.0, 1.0, 0.0]]), around)
    velocity = avoidance.apply(np.array([[1.0, 1.0, 0.0]]), spaces)
    assert np.isfinite(velocity).all()


@given(SEEDS)
def test_where_inequalities_contradict_each_other_the_largest_violation_is_least(seed: int) -> None:
    """Inside several safe distances at once; against a linear program. What is asked for has no say."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(-np.pi, np.pi)
    angles = np.array([angle, angle + np.pi, *rng.uniform(-np.pi, np.pi, rng.integers(0, 3))])
    normal = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
    bound = rng.uniform(0.1, 2.0, len(angles))  # the first two cannot both be met
    avoidance = Avoidance(1.0, 1.0)
    found = [
        avoidance.apply(lower[None], HalfSpaces(normal[None], bound[None]))[0]
        for lower in rng.normal(size=(2, 3)) * [1e3, 1e3, 0.0]
    ]
    np.testing.assert_array_equal(found[0], found[1])
    rows = np.column_stack([-normal[:, :2], -np.ones(len(bound))])
    least = linprog([0.0, 0.0, 1.0], A_ub=rows, b_ub=-bound, bounds=[(None, None)] * 2 + [(0.0, None)]).fun
    assert (bound - normal @ found[0]).max() <= least + 1e-6


def test_a_robot_between_two_obstacles_is_not_driven_into_either() -> None:
    """Inside both safe distances, with a hostile velocity: it is held where it violates both alike."""
    avoidance = Avoidance(3.0, 0.05)
    position, obstacles = np.array([[0.1, 0.0, 0.0]]), np.array([[[-1.5, 0.0, 0.0], [1.5, 0.0, 0.0]]])
    around = Surroundings(obstacles, np.full((1, 2), 2.0), np.ones((1, 2)))
    for _ in range(200):
        spaces = avoidance.half_spaces(position, np.array([[1.0, 1.0, 0.0]]), around)
        position = position + 0.05 * avoidance.apply(np.array([[10.0, 0.0, 0.0]]), spaces)
        assert np.linalg.norm(position - obstacles[0], axis=1).min() >= 1.4 - 1e-9
    assert abs(position[0, 0]) < 1e-3
