"""Compositions of tasks, against hand-written formulas."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from nsbc.cases import COORDINATE, POSITIONS
from nsbc.composition import InterventionTask, augmented, null_space, recursion

from airground_drake.nsbc import law
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.task import pseudoinverse
from airground_drake.world.world import Neighbours


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
def test_the_law_has_20_as_the_composition_of_tasks(position: np.ndarray, selection: np.ndarray) -> None:
    """The intervention task (14) above the UGV's own task (6), in a plane, with nothing near and no speed limit."""
    plane = np.array([1.0, 1.0, 0.0])
    position = position * plane
    target, rate = np.cos(position) * plane, np.sin(position) * plane
    below = rate + 0.7 * (target - position)
    task = InterventionTask(np.full(position.shape, 2.0) * plane, np.full(position.shape, 0.3) * plane, 1.5, selection)
    layers = [
        (task.velocity(position), task.jacobian(position)),
        (below, np.broadcast_to(np.eye(3), (len(below), 3, 3))),
    ]
    composed = augmented(layers)
    chosen = pseudoinverse(selection) @ selection
    count = len(position)
    none = np.zeros((count, 0))
    commanded = law.UgvLaw(Avoidance(1.0, 0.1), 0.7, 1.5, intervention_on_top=True).velocity(
        position,
        Neighbours(
            np.arange(count), none.astype(np.intp), np.zeros((0, 3)), none, none, np.tile(plane, (count, 1)),
            np.full(count, 1e9),
        ),
        target, rate, [law.Intervention(*asked, chosen) for asked in zip(task.target, task.rate, strict=True)],
    )  # fmt: skip
    np.testing.assert_allclose(commanded, composed, rtol=1e-9, atol=1e-9)


def test_only_the_augmented_projector_leaves_all_higher_tasks_alone() -> None:
    """Three planar tasks, pairwise oblique: (5) lets the third disturb the second."""
    rows = np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.0, 1.0, 0.0]])
    lowest = (np.array([[0.0, 1.0, 0.0]]), rows[2].reshape(1, 1, 3))
    layers = [(np.zeros((1, 3)), rows[0].reshape(1, 1, 3)), (np.zeros((1, 3)), rows[1].reshape(1, 1, 3)), lowest]
    assert abs(rows[0] @ augmented(layers)[0]) < 1e-12
    assert abs(rows[1] @ augmented(layers)[0]) < 1e-12
    assert abs(rows[1] @ recursion(layers)[0]) > 0.1
