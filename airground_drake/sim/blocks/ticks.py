"""Sampling instants of systems with different periods, equal to the last bit."""

from fractions import Fraction
from math import isfinite


class Ticks:
    """Ticks of a sampling period, each at an instant of the controllers."""

    # Drake ticks at k times the period, rounded. If a period is a multiple of the control period only up to rounding
    # (0.3 s and 0.1 s), the two ticks of one instant are a unit in the last place apart, and their order varies: a
    # controller would act on the message of the sample before. Such a system ticks with the controllers instead and
    # does nothing at ticks that are not `due`.

    def __init__(self, period: float, control: float) -> None:
        """Both in s."""
        times = period / control if isfinite(period) and control > 0.0 else 0.0
        self._every = round(times)
        if self._every < 1 or abs(times - self._every) > 1e-9 * times:
            raise ValueError(f"period {period!r} s; wanted: a multiple of the control period, {control!r} s")
        exact = Fraction(period) == self._every * Fraction(control)
        # period: of the declared periodic event, s.
        self._every, self.period = (1, period) if exact else (self._every, control)

    def due(self, t: float) -> bool:
        """Whether the event at time t, s, is a tick."""
        return self._every == 1 or round(t / self.period) % self._every == 0

    def instant(self, number: int) -> float:
        """Time of a tick, s, as Drake computes it; the first one, 0, is at 0 s."""
        return number * self._every * self.period
