"""THR-DDM: mean decision time and error rate of simulated drift-diffusion paths against (17)-(18).

The task error grows at the drift, x = drift t + n: over each noise period x changes by drift * period +
noise * sqrt(period) * (a normal number). tests/sim/blocks compares the variance with that of the running noise.

A path is decided at the first sample at or beyond a barrier. That is later, and less often wrong, than for the
continuous process. So the barrier is moved inwards by 0.5826 noise sqrt(period) (Chernoff 1965, Siegmund 1979); the
mean of the sampled time is then T + period/4. ERROR_ALLOWANCE and TIME_ALLOWANCE cover the bias that this leaves; tests
compare them with a quadrature of the sampled process. Intervals are simultaneous over all comparisons (Bonferroni):
Clopper-Pearson for error rates, normal for times. The evidence has the counts, from which everything else can be redone
by hand.
"""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.special import betainccinv, betaincinv, ndtri

from airground_drake.model.trigger.bayes import decision_time, error_rate, optimal_threshold
from airground_drake.scenario.schema import Scenario
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.levels import NUMBERS

LEVEL = 0.99
ERROR_ALLOWANCE = 2e-4  # bias of the corrected error rate
TIME_ALLOWANCE = 0.05  # bias of the corrected time, in noise periods
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


# Mean decision time, s, and error rate that are to be compared with the simulation.
Formulas = Callable[[PassageExperiment], tuple[float, float]]


class ThrDdm(ModelClaim):
    id = "THR-DDM"
    summary = "Simulated decisions have the decision time and the error rate of the formulas."
    statement = (
        "Simulated paths of the decision variable, with and without initial deviation, have the mean decision time and"
        " the error rate of the formulas from which the threshold is computed."
    )
    latex = (
        r"\mathbb{E}[\min \{t : |x(t)| \ge \zeta\}] = T_{(17)}, \quad \mathbb{P}[x(t) = -\zeta] = E_{(18)}",
        r"d x = \mu \, d t + \sigma \, d W, \quad x(0) = y_0",
    )
    method = (
        "Monte Carlo with fixed seeds: six experiments, 36000 paths with the increments of the diagram's noise, "
        "barriers corrected for sampling. Supported if all simultaneous 99 % "
        "confidence intervals, widened by the bias that the correction leaves (2e-4 in the error rate, a twentieth of "
        "the noise period in the time), contain the formulas. Tests compare the formulas with PyDDM's values."
    )
    equations = "(15), (17)-(18) with the initial deviation divided by the drift"
    assumptions = (
        "Drift and intensity are those of the threshold rule, in three experiments others; the drift is constant "
        "and there is no leak.",
        "Both thresholds end a path, as in (17)-(18); the trigger (20) has the upper one only.",
        "The noise period is chosen for the experiment (a fifth of the threshold per step), not the scenario's.",
    )
    does_not_establish = (
        "That a UGV's task error follows (15) with a constant drift, or anything about the scenario's own noise, "
        "period or leak. Statistics exclude deviations larger than the intervals, not smaller ones."
    )
    expected = "supported"
    kept = True
    exercised_by = "simulated paths"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        rule = scenario.decision.threshold
        return {name: getattr(rule, name) for name in NUMBERS}

    def check(self, inputs: dict[str, Any]) -> Finding:
        return compare(experiments(inputs), running)


def compare(chosen: tuple[PassageExperiment, ...], formulas: Formulas) -> Finding:
    """The verdict for these formulas: 'supported' if all intervals contain them, else 'refuted'."""
    rows = [row for experiment in chosen for row in _rows(simulate(experiment), formulas(experiment), 2 * len(chosen))]
    worst = min(rows, key=lambda row: float(row["margin"]))
    supported = worst["margin"] >= 0.0
    paths = sum(experiment.paths for experiment in chosen)
    return Finding(
        "supported" if supported else "refuted",
        margin=worst["margin"],
        unit="interval half-widths",
        quantity="what a simulated mean leaves of its confidence interval about the formula",
        where={key: worst[key] for key in ("experiment", "quantity")},
        counterexample=None if supported else worst,
        evidence={"paths": paths, "comparisons": rows, "family_level": LEVEL},
        exercised=paths,
    )


def _rows(sample: PassageSample, formula: tuple[float, float], comparisons: int) -> list[dict[str, Any]]:
    """Compare the mean decision time and the error rate of an experiment with the formula's."""
    experiment, wrong = sample.experiment, sample.wrong
    count, period = experiment.paths, experiment.period
    tail = (1.0 - LEVEL) / comparisons / 2.0
    mean = sample.periods / count
    deviation = math.sqrt((sample.squares - sample.periods * mean) / (count - 1.0) / count)
    half = float(-ndtri(tail)) * deviation + TIME_ALLOWANCE
    time = [(mean - 0.25 + side * half) * period for side in (-1.0, 1.0)]
    low = float(betaincinv(wrong, count - wrong + 1, tail)) if wrong else 0.0
    high = float(betainccinv(wrong + 1, count - wrong, tail)) if wrong < count else 1.0
    rate = wrong / count
    spread = math.sqrt(max(rate * (1.0 - rate), 1.0 / count) / count)
    estimates = (
        ("mean decision time", "s", (mean - 0.25) * period, deviation * period, time, formula[0]),
        ("error rate", "", rate, spread, [low - ERROR_ALLOWANCE, high + ERROR_ALLOWANCE], formula[1]),
    )
    constants = {**asdict(experiment), "noise_period_s": period, "barrier_m": experiment.barrier}
    return [
        {
            "experiment": experiment.name, "quantity": quantity, "unit": unit, "constants": constants,
            "wrong_decisions": wrong, "periods_sum": sample.periods, "periods_sum_of_squares": sample.squares,
            "estimate": estimate, "interval": interval, "formula": value, "z_score": (estimate - value) / error,
            # in half-widths of the interval
            "margin": 2.0 * min(value - interval[0], interval[1] - value) / (interval[1] - interval[0]),
        }
        for quantity, unit, estimate, error, interval, value in estimates
    ]  # fmt: skip
