"""Simulated drift-diffusion paths of the decision variable between two thresholds.

Paths come from the systems of the diagram that runs: RandomSource -> integrated noise (`make_noise`) ->
DecisionVariable, whose UGVs stand still while their references leave at the drift, so that x = drift t + n. Increments
of x over the noise period are independent, so one long record is cut into paths, one beginning where the one before
has ended, until a fixed number is complete; a fixed number, because the paths that happen to fit into a fixed time are
too short.

A path is decided at the first sample at or beyond a barrier, which is later, and less often wrong, than for the
continuous process. The barrier is therefore moved inwards by 0.5826 noise sqrt(period) (Chernoff 1965, Siegmund
1979); the mean of the sampled time is then T + period/4.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from pydrake.common import RandomGenerator
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput, TrajectorySource

from airground_drake.components import make_noise, stack_presets
from airground_drake.decision.bayes import decision_time, error_rate, optimal_threshold
from airground_drake.nsbc.motion import Motion
from airground_drake.scenarios.schema import Decision
from airground_drake.systems.decision import DecisionVariable

SEED = 20061
CHANNELS = 32
OVERSHOOT = 0.5825971579390107
"""-zeta(1/2)/sqrt(2 pi): mean overshoot of a sampled Wiener path beyond a far barrier, in steps of one deviation."""
STEP = 0.2
"""Standard deviation of x over one noise period as a share of the threshold."""
DRIFT_STEP = 0.02
"""Largest mean of x over one noise period as a share of the threshold."""


@dataclass(frozen=True)
class PassageExperiment:
    """Paths of (15) between +-zeta: lengths in m, drift in m/s, noise in m/sqrt(s)."""

    name: str
    drift: float
    noise: float
    zeta: float
    deviation: float
    paths: int
    seed: int

    @property
    def period(self) -> float:
        """Noise period, s."""
        return min((STEP * self.zeta / self.noise) ** 2, DRIFT_STEP * self.zeta / self.drift)

    @property
    def barrier(self) -> float:
        """The threshold moved inwards, m."""
        return self.zeta - OVERSHOOT * self.noise * math.sqrt(self.period)


@dataclass(frozen=True)
class Sample:
    """What an experiment gave: wrong decisions, sum and sum of squares of the noise periods to the decision."""

    experiment: PassageExperiment
    wrong: int
    periods: int
    squares: int


def experiments(inputs: dict[str, Any]) -> tuple[PassageExperiment, ...]:
    """At the Bayes threshold with and without deviation, with other drift and noise, and Bayes against printed (19).

    The last two have the drift at which the Bayes threshold is at u = 1, where both kinds of decision are common and
    their thresholds differ most clearly.
    """
    drift, noise, c1, c2 = (float(inputs[name]) for name in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2"))
    zeta = optimal_threshold(drift, noise, c1, c2)
    clear = noise * math.sqrt((math.sinh(1.0) + 1.0) * c1 / c2)
    bayes = optimal_threshold(clear, noise, c1, c2)
    printed_zeta = optimal_threshold(clear, noise, c2, c1)
    return (
        PassageExperiment("no deviation", drift, noise, zeta, 0.0, 10000, SEED),
        PassageExperiment("deviation ahead", drift, noise, zeta, 0.4 * zeta, 5000, SEED + 1),
        PassageExperiment("deviation behind", drift, noise, zeta, -0.4 * zeta, 5000, SEED + 2),
        PassageExperiment(
            "other drift and noise", 4.0 * noise**2 / zeta, 2.0 * noise, zeta, -0.4 * zeta, 4000, SEED + 3
        ),
        PassageExperiment("Bayes threshold at u = 1", clear, noise, bayes, 0.0, 6000, SEED + 4),
        PassageExperiment("printed threshold instead", clear, noise, printed_zeta, 0.0, 6000, SEED + 5),
    )


def running(experiment: PassageExperiment) -> tuple[float, float]:
    """(17)-(18) as the package computes them."""
    constants = (experiment.zeta, experiment.drift, experiment.noise, experiment.deviation)
    return decision_time(*constants), error_rate(*constants)


@lru_cache(maxsize=16)
def simulate(experiment: PassageExperiment) -> Sample:
    """Decide `experiment.paths` paths, simulated by Drake.

    Raises:
        ArithmeticError: if the record is too short for them, which the margin makes all but impossible.
    """
    expected = (running(experiment)[0] / experiment.period + 1.0) * experiment.paths
    steps = iter(increments(experiment, math.ceil((1.1 * expected + 1000.0) / CHANNELS)))
    start, barrier = experiment.deviation, experiment.barrier
    wrong = 0
    total = 0
    squares = 0
    for _ in range(experiment.paths):
        periods, x = passage(steps, start, barrier)
        wrong += x < 0.0
        total += periods
        squares += periods**2
    return Sample(experiment, wrong, total, squares)


def passage(steps: Iterator[float], x: float, barrier: float) -> tuple[int, float]:
    """Noise periods until x, m, reaches +-barrier, and where it is then."""
    for periods, step in enumerate(steps, start=1):
        x += step
        if not -barrier < x < barrier:
            return periods, x
    raise ArithmeticError("the record ended within a path")


def increments(experiment: PassageExperiment, rows: int) -> list[float]:
    """Increments of the decision variable over the noise period, m, (rows * CHANNELS), from a Drake simulation."""
    period, duration = experiment.period, rows * experiment.period
    ends = np.array([[0.0, 0.0, 0.0], [1.01 * experiment.drift * duration, 0.0, 0.0]])
    away = Motion.at_speed(ends, experiment.drift)
    builder = DiagramBuilder()
    given = Decision(noise_m_sqrt_s=experiment.noise, leak_1_s=0.0, noise_period_s=period)
    source, noise = map(builder.AddSystem, make_noise(CHANNELS, given))
    reference = builder.AddNamedSystem("reference", TrajectorySource(stack_presets([away] * CHANNELS), 1))
    standing = builder.AddNamedSystem("team_position", ConstantVectorSource(np.zeros(3 * (CHANNELS + 1))))
    variable = builder.AddNamedSystem("decision_variable", DecisionVariable(CHANNELS))
    builder.Connect(source.get_output_port(), noise.get_input_port())
    builder.Connect(noise.get_output_port(), variable.GetInputPort("noise"))
    builder.Connect(reference.get_output_port(), variable.GetInputPort("reference"))
    builder.Connect(standing.get_output_port(), variable.GetInputPort("team_position"))
    log = LogVectorOutput(variable.GetOutputPort("decision_variable"), builder, period)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    diagram.SetRandomContext(context, RandomGenerator(experiment.seed))
    ResetIntegratorFromFlags(simulator, "explicit_euler", period)  # exact, the noise being held over each period
    simulator.Initialize()
    simulator.AdvanceTo(duration)
    return np.diff(log.FindLog(context).data(), axis=1).ravel().tolist()
