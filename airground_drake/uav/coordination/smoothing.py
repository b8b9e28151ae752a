"""Straighten ways: remove detours that only the roadmap causes, and keep every distance."""

from collections.abc import Sequence

import numpy as np

from airground_drake.uav.coordination.roadmap import Space
from airground_drake.uav.coordination.single import OtherRobot, Way
from airground_drake.uav.coordination.timed import straightened

ROUNDS = 2  # how often every way is straightened among the others


def smooth(
    spaces: Sequence[Space], ways: Sequence[Way | None], rests: Sequence[OtherRobot], fixed: Sequence[OtherRobot]
) -> list[Way | None]:
    """The ways with straight pieces where these are free."""
    # The times at which robots join their presets do not change.
    # ways: one per robot; None: the robot stays where it is.
    smoothed = list(ways)
    for _ in range(ROUNDS):
        for i, way in enumerate(smoothed):
            if way is None:
                continue
            others = [*fixed, *(_moving(other, rests[j]) for j, other in enumerate(smoothed) if j != i)]
            smoothed[i] = _straightened(spaces[i], way, others)
    return smoothed


def _moving(way: Way | None, rest: OtherRobot) -> OtherRobot:
    return rest if way is None else rest._replace(motion=way.motion)


def _straightened(space: Space, way: Way, others: Sequence[OtherRobot]) -> Way:
    stacked = np.concatenate([np.zeros((0, 3)), *(other.motion for other in others)])
    begins = np.concatenate([[0], np.cumsum([len(other.motion) for other in others])]).astype(np.int64)
    apart = np.array([space.apart + other.radius + space.spacing for other in others])
    motion = straightened(way.motion, way.rows, space.rows, space.along, stacked, begins, apart)
    return Way(motion, way.joined, way.rows - (len(way.motion) - len(motion)))
