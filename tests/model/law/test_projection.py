"""The closest allowed velocity against its optimality conditions, solved in rational numbers without rounding."""

import itertools
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from model.law.test_avoidance import scene
from properties import examples

from airground_drake.base.arrays import Array
from airground_drake.model.bodies.kinds import ROBOTS
from airground_drake.model.law import kernels
from airground_drake.model.law.avoidance import Avoidance

SEEDS = st.integers(0, 2**32 - 1)
Row = list[Fraction]


def rational(numbers: Array) -> Row:
    return [Fraction(float(x)) for x in numbers]


def dot(a: Sequence[Fraction], b: Sequence[Fraction]) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def solved(matrix: Sequence[Row], right: Row) -> Row | None:
    rows = [[*row, value] for row, value in zip(matrix, right, strict=True)]
    count = len(rows[0]) - 1
    for i in range(count):
        pivot = next((k for k in range(i, len(rows)) if rows[k][i]), None)
        if pivot is None:
            return None
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [x / rows[i][i] for x in rows[i]]
        for k in range(len(rows)):
            if k != i and rows[k][i]:
                rows[k] = [x - rows[k][i] * y for x, y in zip(rows[k], rows[i], strict=True)]
    return None if any(row[-1] for row in rows[count:]) else [row[-1] for row in rows[:count]]


def closest(lower: Array, normal: Array, bound: Sequence[Fraction]) -> Array | None:
    """Of all active sets the one whose forces are >= 0 and whose velocity meets all constraints; None if none does."""
    wish, normals = rational(lower), [rational(n) for n in normal]
    for size in range(len(wish) + 1):
        for active in itertools.combinations(range(len(normals)), size):
            gram = [[dot(normals[i], normals[j]) for j in active] for i in active]
            force = solved(gram, [bound[i] - dot(normals[i], wish) for i in active]) if size else []
            if force is None or any(f < 0 for f in force):
                continue
            push = [dot(force, [normals[i][a] for i in active]) for a in range(len(wish))]
            velocity = [a + b for a, b in zip(wish, push, strict=True)]
            if all(dot(n, velocity) >= b for n, b in zip(normals, bound, strict=True)):
                return np.array([float(x) for x in velocity])
    return None


def least_violation(normal: Array, bound: Sequence[Fraction]) -> Fraction:
    """min over v of max_k bound_k - normal_k . v: the largest weighted sum of bounds whose normals cancel out."""
    normals, axes = [rational(n) for n in normal], normal.shape[1]
    least = Fraction(0)
    for size in range(1, axes + 2):
        for some in itertools.combinations(range(len(normals)), size):
            rows = [[normals[i][a] for i in some] for a in range(axes)]
            weight = solved([*rows, [Fraction(1)] * size], [Fraction(0)] * axes + [Fraction(1)])
            if weight is not None and all(w >= 0 for w in weight):
                least = max(least, dot(weight, [bound[i] for i in some]))
    return least


def law(lower: Array, normal: Array, bound: Array) -> Array | None:
    """The control law: the closest velocity that meets every constraint by the margin."""
    seen = np.isfinite(bound)
    return closest(lower, normal[seen], rational(bound[seen] + kernels.MARGIN_M_S))


@examples(60, fuzz=1000)
@given(SEEDS)
def test_the_command_of_any_team_is_the_closest_allowed_velocity(seed: int) -> None:
    team, positions = scene(seed, robots=3, obstacles=4)
    rng = np.random.default_rng(seed)
    positions[1, :2] = positions[0, :2] + rng.normal(size=2)  # inside each other's safe distance at times
    avoidance = Avoidance(3.0, 0.05)
    near = team.around(team.select(*ROBOTS))
    spaces = avoidance.half_spaces(positions, near)
    lower = rng.normal(size=positions.shape) * 10.0 ** rng.uniform(-2.0, 1.0) * near.mobility
    velocity = avoidance.apply(lower, spaces)
    for v, wish, normal, bound in zip(velocity, lower, spaces.normal, spaces.bound, strict=True):
        missed = bool((normal @ wish < bound).any())
        expected = law(wish, normal, bound) if missed else wish
        if expected is not None:
            np.testing.assert_allclose(v, expected, atol=1e-9)


@examples(150, fuzz=3000)
@given(SEEDS, st.sampled_from(["parallel", "antiparallel", "equal", "coplanar"]), st.booleans())
def test_normals_that_depend_on_each_other(seed: int, kind: str, planar: bool) -> None:
    """Two, or three in one plane, but for an angle of 1e-9 to 1e-1 rad; bounds of contact, off by 1e-12 m/s."""
    rng = np.random.default_rng(seed)
    axes = 2 if planar else 3
    normal = np.zeros((5, 3))
    normal[:, :axes] = rng.normal(size=(5, axes))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    angle = 0.0 if kind == "equal" else 10.0 ** rng.uniform(-8.5, -1.0)
    aside = angle * rng.normal(size=3) * ([1.0, 1.0, 0.0] if planar else 1.0)
    normal[1] = {"antiparallel": -normal[0], "coplanar": rng.normal() * normal[0] + normal[2]}.get(kind, normal[0])
    normal[1] = (normal[1] + aside) / np.linalg.norm(normal[1] + aside)
    dependent = normal[: 3 if kind == "coplanar" and not planar else 2, :axes]
    assume(kind == "equal" or np.linalg.svd(dependent, compute_uv=False)[-1] > 1e-9)  # any flatter counts as parallel
    bound = rng.choice([0.0, 1e-15, -1e-15, -1e-13, -1e-12], 5)
    bound[3:] = -rng.uniform(0.0, 50.0, 2)
    lower = 2.0 * rng.normal(size=3) * ([1.0, 1.0, 0.0] if planar else 1.0)
    expected = law(lower, normal, bound)
    if expected is not None:
        np.testing.assert_allclose(kernels._closest_feasible(lower, normal, bound), expected, atol=1e-6)


@pytest.mark.parametrize("by", [0.0, 1e-17, -1e-17, 1e-15])
def test_a_robot_that_just_fits_between_two_walls_slides_along(by: float) -> None:
    normal, bound = np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]), np.full(2, by)
    for aside in (-1e-17, 1e-17, 0.3, -0.3):
        velocity = kernels.avoid_one(np.array([1.0, aside, 0.0]), normal, bound, kernels.AUGMENTED, np.inf)
        assert velocity == pytest.approx([1.0, 0.0, 0.0], abs=1e-9)
        assert (normal @ velocity >= np.minimum(bound, 0.0)).all()


def test_robots_in_contact_slide_along() -> None:
    """At exactly the safe distance the bound is 0: without the margin, a miss of 1e-17 m/s would stop the robot."""
    rng = np.random.default_rng(1)
    for _ in range(200):
        angle = rng.uniform(0.0, 2.0 * np.pi)
        normal = np.array([[np.cos(angle), np.sin(angle), 0.0]])
        lower = 2.0 * (np.array([-normal[0, 1], normal[0, 0], 0.0]) - normal[0])
        assert kernels.avoid_one(lower, normal, np.zeros(1), kernels.AUGMENTED, np.inf) @ lower == pytest.approx(
            4.0, abs=1e-9
        )


@pytest.mark.parametrize(("normal", "bound"), [((-4e-6, 0.0, 0.0), -20.0), ((1.0, 0.0, 0.0), -5.0)])
def test_exactly_below_the_uav_and_inside_its_safe_distance_a_ugv_stands(
    normal: tuple[float, ...], bound: float
) -> None:
    """No velocity on the ground helps: it does not run to where the bound of something else is, at 5000 km/s."""
    normals, bounds = np.array([[0.0, 0.0, 0.0], normal]), np.array([6.0, bound])
    assert not kernels.avoid_one(np.array([1.0, 0.0, 0.0]), normals, bounds, kernels.AUGMENTED, np.inf).any()


@pytest.mark.parametrize("apart", [1e-8, 1e-6, 1e-4])
def test_a_small_contradiction_is_one(apart: float) -> None:
    """Between two walls that both push, by little: no wish has a say, or a hostile one would set the speed."""
    normal = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    found = kernels._closest_feasible(np.array([0.0, 100.0, 0.0]), normal, np.full(2, apart))
    assert np.abs(found).max() < 1e-9


@examples(80, fuzz=2000)
@given(SEEDS, st.booleans(), st.sampled_from([0.0, 1e-6, 1e-4, 1e-2]), st.sampled_from([1e-6, 1e-3, 1.0]))
def test_contradicting_constraints_are_missed_as_little_and_as_slowly_as_can_be(
    seed: int, planar: bool, angle: float, demand: float
) -> None:
    """Between two that push against each other, among up to four more."""
    rng = np.random.default_rng(seed)
    axes, count = 2 if planar else 3, int(rng.integers(2, 7))
    normal = rng.normal(size=(count, axes))
    normal[1] = -normal[0] + angle * rng.normal(size=axes)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    if angle == 0.0:
        normal[1] = -normal[0]
    bound = demand * rng.uniform(-0.5, 2.0, count)
    bound[:2] = demand * rng.uniform(0.1, 2.0, 2)
    lower = 100.0 * rng.normal(size=3) * [1.0, 1.0, float(not planar)]
    padded = np.pad(normal, ((0, 0), (0, 3 - axes)))
    found = kernels._closest_feasible(lower, padded, bound)[:axes]
    level = rational(bound + kernels.MARGIN_M_S)
    least = least_violation(normal, level)
    if least <= kernels.CONTRADICTION_M_S:
        return
    worst = max(float(b - dot(n, rational(found))) for b, n in zip(level, map(rational, normal), strict=True))
    enough = Fraction(kernels.ABOVE_LEAST) * least + Fraction(kernels.ABOVE_LEAST_M_S) + least
    assert worst <= float(enough) + 1e-13 * demand
    slowest = closest(np.zeros(axes), normal, [b - enough for b in level])
    assert slowest is not None
    scale = max(1.0, float(np.linalg.norm(slowest)))
    np.testing.assert_allclose(found, slowest, atol=1e-6 * scale)
