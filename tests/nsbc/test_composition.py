"""Compositions of tasks, against hand-written formulas."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from nsbc.cases import COORDINATE, POSITIONS

from airground_drake.nsbc.composition import augmented, recursion
from airground_drake.nsbc.task import null_space, pseudoinverse
from airground_drake.nsbc.tasks import InterventionTask


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
