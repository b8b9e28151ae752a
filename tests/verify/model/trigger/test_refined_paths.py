"""Paths under refinement, and the triggers on them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import LogVectorOutput, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial
from verify.model.trigger.cases import REFINE, simulate, trigger_times

from airground_drake.decision.trigger import Trigger
from airground_drake.systems.components import integrated_noise
from airground_drake.systems.decision import EventTrigger
from airground_drake.verify.engines.geometry import NormSignal
from airground_drake.verify.model import refined_paths
from airground_drake.verify.model.refined_paths import experiment
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
    assert abs(count.mean() - refined_paths.expected_bare(setting, dt)) < 4.0 * error


def test_expected_bare_count_grows_as_stated() -> None:
    setting = experiment(REFINE)
    for dt in setting.dt_s:
        steps = round(setting.duration_s / dt)
        first = round(setting.dt_s[0] / dt)
        exact = 0.5 + sum(math.atan(1.0 / math.sqrt(first + k)) for k in range(steps)) / (2.0 * math.pi)
        assert refined_paths.expected_bare(setting, dt) == pytest.approx(exact, rel=1e-9)
        assert abs(exact - (math.sqrt(first + steps) - math.sqrt(first)) / math.pi) < 1.0


@given(
    st.lists(st.floats(0.0, 6.0), min_size=3, max_size=40),
    st.sampled_from([Trigger(3.0, 2.0, 0.5), Trigger(3.0, 3.0, 0.5), Trigger(3.0, 2.0, 0.0), Trigger.bare(3.0)]),
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
    assert refined_paths.triggers(trigger, x, dt) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("trigger", "x", "times"),
    [
        (Trigger.bare(3.0), [0.0, 3.0, 0.0, 4.0, 0.0], [1.0, 2.75]),
        (Trigger.bare(3.0), [4.0, 3.0, 4.0, 0.0, 4.0], [0.0, 3.75]),
        (Trigger(3.0, 2.0, 0.0), [0.0, 3.0, 2.5, 3.0, 1.0, 3.0], [1.0, 5.0]),
        (Trigger(3.0, 2.0, 0.0), [4.0, 2.0, 4.0], [0.0, 1.5]),
        (Trigger(3.0, 2.0, 1.5), [4.0, 0.0, 4.0, 4.0], [0.0, 1.75]),
        (Trigger(3.0, 2.0, 2.0), [4.0, 0.0, 4.0, 4.0], [0.0, 2.0]),
    ],
    ids=[
        "a touch from below triggers",
        "a bare trigger stays above at a touch from above",
        "touches from below, and above the release level in between",
        "a touch of the release level releases",
        "below at the end of the dwell: at the next crossing",
        "above at the end of the dwell: at once",
    ],
)
def test_triggers_by_hand(trigger: Trigger, x: list[float], times: list[float]) -> None:
    assert refined_paths.triggers(trigger, np.array(x), 1.0) == times


@pytest.mark.parametrize("kind", ["automaton", "bare"])
def test_fast_triggers_are_those_of_the_running_systems(kind: str) -> None:
    """EventTrigger in a Drake diagram on six of the experiment's paths, its UGVs 3 m from their references."""
    trigger = Trigger(3.0, 2.0, 0.5) if kind == "automaton" else Trigger.bare(3.0)
    setting = experiment(REFINE | {"duration_s": 8.0})
    dt = setting.dt_s[1]
    noise = np.array([setting.noise_m_sqrt_s * refined_paths.path(setting, i)[1] for i in range(6)])
    source = TrajectorySource(PiecewisePolynomial.FirstOrderHold(dt * np.arange(noise.shape[1]), noise))
    status = simulate(EventTrigger(6, trigger), source, dt * (noise.shape[1] - 1), dt, error_m=3.0)
    total = 0
    for j in range(6):
        expected = refined_paths.triggers(trigger, 3.0 + noise[j], dt)
        assert trigger_times(status, j) == pytest.approx(expected, abs=1e-5)
        total += len(expected)
    assert total > 6


def test_paths_are_those_of_the_diagrams_noise() -> None:
    """The same normal samples through the diagram's AffineSystem, held over each noise step."""
    setting = experiment(REFINE | {"leak_1_s": 0.7, "noise_period_s": 1.0 / 32.0, "duration_s": 2.0})
    dt, n = setting.dt_s[2], refined_paths.path(setting, 0)[2]
    samples = (np.diff(n) + setting.leak_1_s * dt * n[:-1]) / math.sqrt(dt)
    builder = DiagramBuilder()
    held = PiecewisePolynomial.ZeroOrderHold(dt * np.arange(len(n)), [[*samples, 0.0]])
    source = builder.AddNamedSystem("samples", TrajectorySource(held))
    noise = builder.AddNamedSystem("noise", integrated_noise(1, 1.0, setting.leak_1_s, dt))
    builder.Connect(source.get_output_port(), noise.get_input_port())
    log = LogVectorOutput(noise.get_output_port(), builder)
    log.set_name("log")
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    noise.GetMyMutableContextFromRoot(context).SetContinuousState([n[0]])
    simulator = Simulator(diagram, context)
    config = SimulatorConfig(integration_scheme="explicit_euler", max_step_size=dt, use_error_control=False)
    ApplySimulatorConfig(config, simulator)
    simulator.Initialize()
    simulator.AdvanceTo(dt * (len(n) - 1))
    found = log.FindLog(context)
    assert np.interp(dt * np.arange(len(n)), found.sample_times(), found.data()[0]) == pytest.approx(n, abs=1e-9)
