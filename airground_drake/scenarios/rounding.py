"""What rounding may take from a safe distance in binary64: one formula, by which scenarios are accepted.

A scenario is accepted only where the loss stays below `TOLERANCE_M`; SAFE-HYP measures what a run lost.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np

from airground_drake.base.arrays import ROUNDOFF, Array

TOLERANCE_M = 1e-9
"""What a distance may fall short of the safe one, as SAFE-TRACE judges it, m."""
STEPS_PER_PERIOD = 64
"""Integration steps into which events may cut a control period; 13 have been seen, where a witness function was
isolated."""
SLACK = 1.01
"""Over the sum of first-order bounds, for products of roundings and for those of this formula."""

Number = TypeVar("Number", float, Array)


def loss_of_inequality(distance: Number, speed: Number, period: float) -> Number:
    """What rounding in kernels may cost in one period, m: u (7 D + 9 V h) for an inequality that floats meet.

    The bound is computed from D (1 + 3.5u) and errs by (4 D + 3 |D - d|) u / h, |D - d| <= D as D >= d; each term of
    n.v errs by (5.5 + 3)u of itself.
    """
    return ROUNDOFF * (7.0 * distance + 9.0 * speed * period)


class Rounding(NamedTuple):
    """What the loss of a kind of pairs depends on.

    One step loses what the kernels lose (`loss_of_inequality`, both robots), u (P + h V) per coordinate, integration
    step and robot in the positions (P: largest coordinate), and u T V per integration step because multiples of h
    are rounded (T: duration). A deficit calls in the lower branch of the inequality, which leaves (1 - A h) of it per
    period; so alone it never exceeds (loss of a step) / (A h). With A = 0 nothing is restored and losses add up.

    Attributes:
        reach: largest distance at which an inequality acts, m.
        closing: largest closing speed V, m/s.
        period: control period h, s.
        gain: A of the inequality, 1/s.
    """

    reach: float
    closing: float
    period: float
    gain: float

    def of_a_step(self, extent: float, duration: float) -> float:
        """Loss of one step, m, for coordinates up to `extent`, m, in a run of `duration`, s."""
        moves = _PER_METRE * (extent + self.closing * self.period)
        return SLACK * (self._kernel + moves + self._per_second * duration)

    def largest_extent(self, duration: float) -> float:
        """Coordinate up to which a deficit stays within the tolerance, m; may be negative: then none."""
        return (self._budget - self._per_second * duration) / _PER_METRE

    def longest(self, start: float, speed: float) -> float:
        """Duration up to which it does for coordinates up to start + speed * duration, s; may be negative."""
        return (self._budget - _PER_METRE * start) / (_PER_METRE * speed + self._per_second)

    def least_gain(self, extent: float, duration: float) -> float:
        """Gain from which on it does, 1/s."""
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


_PER_METRE = 2.0 * float(np.sqrt(3.0)) * STEPS_PER_PERIOD * ROUNDOFF
"""Loss of a step for each metre of the largest coordinate: three coordinates, two robots."""
