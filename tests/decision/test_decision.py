"""Bayes risk and threshold, and the trigger automaton."""

from __future__ import annotations

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize_scalar

from airground_drake.decision.bayes import bayes_risk, decision_time, error_rate, optimal_threshold
from airground_drake.decision.trigger import Mode, Trigger, TriggerState

POSITIVE = st.floats(0.1, 10.0)


def test_optimal_threshold_of_the_audit() -> None:
    """Drift 1, noise 1, c1 0.5, c2 1: the minimiser solves (19) with c2/c1, and not with c1/c2 as printed."""
    zeta = optimal_threshold(1.0, 1.0, 0.5, 1.0)
    assert zeta == pytest.approx(0.46500451, abs=1e-8)
    printed = optimal_threshold(1.0, 1.0, 1.0, 0.5)  # solves (19) with 1/2 on the right
    assert printed == pytest.approx(0.12435, abs=1e-5)
    assert bayes_risk(zeta, 1.0, 1.0, 0.5, 1.0) < bayes_risk(printed, 1.0, 1.0, 0.5, 1.0)


def test_threshold_of_table_1() -> None:
    """Zeta = 3 with sigma = 10, c1 = 0.5, c2 = 1 is optimal for a drift of about 6.05 m/s."""
    assert optimal_threshold(6.05, 10.0, 0.5, 1.0) == pytest.approx(3.0, abs=0.01)


@given(POSITIVE, POSITIVE, POSITIVE, POSITIVE)
def test_threshold_minimises_the_risk(drift: float, noise: float, c1: float, c2: float) -> None:
    zeta = optimal_threshold(drift, noise, c1, c2)
    best = minimize_scalar(
        lambda z: bayes_risk(z, drift, noise, c1, c2), bounds=(1e-9, 4 * zeta), method="bounded",
        options={"xatol": 1e-10},
    )  # fmt: skip
    assert bayes_risk(zeta, drift, noise, c1, c2) <= best.fun * (1 + 1e-9) + 1e-12


@given(POSITIVE, POSITIVE, POSITIVE, st.floats(-0.9, 0.9))
def test_decision_time_and_error_rate_agree_with_the_martingale_identities(
    zeta: float, drift: float, noise: float, bias: float
) -> None:
    """E[x at exit] = y0 + drift E[T] and the exponential martingale: no formula of (17)-(18) is used here."""
    deviation = bias * zeta
    k = 2.0 * drift / noise**2
    if k * zeta > 300:
        return
    # P(lower) from the scale function exp(-k x)
    p = (math.exp(-k * deviation) - math.exp(-k * zeta)) / (math.exp(k * zeta) - math.exp(-k * zeta))
    assert error_rate(zeta, drift, noise, deviation) == pytest.approx(p, rel=1e-9, abs=1e-12)
    mean = (zeta * (1 - 2 * p) - deviation) / drift
    assert decision_time(zeta, drift, noise, deviation) == pytest.approx(mean, rel=1e-6, abs=1e-9)


@given(st.floats(-6.0, 2.0), POSITIVE, POSITIVE, st.floats(-0.9, 0.9))
def test_nothing_cancels_however_weak_the_drift(power: float, noise: float, zeta: float, bias: float) -> None:
    """Error rates by the scale function with 80 digits; beside them, (18) would lose all digits of small y0 a / s^2."""
    drift, deviation = 10.0**power, bias * zeta
    with localcontext(prec=80):
        z, y0 = (2 * Decimal(drift) / Decimal(noise) ** 2 * Decimal(x) for x in (zeta, deviation))
        lower = ((-y0).exp() - (-z).exp()) / (z.exp() - (-z).exp())
    assert error_rate(zeta, drift, noise, deviation) == pytest.approx(float(lower), rel=1e-13, abs=4e-16)


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf])
def test_bad_parameters_are_refused(bad: float) -> None:
    with pytest.raises(ValueError, match="positive and finite"):
        optimal_threshold(bad, 1.0, 0.5, 1.0)
    with pytest.raises(ValueError, match="positive and finite"):
        decision_time(1.0, bad, 1.0)
    with pytest.raises(ValueError, match="inside the thresholds"):
        error_rate(1.0, 1.0, 1.0, deviation=1.0)


def test_automaton_cycle() -> None:
    trigger = Trigger(zeta=3.0, release=1.5, dwell=1.0)
    state = trigger.start(0.0, 0.0)
    assert state == TriggerState()
    state = trigger.rise(state, 2.0)
    assert (state.mode, state.triggers, state.triggered_at) == (Mode.INTERVENING, 1, 2.0)
    early = trigger.fall(state, 2.5)
    assert (early.mode, early.released_at) == (Mode.REFRACTORY, 2.5)
    assert trigger.recover(early, 3.0, 2.9).mode is Mode.SUPERVISING
    again = trigger.recover(early, 3.0, 3.0)
    assert (again.mode, again.triggers, again.triggered_at) == (Mode.INTERVENING, 2, 3.0)
    assert trigger.fall(state, 3.0).mode is Mode.SUPERVISING


def test_an_intervention_lasts_until_the_release_level_is_reached() -> None:
    trigger = Trigger(zeta=3.0, release=1.5, dwell=0.0)
    state = trigger.rise(TriggerState(), 2.0)
    for x in (2.999, 2.0, 1.501):
        assert trigger.step(state, 3.0, x) is state
    after = trigger.step(state, 3.0, 1.5)
    assert (after.mode, after.released_at) == (Mode.SUPERVISING, 3.0)


def test_above_the_threshold_at_the_start_triggers_at_once() -> None:
    assert Trigger(3.0, 1.5, 1.0).start(0.0, 3.0).triggers == 1


def test_bare_trigger_has_no_hysteresis_and_no_dwell() -> None:
    bare = Trigger.bare(3.0)
    assert bare.fall(bare.rise(TriggerState(), 1.0), 1.0).mode is Mode.SUPERVISING


@pytest.mark.parametrize("numbers", [(0.0, 0.0, 0.0), (1.0, 2.0, 0.0), (1.0, 0.5, -1.0), (math.nan, 0.0, 0.0)])
def test_bad_triggers_are_refused(numbers: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="zeta > 0"):
        Trigger(*numbers)


@given(st.lists(st.floats(-1.0, 5.0), min_size=1, max_size=200), st.floats(0.0, 2.0), st.floats(0.01, 0.5))
def test_triggers_are_never_closer_than_the_dwell(samples: list[float], dwell: float, dt: float) -> None:
    """Any signal, sampled: whatever it does, two triggers are at least the dwell apart."""
    trigger = Trigger(3.0, 1.5, dwell)
    state = trigger.start(0.0, samples[0])
    times = [0.0] if state.triggers else []
    for k, x in enumerate(samples[1:], start=1):
        t = k * dt
        before = state.triggers
        if state.mode is Mode.SUPERVISING and x >= trigger.zeta:
            state = trigger.rise(state, t)
        elif state.mode is Mode.INTERVENING and x <= trigger.release:
            state = trigger.fall(state, t)
        elif state.mode is Mode.REFRACTORY and t >= trigger.dwell_end(state):
            state = trigger.recover(state, t, x)
        if state.triggers > before:
            times.append(t)
    assert (np.diff(times) >= dwell - 1e-12).all()
