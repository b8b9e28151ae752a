"""Broken variants of the threshold and of the formulas that it comes from."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from scipy.optimize import brentq
from scipy.special import ndtri

from airground_drake.decision.bayes import optimal_threshold
from airground_drake.verify.claim import Mutant
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.threshold.expressions import factorisation
from airground_drake.verify.model.threshold.first_passages import (
    PassageExperiment,
    experiments,
    running,
    simulate,
)
from airground_drake.verify.model.threshold.thr_ddm import ERROR_ALLOWANCE, LEVEL, TIME_ALLOWANCE, compare
from airground_drake.verify.model.threshold.thr_opt import judge_optimum
from airground_drake.verify.model.threshold.thr_root import judge_root


def _swapped(drift: float, noise: float, c1: float, c2: float) -> float:
    """(19) as printed."""
    return optimal_threshold(drift, noise, c2, c1)


def _subtracted(drift: float, noise: float, c1: float, c2: float) -> float:
    """(19) with sinh u - u."""
    level = c2 / c1 * drift**2 / noise**2
    upper = 2.0 + 2.0 * math.asinh(level) + level
    return float(brentq(lambda u: math.sinh(u) - u - level, 0.0, upper)) * noise**2 / (2.0 * drift)


def printed(experiment: PassageExperiment, deviation_s: float) -> tuple[float, float]:
    """(17)-(18) as printed, where the initial deviation is a time, s."""
    zeta = experiment.zeta
    drift = experiment.drift
    noise = experiment.noise
    u = 2.0 * zeta * drift / noise**2
    exponent = min(-2.0 * deviation_s * drift**2 / noise**2, 700.0)  # more than the largest float
    bias = (1.0 - math.exp(exponent)) / (2.0 * math.sinh(u))
    time = zeta / drift * math.tanh(u / 2.0) + 2.0 * zeta / drift * bias - deviation_s
    return time, 1.0 / (1.0 + math.exp(u)) - bias


def _printed_is_better(inputs: dict[str, Any]) -> Finding:
    """That the threshold of (19) as printed has no larger Bayes risk than that with c2/c1: one-sided, same level."""
    c1, c2 = float(inputs["c1_1_s"]), float(inputs["c2"])
    chosen = experiments(inputs)
    risks, variances = [], []
    for sample in (simulate(chosen[-2]), simulate(chosen[-1])):
        count, period = sample.experiment.paths, sample.experiment.period
        mean, rate = sample.periods / count, sample.wrong / count
        risks.append(c1 * (mean - 0.25) * period + c2 * rate)
        # standard deviation of a sum is at most the sum of standard deviations, whatever the correlation
        time = math.sqrt(max(sample.squares / count - mean**2, 0.0)) * c1 * period
        variances.append((time + c2 * math.sqrt(rate * (1.0 - rate))) ** 2 / count)
    allowance = c2 * 2.0 * ERROR_ALLOWANCE + c1 * TIME_ALLOWANCE * (chosen[-2].period + chosen[-1].period)
    z = (risks[1] - risks[0] - allowance) / math.sqrt(sum(variances))
    numbers = {"risk_at_the_bayes_threshold": risks[0], "risk_at_the_printed_threshold": risks[1], "z_score": z}
    if z <= float(ndtri(LEVEL)):
        return Finding("inconclusive", evidence=numbers)
    thresholds = {"bayes_threshold_m": chosen[-2].zeta, "printed_threshold_m": chosen[-1].zeta}
    found = {"drift_m_s": chosen[-1].drift, **thresholds, **numbers}
    return Finding("refuted", counterexample=found, evidence=numbers)


def _deviation_in_metres(inputs: dict[str, Any]) -> Finding:
    return compare(experiments(inputs), lambda each: printed(each, each.deviation))


def _wrong_sign_of_the_deviation(inputs: dict[str, Any]) -> Finding:
    def formulas(each: PassageExperiment) -> tuple[float, float]:
        return running(each)[0], running(replace(each, deviation=-each.deviation))[1]

    return compare(experiments(inputs), formulas)


def _noise_squared(inputs: dict[str, Any]) -> Finding:
    return compare(experiments(inputs), lambda each: running(replace(each, noise=each.noise**2)))


def _with_a_wrong_sign(inputs: dict[str, Any]) -> Finding:
    return judge_optimum(inputs, optimal_threshold, factorisation(sign="-"))


MUTANTS: tuple[Mutant, ...] = (
    Mutant("THR-ROOT", "the code solves (19) as printed, c1/c2", lambda inputs: judge_root(inputs, _swapped)),
    Mutant("THR-ROOT", "the code solves (19) with sinh u - u", lambda inputs: judge_root(inputs, _subtracted)),
    Mutant(
        "THR-ROOT", "an enclosure that misses the root", lambda inputs: judge_root(inputs, optimal_threshold, shift=2),
    ),
    Mutant("THR-OPT", "the threshold of (19) as printed, c1/c2", lambda inputs: judge_optimum(inputs, _swapped)),
    Mutant("THR-OPT", "the threshold with sinh u - u", lambda inputs: judge_optimum(inputs, _subtracted)),
    Mutant("THR-OPT", "dB/dzeta with a wrong sign", _with_a_wrong_sign),
    Mutant(
        "THR-OPT", "(19) with an initial deviation",
        lambda inputs: judge_optimum(inputs, optimal_threshold, stationary_with_deviation=True),
    ),
    Mutant("THR-DDM", "initial deviation in m where (17)-(18) have s", _deviation_in_metres),
    Mutant("THR-DDM", "(18) with the wrong sign of the deviation", _wrong_sign_of_the_deviation),
    Mutant("THR-DDM", "noise^2 in place of the noise", _noise_squared),
    Mutant("THR-DDM", "the threshold with c1/c2 minimises the risk", _printed_is_better),
)  # fmt: skip
"""Broken variants: each must be refuted (those with c1/c2 cannot be where c1 = c2)."""
