"""Simulated paths between two thresholds."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.worlds import world
from pydrake.common import RandomGenerator
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput, TrajectorySource
from scipy.special import ndtr
from scipy.stats import kstest
from verify.model.threshold.cases import INPUTS

from airground_drake.geometry.motion import Motion
from airground_drake.scenarios.schema import Decision
from airground_drake.systems.components import make_noise, stack_presets
from airground_drake.systems.decision import DecisionVariable
from airground_drake.verify.model import first_passages, thr_ddm
from airground_drake.verify.model.first_passages import PassageExperiment


def sampled(each: PassageExperiment, nodes: int = 160) -> tuple[float, float]:
    """Mean number of periods and error rate of the sampled walk between the barriers, by Gauss-Legendre quadrature."""
    x, weight = (each.barrier * values for values in np.polynomial.legendre.leggauss(nodes))
    step, mean = each.noise * math.sqrt(each.period), each.drift * each.period

    def kernel(start: Any) -> Any:
        return np.exp(-(((x - start - mean) / step) ** 2) / 2.0) / (step * math.sqrt(2.0 * math.pi)) * weight

    matrix = np.eye(nodes) - np.array([kernel(start) for start in x])
    beyond = ndtr((-each.barrier - x - mean) / step)
    periods, wrong = np.linalg.solve(matrix, np.ones(nodes)), np.linalg.solve(matrix, beyond)
    first = kernel(each.deviation)
    at_once = float(ndtr((-each.barrier - each.deviation - mean) / step))
    return 1.0 + float(first @ periods), at_once + float(first @ wrong)


@pytest.mark.parametrize("deviation", [-0.4, 0.0, 0.4])
@pytest.mark.parametrize("drift", [0.01, 0.1815, 1.0, 10.0])
def test_what_the_barrier_correction_leaves_is_within_the_allowances(drift: float, deviation: float) -> None:
    each = PassageExperiment("", drift, 1.0, 1.0, deviation, 1, 0)
    periods, wrong = sampled(each)
    time, rate = first_passages.running(each)
    assert abs(periods - 0.25 - time / each.period) < thr_ddm.TIME_ALLOWANCE
    assert abs(wrong - rate) < thr_ddm.ERROR_ALLOWANCE
    for inputs in INPUTS.values():  # whose experiments are in the range of this test
        for one in first_passages.experiments(inputs):
            assert 0.0 < one.zeta * one.drift / one.noise**2 <= 10.0
            assert abs(one.deviation) <= 0.4 * one.zeta * (1.0 + 1e-12)


@pytest.mark.parametrize("zeta", [1.0, 1e-3])  # noise periods of 4 ms and 4 ns
def test_increments_of_the_running_systems_are_those_that_are_simulated(zeta: float) -> None:
    """The diagram's noise and decision variable, with a task error that grows at the drift."""
    each = PassageExperiment("", 2.0, 3.0, zeta, 0.0, 1, 5)
    steps = running_increments(each, 1000)
    assert steps.shape == (1000 * CHANNELS,)
    mean, deviation = each.drift * each.period, each.noise * math.sqrt(each.period)
    assert abs(steps.mean() - mean) < 4.0 * deviation / math.sqrt(len(steps))
    assert steps.std() == pytest.approx(deviation, rel=4.0 / math.sqrt(2.0 * len(steps)))
    assert kstest((steps - mean) / deviation, "norm").statistic < 2.0 / math.sqrt(len(steps))
    assert abs(np.corrcoef(steps[:-1], steps[1:])[0, 1]) < 4.0 / math.sqrt(len(steps))


CHANNELS = 32


def running_increments(experiment: PassageExperiment, rows: int) -> np.ndarray:
    """Increments of the running decision variables over the noise period, m, (rows * CHANNELS,)."""
    period, duration = experiment.period, rows * experiment.period
    ends = np.array([[0.0, 0.0, 0.0], [1.01 * experiment.drift * duration, 0.0, 0.0]])
    away = Motion.at_speed(ends, experiment.drift)
    builder = DiagramBuilder()
    given = Decision(noise_m_sqrt_s=experiment.noise, leak_1_s=0.0, noise_period_s=period)
    source, noise = map(builder.AddSystem, make_noise(CHANNELS, given))
    reference = builder.AddNamedSystem("reference", TrajectorySource(stack_presets([away] * CHANNELS), 1))
    standing = builder.AddNamedSystem("bodies", ConstantVectorSource(np.zeros(3 * (CHANNELS + 1))))
    variable = builder.AddNamedSystem("decision_variable", DecisionVariable(world(CHANNELS)))
    builder.Connect(source.get_output_port(), noise.get_input_port())
    builder.Connect(noise.get_output_port(), variable.GetInputPort("noise"))
    builder.Connect(reference.get_output_port(), variable.GetInputPort("reference"))
    builder.Connect(standing.get_output_port(), variable.GetInputPort("bodies"))
    log = LogVectorOutput(variable.GetOutputPort("decision_variable"), builder, period)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    diagram.SetRandomContext(context, RandomGenerator(experiment.seed))
    ResetIntegratorFromFlags(simulator, "explicit_euler", period)  # exact, the noise being held over each period
    simulator.Initialize()
    simulator.AdvanceTo(duration)
    found: np.ndarray = np.diff(log.FindLog(context).data(), axis=1).ravel()
    return found


def test_paths_are_followed_to_their_ends() -> None:
    each = PassageExperiment("", 1.0, 1.0, 1.0, 0.0, 500, 3)
    found, again = first_passages.simulate(each), first_passages.simulate(replace(each, seed=4))
    assert found == first_passages.simulate.__wrapped__(each)
    assert (found.wrong, found.periods) != (again.wrong, again.periods)
    assert first_passages.simulate(replace(each, drift=1e-3, noise=1e-6)).wrong == 0  # the drift alone decides
