"""Who keeps what distance from whom: the constant geometry of a team of UGVs and one UAV."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from airground_drake.arrays import Array
from airground_drake.nsbc import kernels
from airground_drake.nsbc.avoidance import Surroundings


@dataclass(frozen=True, eq=False)
class Team:
    """Robots in array order: n UGVs, then the UAV.

    Attributes:
        ugvs: names of the UGVs.
        uav: name of the UAV.
        obstacles: centres, (m, 3), m.
        obstacle_distance: safe distance of every robot to every obstacle, m.
        ugv_distance: safe distance between UGVs, m.
        air_ground_distance: safe distance between the UAV and each UGV, m.
        max_speed: (n + 1,), m/s.
    """

    ugvs: tuple[str, ...]
    uav: str
    obstacles: Array
    obstacle_distance: float
    ugv_distance: float
    air_ground_distance: float
    max_speed: Array

    @property
    def robots(self) -> tuple[str, ...]:
        """Names of all robots."""
        return (*self.ugvs, self.uav)

    @property
    def mobility(self) -> Array:
        """(n + 1, 3): 1 where a robot can move; UGVs stay in their plane."""
        mobility = np.ones((len(self.robots), 3))
        mobility[:-1, 2] = 0.0
        return mobility

    def pair_distance(self) -> Array:
        """Safe distances between robots, (n + 1, n + 1), m; the diagonal means nothing."""
        distance = np.full((len(self.robots), len(self.robots)), self.ugv_distance)
        distance[-1, :] = distance[:, -1] = self.air_ground_distance
        return distance

    def neighbourhood(self, rows: slice) -> Neighbourhood:
        """The surroundings of the robots in `rows`, ready to be filled with positions."""
        count, m = len(self.robots), len(self.obstacles)
        members = np.arange(count)[rows]
        others = np.array([[j for j in range(count) if j != i] for i in members], dtype=np.intp)
        distance = np.full((len(members), m + count - 1), self.obstacle_distance)
        distance[:, m:] = np.take_along_axis(self.pair_distance()[members], others, axis=1)
        share = np.ones_like(distance)
        share[:, m:] = 0.5
        return Neighbourhood(members, others, self.obstacles, distance, share)


@dataclass(frozen=True, eq=False)
class Neighbourhood:
    """Obstacles and other robots around some robots of a team: K = m + (number of other robots) points.

    Attributes:
        members: indices of the robots, (k,).
        others: indices of the other robots, (k, n).
        obstacles: (m, 3), m.
        distance: (k, K), m.
        share: (k, K).
    """

    members: npt.NDArray[np.intp]
    others: npt.NDArray[np.intp]
    obstacles: Array
    distance: Array
    share: Array

    def around(self, positions: Array) -> Surroundings:
        """Surroundings of the members when all robots are at positions (n + 1, 3) m."""
        return Surroundings(kernels.gather(positions, self.obstacles, self.others), self.distance, self.share)
