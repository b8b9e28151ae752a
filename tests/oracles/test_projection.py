"""The closest velocity under inequalities: against its optimality conditions and against the running kernel."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.base.arrays import Array
from airground_drake.model.law import kernels
from oracles.control_law import Inequalities, avoiding
from oracles.projection import closest, least_violation

SEEDS = st.integers(0, 2**32 - 1)
BATCH = 6
CODES = {
    "augmented": kernels.AUGMENTED, "recursion_nearest": kernels.RECURSION_NEAREST,
    "recursion_listed": kernels.RECURSION_LISTED,
}  # fmt: skip


def both(
    wanted: Array, normal: Array, bound: Array, composition: str = "augmented", planar: bool = True
) -> tuple[Array, Array]:
    ours = avoiding(wanted, Inequalities(normal, bound), composition, planar=planar)
    running = [kernels.avoid_one(*one, CODES[composition]) for one in zip(wanted, normal, bound, strict=True)]
    return ours, np.array(running)


def drawn(seed: int, planar: bool, *, demanding: bool = False) -> tuple[Array, Array, Array]:
    """Wanted velocities (B, 3) and inequalities of 0 to 7 points; `demanding`: some may contradict each other."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(0, 8))
    normal = rng.normal(size=(BATCH, count, 3))
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    wanted = 3.0 * rng.normal(size=(BATCH, 3))
    if planar:
        normal[..., 2] = wanted[:, 2] = 0.0
    bound = rng.normal(size=(BATCH, count)) if demanding else -np.abs(rng.normal(size=(BATCH, count)))
    bound[rng.random(bound.shape) < 0.2] = -np.inf
    return wanted, normal, np.where(rng.random(bound.shape) < 0.1, 0.0, bound)


def around(rng: np.random.Generator, *angles: float | Array) -> Array:
    base = rng.uniform(0.0, 2.0 * np.pi, size=BATCH)
    towards = np.stack([base + angle for angle in angles], axis=1)
    return np.stack([np.cos(towards), np.sin(towards), np.zeros_like(towards)], axis=2)


@given(SEEDS, st.booleans())
def test_the_answer_is_feasible_and_no_feasible_direction_leads_closer(seed: int, planar: bool) -> None:
    wanted, normal, bound = drawn(seed, planar)
    axes = 2 if planar else 3
    found, met = closest(wanted[:, :axes], normal[:, :, :axes], bound)
    assert met.all()
    found = np.pad(found, ((0, 0), (0, 3 - axes)))
    assert (np.einsum("bkd,bd->bk", normal, found) - bound >= -1e-9).all()
    # v is the closest point of a convex set iff (v - wanted).(w - v) >= 0 for all its points w; 0 and many others are
    others, _ = closest(3.0 * np.random.default_rng(seed).normal(size=(BATCH, axes)), normal[:, :, :axes], bound)
    for w in (np.zeros((BATCH, 3)), np.pad(others, ((0, 0), (0, 3 - axes)))):
        assert (((found - wanted) * (w - found)).sum(axis=1) >= -1e-7).all()


@given(SEEDS, st.booleans(), st.booleans())
def test_two_algorithms_agree(seed: int, planar: bool, demanding: bool) -> None:
    wanted, normal, bound = drawn(seed, planar, demanding=demanding)
    ours, running = both(wanted, normal, bound, planar=planar)
    least = np.ones(BATCH)  # sine between two normals, or volume of three: a flat corner enlarges rounding
    for i, j in itertools.combinations(range(normal.shape[1]), 2):
        across = np.cross(normal[:, i], normal[:, j])
        volume = np.abs(np.einsum("ba,bka->bk", across, normal[:, j + 1 :]))
        nonzero = np.where(volume > 0.0, volume, np.inf).min(axis=1, initial=np.inf)
        least = np.minimum(least, np.minimum(np.linalg.norm(across, axis=1), nonzero))
    flat = 1.0 / np.maximum(least, 1e-6) ** 2
    off, judged = np.abs(ours - running).max(axis=1), flat <= 1e6
    assert (off[judged] <= 1e-8 * flat[judged]).all()


@pytest.mark.parametrize("composition", ["recursion_nearest", "recursion_listed"])
@given(SEEDS)
def test_recursion_as_printed_agrees(composition: str, seed: int) -> None:
    ours, running = both(*drawn(seed, planar=True), composition)
    assert ours == pytest.approx(running, abs=1e-12)


@given(SEEDS)
def test_what_no_velocity_can_change_moves_nobody(seed: int) -> None:
    """A UGV exactly below the UAV, inside their safe distance: it does not run to where a far obstacle's bound is."""
    wanted, normal, bound = drawn(seed, planar=True)
    normal = np.concatenate([normal, np.zeros((BATCH, 1, 3))], axis=1)
    more = np.random.default_rng(seed).uniform(1e-6, 1.0, (BATCH, 1))
    assert not np.any(both(wanted, normal, np.concatenate([10.0 * bound, more], axis=1)))


def test_on_an_obstacle_below_the_uav_nothing_moves() -> None:
    """There is no way out of where an obstacle is; what is nearly above asks for nothing that 5000 km/s would help."""
    normal = np.array([[[0.0, 0.0, 0.0], [-4e-6, 0.0, 0.0]]])
    assert not np.any(both(np.array([[1.0, 0.0, 0.0]]), normal, np.array([[6.0, -20.0]])))


def test_parallel_walls() -> None:
    """They leave the way between them; where they close in, they are missed evenly and slowly."""
    normal = np.array([[[1.0, 0.0], [-1.0, 0.0], [1.0, 0.0]]])
    found, met = closest(np.array([[3.0, 4.0]]), normal, np.array([[0.0, 0.0, -1.0]]))
    assert met.all()
    assert found == pytest.approx(np.array([[0.0, 4.0]]))
    normal, bound = normal[:, :2], np.array([[1.0, 0.5]])
    assert not closest(np.array([[9.0, 9.0]]), normal, bound)[1].any()
    assert least_violation(normal, bound) == pytest.approx(np.array([[0.25, 0.0]]), abs=1e-8)
