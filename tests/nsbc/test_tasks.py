"""Tasks and their composition, against finite differences and hand-written formulas."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airground_drake.nsbc.composition import augmented, recursion
from airground_drake.nsbc.motion import Motion
from airground_drake.nsbc.task import Task, null_space, pseudoinverse
from airground_drake.nsbc.tasks import DistanceTask, FormationTask, InterventionTask, PositionTask

COORDINATE = st.floats(-20.0, 20.0, allow_subnormal=False).map(lambda x: round(x, 3))
POSITIONS = st.integers(1, 4).flatmap(lambda n: arrays(np.float64, (n, 3), elements=COORDINATE))
VECTOR = arrays(np.float64, 3, elements=COORDINATE)


def every_task(n: int, centre: np.ndarray) -> list[Task]:
    target, rate = np.ones((n, 3)), np.full((n, 3), 0.5)
    return [
        PositionTask(target, rate, 2.0),
        DistanceTask(centre, 2.0, 3.0),
        FormationTask(target, rate, 2.0, 5.0),
        InterventionTask(target, rate, 1.5, np.eye(3)),
        InterventionTask(target, rate, 1.5, np.array([[0.6, 0.8, 0.0]])),
    ]


@given(POSITIONS, VECTOR)
def test_jacobians_agree_with_finite_differences(position: np.ndarray, centre: np.ndarray) -> None:
    step = 1e-6
    for task in every_task(len(position), centre):
        if isinstance(task, DistanceTask) and np.linalg.norm(position - centre, axis=1).min() < 0.1:
            continue  # the direction turns too fast for a finite difference
        jacobian = task.jacobian(position)
        for axis in range(3):
            shift = step * np.eye(3)[axis]
            slope = (task.value(position + shift) - task.value(position - shift)) / (2.0 * step)
            np.testing.assert_allclose(jacobian[..., axis], slope, atol=1e-6)


@given(POSITIONS, VECTOR)
def test_task_velocity_moves_the_task_as_asked(position: np.ndarray, centre: np.ndarray) -> None:
    """J v_d = rate + gain * error wherever J has full row rank, eq (4)."""
    for task in every_task(len(position), centre):
        if isinstance(task, DistanceTask) and (np.linalg.norm(position - centre, axis=1) == 0.0).any():
            continue
        wanted, rate = task.desired()
        moved = np.einsum("nij,nj->ni", task.jacobian(position), task.velocity(position))
        np.testing.assert_allclose(moved, rate + task.gain * (wanted - task.value(position)) + 0.0 * moved, atol=1e-9)


def test_distance_task_is_singular_but_finite_at_the_centre() -> None:
    task = DistanceTask(np.zeros(3), 2.0, 3.0)
    np.testing.assert_array_equal(task.velocity(np.zeros((1, 3))), np.zeros((1, 3)))


@pytest.mark.parametrize("gain", [-1.0, np.nan, np.inf])
def test_bad_gain_is_refused(gain: float) -> None:
    with pytest.raises(ValueError, match="gain"):
        PositionTask(np.zeros((1, 3)), np.zeros((1, 3)), gain)


@given(arrays(np.float64, (3, 2, 1, 3), elements=COORDINATE), arrays(np.float64, (3, 2, 3), elements=COORDINATE))
def test_compositions_follow_their_formulas(jacobians: np.ndarray, wishes: np.ndarray) -> None:
    layers = [(np.einsum("nij,nj->ni", pseudoinverse(j) @ j, v), j) for j, v in zip(jacobians, wishes, strict=True)]
    (v1, j1), (v2, j2), (v3, _) = layers
    by_hand = v1 + np.einsum("nij,nj->ni", null_space(j1), v2 + np.einsum("nij,nj->ni", null_space(j2), v3))
    np.testing.assert_allclose(recursion(layers), by_hand, atol=1e-8)
    stacked = np.concatenate([j1, j2], axis=1)
    by_hand = v1 + np.einsum("nij,nj->ni", null_space(j1), v2) + np.einsum("nij,nj->ni", null_space(stacked), v3)
    np.testing.assert_allclose(augmented(layers), by_hand, atol=1e-8)


@given(POSITIONS, st.sampled_from([np.eye(3), np.array([[0.6, 0.8, 0.0]]), np.array([[1.0, 0, 0], [0, 1.0, 0]])]))
def test_the_controllers_form_of_20_is_the_composition_of_tasks(position: np.ndarray, selection: np.ndarray) -> None:
    """v + J^+ J (rate + gain * error - v) is the intervention task (14) above v, for a constant Jacobian."""
    below = np.cos(position)
    task = InterventionTask(np.full(position.shape, 2.0), np.full(position.shape, 0.3), 1.5, selection)
    layers = [
        (task.velocity(position), task.jacobian(position)),
        (below, np.broadcast_to(np.eye(3), (len(below), 3, 3))),
    ]
    composed = augmented(layers)
    chosen = pseudoinverse(selection) @ selection
    asked = task.rate + 1.5 * (task.target - position)
    np.testing.assert_allclose(below + (asked - below) @ chosen.T, composed, atol=1e-9)


def test_only_the_augmented_projector_leaves_all_higher_tasks_alone() -> None:
    """Three planar tasks, pairwise oblique: (5) lets the third disturb the second."""
    rows = np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.0, 1.0, 0.0]])
    lowest = (np.array([[0.0, 1.0, 0.0]]), rows[2].reshape(1, 1, 3))
    layers = [(np.zeros((1, 3)), rows[0].reshape(1, 1, 3)), (np.zeros((1, 3)), rows[1].reshape(1, 1, 3)), lowest]
    assert abs(rows[0] @ augmented(layers)[0]) < 1e-12
    assert abs(rows[1] @ augmented(layers)[0]) < 1e-12
    assert abs(rows[1] @ recursion(layers)[0]) > 0.1


def test_motion_interpolates_and_rests_at_its_ends() -> None:
    motion = Motion.at_speed(np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0]]), 0.5, start=1.0)
    assert motion.end == 7.0
    for t, position, rate in [
        (0.0, [0, 0, 0], [0, 0, 0]),
        (1.0, [0, 0, 0], [0.5, 0, 0]),
        (3.0, [1, 0, 0], [0.5, 0, 0]),
        (5.0, [2, 0, 0], [0, 0.5, 0]),
        (9.0, [2, 1, 0], [0, 0, 0]),
    ]:
        np.testing.assert_allclose(motion.at(t)[0], position, atol=1e-12)
        np.testing.assert_allclose(motion.at(t)[1], rate, atol=1e-12)
        np.testing.assert_allclose(motion.sample(np.array([t]))[0], position, atol=1e-12)


@pytest.mark.parametrize(
    ("times", "positions"),
    [([], np.zeros((0, 3))), ([0, 0], np.zeros((2, 3))), ([0, np.nan], np.zeros((2, 3))), ([0, 1], np.zeros((2, 2)))],
)
def test_bad_motions_are_refused(times: list[float], positions: np.ndarray) -> None:
    with pytest.raises(ValueError, match="motion"):
        Motion(np.array(times), positions)
