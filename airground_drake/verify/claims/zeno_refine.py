"""ZENO-REFINE: as the noise step is refined, the bare threshold's event count diverges and the automaton's does not.

Paths are x = zeta + n: the task error stays at the threshold, and n is the diagram's integrated noise, dn = -leak n dt
+ s dW by Euler-Maruyama on the grid dt and linear in between. Every dt uses the same Wiener paths (increments summed).
n(0) is a Wiener path after one coarse step, so no path starts exactly at the threshold. The running `Trigger` counts
triggers exactly on the piecewise linear path.

Theory of the bare count: x rises through zeta in one step with probability arccos(rho_k) / (2 pi), rho_k being the
correlation of n at the step's ends (both are normal with mean 0), and starts above it with probability 1/2. So the
expected count is 1/2 + sum_k arccos(rho_k) / (2 pi), k = 0, ..., K - 1, K = duration/dt, whatever s is. Without leak
rho_k = sqrt((c + k)/(c + k + 1)), c = (coarsest dt)/dt, arccos(rho_k) = arctan(1/sqrt(c + k)), and the sum is
(sqrt(c + K) - sqrt(c))/pi + O(1): dt^(-1/2) with a relative correction of order sqrt(dt).

The intensity s is that of the scenario, but at least (zeta - release) / sqrt(dwell), which crosses the hysteresis
within a dwell: the automaton must have something to do. It is also counted at the scenario's own intensity.

A level crossing is seen on a grid with a delay of 0.58 s sqrt(dt) (Chernoff 1965, Siegmund 1979), so
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
from airground_drake.model.trigger.automaton import Mode, Trigger
from airground_drake.scenario.schema import Scenario
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Chart, Finding
from airground_drake.verify.model.levels import levels_of, trigger_of

LEVEL = 0.99
RESAMPLES = 4000
DIVERGES_BELOW = -0.25
FLAT_WITHIN = 0.1
STANDARD_ERRORS = 5.0
FEWEST = 0.05  # smaller mean counts are drawn as this one: the axis is logarithmic
ROUNDING = 1e-9  # exponents are equal within this: the fit to equal counts gives about 1e-15
SEED = 5
PATHS = 96
SERIES = ("bare", "automaton", "automaton_at_scenario_noise")
HALVINGS = 8  # dt is halved this often: a factor of 256
COARSE_STEPS = (64, 640)  # fewest and most steps of the coarsest grid; the first dt or the duration is cut down to that
DWELL_STEPS = 10  # fewest steps of the coarsest grid in a dwell (in 1 s without one): the correction must be small


@dataclass(frozen=True)
class Refinement:
    """Constants of the experiment."""

    trigger: Trigger  # the automaton, the scenario's or a mutant
    noise_m_sqrt_s: float  # intensity
    own_noise_m_sqrt_s: float  # the scenario's intensity
    leak_1_s: float
    duration_s: float  # of a path
    dt_s: tuple[float, ...]  # noise steps, coarsest first, each half the one before


def experiment(inputs: dict[str, Any]) -> Refinement:
    trigger = trigger_of(inputs)
    fewest, most = COARSE_STEPS
    scale = trigger.dwell or 1.0
    coarse = min(inputs["noise_period_s"], inputs["duration_s"] / fewest, scale / DWELL_STEPS)
    steps = min(int(inputs["duration_s"] / coarse + 1e-9), most)
    own = inputs["noise_m_sqrt_s"]
    intensity = max(own, (trigger.zeta - trigger.release) / math.sqrt(scale)) or 1.0
    dts = tuple(coarse / 2**k for k in range(HALVINGS + 1))
    return Refinement(trigger, intensity, own, inputs["leak_1_s"], steps * coarse, dts)


def path(setting: Refinement, index: int) -> list[Array]:
    """x - zeta at the grid points of every dt, m, for one path of unit intensity."""
    coarse = setting.dt_s[0]
    steps = [round(setting.duration_s / dt) for dt in setting.dt_s]
    rng = np.random.default_rng([SEED, index])
    start = math.sqrt(coarse) * rng.standard_normal()
    increments = math.sqrt(setting.dt_s[-1]) * rng.standard_normal(steps[-1])
    paths = []
    for dt, count in zip(setting.dt_s, steps, strict=True):
        summed = increments.reshape(count, -1).sum(axis=1)
        paths.append(leaky_sum(1.0 - setting.leak_1_s * dt, np.concatenate([[start], summed])))
    return paths


def triggers(trigger: Trigger, x: Array, dt: float) -> list[float]:
    """Times, s, of the running automaton's triggers on the linear path through x, m, at 0, dt, 2 dt, ..., s."""
    # A touch from below is a rise. Where the levels are one, a touch from above is no fall: x >= zeta all the time.
    above, below = x - trigger.zeta, trigger.release - x
    rises = np.flatnonzero(above[1:] >= 0.0)  # segments at whose end x is at or above zeta
    falls = np.flatnonzero(below[1:] >= 0.0 if trigger.release < trigger.zeta else below[1:] > 0.0)
    state = trigger.start(0.0, float(x[0]))
    t = 0.0
    segment = 0
    end = (len(x) - 1) * dt
    times = [0.0] if state.triggers else []
    while True:
        if state.mode is Mode.REFRACTORY:
            t = max(t, trigger.dwell_end(state))
            if t > end:
                return times
            segment = min(int(t / dt), len(x) - 2)
            now = x[segment] + (x[segment + 1] - x[segment]) * (t / dt - segment)
            state = trigger.step(state, t, float(now))
        else:
            supervising = state.mode is Mode.SUPERVISING
            ends, height = (rises, above) if supervising else (falls, below)
            i = int(np.searchsorted(ends, segment))
            if i == len(ends):
                return times
            segment = int(ends[i])
            t = max(t, _crossing(height, segment, dt))
            state = trigger.step(state, t, trigger.zeta if supervising else -math.inf)
        if state.triggers > len(times):
            times.append(t)


def _crossing(height: Array, segment: int, dt: float) -> float:
    """Time, s, at which a piecewise linear signal is 0 in a segment at whose end it is not negative."""
    before, after = height[segment], height[segment + 1]
    return float((segment + before / (before - after)) * dt) if before < 0.0 else float(segment * dt)


def leaky_sum(keep: float, added: Array) -> Array:
    """y[k] = keep * y[k-1] + added[k] from y[-1] = 0."""
    from scipy.signal import lfilter  # takes longer to import than to read a finding that was kept

    summed: Array = lfilter([1.0], [1.0, -keep], added)
    return summed


def expected_bare(setting: Refinement, dt: float) -> float:
    """Expected number of triggers of the bare threshold, exact (module docstring)."""
    count, keep = round(setting.duration_s / dt), 1.0 - setting.leak_1_s * dt
    variance = leaky_sum(keep * keep, np.concatenate([[setting.dt_s[0]], np.full(count, dt)]))
    rho = keep * np.sqrt(variance[:-1] / variance[1:])
    return 0.5 + float(np.arccos(np.minimum(rho, 1.0)).sum()) / (2.0 * math.pi)


def counts(setting: Refinement) -> dict[str, Array]:
    """Triggers by path and dt, (PATHS, dt): bare threshold, automaton, automaton at the scenario's own noise."""
    trigger = setting.trigger
    triggered = {name: np.zeros((PATHS, len(setting.dt_s))) for name in SERIES}
    for i in range(PATHS):
        for j, (dt, unit) in enumerate(zip(setting.dt_s, path(setting, i), strict=True)):
            above = unit >= 0.0
            # the bare threshold has no memory: it triggers at the start, if above, and at every rise
            triggered["bare"][i, j] = above[0] + np.count_nonzero(above[1:] & ~above[:-1])
            for name, noise in zip(SERIES[1:], (setting.noise_m_sqrt_s, setting.own_noise_m_sqrt_s), strict=True):
                triggered[name][i, j] = len(triggers(trigger, trigger.zeta + noise * unit, dt))
    return triggered


class ZenoRefine(ModelClaim):
    id = "ZENO-REFINE"
    expected = "supported"
    summary = "As the noise step shrinks, a bare threshold triggers more and more often; the trigger in use does not."
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
        f"The running `Trigger` counts triggers exactly on {PATHS} piecewise linear Wiener paths with the task error "
        f"held at the threshold, at {HALVINGS + 1} noise steps over a factor of {2**HALVINGS}. Exponents are fitted by "
        "least squares with a term for the finite step, ln(mean) = c + p ln(dt) + b sqrt(dt), with 99 % intervals by "
        "bootstrap over the paths. Supported if the bare exponent's interval, widened by the known bias of the fit, "
        "contains -1/2 and is below -1/4; the automaton's contains 0 and is within 1/10 of it; and no path exceeds the "
        "bound. The bare counts must also be within 5 standard errors of their exact expectation."
    )
    equations = "(15), (20)"
    assumptions = (
        "Noise is linear between its samples, as in the simulation.",
        "The task error stays at the threshold, where the noise decides. If the scenario's noise does not cross the "
        "hysteresis within a dwell, a larger noise is used that does; the bare count is the same at any intensity.",
    )
    does_not_establish = (
        "A proof of divergence or of the limit; ZENO-PROOF proves the bound for the automaton. The number of events in "
        "a run, where the task error does not stay at the threshold; ZENO-TRACE counts them."
    )

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


def series(setting: Refinement, triggers: dict[str, Array]) -> dict[str, Any]:
    """The evidence: everything that the figure needs."""
    dt, dwell = np.array(setting.dt_s), setting.trigger.dwell
    expected = np.array([expected_bare(setting, step) for step in setting.dt_s])
    rng = np.random.default_rng([SEED, PATHS])
    weights = rng.multinomial(PATHS, np.full(PATHS, 1.0 / PATHS), RESAMPLES) / PATHS
    fits = dict[str, dict[str, Any]]()
    for name in ("bare", "automaton"):
        intercept, exponent, correction = _fit(dt, triggers[name].mean(axis=0)).tolist()
        resampled = _fit(dt, weights @ triggers[name])[1]
        interval = np.quantile(resampled, [(1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0]).tolist()
        at_dt = (np.exp(intercept + correction * np.sqrt(dt)) * dt**exponent).tolist()
        fits[name] = {
            "exponent": exponent, "interval": interval, "intercept": intercept, "correction": correction,
            "at_dt": at_dt,
        }  # fmt: skip
    return {
        "dt_s": dt.tolist(),
        **{name: _counted(triggers[name]) for name in SERIES},
        "expected_bare": expected.tolist(),
        # a text for each path, with its triggers at each dt
        "counts": {name: [" ".join(f"{n:.0f}" for n in row) for row in values] for name, values in triggers.items()},
        "fit": fits,
        "bias": float(_fit(dt, expected)[1]) + 0.5,  # of the bare exponent
        "most_triggers": int(setting.duration_s / dwell + 1e-9) + 1 if dwell > 0.0 else None,
        "duration_s": setting.duration_s,
        "noise_m_sqrt_s": setting.noise_m_sqrt_s,
        "own_noise_m_sqrt_s": setting.own_noise_m_sqrt_s,
        "leak_1_s": setting.leak_1_s,
        "paths": PATHS,
        "seed": SEED,
        "level": LEVEL,
    }


def _counted(values: Array) -> dict[str, list[float]]:
    """Triggers in a path, a number for each dt."""
    error = values.std(axis=0, ddof=1) / math.sqrt(PATHS)
    mean, largest = values.mean(axis=0).tolist(), values.max(axis=0).tolist()
    return {"mean": mean, "standard_error": error.tolist(), "largest": largest}


def _fit(dt: Array, mean: Array) -> Array:
    """Intercept, exponent and correction of the module docstring, (3,) or (3, m) for means (dt,) or (m, dt)."""
    design = np.column_stack([np.ones_like(dt), np.log(dt), np.sqrt(dt)])
    return np.linalg.lstsq(design, np.log(mean).T, rcond=None)[0]


def judge_experiment(setting: Refinement) -> Finding:
    triggers = counts(setting)
    evidence = series(setting, triggers)
    bare, ours = evidence["fit"]["bare"], evidence["fit"]["automaton"]
    (low, high), (ours_low, ours_high) = bare["interval"], ours["interval"]
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
    off = np.abs(np.array(evidence["bare"]["mean"]) - evidence["expected_bare"])
    most, largest = evidence["most_triggers"], max(evidence["automaton"]["largest"])
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
        fit, counted = (bare, evidence["bare"]) if condition.startswith("bare") else (ours, evidence["automaton"])
        broken = {"what": f"not so: {condition}", "exponent": fit["exponent"], "interval": fit["interval"]}
        broken |= {"dt_s": evidence["dt_s"], "mean": counted["mean"]}
    elif (off > STANDARD_ERRORS * np.array(evidence["bare"]["standard_error"])).any():
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


def _chart(evidence: dict[str, Any]) -> Chart:
    """Triggers against the noise step, of the bare threshold and of the automaton."""
    counts = {
        "bare threshold": evidence["bare"]["mean"],
        "bare, theory": evidence["expected_bare"],
        "automaton": evidence["automaton"]["mean"],
    }
    exponents = (
        f"{name}: exponent {fit['exponent']:.3f}, {100 * LEVEL:g} % interval "
        f"[{fit['interval'][0]:.3f}, {fit['interval'][1]:.3f}]"
        for name, fit in (("Bare threshold", evidence["fit"]["bare"]), ("automaton", evidence["fit"]["automaton"]))
    )
    return Chart(
        "Triggers under refinement of the noise step",
        "noise step, s",
        "triggers per path",
        {name: (evidence["dt_s"], np.maximum(count, FEWEST)) for name, count in counts.items()},
        log="xy",
        caption=f"The task error stays at the threshold; means of {PATHS} paths of {evidence['duration_s']:.3g} "
        "s. With finer noise the bare threshold triggers without bound, like one over the square root of the step; the "
        f"automaton does not. {'; '.join(exponents)}.",
    )
