"""Paths under refinement, and the triggers on them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from builders.worlds import world
from hypothesis import example, given
from hypothesis import strategies as st
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import (
    ConstantVectorSource,
    Integrator,
    LogVectorOutput,
    TrajectorySource,
    ZeroOrderHold,
)
from pydrake.trajectories import PiecewisePolynomial
from verify.model.trigger.cases import REFINE

from airground_drake.decision.trigger import Trigger
from airground_drake.systems.components import integrated_noise
from airground_drake.systems.decision import DecisionVariable, EventTrigger
from airground_drake.systems.signals import FIELDS
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
        (Trigger.bare(3.0), [0.0, 3.0, 0.0, 4.0, 0.0], [1.0, 2.75]),  # a touch from below triggers
        (Trigger.bare(3.0), [4.0, 3.0, 4.0, 0.0, 4.0], [0.0, 3.75]),  # a touch from above does not release
        (Trigger(3.0, 2.0, 0.0), [0.0, 3.0, 2.5, 3.0, 1.0, 3.0], [1.0, 5.0]),  # above the release level in between
        (Trigger(3.0, 2.0, 0.0), [4.0, 2.0, 4.0], [0.0, 1.5]),  # a touch of the release level releases
        (Trigger(3.0, 2.0, 1.5), [4.0, 0.0, 4.0, 4.0], [0.0, 1.75]),  # below at the end of the dwell
        (Trigger(3.0, 2.0, 2.0), [4.0, 0.0, 4.0, 4.0], [0.0, 2.0]),  # above at the end of the dwell: at once
    ],
)
def test_triggers_by_hand(trigger: Trigger, x: list[float], times: list[float]) -> None:
    assert refined_paths.triggers(trigger, np.array(x), 1.0) == times


@pytest.mark.parametrize("trigger", [Trigger(3.0, 2.0, 0.5), Trigger.bare(3.0)])
def test_fast_triggers_are_those_of_the_running_systems(trigger: Trigger) -> None:
    """EventTrigger in a Drake diagram on six of the experiment's paths, its UGVs 3 m from their references."""
    setting = experiment(REFINE | {"duration_s": 8.0})
    dt = setting.dt_s[1]
    paths = np.array([setting.noise_m_sqrt_s * refined_paths.path(setting, i)[1] for i in range(6)])
    noise = TrajectorySource(PiecewisePolynomial.FirstOrderHold(dt * np.arange(paths.shape[1]), paths))
    builder, system, variable = DiagramBuilder(), EventTrigger(6, trigger), DecisionVariable(world(6))
    for name, each in (("noise", noise), ("event_trigger", system), ("decision_variable", variable)):
        builder.AddNamedSystem(name, each)
    for port in ("decision_variable", "decision_range"):
        builder.Connect(variable.GetOutputPort(port), system.GetInputPort(port))
    reference = np.concatenate([[3.0, 0.0, 0.0] * 6, np.zeros(18)])
    for name, value in (("bodies", np.zeros(21)), ("reference", reference)):
        constant = builder.AddNamedSystem(name, ConstantVectorSource(value))
        builder.Connect(constant.get_output_port(), variable.GetInputPort(name))
    builder.Connect(noise.get_output_port(), variable.GetInputPort("noise"))
    # steps end at the multiples of dt, as at the noise samples of the diagram; they need a continuous state
    clock = builder.AddNamedSystem("clock", Integrator(1))
    sampled = builder.AddNamedSystem("sampled", ZeroOrderHold(dt, 1))
    builder.Connect(clock.get_output_port(), sampled.get_input_port())
    rate = builder.AddNamedSystem("rate", ConstantVectorSource([1.0]))
    builder.Connect(rate.get_output_port(), clock.get_input_port())
    log = LogVectorOutput(system.get_output_port(), builder)
    log.set_name("log")
    simulator = Simulator(builder.Build())
    context = simulator.get_mutable_context()
    context.SetAccuracy(1e-6)
    config = SimulatorConfig(integration_scheme="explicit_euler", max_step_size=dt, use_error_control=False)
    ApplySimulatorConfig(config, simulator)
    simulator.Initialize()
    simulator.AdvanceTo(dt * (paths.shape[1] - 1))
    status, total = log.FindLog(context).data(), 0
    for j in range(6):
        expected = refined_paths.triggers(trigger, 3.0 + paths[j], dt)
        times = sorted({float(t) for t in status[FIELDS * j + 2] if t >= 0.0})
        assert times == pytest.approx(expected, abs=1e-5)
        total += len(expected)
    assert total > 6


def test_paths_are_those_of_the_diagrams_noise() -> None:
    """Euler steps of the diagram's AffineSystem with the same normal samples."""
    setting = experiment(REFINE | {"leak_1_s": 0.7})
    dt, n = setting.dt_s[2], refined_paths.path(setting, 0)[2]
    unit = refined_paths.path(experiment(REFINE), 0)[2]
    samples = np.diff(unit) / math.sqrt(dt)  # without leak a path is the sum of its samples
    noise = integrated_noise(1, 1.0, setting.leak_1_s, dt)
    assert n[0] == unit[0]
    assert n[1:] == pytest.approx(n[:-1] + dt * (noise.A()[0, 0] * n[:-1] + noise.B()[0, 0] * samples), abs=1e-9)
