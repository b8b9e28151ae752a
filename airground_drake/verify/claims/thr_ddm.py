"""THR-DDM: mean decision time and error rate of simulated drift-diffusion paths against (17)-(18).

The paths are those of `first_passages.py`. ERROR_ALLOWANCE and TIME_ALLOWANCE cover the bias that their correction for
sampling leaves; tests compare them with a quadrature of the sampled process. Intervals are simultaneous over all
comparisons (Bonferroni): Clopper-Pearson for error rates, normal for times. The evidence has the counts, from which
everything else can be redone by hand.
"""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from scipy.special import betainccinv, betaincinv, ndtri

from airground_drake.scenario.schema import Scenario
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Evidence, Finding
from airground_drake.verify.model.first_passages import PassageExperiment, PassageSample, experiments, running, simulate
from airground_drake.verify.model.levels import NUMBERS

LEVEL = 0.99
ERROR_ALLOWANCE = 2e-4  # bias of the corrected error rate
TIME_ALLOWANCE = 0.05  # bias of the corrected time, in noise periods

# Mean decision time, s, and error rate that are to be compared with the simulation.
Formulas = Callable[[PassageExperiment], tuple[float, float]]


@dataclass(frozen=True)
class Comparison(Evidence):
    """A simulated mean, its interval and the formula's value; the margin is in half-widths of the interval."""

    experiment: str
    quantity: str
    unit: str
    constants: dict[str, Any]
    wrong_decisions: int
    periods_sum: int
    periods_sum_of_squares: int
    estimate: float
    interval: list[float]
    formula: float
    z_score: float
    margin: float


@dataclass(frozen=True)
class Comparisons(Evidence):
    """All comparisons, the number of paths and the simultaneous level of the intervals."""

    paths: int
    comparisons: list[Comparison]
    family_level: float


class ThrDdm(ModelClaim):
    id = "THR-DDM"
    summary = "Simulated decisions take as long, and err as often, as the formulas say."
    statement = (
        "Simulated paths of the decision variable, with and without initial deviation, have the mean decision time and "
        "the error rate of the formulas that the threshold rests on."
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
    record = Comparisons
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
    worst = min(rows, key=lambda row: row.margin)
    supported = worst.margin >= 0.0
    paths = sum(experiment.paths for experiment in chosen)
    return Finding(
        "supported" if supported else "refuted",
        margin=worst.margin,
        unit="interval half-widths",
        quantity="what a simulated mean leaves of its confidence interval about the formula",
        where={"experiment": worst.experiment, "quantity": worst.quantity},
        counterexample=None if supported else asdict(worst),
        evidence=Comparisons(paths, rows, LEVEL),
        exercised=paths,
    )


def _rows(sample: PassageSample, formula: tuple[float, float], comparisons: int) -> list[Comparison]:
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
        Comparison(
            experiment=experiment.name, quantity=quantity, unit=unit, constants=constants, wrong_decisions=wrong,
            periods_sum=sample.periods, periods_sum_of_squares=sample.squares, estimate=estimate, interval=interval,
            formula=value, z_score=(estimate - value) / error,
            margin=2.0 * min(value - interval[0], interval[1] - value) / (interval[1] - interval[0]),
        )
        for quantity, unit, estimate, error, interval, value in estimates
    ]  # fmt: skip
