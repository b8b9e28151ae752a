"""Bayes risk and threshold, and the trigger automaton."""

import math
from decimal import Decimal, localcontext

import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.model.trigger.automaton import Mode, Trigger
from airground_drake.model.trigger.bayes import decision_time, error_rate, optimal_threshold

POSITIVE = st.floats(0.1, 10.0)


@given(st.floats(-6.0, 2.0), POSITIVE, POSITIVE, st.floats(-0.9, 0.9))
def test_error_rate_by_the_scale_function_and_decision_time_by_the_martingale(
    power: float, noise: float, zeta: float, bias: float
) -> None:
    """E[x at exit] = y0 + drift E[T]. With 80 digits: beside them (18) would lose all digits of small y0 a / s^2."""
    drift, deviation = 10.0**power, bias * zeta
    with localcontext(prec=80):
        z, y0 = (2 * Decimal(drift) / Decimal(noise) ** 2 * Decimal(x) for x in (zeta, deviation))
        lower = ((-y0).exp() - (-z).exp()) / (z.exp() - (-z).exp())
        mean = (Decimal(zeta) * (1 - 2 * lower) - Decimal(deviation)) / Decimal(drift)
    assert error_rate(zeta, drift, noise, deviation) == pytest.approx(float(lower), rel=1e-13, abs=4e-16)
    if power > -3.0:
        assert decision_time(zeta, drift, noise, deviation) == pytest.approx(float(mean), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_bad_parameters_are_refused(bad: float) -> None:
    with pytest.raises(ValueError, match="positive and finite"):
        optimal_threshold(bad, 1.0, 0.5, 1.0)
    with pytest.raises(ValueError, match="positive and finite"):
        decision_time(1.0, bad, 1.0)
    with pytest.raises(ValueError, match="inside the thresholds"):
        error_rate(1.0, 1.0, 1.0, deviation=1.0)
    with pytest.raises(ValueError, match="zeta > 0"):
        Trigger(*((1.0, 2.0, 0.0) if bad == math.inf else (bad, bad, 0.0)))
    with pytest.raises(ValueError, match="zeta > 0"):
        Trigger(1.0, 0.5, -1.0)


S, I, R = Mode  # noqa: E741
TRIGGER, BARE = Trigger(zeta=3.0, release=1.5, dwell=1.0), Trigger(3.0, 3.0, 0.0)
