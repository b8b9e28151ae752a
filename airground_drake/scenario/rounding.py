"""A bound of the distance that rounding (binary64) may take from a safe distance.

A scenario is accepted only if the bound stays below `TOLERANCE_M`. Reports measure what a run lost.
"""

from typing import NamedTuple, TypeVar

import numpy as np

from airground_drake.base.arrays import ROUNDOFF, Array

TOLERANCE_M = 1e-9  # largest shortfall of a safe distance that reports tolerate, m
STEPS_PER_PERIOD = 64  # largest number of integration steps in a control period, which events cut; the most seen is 13
# Additional age of old positions in the asynchronous law, s, for rounding errors of both UGVs in a period: this law
# does not recover distances, so these losses would add up.
SPARE_S = 1e-8
SLACK = 1.01  # factor on the first-order bounds, for products of roundings and for rounding in this formula

Number = TypeVar("Number", float, Array)


def loss_of_inequality(distance: Number, speed: Number, period: float) -> Number:
    """Loss by rounding in the kernels in one period, m: u (7 D + 9 V h) if floats meet the inequality."""
    # The kernels compute the bound from D (1 + 3.5u). It errs by (4 D + 3 |D - d|) u / h, and |D - d| <= D as D >= d.
    # Each term of n.v has a relative error of (5.5 + 3)u.
    return ROUNDOFF * (7.0 * distance + 9.0 * speed * period)


class Rounding(NamedTuple):
    """The quantities on which the loss of a kind of pairs depends."""

    # One control period loses three amounts: the kernels' loss (`loss_of_inequality`, for both robots); u (P + h V) in
    # the positions, per coordinate, integration step and robot (P: largest coordinate); and u T V per integration step,
    # as multiples of h are rounded (T: duration). The law reduces a deficit to (1 - A h) of it per period. So a deficit
    # never exceeds (loss of a period) / (A h). With A = 0 nothing is restored, and losses add up.

    reach: float  # largest distance at which an inequality acts, m
    closing: float  # largest closing speed V, m/s
    period: float  # control period h, s
    gain: float  # a of the inequality, 1/s

    def of_a_step(self, extent: float, duration: float) -> float:
        """Loss of one step, m, for coordinates up to `extent`, m, in a run of `duration`, s."""
        moves = _PER_METRE * (extent + self.closing * self.period)
        return SLACK * (self._kernel + moves + self._per_second * duration)

    def largest_extent(self, duration: float) -> float:
        """Largest coordinate for which a deficit stays within the tolerance, m; negative if there is no such one."""
        return (self._budget - self._per_second * duration) / _PER_METRE

    def longest(self, start: float, speed: float) -> float:
        """Largest duration for coordinates up to start + speed * duration, s; negative if there is no such one."""
        return (self._budget - _PER_METRE * start) / (_PER_METRE * speed + self._per_second)

    def least_gain(self, extent: float, duration: float) -> float:
        """Smallest gain for which a deficit stays within the tolerance, 1/s."""
        return self.of_a_step(extent, duration) / (TOLERANCE_M * self.period)

    @property
    def _kernel(self) -> float:
        return float(loss_of_inequality(self.reach, self.closing, self.period))

    @property
    def _per_second(self) -> float:
        return (STEPS_PER_PERIOD + 2.0) * self.closing * ROUNDOFF

    @property
    def _budget(self) -> float:
        step = TOLERANCE_M * self.gain * self.period / SLACK
        return step - self._kernel - _PER_METRE * self.closing * self.period


# Loss of a step per metre of the largest coordinate, for three coordinates and two robots.
_PER_METRE = 2.0 * float(np.sqrt(3.0)) * STEPS_PER_PERIOD * ROUNDOFF
