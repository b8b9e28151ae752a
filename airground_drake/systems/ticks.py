"""Instants that sampled systems of different periods share, to the last bit."""

from __future__ import annotations

from fractions import Fraction


class Ticks:
    """Every so many control periods: a tick per sampling period, each of them an instant of the controllers.

    Drake ticks at k times the period, rounded. Where a period is a multiple of the control period only up to rounding
    (0.3 s and 0.1 s), the two ticks of one instant are a unit in the last place apart, and which comes first changes
    from tick to tick: a controller would act on the message of the sample before. There the system ticks with the
    controllers and does nothing at most ticks.

    Attributes:
        period: with which to declare the periodic event, s.
    """

    def __init__(self, period: float, control: float) -> None:
        """Of a sampling period, a whole multiple of the control period to 1e-9; both s."""
        self._control, self._every = control, round(period / control)
        exact = Fraction(period) == self._every * Fraction(control)
        if exact or self._every < 1:
            self._every = 1
            self._control = period
        self.period = self._control

    def due(self, t: float) -> bool:
        """Whether the event at time t, s, is a tick."""
        return self._every == 1 or round(t / self._control) % self._every == 0
