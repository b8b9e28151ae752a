"""Tasks of the UAV: track a position, stay over the centroid.

The UAV's controller runs the task it is given, by default `FormationTask`. The UGVs' law is compiled and has its tasks
written out: distances (7)-(8) as inequalities (`kernels.py`), tracking (6) and the intervention (14) (`ugv_law.py`).
"""

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit
from airground_drake.model.law.task import Task


class PositionTask(Task):
    """Go to a place, or track one that moves: sigma = rho, J = I. The form of (6), for the UAV and tasks of your own.

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
        """Eq (4), (n, 3) m/s; the pseudoinverse of the identity is the identity."""
        return self.rate + self.gain * (self.target - position)


class FormationTask(PositionTask):
    """Stay over the centroid of the UGVs, eqs (9)-(10), at a set altitude (gain C).

    Equation (9) makes the centroid of the UGVs the task value, which the UAV cannot move. Here the UAV holds its own
    position at that centroid, raised by the altitude.
    """

    def __init__(self, ugv_positions: Array, ugv_velocities: Array, altitude: float, gain: float) -> None:
        """Fly `altitude` m over the centroid of UGVs at (n, 3) m moving at (n, 3) m/s."""
        target, rate = over_centroid(ugv_positions, ugv_velocities, altitude)
        super().__init__(target, rate, gain)


@njit(cache=True)
def over_centroid(positions: Array, velocities: Array, altitude: float) -> tuple[Array, Array]:
    """The place `altitude`, m, above the centroid of n points, (n, 3), m, and its velocity, (1, 3) each."""
    # Summed in order, without BLAS, whose sums depend on the processor.
    target, rate, weight = np.zeros((1, 3)), np.zeros((1, 3)), 1.0 / len(positions)
    for j in range(len(positions)):
        for a in range(3):
            target[0, a] += weight * positions[j, a]
            rate[0, a] += weight * velocities[j, a]
    target[0, 2] += altitude
    return target, rate
