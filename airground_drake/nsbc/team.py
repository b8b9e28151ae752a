"""Who keeps what distance from whom: the constant geometry of a team of UGVs and one UAV."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.nsbc import kernels
from airground_drake.nsbc.avoidance import Surroundings


@dataclass(frozen=True, eq=False)
class Team:
    """Robots in array order: n UGVs, then the UAV.

    Attributes:
        ugvs: names of the UGVs.
        uav: name of the UAV.
        obstacles: centres, (m, 3), m.
        obstacle_distance: safe distance between the surfaces of every robot and every obstacle, m.
        ugv_distance: safe distance between the surfaces of UGVs, m.
        air_ground_distance: safe distance between the surfaces of the UAV and each UGV, m.
        max_speed: (n + 1,), m/s.
        radius: of the robots' bodies, (n + 1,), m, or one for all.
        obstacle_radius: of the obstacles, (m,), m, or one for all.
    """

    ugvs: tuple[str, ...]
    uav: str
    obstacles: Array
    obstacle_distance: float
    ugv_distance: float
    air_ground_distance: float
    max_speed: Array
    radius: Array | float = 0.0
    obstacle_radius: Array | float = 0.0

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

    @property
    def radii(self) -> Array:
        """Radii of the robots' bodies, (n + 1,), m."""
        return np.broadcast_to(self.radius, len(self.robots))

    @property
    def obstacle_radii(self) -> Array:
        """Radii of the obstacles, (m,), m."""
        return np.broadcast_to(self.obstacle_radius, len(self.obstacles))

    def pair_distance(self) -> Array:
        """Safe distances between the centres of robots, (n + 1, n + 1), m; the diagonal means nothing."""
        distance = np.full((len(self.robots), len(self.robots)), self.ugv_distance)
        distance[-1, :] = distance[:, -1] = self.air_ground_distance
        return distance + (self.radii[:, None] + self.radii)

    def distance_to(self, obstacle_radii: Array) -> Array:
        """Safe distances of every robot to obstacles of radii (k,), m, between centres: (n + 1, k), m."""
        return self.obstacle_distance + (self.radii[:, None] + obstacle_radii)

    def neighbourhood(self, rows: slice) -> Neighbourhood:
        """The surroundings of the robots in `rows`, ready to be filled with positions."""
        count, m = len(self.robots), len(self.obstacles)
        members = np.arange(count)[rows]
        others = np.array([[j for j in range(count) if j != i] for i in members], dtype=np.intp)
        distance = np.empty((len(members), m + count - 1))
        distance[:, :m] = self.distance_to(self.obstacle_radii)[members]
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
        distance: between centres, (k, K), m.
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
