"""Tasks, against finite differences and by hand; the law as their composition."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airground_drake.model.bodies.world import Neighbours
from airground_drake.model.geometry.outline import balls, stacked
from airground_drake.model.law import ugv_law as law
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.law.tasks import FormationTask, PositionTask

COORDINATE = st.floats(-20.0, 20.0, allow_subnormal=False).map(lambda x: round(x, 3))
POSITIONS = st.integers(1, 4).flatmap(lambda n: arrays(np.float64, (n, 3), elements=COORDINATE))


@given(POSITIONS)
def test_jacobians_are_derivatives_and_velocities_move_the_tasks_as_asked(p: np.ndarray) -> None:
    """J v_d = rate + gain * error, eq (4)."""
    target, rate = np.ones(p.shape), np.full(p.shape, 0.5)
    tasks = PositionTask(target, rate, 2.0), FormationTask(target, rate, 2.0, 5.0)
    for task in tasks:
        jacobian, step = task.jacobian(p), 1e-6
        for axis in range(3):
            shift = step * np.eye(3)[axis]
            slope = (task.value(p + shift) - task.value(p - shift)) / (2.0 * step)
            np.testing.assert_allclose(jacobian[..., axis], slope, atol=1e-6)
        wanted, rates = task.desired()
        moved = np.einsum("nij,nj->ni", jacobian, task.velocity(p))
        np.testing.assert_allclose(moved, rates + task.gain * (wanted - task.value(p)) + 0.0 * moved, atol=1e-9)
    place, asked = tasks[1].desired()
    np.testing.assert_allclose((place[0], asked[0]), ([1.0, 1.0, 3.0], [0.5, 0.5, 0.5]))


@given(st.floats(0.05, 1.9), st.floats(0.0, 6.3), arrays(np.float64, 2, elements=COORDINATE))
def test_the_law_has_7_and_8_as_jacobian_and_bound(apart: float, angle: float, centre: np.ndarray) -> None:
    """Inside d = 2 m: n is the derivative of the distance D, and n.v >= A (d - D)."""
    near = Neighbours.at_rest(balls([[*centre, 0.0]], gap=2.0), np.full(1, 1e9))
    direction, step = np.array([np.cos(angle), np.sin(angle), 0.0]), 1e-6
    position = np.array([*centre, 0.0]) + apart * direction
    spaces = Avoidance(3.0, 0.1).half_spaces(position[None], near)
    for axis in range(2):
        moved = [position + sign * step * np.eye(3)[axis] for sign in (1.0, -1.0)]
        far, close = (float(np.hypot(*(at[:2] - centre))) for at in moved)
        np.testing.assert_allclose(spaces.normal[0, 0, axis], (far - close) / (2.0 * step), atol=1e-6)
    np.testing.assert_allclose(spaces.bound[0, 0], 3.0 * (2.0 - apart), atol=1e-9)


@given(POSITIONS, st.sampled_from([np.eye(3), np.array([[0.6, 0.8, 0.0]]), np.array([[1.0, 0, 0], [0, 1.0, 0]])]))
def test_the_law_has_20_as_the_composition_of_tasks(position: np.ndarray, selection: np.ndarray) -> None:
    """The intervention (12)-(14) above the UGV's own task (6), in a plane, with nothing near and no speed limit."""
    plane, count = np.array([1.0, 1.0, 0.0]), len(position)
    position = position * plane
    target, rate = np.cos(position) * plane, np.sin(position) * plane
    wanted, wanted_rate, inverse = 2.0 * plane, 0.3 * plane, np.linalg.pinv(selection)
    intervention = (wanted_rate + 1.5 * (wanted - position)) @ selection.T @ inverse.T
    composed = intervention + (rate + 0.7 * (target - position)) @ (np.eye(3) - inverse @ selection).T
    near = Neighbours.at_rest(stacked([]), np.full(count, 1e9))
    asked = [law.AcceptedMotion(wanted, wanted_rate, inverse @ selection)] * count
    commanded = law.UgvLaw(Avoidance(1.0, 0.1), 0.7, 1.5, True).velocity(position, near, target, rate, asked)
    np.testing.assert_allclose(commanded, composed, rtol=1e-9, atol=1e-9)
