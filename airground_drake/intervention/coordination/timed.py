"""Exact distances of timed motions in the plane, over all times."""

from __future__ import annotations

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.intervention.coordination import kernels


def timed(times: Array, places: Array) -> Array:
    """A timed motion (M, 3) from times (M,), s, and places (M, 2), m."""
    return np.ascontiguousarray(np.column_stack([times, places]), dtype=np.float64)


def at_rest(place: Array) -> Array:
    """The timed motion of a robot that stays at a place (2,), m."""
    return timed(np.zeros(1), np.asarray(place, dtype=np.float64)[None])


def distance(one: Array, other: Array, begin: float = 0.0, end: float = np.inf) -> float:
    """Least distance of two timed motions (M, 3) over [begin, end], s, in m."""
    return float(kernels.closest(one, other, begin, end))


def speed(motion: Array) -> float:
    """Largest speed of a timed motion (M, 3), m/s."""
    legs = np.diff(motion, axis=0)
    return float((np.hypot(legs[:, 1], legs[:, 2]) / legs[:, 0]).max(initial=0.0))


def without_repeats(motion: Array) -> Array:
    """The same timed motion without redundant rows: at the time of the row before, or between neighbours on a line."""
    motion = motion[np.append(True, np.diff(motion[:, 0]) > 1e-9)]
    if len(motion) < 3:
        return motion
    before, here, after = motion[:-2], motion[1:-1], motion[2:]
    share = ((here[:, 0] - before[:, 0]) / (after[:, 0] - before[:, 0]))[:, None]
    off = np.abs(here[:, 1:] - before[:, 1:] - share * (after[:, 1:] - before[:, 1:])).max(axis=1)
    needed = np.concatenate([[True], off > 1e-12, [True]])
    return motion[needed]
