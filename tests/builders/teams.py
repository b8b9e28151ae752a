"""Teams in the plane for joint planning: where robots are, where they are to go, and what is in between."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from airground_drake.model.geometry.outline import balls
from airground_drake.uav.coordination.joint import Plan
from airground_drake.uav.coordination.roadmap import RobotTask, Space
from airground_drake.uav.coordination.timed import at_rest

Array = npt.NDArray[np.float64]

APART = 2.0
"""Distance to keep, m."""


def space(obstacles: Sequence[Sequence[float]] | Array = ()) -> Space:
    rows = balls([[*centre, 0.0] for centre in obstacles])
    return Space(rows, np.full(len(rows), APART), 0.1, APART, 0.2)


def task(start: Sequence[float] | Array, target: Sequence[float] | Array) -> RobotTask:
    return RobotTask(np.asarray(start, dtype=np.float64), np.array([[0.0, *target]]))


def random_team(seed: int, count: int, obstacles: int, extent: float) -> tuple[Space, list[RobotTask]]:
    rng = np.random.default_rng([seed, count])

    def apart(number: int, others: Sequence[Array], least: float) -> list[Array]:
        found: list[Array] = []
        while len(found) < number:
            point = rng.uniform(0.0, extent, 2)
            if all(np.hypot(*(point - other)) >= least for other in [*others, *found]):
                found.append(point)
        return found

    discs = apart(obstacles, [], 1.0)
    starts, targets = apart(count, discs, 2.15), apart(count, discs, 2.15)
    return space(discs), [task(start, target) for start, target in zip(starts, targets, strict=True)]


def motions(plan: Plan, tasks: Sequence[RobotTask]) -> list[Array]:
    return [at_rest(e.start) if way is None else way.motion for way, e in zip(plan.ways, tasks, strict=True)]
