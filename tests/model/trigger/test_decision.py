"""Bayes risk and threshold, and the trigger automaton."""

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from airground_drake.model.trigger.automaton import Mode, Trigger, TriggerState
from airground_drake.model.trigger.bayes import bayes_risk, decision_time, error_rate, optimal_threshold

POSITIVE = st.floats(0.1, 10.0)


@given(POSITIVE, POSITIVE, POSITIVE, POSITIVE)
def test_threshold_minimises_the_risk(drift: float, noise: float, c1: float, c2: float) -> None:
    zeta = optimal_threshold(drift, noise, c1, c2)
    best = minimize_scalar(
        lambda z: bayes_risk(z, drift, noise, c1, c2), bounds=(1e-9, 4 * zeta), method="bounded",
        options={"xatol": 1e-10},
    )  # fmt: skip
    assert bayes_risk(zeta, drift, noise, c1, c2) <= best.fun * (1 + 1e-9) + 1e-12


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
TRIGGER, BARE = Trigger(zeta=3.0, release=1.5, dwell=1.0), Trigger.bare(3.0)


@pytest.mark.parametrize(
    ("trigger", "before", "t", "x", "after"),
    [
        (TRIGGER, (S, 0, -1.0, -1.0), 2.0, 2.999, (S, 0, -1.0, -1.0)),
        (TRIGGER, (S, 0, -1.0, -1.0), 2.0, 3.0, (I, 1, 2.0, -1.0)),
        (TRIGGER, (I, 1, 2.0, -1.0), 2.5, 1.501, (I, 1, 2.0, -1.0)),
        (TRIGGER, (I, 1, 2.0, -1.0), 2.5, 1.5, (R, 1, 2.0, 2.5)),  # a release within the dwell
        (TRIGGER, (I, 1, 2.0, -1.0), 3.0, 1.5, (S, 1, 2.0, 3.0)),
        (TRIGGER, (R, 1, 2.0, 2.5), 2.9, 9.0, (R, 1, 2.0, 2.5)),
        (TRIGGER, (R, 1, 2.0, 2.5), 3.0, 2.9, (S, 1, 2.0, 2.5)),
        (TRIGGER, (R, 1, 2.0, 2.5), 3.0, 3.0, (I, 2, 3.0, 2.5)),
        (BARE, (I, 1, 2.0, -1.0), 2.0, 3.0, (I, 1, 2.0, -1.0)),
        (BARE, (I, 1, 2.0, -1.0), 2.0, 2.999, (S, 1, 2.0, 2.0)),  # no hysteresis, no dwell
    ],
)
def test_transitions(trigger: Trigger, before: tuple, t: float, x: float, after: tuple) -> None:
    assert trigger.step(TriggerState(*before), t, x) == TriggerState(*after)


@given(st.lists(st.floats(-1.0, 5.0), min_size=1, max_size=200), st.floats(0.0, 2.0), st.floats(0.01, 0.5))
def test_triggers_are_never_closer_than_the_dwell(samples: list[float], dwell: float, dt: float) -> None:
    trigger = Trigger(3.0, 1.5, dwell)
    state = trigger.start(0.0, samples[0])
    assert state.triggers == (samples[0] >= 3.0)
    times = [0.0] * state.triggers
    for k, x in enumerate(samples[1:], start=1):
        before, state = state.triggers, trigger.step(state, k * dt, x)
        times += [k * dt] * (state.triggers - before)
    assert (np.diff(times) >= dwell - 1e-12).all()
