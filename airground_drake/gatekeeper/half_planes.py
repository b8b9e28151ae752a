"""Supporting half-planes n.(p - o) >= d - u in place of (26d): what the convexified routes share."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from airground_drake.gatekeeper.problem import Problem
from airground_drake.nsbc.task import Array


def normals_along(problem: Problem, positions: Array) -> Array:
    """Unit vectors (N, m, 3) from the points to a guiding trajectory (N, 3)."""
    offset = positions[:, None, :] - problem.centres
    norm = np.sqrt(np.einsum("kmi,kmi->km", offset, offset))[:, :, None]
    if norm.min(initial=np.inf) > 1e-9:
        return offset / norm
    return np.where(norm > 1e-9, offset / np.maximum(norm, 1e-9), [1.0, 0.0, 0.0])


def offsets(problem: Problem, normals: Array) -> Array:
    """d + n.(o - reference): right-hand sides (N, m) of the half-planes for the task error in the plane, m."""
    at = problem.reference[:, None, :].copy()
    at[:, :, 2] = problem.initial[2]
    return problem.distances + np.einsum("kmi,kmi->km", normals, problem.centres - at)


def reachable(problem: Problem) -> npt.NDArray[np.bool_]:
    """(N, m): False where no relaxed plan can come within the safe distance, so that the row cannot bind.

    Any plan stays, per axis, between the running sums of the smaller and of the larger mode velocity.
    """
    both = np.stack([problem.accept, problem.refuse])
    low = problem.initial + problem.dt * np.cumsum(both.min(axis=0), axis=0)
    high = problem.initial + problem.dt * np.cumsum(both.max(axis=0), axis=0)
    outside = np.maximum(low[:, None] - problem.centres, problem.centres - high[:, None])
    gap = np.maximum(outside, 0.0)
    within: npt.NDArray[np.bool_] = np.einsum("kmi,kmi->km", gap, gap) < problem.distances**2
    return within
