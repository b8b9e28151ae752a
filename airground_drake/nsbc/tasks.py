"""The tasks of the paper: move to target or track, keep a distance, stay over the centroid.

The UAV's controller runs the task it is given, by default `FormationTask`. The UGVs' law is compiled: it has
`DistanceTask` as inequalities (`avoidance.py`), and `PositionTask` and the intervention (14) in closed form (`law.py`).
"""

from __future__ import annotations

from functools import cache

import numpy as np

from airground_drake.base.arrays import Array, read_only
from airground_drake.nsbc.task import Task


class PositionTask(Task):
    """Move-to-target and preset-trajectory tracking, eq (6): sigma = rho, J = I (gain B).

    Attributes:
        target: desired positions, (n, 3), m.
        rate: desired velocities, (n, 3), m/s.
    """

    def __init__(self, target: Array, rate: Array, gain: float) -> None:
        """Track `target` (n, 3) m moving at `rate` (n, 3) m/s; raises ValueError on a bad gain."""
        super().__init__(gain)
        self.target = target
        self.rate = rate

    def value(self, position: Array) -> Array:
        """The position itself, (n, 3), m."""
        return position

    def jacobian(self, position: Array) -> Array:
        """The identity, (n, 3, 3)."""
        return np.broadcast_to(np.eye(3), (*position.shape, 3))

    def desired(self) -> tuple[Array, Array]:
        """Target (n, 3) m and its velocity (n, 3) m/s."""
        return self.target, self.rate

    def velocity(self, position: Array) -> Array:
        """Eq (6), (n, 3) m/s; the pseudoinverse of the identity is the identity."""
        return self.rate + self.gain * (self.target - position)


class DistanceTask(Task):
    """Obstacle avoidance as an equality, eqs (7)-(8): sigma = ||rho - rho_o||, sigma_d = d (gain A).

    Attributes:
        obstacle: centre of the obstacle, (3,) or (n, 3), m.
        distance: safe distance d, m.
    """

    def __init__(self, obstacle: Array, distance: float, gain: float) -> None:
        """Keep `distance` m from `obstacle`; raises ValueError on a bad gain."""
        super().__init__(gain)
        self.obstacle = obstacle
        self.distance = distance

    def value(self, position: Array) -> Array:
        """Distance D to the obstacle, (n, 1), m."""
        return np.linalg.norm(position - self.obstacle, axis=-1, keepdims=True)

    def jacobian(self, position: Array) -> Array:
        """Unit row vector away from the obstacle, (n, 1, 3); zero at the centre, where it is undefined."""
        offset = position - self.obstacle
        norm = np.linalg.norm(offset, axis=-1, keepdims=True)
        unit = np.divide(offset, norm, out=np.zeros_like(offset), where=norm > 0.0)
        return unit[..., None, :]

    def desired(self) -> tuple[Array, Array]:
        """Safe distance and zero rate, each (1,), m and m/s."""
        return np.array([self.distance]), np.zeros(1)


class FormationTask(PositionTask):
    """Stay over the centroid of the UGVs, eqs (9)-(10), at a set altitude (gain C).

    Equation (9) makes the centroid of the UGVs the task value, which the UAV cannot move. Here the UAV holds its own
    position at that centroid, raised by the altitude.
    """

    def __init__(self, ugv_positions: Array, ugv_velocities: Array, altitude: float, gain: float) -> None:
        """Fly `altitude` m over the centroid of UGVs at (n, 3) m moving at (n, 3) m/s."""
        share = _share(len(ugv_positions))
        super().__init__(share @ ugv_positions + np.array([0.0, 0.0, altitude]), share @ ugv_velocities, gain)


@cache
def _share(count: int) -> Array:
    """Weight of each of `count` robots in their centroid, (1, count)."""
    return read_only(np.full((1, count), 1.0 / count))
