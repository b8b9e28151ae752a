"""Tasks composed by projectors: recursion (5) as printed, the augmented projector, the intervention (12)-(14)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.nsbc.task import Task, pseudoinverse

Layer = tuple[Array, Array]
"""One task at the current position: velocity (n, 3) in m/s and Jacobian (n, m, 3)."""


def null_space(jacobian: Array) -> Array:
    """Projector N = I - J^+ J of (5) onto the null space of J: (..., m, 3) to (..., 3, 3)."""
    return np.eye(jacobian.shape[-1]) - pseudoinverse(jacobian) @ jacobian


def recursion(layers: Sequence[Layer]) -> Array:
    """Recursion (5): v^i = v_d,i + N_i v^(i+1), each level projected by the next higher task alone.

    Args:
        layers: tasks from the highest priority to the lowest.

    Returns:
        Composite velocity, (n, 3), m/s. With three levels or more a low task may disturb a high one:
        the projection by task 1 undoes what the projection by task 2 protected.
    """
    composite = np.zeros_like(layers[-1][0])
    for velocity, jacobian in reversed(layers):
        composite = velocity + _apply(null_space(jacobian), composite)
    return composite


def augmented(layers: Sequence[Layer]) -> Array:
    """Augmented projection: each task acts in the null space of the *stacked* Jacobian of all higher ones.

    Args:
        layers: tasks from the highest priority to the lowest.

    Returns:
        Composite velocity, (n, 3), m/s; no task disturbs any higher one (rule (1) of the paper's 3.1.3).
    """
    composite, stacked = layers[0]
    for velocity, jacobian in layers[1:]:
        composite = composite + _apply(null_space(stacked), velocity)
        stacked = np.concatenate([stacked, jacobian], axis=-2)
    return composite


def _apply(matrix: Array, vector: Array) -> Array:
    return np.einsum("...ij,...j->...i", matrix, vector)


class InterventionTask(Task):
    """The UAV's intervention on UGVs, eqs (12)-(14): sigma_int = S rho (gain Lambda).

    Attributes:
        target: intervened positions, (n, 3), m.
        rate: their velocities, (n, 3), m/s.
        selection: constant task Jacobian J_int = S, (m, 3): the directions in which the UAV intervenes
            (the identity: all of them, so that nothing is left for the UGV's own tasks).
    """

    def __init__(self, target: Array, rate: Array, gain: float, selection: Array) -> None:
        """Steer `selection @ rho` to `selection @ target`; raises ValueError on a bad gain."""
        super().__init__(gain)
        self.target = target
        self.rate = rate
        self.selection = selection

    def value(self, position: Array) -> Array:
        """S rho, (n, m), m."""
        return position @ self.selection.T

    def jacobian(self, position: Array) -> Array:
        """S for every robot, (n, m, 3)."""
        return np.broadcast_to(self.selection, (len(position), *self.selection.shape))

    def desired(self) -> tuple[Array, Array]:
        """S target in m and S rate in m/s, each (n, m)."""
        return self.target @ self.selection.T, self.rate @ self.selection.T
