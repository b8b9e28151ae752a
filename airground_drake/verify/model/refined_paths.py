"""Paths of the decision variable at the threshold under refinement of the noise step, and the triggers on them.

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
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.model.trigger.automaton import Mode, Trigger
from airground_drake.verify.model.levels import trigger_of

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
    """The experiment for the constants of a scenario."""
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
