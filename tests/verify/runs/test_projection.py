"""The closest velocity under inequalities: against its optimality conditions and against the running kernel."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.base.arrays import Array
from airground_drake.nsbc import kernels
from airground_drake.verify.runs.control_law import Inequalities, avoiding
from airground_drake.verify.runs.projection import closest, least_violation

SEEDS = st.integers(0, 2**32 - 1)
BATCH = 6


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


@given(SEEDS, st.booleans())
def test_the_answer_is_feasible_and_no_feasible_direction_leads_closer(seed: int, planar: bool) -> None:
    wanted, normal, bound = drawn(seed, planar)
    axes = 2 if planar else 3
    found, met = closest(wanted[:, :axes], normal[:, :, :axes], bound)
    assert met.all()
    found = np.pad(found, ((0, 0), (0, 3 - axes)))
    spare = np.einsum("bkd,bd->bk", normal, found) - bound
    assert (spare >= -1e-9).all()
    # v is the closest point of a convex set iff (v - wanted).(w - v) >= 0 for all its points w; 0 and many others are
    rng = np.random.default_rng(seed)
    others, _ = closest(3.0 * rng.normal(size=(BATCH, axes)), normal[:, :, :axes], bound)
    for w in (np.zeros((BATCH, 3)), np.pad(others, ((0, 0), (0, 3 - axes)))):
        assert (((found - wanted) * (w - found)).sum(axis=1) >= -1e-7).all()


@given(SEEDS, st.booleans(), st.booleans())
def test_two_algorithms_agree(seed: int, planar: bool, demanding: bool) -> None:
    wanted, normal, bound = drawn(seed, planar, demanding=demanding)
    ours = avoiding(wanted, Inequalities(normal, bound), "augmented", planar=planar)
    running = kernels.team_avoid(wanted, normal, bound, kernels.AUGMENTED)
    flat = _flattest(normal)  # a corner of nearly parallel inequalities enlarges rounding by this
    judged = flat <= 1e6
    off = np.abs(ours - running).max(axis=1)
    assert (off[judged] <= 1e-8 * flat[judged]).all()


@given(SEEDS, st.booleans(), st.sampled_from([1e-2, 1e-3, 1e-4]), st.sampled_from([1e-7, 1e-4, 1.0]))
def test_nearly_parallel_inequalities(seed: int, planar: bool, angle: float, demand: float) -> None:
    """A robot behind another, both ahead: where their inequalities meet, not where one meets that of a far obstacle."""
    rng = np.random.default_rng(seed)
    ahead = rng.normal(size=(BATCH, 1, 3)) * [1.0, 1.0, float(not planar)]
    normal = ahead / np.linalg.norm(ahead, axis=2, keepdims=True) + angle * rng.normal(size=(BATCH, 5, 3))
    normal[:, 3:] = rng.normal(size=(BATCH, 2, 3))
    if planar:
        normal[..., 2] = 0.0
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    bound = demand * rng.normal(size=(BATCH, 5))
    bound[:, 3:] = -rng.uniform(50.0, 500.0, size=(BATCH, 2))
    wanted = -3.0 * ahead[:, 0] / np.linalg.norm(ahead[:, 0], axis=1, keepdims=True)
    ours = avoiding(wanted, Inequalities(normal, bound), "augmented", planar=planar)
    running = kernels.team_avoid(wanted, normal, bound, kernels.AUGMENTED)
    allowed = 1e-6 * np.maximum(1.0, np.linalg.norm(ours, axis=1, keepdims=True))
    assert (np.abs(running - ours) <= allowed).all()


@given(SEEDS, st.sampled_from([1e-3, 1e-5, 1e-7, 1e-9]), st.sampled_from([0.0, 1e-10, 1e-8]))
def test_a_robot_squeezed_between_two_goes_to_the_same_corner(seed: int, angle: float, gap: float) -> None:
    """Between an obstacle and another robot, nearly opposite: what each bound is kept by decides where they meet."""
    rng = np.random.default_rng(seed)
    towards = rng.uniform(0.0, 2.0 * np.pi, size=(BATCH, 1)) + np.array([0.0, np.pi, 1.0])
    towards[:, 1] += angle * rng.uniform(0.5, 1.5, size=BATCH) * rng.choice([-1.0, 1.0], size=BATCH)
    normal = np.stack([np.cos(towards), np.sin(towards), np.zeros_like(towards)], axis=2)
    bound = -gap * rng.uniform(0.1, 1.0, size=(BATCH, 3))
    bound[:, 2] = -50.0
    wanted = 2.0 * rng.normal(size=(BATCH, 3)) * [1.0, 1.0, 0.0]
    running = kernels.team_avoid(wanted, normal, bound, kernels.AUGMENTED)
    ours = avoiding(wanted, Inequalities(normal, bound), "augmented", planar=True)
    assert ours == pytest.approx(running, abs=1e-6)


@given(SEEDS, st.sampled_from([1e-8, 1e-6, 1e-4]))
def test_between_two_that_both_push_rounding_makes_no_speed(seed: int, demand: float) -> None:
    """Opposite directions but for rounding: along both boundaries it is 16 m/s to that of a far obstacle."""
    rng = np.random.default_rng(seed)
    towards = rng.uniform(0.0, 2.0 * np.pi, size=(BATCH, 1)) + np.array([0.0, np.pi, 2.0, -2.5])
    towards[:, 1] += 10.0 ** rng.uniform(-17.0, -15.0, size=BATCH)
    normal = np.stack([np.cos(towards), np.sin(towards), np.zeros_like(towards)], axis=2)
    bound = np.hstack([demand * rng.uniform(0.1, 1.0, size=(BATCH, 2)), np.full((BATCH, 2), [-16.0, -30.0])])
    wanted = 2.0 * rng.normal(size=(BATCH, 3)) * [1.0, 1.0, 0.0]
    running = kernels.team_avoid(wanted, normal, bound, kernels.AUGMENTED)
    assert (np.linalg.norm(running, axis=1) <= demand).all()
    ours = avoiding(wanted, Inequalities(normal, bound), "augmented", planar=True)
    assert ours == pytest.approx(running, abs=1e-10)


def test_on_an_obstacle_below_the_uav_nothing_moves() -> None:
    """There is no way out of where an obstacle is; what is nearly above asks for nothing that 5000 km/s would help."""
    normal, bound = np.array([[[0.0, 0.0, 0.0], [-4e-6, 0.0, 0.0]]]), np.array([[6.0, -20.0]])
    wanted = np.array([[1.0, 0.0, 0.0]])
    assert not kernels.team_avoid(wanted, normal, bound, kernels.AUGMENTED).any()
    assert not avoiding(wanted, Inequalities(normal, bound), "augmented", planar=True).any()


def _flattest(normal: Array) -> Array:
    """1 / the least sine between two normals (B, K, 3), or volume of three, squared; (B,)."""
    least = np.ones(len(normal))
    for i, j in itertools.combinations(range(normal.shape[1]), 2):
        across = np.cross(normal[:, i], normal[:, j])
        least = np.minimum(least, np.linalg.norm(across, axis=1))
        volume = np.abs(np.einsum("ba,bka->bk", across, normal[:, j + 1 :]))
        least = np.minimum(least, np.where(volume > 0.0, volume, np.inf).min(axis=1, initial=np.inf))
    return 1.0 / np.maximum(least, 1e-6) ** 2


@pytest.mark.parametrize("composition", ["recursion_nearest", "recursion_listed"])
@given(SEEDS)
def test_recursion_as_printed_agrees(composition: str, seed: int) -> None:
    wanted, normal, bound = drawn(seed, planar=True)
    code = {"recursion_nearest": kernels.RECURSION_NEAREST, "recursion_listed": kernels.RECURSION_LISTED}[composition]
    running = kernels.team_avoid(wanted, normal, bound, code)
    ours = avoiding(wanted, Inequalities(normal, bound), composition, planar=True)
    assert ours == pytest.approx(running, abs=1e-12)


def test_parallel_walls_leave_the_way_between_them() -> None:
    normal = np.array([[[1.0, 0.0], [-1.0, 0.0], [1.0, 0.0]]])
    found, met = closest(np.array([[3.0, 4.0]]), normal, np.array([[0.0, 0.0, -1.0]]))
    assert met.all()
    assert found == pytest.approx(np.array([[0.0, 4.0]]))


def test_walls_that_close_in_are_missed_evenly_and_slowly() -> None:
    normal, bound = np.array([[[1.0, 0.0], [-1.0, 0.0]]]), np.array([[1.0, 0.5]])
    assert not closest(np.array([[9.0, 9.0]]), normal, bound)[1].any()
    assert least_violation(normal, bound) == pytest.approx(np.array([[0.25, 0.0]]), abs=1e-8)


@given(SEEDS)
def test_in_contact_rounding_decides_nothing(seed: int) -> None:
    """A robot at the safe distance of one, and inside that of another behind it: on which side rounding puts it."""
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.0, 2.0 * np.pi) + np.array([0.0, np.pi + rng.uniform(-0.2, 0.2), rng.uniform(1.0, 2.0)])
    touches = np.array([0.0, -1e-15, 1e-15, -1e-12, 1e-12])
    normal = np.tile(np.column_stack([np.cos(angle), np.sin(angle), np.zeros(3)]), (len(touches), 1, 1))
    wanted = np.tile(3.0 * rng.normal(size=3) * [1.0, 1.0, 0.0], (len(touches), 1))
    inside, aside = rng.uniform(0.1, 2.0), rng.uniform(-1.0, 0.0)
    bound = np.column_stack([touches, np.full_like(touches, inside), np.full_like(touches, aside)])
    for found in (
        avoiding(wanted, Inequalities(normal, bound), "augmented", planar=True),
        kernels.team_avoid(wanted, normal, bound, kernels.AUGMENTED),
    ):
        assert found[1:] == pytest.approx(np.tile(found[0], (len(touches) - 1, 1)), abs=1e-9)


@given(SEEDS)
def test_what_no_velocity_can_change_moves_nobody(seed: int) -> None:
    """A UGV exactly below the UAV, inside their safe distance: it does not run to where a far obstacle's bound is."""
    rng = np.random.default_rng(seed)
    wanted, normal, bound = drawn(seed, planar=True)
    normal = np.concatenate([normal, np.zeros((BATCH, 1, 3))], axis=1)
    bound = np.concatenate([10.0 * bound, rng.uniform(1e-6, 1.0, (BATCH, 1))], axis=1)
    for found in (
        avoiding(wanted, Inequalities(normal, bound), "augmented", planar=True),
        kernels.team_avoid(wanted, normal, bound, kernels.AUGMENTED),
    ):
        assert not found.any()
