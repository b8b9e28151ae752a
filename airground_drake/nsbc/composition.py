"""Strict-priority composition of task velocities: recursion (5) as printed, and the augmented projector."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from airground_drake.arrays import Array
from airground_drake.nsbc.task import null_space

Layer = tuple[Array, Array]
"""One task at the current position: velocity (n, 3) in m/s and Jacobian (n, m, 3)."""


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
