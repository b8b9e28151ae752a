"""Simulated drift-diffusion paths of the decision variable between two thresholds.

The task error grows at the drift, x = drift t + n: over each noise period x changes by drift * period +
noise * sqrt(period) * (a normal number). tests/sim/blocks compares the variance with that of the running noise.

A path is decided at the first sample at or beyond a barrier. That is later, and less often wrong, than for the
continuous process. So the barrier is moved inwards by 0.5826 noise sqrt(period) (Chernoff 1965, Siegmund 1979); the
mean of the sampled time is then T + period/4.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from airground_drake.model.trigger.bayes import decision_time, error_rate, optimal_threshold
from airground_drake.verify.model.levels import NUMBERS

SEED = 20061
MOST_PERIODS = 1_000_000  # most noise periods of a path; a few hundred are needed with the drifts in use
# -zeta(1/2)/sqrt(2 pi): mean overshoot of a sampled Wiener path beyond a far barrier, in steps of one deviation.
OVERSHOOT = 0.5825971579390107
STEP = 0.2  # standard deviation of x over one noise period as a share of the threshold
DRIFT_STEP = 0.02  # largest mean of x over one noise period as a share of the threshold


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
class PassageSample:
    """Wrong decisions of an experiment, sum and sum of squares of the noise periods to the decision."""

    experiment: PassageExperiment
    wrong: int
    periods: int
    squares: int


def experiments(inputs: dict[str, Any]) -> tuple[PassageExperiment, ...]:
    """Experiments with and without deviation, with other drift and noise, and with (19) as printed."""
    # The last two have the drift at which the Bayes threshold is at u = 1, where both kinds of decision are common and
    # their thresholds differ most clearly.
    drift, noise, c1, c2 = (float(inputs[name]) for name in NUMBERS)
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
def simulate(experiment: PassageExperiment) -> PassageSample:
    """Decide all paths of an experiment."""
    rng = np.random.default_rng(experiment.seed)
    mean, deviation = experiment.drift * experiment.period, experiment.noise * math.sqrt(experiment.period)
    x = np.full(experiment.paths, experiment.deviation)
    wrong, total, squares = 0, 0, 0
    for periods in range(1, MOST_PERIODS + 1):
        x = x + rng.normal(mean, deviation, len(x))
        inside = np.abs(x) < experiment.barrier
        decided = len(x) - int(np.count_nonzero(inside))
        wrong += int(np.count_nonzero(x <= -experiment.barrier))
        total += periods * decided
        squares += periods**2 * decided
        x = x[inside]
        if not len(x):
            return PassageSample(experiment, wrong, total, squares)
    raise ArithmeticError(f"{experiment.name}: {len(x)} paths are undecided after {MOST_PERIODS} noise periods")
