"""The null-space-based behavioural control (NSBC) task, eqs (1)-(4), vectorised over robots."""

import abc
import math

import numpy as np

from airground_drake.base.arrays import Array


class Task(abc.ABC):
    """A behaviour of each of n robots: a function of position that is driven to a desired value.

    All methods take the positions of n robots at once. Positions and velocities are expressed in the
    world frame, in m and m/s; m is the dimension of the task, in the unit of its value.

    Attributes:
        gain: closed-loop gain Lambda of (4), 1/s, at least 0.
    """

    def __init__(self, gain: float) -> None:
        """Set the gain.

        Raises:
            ValueError: if the gain is negative or not finite.
        """
        if not (math.isfinite(gain) and gain >= 0.0):
            raise ValueError(f"the gain of a task must be a finite number >= 0 1/s, got {gain!r}")
        self.gain = float(gain)

    @abc.abstractmethod
    def value(self, position: Array) -> Array:
        """Task value sigma = f(rho), eq (1): positions (n, 3) in m to values (n, m)."""

    @abc.abstractmethod
    def jacobian(self, position: Array) -> Array:
        """Task Jacobian J = df/drho, eq (2): positions (n, 3) in m to Jacobians (n, m, 3)."""

    @abc.abstractmethod
    def desired(self) -> tuple[Array, Array]:
        """Desired value sigma_d and its rate, each (n, m) or broadcastable to it."""

    def velocity(self, position: Array) -> Array:
        """Task velocity v_d = J^+ (sigma_d_dot + gain * (sigma_d - sigma)), eq (4): (n, 3) in m/s."""
        wanted, rate = self.desired()
        closed_loop = rate + self.gain * (wanted - self.value(position))
        return np.einsum("...ij,...j->...i", pseudoinverse(self.jacobian(position)), closed_loop)


def pseudoinverse(jacobian: Array) -> Array:
    """Moore-Penrose inverse, eq (3): Jacobians (..., m, 3) to (..., 3, m); J^T (J J^T)^-1 at full row rank.

    Rank-deficient Jacobians (a task that is singular at this position) get the least-squares inverse,
    so that no velocity is asked for in a direction in which the task cannot move.
    """
    return np.asarray(np.linalg.pinv(jacobian, rcond=1e-12), dtype=np.float64)
