"""Supporting half-planes n.(p - o) >= d - u in place of (26d): what the convexified routes share.

For unit n, ||p - o|| >= n.(p - o), so that they imply (26d): conservative, never optimistic.
"""

from __future__ import annotations

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.gatekeeper.problem import Problem
from airground_drake.gatekeeper.reachable_box import nearest_in_reach, within_reach


def normals_along(problem: Problem, positions: Array) -> Array:
    """Unit vectors (N, m, 3) from the points to a guiding trajectory (N, 3).

    Where no plan can come near, (26d) asks for nothing, and no half-plane shall: there they are from the points to
    the nearest place that any plan could reach. All of them are beyond that half-plane.
    """
    guide = np.where(within_reach(problem)[:, :, None], positions[:, None, :], nearest_in_reach(problem))
    offset = guide - problem.centres
    norm = np.sqrt(np.einsum("kmi,kmi->km", offset, offset))[:, :, None]
    if norm.min(initial=np.inf) > 1e-9:
        return offset / norm
    return np.where(norm > 1e-9, offset / np.maximum(norm, 1e-9), [1.0, 0.0, 0.0])


def offsets(problem: Problem, normals: Array) -> Array:
    """d + n.(o - reference): right-hand sides (N, m) of the half-planes for the task error in the plane, m."""
    at = problem.reference[:, None, :].copy()
    at[:, :, 2] = problem.initial[2]
    return problem.distances + np.einsum("kmi,kmi->km", normals, problem.centres - at)
