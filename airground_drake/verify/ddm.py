"""THR-DDM: mean decision time and error rate of simulated drift-diffusion paths against (17)-(18).

Paths come from the project's own systems: RandomSource -> integrated noise -> DecisionVariable, whose UGVs stand
still while their references leave at the drift, so that x = drift t + n. Increments of x over the noise period are
independent, so one long record is cut into paths, one beginning where the one before has ended, until a fixed
number is complete; a fixed number, because the paths that happen to fit into a fixed time are too short.

A path is decided at the first sample at or beyond a barrier, which is later, and less often wrong, than for the
continuous process. The barrier is therefore moved inwards by 0.5826 noise sqrt(period) (Chernoff 1965, Siegmund
1979); the mean of the sampled time is then T + period/4. What this leaves is allowed for by ERROR_ALLOWANCE and
TIME_ALLOWANCE, which the tests check against a quadrature of the sampled process.

Verdict: 'supported' if the simultaneous 99 % confidence intervals (Bonferroni over all comparisons; Clopper-Pearson
for error rates, normal for times), widened by the allowances, all contain the formulas; else 'refuted'.

Certificate `paths.json`: `tail` (probability beyond each end of an interval), its `normal_quantile`, and
`comparisons`, each with the experiment's constants and seed, the numbers of paths and of wrong decisions, sum and sum
of squares of the noise periods to the decision, the interval and the formula's value: from the counts on everything
can be redone by hand.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from pydrake.common import RandomDistribution, RandomGenerator
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput, RandomSource, TrajectorySource
from scipy.stats import beta, norm

from airground_drake.decision.bayes import decision_time, error_rate, optimal_threshold
from airground_drake.diagram import integrated_noise, stack_presets
from airground_drake.nsbc.motion import Motion
from airground_drake.scenarios.schema import Scenario
from airground_drake.systems.decision import DecisionVariable
from airground_drake.verify.verdict import Finding, ModelClaim

SEED = 20061
CHANNELS = 32
OVERSHOOT = 0.5825971579390107
"""-zeta(1/2)/sqrt(2 pi): mean overshoot of a sampled Wiener path beyond a far barrier, in steps of one deviation."""
STEP = 0.2
"""Standard deviation of x over one noise period as a share of the threshold."""
DRIFT_STEP = 0.02
"""Largest mean of x over one noise period as a share of the threshold."""
LEVEL = 0.99
ERROR_ALLOWANCE = 2e-4
"""Bias of the corrected error rate."""
TIME_ALLOWANCE = 0.05
"""Bias of the corrected time, in noise periods."""


@dataclass(frozen=True)
class Experiment:
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

    experiment: Experiment
    wrong: int
    periods: int
    squares: int


Formulas = Callable[[Experiment], tuple[float, float]]
"""Mean decision time, s, and error rate that are to be compared with the simulation."""


class ThrDdm(ModelClaim):
    """THR-DDM."""

    id = "THR-DDM"
    statement = (
        "Simulated paths of the decision variable, with and without initial deviation, have the mean decision time and "
        "the error rate of the formulas that the threshold rests on."
    )
    formula = "E[min t: |x(t)| >= zeta] = T of (17), P[x(t) = -zeta] = E of (18), dx = drift dt + noise dW, x(0) = y0"
    method = (
        "Monte Carlo on the project's Drake systems (random source, integrated noise, decision variable) with a fixed "
        "seed: six experiments, 36000 paths, barriers corrected for sampling. Supported if all simultaneous 99 % "
        "confidence intervals, widened by the bias that the correction leaves (2e-4 in the error rate, a twentieth of "
        "the noise period in the time), contain the formulas. PyDDM's values, where it is installed, are evidence only."
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

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """The numbers of the threshold rule."""
        rule = scenario.decision.threshold
        return {
            "drift_m_s": rule.drift_m_s,
            "noise_m_sqrt_s": rule.noise_m_sqrt_s,
            "c1_1_s": rule.c1_1_s,
            "c2": rule.c2,
        }

    def check(self, inputs: dict[str, Any]) -> Finding:
        """Simulate and compare."""
        return compare(experiments(inputs), running)


def experiments(inputs: dict[str, Any]) -> tuple[Experiment, ...]:
    """At the Bayes threshold with and without deviation, with other drift and noise, and Bayes against printed (19).

    The last two have the drift at which the Bayes threshold is at u = 1, where both kinds of decision are common and
    their thresholds differ most clearly.
    """
    drift, noise, c1, c2 = (float(inputs[name]) for name in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2"))
    zeta = optimal_threshold(drift, noise, c1, c2)
    clear = noise * math.sqrt((math.sinh(1.0) + 1.0) * c1 / c2)
    bayes, printed_zeta = optimal_threshold(clear, noise, c1, c2), optimal_threshold(clear, noise, c2, c1)
    return (
        Experiment("no deviation", drift, noise, zeta, 0.0, 10000, SEED),
        Experiment("deviation ahead", drift, noise, zeta, 0.4 * zeta, 5000, SEED + 1),
        Experiment("deviation behind", drift, noise, zeta, -0.4 * zeta, 5000, SEED + 2),
        Experiment("other drift and noise", 4.0 * noise**2 / zeta, 2.0 * noise, zeta, -0.4 * zeta, 4000, SEED + 3),
        Experiment("Bayes threshold at u = 1", clear, noise, bayes, 0.0, 6000, SEED + 4),
        Experiment("printed threshold instead", clear, noise, printed_zeta, 0.0, 6000, SEED + 5),
    )


def running(experiment: Experiment) -> tuple[float, float]:
    """(17)-(18) as the package computes them."""
    constants = (experiment.zeta, experiment.drift, experiment.noise, experiment.deviation)
    return decision_time(*constants), error_rate(*constants)


@lru_cache(maxsize=16)
def simulate(experiment: Experiment) -> Sample:
    """Decide `experiment.paths` paths, simulated by Drake.

    Raises:
        ArithmeticError: if the record is too short for them, which the margin makes all but impossible.
    """
    expected = (running(experiment)[0] / experiment.period + 1.0) * experiment.paths
    steps = iter(_increments(experiment, math.ceil((1.1 * expected + 1000.0) / CHANNELS)))
    start, barrier = experiment.deviation, experiment.barrier
    wrong, total, squares = 0, 0, 0
    for _ in range(experiment.paths):
        periods, x = _passage(steps, start, barrier)
        wrong += x < 0.0
        total += periods
        squares += periods**2
    return Sample(experiment, wrong, total, squares)


def _passage(steps: Iterator[float], x: float, barrier: float) -> tuple[int, float]:
    """Noise periods until x, m, reaches +-barrier, and where it is then."""
    for periods, step in enumerate(steps, start=1):
        x += step
        if not -barrier < x < barrier:
            return periods, x
    raise ArithmeticError("the record ended within a path")


def _increments(experiment: Experiment, rows: int) -> list[float]:
    """Increments of the decision variable over the noise period, m, (rows * CHANNELS), from a Drake simulation."""
    period, duration = experiment.period, rows * experiment.period
    away = Motion.at_speed(
        np.array([[0.0, 0.0, 0.0], [1.01 * experiment.drift * duration, 0.0, 0.0]]), experiment.drift
    )
    builder = DiagramBuilder()
    source = builder.AddNamedSystem("noise_source", RandomSource(RandomDistribution.kGaussian, CHANNELS, period))
    noise = builder.AddNamedSystem("decision_noise", integrated_noise(CHANNELS, experiment.noise, 0.0, period))
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


def compare(chosen: tuple[Experiment, ...], formulas: Formulas) -> Finding:
    """The verdict of the module's docstring for these formulas."""
    rows = [row for each in chosen for row in _rows(simulate(each), formulas(each), 2 * len(chosen))]
    worst = min(rows, key=lambda row: float(row["margin"]))
    supported = worst["margin"] >= 0.0
    evidence = {
        "paths": sum(each.paths for each in chosen),
        "comparisons": rows,
        "family_level": LEVEL,
        "pyddm": {each.name: _pyddm(each) for each in chosen},
    }
    tail = (1.0 - LEVEL) / len(rows) / 2.0
    certificate = {"channels": CHANNELS, "tail": tail, "normal_quantile": float(norm.isf(tail)), "comparisons": rows}
    return Finding(
        "supported" if supported else "refuted",
        margin=worst["margin"],
        unit="interval half-widths",
        where={key: worst[key] for key in ("experiment", "quantity")},
        counterexample=None if supported else worst,
        evidence=evidence,
        certificates={"paths.json": json.dumps(certificate, indent=1) + "\n"},
    )


def _rows(sample: Sample, formula: tuple[float, float], comparisons: int) -> list[dict[str, Any]]:
    """Both comparisons of an experiment: estimate, interval, formula, z-score and margin."""
    each, count, tail = sample.experiment, sample.experiment.paths, (1.0 - LEVEL) / comparisons / 2.0
    period = each.period
    mean = sample.periods / count
    deviation = math.sqrt((sample.squares - sample.periods * mean) / (count - 1.0) / count)
    half = float(norm.isf(tail)) * deviation + TIME_ALLOWANCE
    time = [(mean - 0.25 + side * half) * period for side in (-1.0, 1.0)]
    low = float(beta.ppf(tail, sample.wrong, count - sample.wrong + 1)) if sample.wrong else 0.0
    high = float(beta.isf(tail, sample.wrong + 1, count - sample.wrong)) if sample.wrong < count else 1.0
    rate = sample.wrong / count
    spread = math.sqrt(max(rate * (1.0 - rate), 1.0 / count) / count)
    found = (
        ("mean decision time", "s", (mean - 0.25) * period, deviation * period, time, formula[0]),
        ("error rate", "", rate, spread, [low - ERROR_ALLOWANCE, high + ERROR_ALLOWANCE], formula[1]),
    )
    return [
        {
            "experiment": each.name,
            "quantity": quantity,
            "unit": unit,
            "constants": {**asdict(each), "noise_period_s": period, "barrier_m": each.barrier},
            "wrong_decisions": sample.wrong,
            "periods_sum": sample.periods,
            "periods_sum_of_squares": sample.squares,
            "estimate": estimate,
            "interval": interval,
            "formula": value,
            "z_score": (estimate - value) / error,
            "margin": 2.0 * min(value - interval[0], interval[1] - value) / (interval[1] - interval[0]),
        }
        for quantity, unit, estimate, error, interval, value in found
    ]


def _pyddm(experiment: Experiment) -> dict[str, float] | str:
    """PyDDM's mean time over all decisions, s, and error rate, computed in units of zeta and zeta^2/noise^2."""
    try:
        import pyddm
    except ImportError:
        return "not installed"
    unit = (experiment.zeta / experiment.noise) ** 2
    model = pyddm.gddm(
        drift=experiment.drift * unit / experiment.zeta,
        noise=1.0,
        bound=1.0,
        starting_position=experiment.deviation / experiment.zeta,
        T_dur=20.0,
        mixture_coef=0.0,
    )
    solution = model.solve()
    density = solution.pdf("correct") + solution.pdf("error")
    return {
        "decision_time_s": float(density @ solution.t_domain) * float(model.dt) * unit,
        "error_rate": float(solution.prob("error")),
    }


def printed(experiment: Experiment, deviation_s: float) -> tuple[float, float]:
    """(17)-(18) as printed, where the initial deviation is a time, s."""
    zeta, drift, noise = experiment.zeta, experiment.drift, experiment.noise
    u = 2.0 * zeta * drift / noise**2
    exponent = min(-2.0 * deviation_s * drift**2 / noise**2, 700.0)  # more than the largest float
    bias = (1.0 - math.exp(exponent)) / (2.0 * math.sinh(u))
    time = zeta / drift * math.tanh(u / 2.0) + 2.0 * zeta / drift * bias - deviation_s
    return time, 1.0 / (1.0 + math.exp(u)) - bias


def _wrong_sign(experiment: Experiment) -> tuple[float, float]:
    """(18) with the deviation towards the other threshold."""
    time, _ = running(experiment)
    return time, error_rate(experiment.zeta, experiment.drift, experiment.noise, -experiment.deviation)


def _variance(experiment: Experiment) -> tuple[float, float]:
    """The noise's variance per second in place of its intensity."""
    return running(replace(experiment, noise=experiment.noise**2))


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
    thresholds = {
        "drift_m_s": chosen[-1].drift,
        "bayes_threshold_m": chosen[-2].zeta,
        "printed_threshold_m": chosen[-1].zeta,
    }
    refuted = z > float(norm.isf(1.0 - LEVEL))
    return Finding(
        "refuted" if refuted else "inconclusive",
        counterexample={**thresholds, **numbers} if refuted else None,
        evidence=numbers,
    )


MUTANTS: dict[str, Callable[[dict[str, Any]], Finding]] = {
    "THR-DDM: initial deviation in m where (17)-(18) have s": lambda inputs: compare(
        experiments(inputs), lambda each: printed(each, each.deviation)
    ),
    "THR-DDM: (18) with the wrong sign of the deviation": lambda inputs: compare(experiments(inputs), _wrong_sign),
    "THR-DDM: noise^2 in place of the noise": lambda inputs: compare(experiments(inputs), _variance),
    "THR-DDM: the threshold with c1/c2 minimises the risk": _printed_is_better,
}
"""Broken variants by name: each must be refuted by the simulated paths (the last where c1 and c2 differ enough)."""
