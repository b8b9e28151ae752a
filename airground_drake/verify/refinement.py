"""ZENO-REFINE: as the noise step is refined, the bare threshold's event count diverges and the automaton's does not.

Paths: x = zeta + n, a task error held at the threshold plus the diagram's integrated noise, dn = -leak n dt + s dW by
Euler-Maruyama on the grid dt and linear in between. The same Wiener paths are used at every dt (increments summed), and
n(0) is that of a Wiener path one coarse step old, so that no path starts exactly at the threshold. Events are
triggers, counted exactly on the piecewise linear path by the running `Trigger`.

Theory of the bare count: x rises through zeta in one step with probability arccos(rho_k) / (2 pi), rho_k being the
correlation of n at the step's ends (both are normal with mean 0), and starts above it with probability 1/2. So the
expected count is 1/2 + sum_k arccos(rho_k) / (2 pi), k = 0, ..., K - 1, K = duration/dt, whatever s is. Without leak
rho_k = sqrt((c + k)/(c + k + 1)), c = (coarsest dt)/dt, arccos(rho_k) = arctan(1/sqrt(c + k)), and the sum is
(sqrt(c + K) - sqrt(c))/pi + O(1): dt^(-1/2) with a relative correction of order sqrt(dt). The delay of a level
crossing that is seen on a grid, 0.58 s sqrt(dt) (Chernoff 1965, Siegmund 1979), makes the correction of the
automaton's count one of order sqrt(dt) as well. Both counts are therefore fitted by

    ln(mean count) = intercept + exponent ln(dt) + correction sqrt(dt)        (least squares over the dt)

and the interval of the exponent is the percentile bootstrap over paths, which are independent (resampling weights:
numpy's default_rng([SEED, PATHS]).multinomial).

Intensity s: that of the scenario, or if that is less what crosses the hysteresis within a dwell,
(zeta - release) / sqrt(dwell), so that the automaton has something to do; it is also counted at the scenario's own.

Verdict, fixed beforehand: 'supported' if the bare exponent's interval, widened by the finite-dt bias (the fit to the
theoretical counts, less -1/2), contains -1/2 and stays below -1/4; the automaton's contains 0 and stays within 1/10 of
it; and no path has more than duration/dwell + 1 triggers. 'inconclusive' if an interval is wider than 1/5, or all that
holds but the bare counts differ from their expectation by more than 5 standard errors at some dt; else 'refuted'.
Margin: the smallest distance of an interval's end from where it would break the rule.

Evidence for the figure: `series`, see there. Certificate `counts.csv`: trigger counts by path and dt, from which means,
standard errors and fits can be redone; the theoretical counts follow from the formula above.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

from airground_drake.decision.trigger import Mode, Trigger
from airground_drake.diagram import make_trigger, threshold
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.verdict import Finding, ModelClaim, Status

Array = npt.NDArray[np.float64]

SEED = 5
PATHS = 96
SERIES = ("bare", "automaton", "automaton_at_scenario_noise")
HALVINGS = 8
"""dt is halved this often: a factor of 256."""
COARSE_STEPS = (64, 640)
"""Fewest and most steps of the coarsest grid; the duration or the first dt is cut down to that."""
DWELL_STEPS = 10
"""Fewest steps of the coarsest grid in a dwell (in 1 s without one): the correction must be small."""
LEVEL = 0.99
RESAMPLES = 4000
DIVERGES_BELOW = -0.25
FLAT_WITHIN = 0.1
STANDARD_ERRORS = 5.0
ROUNDING = 1e-9
"""Exponents are equal within this: the fit to equal counts gives about 1e-15."""


@dataclass(frozen=True)
class Experiment:
    """Constants of the experiment.

    Attributes:
        trigger: the automaton, the scenario's or a mutant.
        noise_m_sqrt_s: intensity.
        own_noise_m_sqrt_s: the scenario's intensity.
        leak_1_s: leak.
        duration_s: of a path.
        dt_s: noise steps, coarsest first, each half the one before.
        smooth: a sine about the threshold in place of the noise.
    """

    trigger: Trigger
    noise_m_sqrt_s: float
    own_noise_m_sqrt_s: float
    leak_1_s: float
    duration_s: float
    dt_s: tuple[float, ...]
    smooth: bool = False


def experiment(inputs: dict[str, Any]) -> Experiment:
    """The experiment for the constants of a scenario."""
    trigger = Trigger(inputs["zeta_m"], inputs["release_m"], inputs["dwell_s"])
    fewest, most = COARSE_STEPS
    scale = trigger.dwell or 1.0
    coarse = min(inputs["noise_period_s"], inputs["duration_s"] / fewest, scale / DWELL_STEPS)
    steps = min(int(inputs["duration_s"] / coarse + 1e-9), most)
    own = inputs["noise_m_sqrt_s"]
    intensity = max(own, (trigger.zeta - trigger.release) / math.sqrt(scale)) or 1.0
    dts = tuple(coarse / 2**k for k in range(HALVINGS + 1))
    return Experiment(trigger, intensity, own, inputs["leak_1_s"], steps * coarse, dts)


def path(setting: Experiment, index: int) -> list[Array]:
    """x - zeta at the grid points of every dt, m, for one path of unit intensity (or the sine)."""
    coarse = setting.dt_s[0]
    steps = [round(setting.duration_s / dt) for dt in setting.dt_s]
    if setting.smooth:
        phase = 2.0 * np.pi * (index + math.sqrt(0.5)) / PATHS
        return [np.sin(2.0 * np.pi * np.linspace(0.0, 10.0, count + 1) + phase) for count in steps]
    rng = np.random.default_rng([SEED, index])
    start = math.sqrt(coarse) * rng.standard_normal()
    increments = math.sqrt(setting.dt_s[-1]) * rng.standard_normal(steps[-1])
    found = []
    for dt, count in zip(setting.dt_s, steps, strict=True):
        summed = increments.reshape(count, -1).sum(axis=1)
        found.append(lfilter([1.0], [1.0, -(1.0 - setting.leak_1_s * dt)], np.concatenate([[start], summed])))
    return found


def triggers(trigger: Trigger, x: Array, dt: float) -> list[float]:
    """Times of the triggers on a piecewise linear path, s, by the running automaton.

    Args:
        trigger: the automaton.
        x: decision variable at 0, dt, 2 dt, ..., m.
        dt: s.
    """
    rises, falls = _crossings(x - trigger.zeta, dt), _crossings(trigger.release - x, dt)
    state, t, end = trigger.start(0.0, float(x[0])), 0.0, (len(x) - 1) * dt
    times = [0.0] if state.triggers else []
    while True:
        if state.mode is Mode.REFRACTORY:
            t = max(t, trigger.dwell_end(state))
            if t > end:
                return times
            k = min(int(t / dt), len(x) - 2)
            state = trigger.recover(state, t, float(x[k] + (x[k + 1] - x[k]) * (t / dt - k)))
        else:
            level = rises if state.mode is Mode.SUPERVISING else falls
            i = int(np.searchsorted(level, t, side="right"))
            if i == len(level):
                return times
            t = float(level[i])
            state = trigger.rise(state, t) if state.mode is Mode.SUPERVISING else trigger.fall(state, t)
        if state.triggers > len(times):
            times.append(t)


def _crossings(height: Array, dt: float) -> Array:
    """Times at which a piecewise linear signal rises to 0 from below."""
    k = np.flatnonzero((height[:-1] < 0.0) & (height[1:] >= 0.0))
    return (k + height[k] / (height[k] - height[k + 1])) * dt


def expected_bare(setting: Experiment, dt: float) -> float:
    """Expected number of triggers of the bare threshold, exact (module docstring)."""
    count, keep = round(setting.duration_s / dt), 1.0 - setting.leak_1_s * dt
    variance = lfilter([1.0], [1.0, -keep * keep], np.concatenate([[setting.dt_s[0]], np.full(count, dt)]))
    rho = keep * np.sqrt(variance[:-1] / variance[1:])
    return 0.5 + float(np.arccos(np.minimum(rho, 1.0)).sum()) / (2.0 * math.pi)


def counts(setting: Experiment) -> dict[str, Array]:
    """Triggers by path and dt, (PATHS, dt): bare threshold, automaton, automaton at the scenario's own noise."""
    trigger = setting.trigger
    found = {name: np.zeros((PATHS, len(setting.dt_s))) for name in SERIES}
    for i in range(PATHS):
        for j, (dt, unit) in enumerate(zip(setting.dt_s, path(setting, i), strict=True)):
            above = unit >= 0.0
            # the bare threshold has no memory: it triggers at the start, if above, and at every rise
            found["bare"][i, j] = above[0] + np.count_nonzero(above[1:] & ~above[:-1])
            for name, noise in zip(SERIES[1:], (setting.noise_m_sqrt_s, setting.own_noise_m_sqrt_s), strict=True):
                found[name][i, j] = len(triggers(trigger, trigger.zeta + noise * unit, dt))
    return found


def series(inputs: dict[str, Any]) -> dict[str, Any]:
    """Everything that the figure needs, for the constants of a scenario (also the finding's evidence).

    Returns:
        `dt_s`: noise steps, s. Under `bare`, `automaton` and `automaton_at_scenario_noise`, one number per dt:
        `mean` and `largest` number of triggers in a path, `standard_error` of the mean. `expected_bare`: theory of
        the bare mean, per dt. `fit`: for `bare` and `automaton`, `exponent`, its `interval`, `intercept` and
        `correction` (the curve exp(intercept + correction sqrt(dt)) dt^exponent), `at_dt`: that curve per dt.
        `bias`: of the bare exponent. `most_triggers`: duration/dwell + 1, None without a dwell. `duration_s`,
        `noise_m_sqrt_s`, `own_noise_m_sqrt_s`, `leak_1_s`, `paths`, `seed`, `level` of the intervals.
    """
    setting = experiment(inputs)
    return _evidence(setting, counts(setting))


def _evidence(setting: Experiment, found: dict[str, Array]) -> dict[str, Any]:
    dt, dwell = np.array(setting.dt_s), setting.trigger.dwell
    expected = np.array([expected_bare(setting, step) for step in setting.dt_s])
    rng = np.random.default_rng([SEED, PATHS])
    weights = rng.multinomial(PATHS, np.full(PATHS, 1.0 / PATHS), RESAMPLES) / PATHS
    fits = {}
    for name in ("bare", "automaton"):
        intercept, exponent, correction = _fit(dt, found[name].mean(axis=0))
        resampled = _fit(dt, weights @ found[name])[1]
        fits[name] = {
            "exponent": float(exponent),
            "interval": np.quantile(resampled, [(1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0]).tolist(),
            "intercept": float(intercept),
            "correction": float(correction),
            "at_dt": (np.exp(intercept + correction * np.sqrt(dt)) * dt**exponent).tolist(),
        }
    return {
        "dt_s": dt.tolist(),
        **{
            name: {
                "mean": values.mean(axis=0).tolist(),
                "standard_error": (values.std(axis=0, ddof=1) / math.sqrt(PATHS)).tolist(),
                "largest": values.max(axis=0).tolist(),
            }
            for name, values in found.items()
        },
        "expected_bare": expected.tolist(),
        "fit": fits,
        "bias": float(_fit(dt, expected)[1]) + 0.5,
        "most_triggers": int(setting.duration_s / dwell + 1e-9) + 1 if dwell > 0.0 else None,
        "duration_s": setting.duration_s,
        "noise_m_sqrt_s": setting.noise_m_sqrt_s,
        "own_noise_m_sqrt_s": setting.own_noise_m_sqrt_s,
        "leak_1_s": setting.leak_1_s,
        "paths": PATHS,
        "seed": SEED,
        "level": LEVEL,
    }


def _fit(dt: Array, mean: Array) -> Array:
    """Intercept, exponent and correction of the module docstring, (3,) or (3, m) for means (dt,) or (m, dt)."""
    design = np.column_stack([np.ones_like(dt), np.log(dt), np.sqrt(dt)])
    return np.linalg.lstsq(design, np.log(mean).T, rcond=None)[0]


class ZenoRefine(ModelClaim):
    """ZENO-REFINE."""

    id = "ZENO-REFINE"
    expected = "supported"
    statement = (
        "As the step of the decision noise is refined, the number of events of the bare threshold grows without bound, "
        "like one over the square root of the step; that of the trigger in use tends to a limit."
    )
    formula = (
        "E[triggers of x >= zeta] ~ dt^p with p = -1/2; E[triggers of the automaton] ~ dt^0, and never more than "
        "duration / min_inter_event_s + 1"
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

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """The running trigger, the noise of (15) and its step, the duration."""
        trigger, decision = make_trigger(scenario, threshold(scenario)), scenario.decision
        return {
            "zeta_m": float(trigger.zeta),
            "release_m": float(trigger.release),
            "dwell_s": float(trigger.dwell),
            "noise_m_sqrt_s": float(decision.noise_m_sqrt_s),
            "leak_1_s": float(decision.leak_1_s),
            "noise_period_s": float(decision.noise_period_s),
            "duration_s": float(scenario.duration_s),
        }

    def check(self, inputs: dict[str, Any]) -> Finding:
        """Run the experiment for these constants."""
        return judge_experiment(experiment(inputs))


def judge_experiment(setting: Experiment) -> Finding:
    """The finding of an experiment by the rule of the module docstring."""
    found = counts(setting)
    evidence = _evidence(setting, found)
    (low, high), (ours_low, ours_high) = (evidence["fit"][name]["interval"] for name in ("bare", "automaton"))
    bias = abs(evidence["bias"])
    slack = {
        "bare exponent: -1/2 is not below its interval": -0.5 - (low - bias),
        "bare exponent: -1/2 is not above its interval": high + bias + 0.5,
        "bare exponent: well below 0": DIVERGES_BELOW - high,
        "automaton's exponent: 0 is not below its interval": -ours_low,
        "automaton's exponent: 0 is not above its interval": ours_high,
        "automaton's exponent: close to 0": FLAT_WITHIN - max(-ours_low, ours_high),
    }
    condition = min(slack, key=lambda name: slack[name])
    spread = np.array(evidence["bare"]["standard_error"])
    off = np.abs(np.array(evidence["bare"]["mean"]) - evidence["expected_bare"])
    most, largest = evidence["most_triggers"], max(evidence["automaton"]["largest"])
    status: Status = "supported"
    broken: dict[str, Any] | None = None
    if most is not None and largest > most:
        status = "refuted"
        i, j = (int(k) for k in np.argwhere(found["automaton"] == largest)[0])
        broken = {
            "what": "more triggers than the dwell admits",
            "path": i,
            "dt_s": setting.dt_s[j],
            "triggers": largest,
        }
    elif max(high - low, ours_high - ours_low) > 2.0 * FLAT_WITHIN:
        status = "inconclusive"
    elif slack[condition] < -ROUNDING:
        status = "refuted"
        which = condition.split("'")[0].split(" ")[0]
        fit = {key: evidence["fit"][which][key] for key in ("exponent", "interval")}
        broken = {"what": f"not so: {condition}", **fit, "dt_s": evidence["dt_s"], "mean": evidence[which]["mean"]}
    elif (off > STANDARD_ERRORS * spread).any():
        status = "inconclusive"
    rows = [
        f"{i},{dt!r}," + ",".join(str(int(found[name][i, j])) for name in SERIES)
        for i in range(PATHS)
        for j, dt in enumerate(setting.dt_s)
    ]
    table = "\n".join([f"path,dt_s,{','.join(SERIES)}", *rows]) + "\n"
    return Finding(status, slack[condition], "", {"condition": condition}, broken, evidence, {"counts.csv": table})


MUTANTS: dict[str, Callable[[dict[str, Any]], Finding]] = {
    "automaton with no hysteresis and no dwell": lambda inputs: judge_experiment(
        replace(experiment(inputs), trigger=Trigger.bare(inputs["zeta_m"]))
    ),
    "a smooth signal instead of noise": lambda inputs: judge_experiment(replace(experiment(inputs), smooth=True)),
}
"""Experiments that must be refuted: the first is not flat, the second does not diverge."""
