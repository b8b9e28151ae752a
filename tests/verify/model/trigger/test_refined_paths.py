"""Paths under refinement, and the triggers on them."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from verify.model.trigger.cases import REFINE

from airground_drake.model.trigger.automaton import Trigger
from airground_drake.sim.components import integrated_noise
from airground_drake.verify.claims import zeno_refine
from airground_drake.verify.claims.zeno_refine import experiment
from airground_drake.verify.engines.geometry import NormSignal
from airground_drake.verify.runs.triggers import transitions


@pytest.mark.parametrize("leak", [0.0, 0.7])
def test_expected_bare_count_against_random_walks(leak: float) -> None:
    """Exact expectation against 40 000 walks of 64 steps made here."""
    setting = experiment(REFINE | {"leak_1_s": leak, "duration_s": 3.2})
    dt, rng, walks = setting.dt_s[0], np.random.default_rng(0), 40_000
    x = rng.normal(0.0, math.sqrt(dt), walks)
    count = (x >= 0.0).astype(float)
    for _ in range(round(setting.duration_s / dt)):
        after = x - leak * dt * x + rng.normal(0.0, math.sqrt(dt), walks)
        count += (x < 0.0) & (after >= 0.0)
        x = after
    error = count.std() / math.sqrt(walks)
    assert abs(count.mean() - zeno_refine.expected_bare(setting, dt)) < 4.0 * error


@given(
    st.lists(st.floats(0.0, 6.0), min_size=3, max_size=40),
    st.sampled_from([Trigger(3.0, 2.0, 0.5), Trigger(3.0, 3.0, 0.5), Trigger(3.0, 2.0, 0.0), Trigger(3.0, 3.0, 0.0)]),
)
@example([0.0, 3.0, 0.0, 0.0, 0.0, 3.0], Trigger(3.0, 2.0, 0.5))  # x rises to zeta just when the dwell is over
def test_fast_triggers_are_those_of_the_independent_checker(values: list[float], trigger: Trigger) -> None:
    x = np.array(values) + 1e-3 * math.sqrt(2.0)  # not at a level, where a touch may count or not
    dt = 0.125
    t = dt * np.arange(len(x))
    signal = NormSignal.of(t, np.column_stack([np.zeros((len(x), 3)), x]))
    expected = [
        time for time, kind in transitions(signal, trigger.zeta, trigger.release, trigger.dwell) if kind == "trigger"
    ]
    assert zeno_refine.triggers(trigger, x, dt) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("trigger", "x", "times"),
    [
        (Trigger(3.0, 3.0, 0.0), [0.0, 3.0, 0.0, 4.0, 0.0], [1.0, 2.75]),  # a touch from below triggers
        (Trigger(3.0, 3.0, 0.0), [4.0, 3.0, 4.0, 0.0, 4.0], [0.0, 3.75]),  # a touch from above does not release
        (Trigger(3.0, 2.0, 0.0), [0.0, 3.0, 2.5, 3.0, 1.0, 3.0], [1.0, 5.0]),  # above the release level in between
        (Trigger(3.0, 2.0, 0.0), [4.0, 2.0, 4.0], [0.0, 1.5]),  # a touch of the release level releases
        (Trigger(3.0, 2.0, 1.5), [4.0, 0.0, 4.0, 4.0], [0.0, 1.75]),  # below at the end of the dwell
        (Trigger(3.0, 2.0, 2.0), [4.0, 0.0, 4.0, 4.0], [0.0, 2.0]),  # above at the end of the dwell: at once
    ],
)
def test_triggers_by_hand(trigger: Trigger, x: list[float], times: list[float]) -> None:
    assert zeno_refine.triggers(trigger, np.array(x), 1.0) == times


def test_paths_are_those_of_the_diagrams_noise() -> None:
    """Euler steps of the diagram's AffineSystem with the same normal samples."""
    setting = experiment(REFINE | {"leak_1_s": 0.7})
    dt, n = setting.dt_s[2], zeno_refine.path(setting, 0)[2]
    unit = zeno_refine.path(experiment(REFINE), 0)[2]
    samples = np.diff(unit) / math.sqrt(dt)  # without leak a path is the sum of its samples
    noise = integrated_noise(1, 1.0, setting.leak_1_s, dt)
    assert n[0] == unit[0]
    assert n[1:] == pytest.approx(n[:-1] + dt * (noise.A()[0, 0] * n[:-1] + noise.B()[0, 0] * samples), abs=1e-9)
