"""Tasks, against finite differences and by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from nsbc.cases import POSITIONS, VECTOR
from nsbc.composition import InterventionTask

from airground_drake.nsbc.task import Task
from airground_drake.nsbc.tasks import DistanceTask, FormationTask, PositionTask


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
