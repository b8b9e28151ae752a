"""ZENO-REFINE: as the noise step is refined, the bare threshold's event count diverges and the automaton's does not.

Paths and counts are those of `refined_paths.py`. The bare count grows like dt^(-1/2) with a relative correction of
order sqrt(dt). A level crossing is seen on a grid with a delay of 0.58 s sqrt(dt) (Chernoff 1965, Siegmund 1979), so
the correction of the automaton's count is of order sqrt(dt), too. Both counts are therefore fitted by

    ln(mean count) = intercept + exponent ln(dt) + correction sqrt(dt)        (least squares over the dt)

The interval of the exponent is the percentile bootstrap over paths, which are independent (resampling weights:
numpy's default_rng([SEED, PATHS]).multinomial).

The rule was fixed beforehand. 'supported': see the claim's `method`; the bias is that of the fit to the theoretical
counts. 'inconclusive': an interval is wider than 1/5, or only the bare counts are too far from their expectation at
some dt. Else 'refuted'. The margin is the smallest distance of an interval's end from breaking the rule.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.statuses import Status
from airground_drake.scenario.schema import Scenario
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Chart, Evidence, Finding
from airground_drake.verify.model.levels import levels_of
from airground_drake.verify.model.refined_paths import (
    HALVINGS,
    PATHS,
    SEED,
    SERIES,
    Refinement,
    counts,
    expected_bare,
    experiment,
)

LEVEL = 0.99
RESAMPLES = 4000
DIVERGES_BELOW = -0.25
FLAT_WITHIN = 0.1
STANDARD_ERRORS = 5.0
FEWEST = 0.05  # smaller mean counts are drawn as this one: the axis is logarithmic
ROUNDING = 1e-9  # exponents are equal within this: the fit to equal counts gives about 1e-15


@dataclass(frozen=True)
class Counted(Evidence):
    """Triggers in a path, a number for each dt: their mean, its standard error, the largest."""

    mean: list[float]
    standard_error: list[float]
    largest: list[float]


@dataclass(frozen=True)
class Fit(Evidence):
    """The curve exp(intercept + correction sqrt(dt)) dt^exponent, and its values at each dt."""

    exponent: float
    interval: list[float]
    intercept: float
    correction: float
    at_dt: list[float]


@dataclass(frozen=True)
class Series(Evidence):
    """The evidence: everything that the figure needs."""

    # `dt_s` are the noise steps, and `expected_bare` is the theory of the bare mean at each. `counts` has a text for
    # each path with its triggers at each dt. `bias` is that of the bare exponent. `most_triggers` is duration/dwell +
    # 1; None without a dwell. `level` is that of the intervals.

    dt_s: list[float]
    bare: Counted
    automaton: Counted
    automaton_at_scenario_noise: Counted
    expected_bare: list[float]
    counts: dict[str, list[str]]
    fit: dict[str, Fit]
    bias: float
    most_triggers: int | None
    duration_s: float
    noise_m_sqrt_s: float
    own_noise_m_sqrt_s: float
    leak_1_s: float
    paths: int
    seed: int
    level: float


class ZenoRefine(ModelClaim):
    id = "ZENO-REFINE"
    expected = "supported"
    summary = "With ever finer noise a bare threshold triggers ever more often; the trigger in use does not."
    statement = (
        "As the step of the decision noise is refined, the number of events of the bare threshold grows without bound, "
        "like one over the square root of the step; that of the trigger in use tends to a limit."
    )
    latex = (
        r"\mathbb{E}[N_{\text{bare}}] \sim \Delta t^{p}, \; p = -\frac{1}{2}; \quad "
        r"\mathbb{E}[N_{\text{automaton}}] \sim \Delta t^{0}, \quad N_{\text{automaton}} \le "
        r"\frac{T}{\tau_{\min}} + 1",
    )
    method = (
        f"{PATHS} Wiener paths with the task error held at the threshold, each at {HALVINGS + 1} noise steps that "
        f"differ by a factor of {2**HALVINGS} in all; triggers counted exactly on the piecewise linear paths by the "
        "running `Trigger`. Exponents by least squares with a term for the finite step, ln(mean) = c + p ln(dt) + "
        "b sqrt(dt); "
        "99 % intervals by bootstrap over the paths. Supported if the bare exponent's interval, widened by the known "
        "bias of the fit, contains -1/2 and is below -1/4, the automaton's contains 0 and is within 1/10 of it, and no "
        "path exceeds the bound. The bare counts must also be within 5 standard errors of their exact expectation."
    )
    equations = "(15), (20)"
    assumptions = (
        "Noise is linear between its samples, as in the simulation.",
        "The task error stays at the threshold, where the noise decides. If the scenario's noise does not cross the "
        "hysteresis within a dwell, louder noise that does is used; the bare count is the same at any intensity.",
    )
    does_not_establish = (
        "A proof of divergence or of the limit (ZENO-PROOF proves the bound for the automaton), or how many events a "
        "run of the scenario has: its task error passes the threshold, it does not stay there (ZENO-TRACE counts them)."
    )

    record = Series
    kept = True
    exercised_by = "simulated paths, each at every noise step"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        decision = scenario.decision
        return {
            **levels_of(scenario),
            "noise_m_sqrt_s": float(decision.noise_m_sqrt_s),
            "leak_1_s": float(decision.leak_1_s),
            "noise_period_s": float(decision.noise_period_s),
            "duration_s": float(scenario.duration_s),
        }

    def check(self, inputs: dict[str, Any]) -> Finding:
        return judge_experiment(experiment(inputs))


def series(setting: Refinement, triggers: dict[str, Array]) -> Series:
    """The evidence, from the counts of an experiment."""
    dt, dwell = np.array(setting.dt_s), setting.trigger.dwell
    expected = np.array([expected_bare(setting, step) for step in setting.dt_s])
    rng = np.random.default_rng([SEED, PATHS])
    weights = rng.multinomial(PATHS, np.full(PATHS, 1.0 / PATHS), RESAMPLES) / PATHS
    fits = dict[str, Fit]()
    for name in ("bare", "automaton"):
        intercept, exponent, correction = _fit(dt, triggers[name].mean(axis=0)).tolist()
        resampled = _fit(dt, weights @ triggers[name])[1]
        interval = np.quantile(resampled, [(1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0]).tolist()
        at_dt = (np.exp(intercept + correction * np.sqrt(dt)) * dt**exponent).tolist()
        fits[name] = Fit(exponent, interval, intercept, correction, at_dt)
    return Series(
        dt_s=dt.tolist(),
        **{name: _counted(triggers[name]) for name in SERIES},
        expected_bare=expected.tolist(),
        counts={name: [" ".join(f"{n:.0f}" for n in row) for row in values] for name, values in triggers.items()},
        fit=fits,
        bias=float(_fit(dt, expected)[1]) + 0.5,
        most_triggers=int(setting.duration_s / dwell + 1e-9) + 1 if dwell > 0.0 else None,
        duration_s=setting.duration_s,
        noise_m_sqrt_s=setting.noise_m_sqrt_s,
        own_noise_m_sqrt_s=setting.own_noise_m_sqrt_s,
        leak_1_s=setting.leak_1_s,
        paths=PATHS,
        seed=SEED,
        level=LEVEL,
    )


def _counted(values: Array) -> Counted:
    """Summarise triggers by path and dt."""
    error = values.std(axis=0, ddof=1) / math.sqrt(PATHS)
    return Counted(values.mean(axis=0).tolist(), error.tolist(), values.max(axis=0).tolist())


def _fit(dt: Array, mean: Array) -> Array:
    """Intercept, exponent and correction of the module docstring, (3,) or (3, m) for means (dt,) or (m, dt)."""
    design = np.column_stack([np.ones_like(dt), np.log(dt), np.sqrt(dt)])
    return np.linalg.lstsq(design, np.log(mean).T, rcond=None)[0]


def judge_experiment(setting: Refinement) -> Finding:
    """The finding of an experiment by the rule of the module docstring."""
    triggers = counts(setting)
    evidence = series(setting, triggers)
    bare, ours = evidence.fit["bare"], evidence.fit["automaton"]
    (low, high), (ours_low, ours_high) = bare.interval, ours.interval
    bias = abs(evidence.bias)
    slack = {
        "bare exponent: -1/2 is not below its interval": -0.5 - (low - bias),
        "bare exponent: -1/2 is not above its interval": high + bias + 0.5,
        "bare exponent: well below 0": DIVERGES_BELOW - high,
        "automaton's exponent: 0 is not below its interval": -ours_low,
        "automaton's exponent: 0 is not above its interval": ours_high,
        "automaton's exponent: close to 0": FLAT_WITHIN - max(-ours_low, ours_high),
    }
    condition = min(slack, key=lambda name: slack[name])
    off = np.abs(np.array(evidence.bare.mean) - evidence.expected_bare)
    most, largest = evidence.most_triggers, max(evidence.automaton.largest)
    status: Status = "supported"
    broken: dict[str, Any] | None = None
    if most is not None and largest > most:
        status = "refuted"
        i, j = (int(index) for index in np.argwhere(triggers["automaton"] == largest)[0])
        what = "more triggers than the dwell admits"
        broken = {"what": what, "path": i, "dt_s": setting.dt_s[j], "triggers": largest}
    elif max(high - low, ours_high - ours_low) > 2.0 * FLAT_WITHIN:
        status = "inconclusive"
    elif slack[condition] < -ROUNDING:
        status = "refuted"
        fit, counted = (bare, evidence.bare) if condition.startswith("bare") else (ours, evidence.automaton)
        broken = {"what": f"not so: {condition}", "exponent": fit.exponent, "interval": fit.interval}
        broken |= {"dt_s": evidence.dt_s, "mean": counted.mean}
    elif (off > STANDARD_ERRORS * np.array(evidence.bare.standard_error)).any():
        status = "inconclusive"
    return Finding(
        status,
        margin=slack[condition],
        where={"condition": condition},
        counterexample=broken,
        evidence=evidence,
        quantity="what the confidence interval of an exponent, or a count, leaves of the condition",
        exercised=PATHS,
        figure=_chart(evidence),
    )


def _chart(evidence: Series) -> Chart:
    """Triggers against the noise step, of the bare threshold and of the automaton."""
    counts = {
        "bare threshold": evidence.bare.mean,
        "bare, theory": evidence.expected_bare,
        "automaton": evidence.automaton.mean,
    }
    exponents = (
        f"{name}: exponent {fit.exponent:.3f}, {100 * evidence.level:g} % interval "
        f"[{fit.interval[0]:.3f}, {fit.interval[1]:.3f}]"
        for name, fit in (("Bare threshold", evidence.fit["bare"]), ("automaton", evidence.fit["automaton"]))
    )
    return Chart(
        "Triggers under refinement of the noise step",
        "noise step, s",
        "triggers per path",
        {name: (evidence.dt_s, np.maximum(count, FEWEST)) for name, count in counts.items()},
        log="xy",
        caption=f"The task error stays at the threshold; means of {evidence.paths} paths of {evidence.duration_s:.3g} "
        "s. With finer noise the bare threshold triggers without bound, like one over the square root of the step; the "
        f"automaton does not. {'; '.join(exponents)}.",
    )
