"""What the UAV sees of a team, for policies alone."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from airground_drake.model.geometry.motion import Motion
from airground_drake.model.geometry.outline import balls
from airground_drake.uav.policy import Observation, Teammate


def mate(name: str, position: Sequence[float], target: Sequence[float], **more: Any) -> Teammate:
    """A UGV in the plane whose preset has ended at its target; triggered and standing unless `more` says otherwise."""
    goal = np.array([*target, 0.0])
    known = Teammate(name, np.array([*position, 0.0]), goal, Motion(np.zeros(1), goal[None]), 1.0, True, True)
    return replace(known, **more)


def seen(team: Sequence[Teammate], obstacles: Sequence[Sequence[float]] = (), *, robot: int = 0) -> Observation:
    """What the UAV sees at t = 10 s when it plans for one of them; safe distances are 2 m."""
    known = balls([[*point, 0.0] for point in obstacles], gap=2.0)
    one = team[robot]
    others = np.array([other.position for other in team if other is not one]).reshape(-1, 3)
    return Observation(
        t=10.0, start=10.05, robot=one.name, position=one.position, target=one.target, preset=one.preset,
        obstacles=known, mapped=known, others=others, refusals=0, team=tuple(team),
        robot_distance=2.0,
    )  # fmt: skip
