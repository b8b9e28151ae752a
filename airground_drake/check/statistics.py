"""THR-DDM and ZENO-REFINE: what follows from the recorded counts. The paths themselves are not simulated again."""

from __future__ import annotations

import math
from functools import lru_cache, partial
from statistics import NormalDist
from typing import Any, NamedTuple

import numpy as np

from .files import Json
from .rules import SMALL, Array, Found, agrees, close, holds, same
from .scenario import bayes_threshold_m, levels_of

LEVEL = 0.99
FIRST_SEED = 20061
"""Of THR-DDM's first experiment."""
ERROR_ALLOWANCE = 2e-4
"""Bias that the correction for sampling leaves in the error rate."""
TIME_ALLOWANCE = 0.05
"""Bias that it leaves in the decision time, in noise periods."""
OVERSHOOT = 0.5825971579390107
"""Mean overshoot of a sampled Wiener path beyond a far barrier, in standard deviations of a step."""


class Experiment(NamedTuple):
    """Paths of (15) between +-zeta that THR-DDM simulates."""

    name: str
    drift: float
    noise: float
    zeta: float
    deviation: float
    paths: int
    seed: int

    @property
    def period_s(self) -> float:
        """Noise period: a fifth of the threshold per step, but no more than 2 % of it by the drift."""
        return min((0.2 * self.zeta / self.noise) ** 2, 0.02 * self.zeta / self.drift)

    @property
    def constants(self) -> Json:
        """As recorded."""
        barrier = self.zeta - OVERSHOOT * self.noise * math.sqrt(self.period_s)
        return {**self._asdict(), "noise_period_s": self.period_s, "barrier_m": barrier}

    def decision_time_s(self) -> float:
        """(17): T = zeta/drift tanh(u/2) + 2 zeta/drift b - y0/drift, b = (1 - exp(-w))/(2 sinh u)."""
        u, bias = self._u(), self._bias()
        return self.zeta / self.drift * (math.tanh(u / 2.0) + 2.0 * bias) - self.deviation / self.drift

    def error_rate(self) -> float:
        """(18): E = 1/(1 + exp u) - b."""
        return 1.0 / (1.0 + math.exp(self._u())) - self._bias()

    def _u(self) -> float:
        return 2.0 * self.zeta * self.drift / self.noise**2

    def _bias(self) -> float:
        w = 2.0 * self.deviation * self.drift / self.noise**2
        return (1.0 - math.exp(-w)) / (2.0 * math.sinh(self._u()))


def experiments_of(scenario: Json) -> list[Experiment]:
    """The six experiments of THR-DDM for the numbers of the threshold rule."""
    rule = scenario["decision"]["threshold"]
    drift, noise, ratio = float(rule["drift_m_s"]), float(rule["noise_m_sqrt_s"]), rule["c2"] / rule["c1_1_s"]
    zeta = bayes_threshold_m(drift, noise, ratio)
    clear = noise * math.sqrt((math.sinh(1.0) + 1.0) / ratio)  # here the Bayes threshold is at u = 1
    bayes, printed = bayes_threshold_m(clear, noise, ratio), bayes_threshold_m(clear, noise, 1.0 / ratio)
    return [
        Experiment(*given, FIRST_SEED + k)
        for k, given in enumerate(
            (
                ("no deviation", drift, noise, zeta, 0.0, 10000),
                ("deviation ahead", drift, noise, zeta, 0.4 * zeta, 5000),
                ("deviation behind", drift, noise, zeta, -0.4 * zeta, 5000),
                ("other drift and noise", 4.0 * noise**2 / zeta, 2.0 * noise, zeta, -0.4 * zeta, 4000),
                ("Bayes threshold at u = 1", clear, noise, bayes, 0.0, 6000),
                ("printed threshold instead", clear, noise, printed, 0.0, 6000),
            )
        )
    ]


def ddm(claim: Json, scenario: Json) -> Found:
    """THR-DDM: (17)-(18) are in intervals of 99 % for all comparisons together, which follow from the counts."""
    recorded, experiments = claim["evidence"]["comparisons"], experiments_of(scenario)
    same("number of comparisons", len(recorded), 2 * len(experiments))
    tail = (1.0 - LEVEL) / len(recorded) / 2.0
    rows: list[Json] = []
    margins: list[float] = []
    for k, experiment in enumerate(experiments):
        both = recorded[2 * k : 2 * k + 2]
        expected = _comparisons_of(experiment, _counts_of(both, experiment))
        _time_interval(both[0], experiment, expected[0], tail)
        _error_interval(both[1], experiment, both[1]["wrong_decisions"], tail)
        rows += [_established(*each, experiment) for each in zip(both, expected, strict=True)]
        margins += [_margin(row["interval"], ours.formula) for row, ours in zip(both, expected, strict=True)]
    paths = sum(experiment.paths for experiment in experiments)
    status = "supported" if min(margins) >= 0.0 else "refuted"
    found = Found.with_margin(status, min(margins), paths=paths, family_level=LEVEL, comparisons=rows)
    lowest = [row for row, margin in zip(recorded, margins, strict=True) if margin <= min(margins) + SMALL]
    places = [{key: row[key] for key in ("experiment", "quantity")} for row in lowest]
    found = found.judging(partial(_one_of, "where the margin is attained", claim["where"], places), "where")
    shown = lowest if status == "refuted" else [None]
    return found.counted(paths).judging(
        partial(_one_of, "counterexample", claim["counterexample"], shown), "counterexample"
    )


def _one_of(rule: str, recorded: Any, possible: list[Any]) -> None:
    holds(rule, recorded in possible, str(recorded), str(possible))


class Passages(NamedTuple):
    """What came of the paths of an experiment: all that is taken as recorded of it."""

    wrong_decisions: int
    periods_sum: int
    periods_sum_of_squares: int


def _counts_of(both: list[Json], experiment: Experiment) -> Passages:
    """The counts in both rows of an experiment, which are the same, and such as its paths can have."""
    time, error = (Passages(*(row[key] for key in Passages._fields)) for row in both)
    same("counts of an experiment", error._asdict(), time._asdict(), about=experiment.name)
    whole = all(type(count) is int for count in time)
    holds("counts of an experiment are whole numbers", whole, str([*time]), "0, 1, ...", about=experiment.name)
    n, wrong, total, squares = experiment.paths, *time
    holds("wrong decisions", 0 <= wrong <= n, wrong, f"0 to {n}", about=experiment.name)
    holds("sum of periods", total >= n, total, f"at least one in each of {n} paths", about=experiment.name)
    holds("sum of squares", squares * n > total**2, squares, f"more than {total**2 / n}", about=experiment.name)
    return time


class Comparison(NamedTuple):
    """An estimate, its standard deviation, and the value of the formula, by its number in the paper."""

    quantity: str
    unit: str
    estimate: float
    deviation: float
    equation: str
    formula: float


def _comparisons_of(experiment: Experiment, counts: Passages) -> tuple[Comparison, Comparison]:
    """Of the mean decision time, s, and of the error rate; the sampled time is a quarter of a period late."""
    n, wrong, total, squares = experiment.paths, *counts
    time_s = (total / n - 0.25) * experiment.period_s
    spread_s = math.sqrt((squares * n - total**2) / (n * n * (n - 1))) * experiment.period_s
    rate = wrong / n
    spread = math.sqrt(max(rate * (1.0 - rate), 1.0 / n) / n)
    return (
        Comparison("mean decision time", "s", time_s, spread_s, "(17)", experiment.decision_time_s()),
        Comparison("error rate", "", rate, spread, "(18)", experiment.error_rate()),
    )


def _established(row: Json, ours: Comparison, experiment: Experiment) -> Json:
    """A recorded comparison, all but its counts: it follows from them, and has nothing besides.

    Its interval is right already; what depends on that and on the formula's value is made of the recorded ones.
    """
    about = f"{experiment.name}, {ours.quantity}"
    same("experiment", row["experiment"], experiment.name, about=about)
    same("quantities", [row["quantity"], row["unit"]], [ours.quantity, ours.unit], about=about)
    same("constants of an experiment", sorted(row["constants"]), sorted(experiment.constants), about=about)
    agrees("constants of an experiment", row["constants"], experiment.constants, within=SMALL, about=about)
    agrees("estimate", row["estimate"], ours.estimate, within=SMALL, about=about)
    close(ours.equation, row["formula"], ours.formula, within=SMALL, about=about)
    made: Json = {
        "z_score": (row["estimate"] - row["formula"]) / ours.deviation,
        "margin": _margin(row["interval"], row["formula"]),
    }
    agrees("numbers of a comparison", row, made, within=SMALL, about=about)
    known = ("experiment", "quantity", "unit", "constants", "estimate", "interval", "formula", *made)
    same("what a comparison consists of", sorted(row), sorted([*known, *Passages._fields]), about=about)
    return {key: row[key] for key in known}


def _margin(interval: list[float], formula: float) -> float:
    """Half-widths by which the formula is inside the interval."""
    low, high = interval
    return 2.0 * min(formula - low, high - formula) / (high - low)


def _time_interval(row: Json, experiment: Experiment, time: Comparison, tail: float) -> None:
    """Normal, widened by the bias of the correction."""
    half_s = NormalDist().inv_cdf(1.0 - tail) * time.deviation + TIME_ALLOWANCE * experiment.period_s
    ends = [time.estimate - half_s, time.estimate + half_s]
    agrees("interval of the decision time", row["interval"], ends, within=1e-7, about=experiment.name)


def _error_interval(row: Json, experiment: Experiment, wrong: int, tail: float) -> None:
    """Clopper and Pearson's, widened by the bias: at an end the counts, or more extreme ones, have probability tail."""
    n = experiment.paths
    low, high = row["interval"][0] + ERROR_ALLOWANCE, row["interval"][1] - ERROR_ALLOWANCE
    what = "interval of the error rate: probability of the counts at its end"
    if wrong:
        close(what, _probability(n, wrong, n, low), tail, within=1e-5 * tail, about=f"{experiment.name}, low end")
    else:
        close("interval of the error rate", low, 0.0, within=SMALL, about=experiment.name)
    if wrong < n:
        close(what, _probability(n, 0, wrong, high), tail, within=1e-5 * tail, about=f"{experiment.name}, high end")
    else:
        close("interval of the error rate", high, 1.0, within=SMALL, about=experiment.name)


def _probability(n: int, least: int, most: int, p: float) -> float:
    """That a binomial number of n trials, each a success with probability p, is between `least` and `most`."""
    if not 0.0 < p < 1.0:
        return math.nan
    log_factorial = np.append(0.0, np.cumsum(np.log(np.arange(1.0, n + 1.0))))
    j = np.arange(least, most + 1)
    chosen = log_factorial[n] - log_factorial[j] - log_factorial[n - j]
    return float(np.exp(chosen + j * math.log(p) + (n - j) * math.log1p(-p)).sum())


PATHS, SEED, RESAMPLES, HALVINGS = 96, 5, 4000, 8
"""Paths of ZENO-REFINE, seed and number of its bootstrap samples, and how often its noise step is halved."""
SERIES = ("bare", "automaton", "automaton_at_scenario_noise")
DIVERGES_BELOW, FLAT_WITHIN, STANDARD_ERRORS = -0.25, 0.1, 5.0


def refine(claim: Json, scenario: Json) -> Found:
    """ZENO-REFINE: the bare threshold's mean count grows like dt^(-1/2), the automaton's tends to a limit.

    ln(mean) = c + p ln(dt) + b sqrt(dt); intervals of p by bootstrap over the paths. Supported if the bare p's
    interval, widened by the bias of that fit for the known expectation, contains -1/2 and is below -1/4, the
    automaton's contains 0 and is within 1/10 of it, and no path exceeds duration / dwell + 1.
    """
    dt, duration, intensity = _steps_of(scenario)
    counts = _counts(claim["evidence"]["counts"])
    levels, leak = levels_of(scenario), scenario["decision"]["leak_1_s"]
    expected = np.array([expected_bare(float(step), duration, leak, float(dt[0])) for step in dt])
    fits = {name: [float(value) for value in _fit(dt, counts.of[name].mean(axis=0))] for name in SERIES[:2]}
    intervals = {name: _interval(dt, counts.of[name]) for name in SERIES[:2]}
    bias = float(_fit(dt, expected)[1]) + 0.5
    most = int(duration / levels.dwell_s + SMALL) + 1 if levels.dwell_s > 0.0 else None
    facts: Json = {
        **{name: _series(values) for name, values in counts.of.items()},
        "counts": claim["evidence"]["counts"],
        "dt_s": dt.tolist(),
        "expected_bare": expected.tolist(),
        "fit": {
            name: {
                "intercept": c, "exponent": p, "correction": b, "interval": list(intervals[name]),
                "at_dt": (np.exp(c + b * np.sqrt(dt)) * dt**p).tolist(),
            }
            for name, (c, p, b) in fits.items()
        },
        "bias": bias,
        "most_triggers": most,
        "duration_s": duration,
        "noise_m_sqrt_s": intensity,
        "own_noise_m_sqrt_s": scenario["decision"]["noise_m_sqrt_s"],
        "leak_1_s": leak,
        "paths": PATHS,
        "seed": SEED,
        "level": LEVEL,
    }  # fmt: skip
    (low, high), (ours_low, ours_high) = intervals["bare"], intervals["automaton"]
    spare = {
        "bare exponent: -1/2 is not below its interval": -0.5 - low + abs(bias),
        "bare exponent: -1/2 is not above its interval": high + abs(bias) + 0.5,
        "bare exponent: well below 0": DIVERGES_BELOW - high,
        "automaton's exponent: 0 is not below its interval": -ours_low,
        "automaton's exponent: 0 is not above its interval": ours_high,
        "automaton's exponent: close to 0": FLAT_WITHIN - max(-ours_low, ours_high),
    }
    slack = min(spare.values())
    lowest = [condition for condition in spare if spare[condition] <= slack + SMALL]
    spread = counts.of["bare"].std(axis=0, ddof=1) / math.sqrt(PATHS)
    as_expected = bool((np.abs(counts.of["bare"].mean(axis=0) - expected) <= STANDARD_ERRORS * spread).all())
    status = "supported" if as_expected else "inconclusive"
    if most is not None and counts.of["automaton"].max() > most:
        status = "refuted"
    elif max(high - low, ours_high - ours_low) > 2.0 * FLAT_WITHIN:
        status = "inconclusive"
    elif slack < -SMALL:
        status = "refuted"
    found = Found.with_margin(status, slack, **facts).counted(PATHS)
    attained = partial(_one_of, "where the margin is attained", claim["where"].get("condition"), lowest)
    found = found.judging(attained, "where.condition")
    too_many = most is not None and counts.of["automaton"].max() > most
    shown = _too_many(counts, dt) if too_many else _not_so(claim["where"].get("condition", ""), facts, dt)
    against = partial(_counterexample, claim["counterexample"], shown if status == "refuted" else None)
    return found.judging(against, *(f"counterexample.{key}" for key in shown))


def _counterexample(recorded: Json | None, shown: Json | None) -> None:
    if shown is None:
        same("counterexample", recorded, None)
    else:
        agrees("counterexample", recorded, shown, within=1e-8)


def _too_many(counts: Counts, dt: Array) -> Json:
    """The first path with the most triggers, which are more than the dwell admits."""
    values = counts.of["automaton"]
    i, j = (int(k) for k in np.argwhere(values == values.max())[0])
    what = "more triggers than the dwell admits"
    return {"what": what, "path": i, "dt_s": float(dt[j]), "triggers": float(values.max())}


def _not_so(condition: str, facts: Json, dt: Array) -> Json:
    """The condition of least margin, and the fit that does not meet it."""
    which = SERIES["automaton" in condition]
    fit = {key: facts["fit"][which][key] for key in ("exponent", "interval")}
    return {"what": f"not so: {condition}", **fit, "dt_s": dt.tolist(), "mean": facts[which]["mean"]}


def _steps_of(scenario: Json) -> tuple[Array, float, float]:
    """Noise steps, coarsest first, duration of a path, s, and intensity of the noise, m/sqrt(s)."""
    decision, levels, whole = scenario["decision"], levels_of(scenario), scenario["duration_s"]
    rest = levels.dwell_s or 1.0
    coarse = min(decision["noise_period_s"], whole / 64, rest / 10)
    count = min(int(whole / coarse + SMALL), 640)
    crossing = (levels.zeta_m - levels.release_m) / math.sqrt(rest)
    intensity = max(decision["noise_m_sqrt_s"], crossing) or 1.0
    return coarse / 2.0 ** np.arange(HALVINGS + 1), count * coarse, intensity


class Counts(NamedTuple):
    """Trigger counts by series, (paths, steps) each, the coarsest step first."""

    of: dict[str, Array]


def _counts(recorded: dict[str, list[str]]) -> Counts:
    """The recorded counts: a text for each path, a number for each step."""
    found = {}
    for name in SERIES:
        values = np.array([[float(n) for n in row.split()] for row in recorded[name]])
        same("counts of every path at every step", list(values.shape), [PATHS, HALVINGS + 1], about=name)
        whole = (values >= 0.0) & (values == np.round(values))
        holds("counts are whole numbers", whole, values, "0, 1, ...", about=name)
        found[name] = values
    return Counts(found)


def _series(values: Array) -> Json:
    error = values.std(axis=0, ddof=1) / math.sqrt(PATHS)
    return {
        "mean": values.mean(axis=0).tolist(),
        "standard_error": error.tolist(),
        "largest": values.max(axis=0).tolist(),
    }


def _fit(dt_s: Array, mean: Array) -> Any:
    """c, p and b of ln(mean) = c + p ln(dt) + b sqrt(dt), (3,); of means (m, dt): (3, m)."""
    design = np.column_stack([np.ones_like(dt_s), np.log(dt_s), np.sqrt(dt_s)])
    return np.linalg.lstsq(design, np.log(mean).T, rcond=None)[0]


def _interval(dt_s: Array, counts: Array) -> tuple[float, float]:
    """Percentile bootstrap of the exponent over the paths."""
    exponents = _fit(dt_s, _weights() @ counts)[1]
    low, high = np.quantile(exponents, [(1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0])
    return float(low), float(high)


@lru_cache(maxsize=1)
def _weights() -> Array:
    """Weights of the paths in each bootstrap sample."""
    rng = np.random.default_rng([SEED, PATHS])
    return rng.multinomial(PATHS, np.full(PATHS, 1.0 / PATHS), RESAMPLES) / PATHS


@lru_cache(maxsize=64)
def expected_bare(dt_s: float, duration_s: float, leak_1_s: float, coarsest_s: float) -> float:
    """Expected number of triggers of the bare threshold: 1/2 + sum_k arccos(rho_k) / (2 pi).

    rho_k is the correlation of n at the ends of step k: n' = (1 - leak dt) n + dW, and n(0) is one coarsest step old.
    """
    keep, k = 1.0 - leak_1_s * dt_s, np.arange(round(duration_s / dt_s) + 1)
    grown = k * dt_s if leak_1_s == 0.0 else dt_s * (1.0 - keep ** (2.0 * k)) / (1.0 - keep**2)
    variance = keep ** (2.0 * k) * coarsest_s + grown
    rho = keep * np.sqrt(variance[:-1] / variance[1:])
    return 0.5 + float(np.arccos(np.minimum(rho, 1.0)).sum()) / (2.0 * math.pi)
