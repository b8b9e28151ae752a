"""THR-CHOICE: whether the threshold in force is the right one for the scenario's own numbers, and for its runs."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from airground_drake.base.statuses import Status
from airground_drake.decision.bayes import bayes_risk, optimal_threshold, printed_threshold
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.finding import Evidence, Finding
from airground_drake.verify.model.levels import NUMBERS
from airground_drake.verify.model.thr_root import ThrRoot, rule_of

EQUAL = 1e-6
"""A threshold is the optimum if it differs by this share at most: it then costs less than 1e-11 of the risk."""

DIGITS = 12
"""Decimals of a difference of risks: it is rounded in floating point."""

BEFORE_S = 1.0
"""The drift of a run is the growth of the task error over this time before the first trigger, s."""


@dataclass(frozen=True)
class Measured(Evidence):
    """Drift and noise that a UGV had in a run before its first trigger, and what they say of the threshold.

    Thresholds, m, are the optima for this drift: with the noise that the rule assumes, and with the run's own. The
    extra risk is that of the threshold in force. None: the task error does not grow, or the run has no noise.
    """

    first_trigger_s: float
    drift_m_s: float
    noise_m_sqrt_s: float
    threshold_m: float
    optimum_for_this_drift_m: float | None
    optimum_for_this_drift_and_noise_m: float | None
    extra_risk: float | None


@dataclass(frozen=True)
class Choice(Evidence):
    """Thresholds, m, their Bayes risks, and what was measured in the runs of a report, by `run UGV`."""

    kind: str
    rule: str
    threshold_in_force_m: float
    optimal_threshold_m: float
    threshold_as_printed_in_19_m: float
    risk_in_force: float
    least_risk: float
    extra_risk: float
    runs: dict[str, Measured] | None = None


class ThrChoice(ModelClaim):
    """THR-CHOICE."""

    id = "THR-CHOICE"
    summary = "The threshold in force is the best one for the scenario's own numbers, or it is declared by the user."
    statement = (
        "The threshold in force minimises the Bayes risk for the scenario's own c1, c2, drift and noise, or somebody "
        "declared it: the rule `fixed` takes a number, the rule `printed` takes (19) as the paper prints it."
    )
    formula = "rule bayes: B(zeta; drift, noise, c1, c2) = min B; otherwise B(zeta) - min B is shown"
    latex = (
        r"\text{rule bayes: } B(\zeta) = \min_z B(z), \quad \text{otherwise } B(\zeta) - \min_z B(z) \text{ is shown}",
    )
    method = (
        "The optimum is the root of (19) with c2/c1, enclosed by two signs in ball arithmetic (THR-ROOT, THR-OPT). The "
        "threshold in force equals it to 1e-6 (relative), or it is declared. A declared threshold cannot be refuted, "
        "so it counts as not exercised. Each run then shows the drift that the task error had in the last second "
        "before the first trigger, its noise, and the optima for these."
    )
    equations = "(16)-(20), Table 1"
    assumptions = ("Drift and noise of the rule are those that the user assumes; (16)-(18) without initial deviation.",)
    does_not_establish = (
        "That the assumed drift and noise are those of the runs: compare the rows of the runs. A declared threshold is "
        "not optimal. The risk says nothing about what an intervention brings."
    )
    expected: Status = "holds"
    exercised_by = "thresholds that are, or must be, the optimum"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """As THR-ROOT."""
        return ThrRoot().inputs(scenario)

    def check(self, inputs: dict[str, Any]) -> Finding:
        """Compare the threshold in force with the optimum, and their risks."""
        numbers = [inputs[name] for name in NUMBERS]
        rule, zeta = rule_of(inputs), float(inputs["zeta_m"])
        optimum = float(rule.zeta(rule.root.low))
        least, risk = (float(bayes_risk(each, *numbers)) for each in (optimum, zeta))
        off = abs(zeta - optimum)
        optimal = off <= EQUAL * optimum
        evidence = Choice(
            "optimal" if optimal else "declared",
            inputs["rule"],
            zeta,
            optimum,
            float(printed_threshold(*numbers)),
            risk_in_force=risk,
            least_risk=least,
            extra_risk=max(round(risk - least, DIGITS), 0.0),
        )
        shown = {key: value for key, value in asdict(evidence).items() if value is not None}
        if not optimal and inputs["rule"] != "bayes":
            return Finding("holds", evidence=evidence, exercised=0)
        return Finding(
            "holds" if optimal else "refuted",
            margin=EQUAL * optimum - off,
            unit="m",
            quantity="tolerance left between threshold and optimum",
            counterexample=None if optimal else shown,
            evidence=evidence,
            exercised=1,
        )


def of_run(trace: Trace) -> dict[str, Measured]:
    """What was measured in a run, for each UGV that triggered, by `run UGV`."""
    decision = trace.scenario.decision
    rule, noise, zeta = decision.threshold, decision.noise_m_sqrt_s, float(trace.meta["zeta_m"])
    costs = rule.c1_1_s, rule.c2
    found = dict[str, Measured]()
    for ugv in trace.ugvs:
        times = [float(event["t_s"]) for event in trace.events if (event["robot"], event["kind"]) == (ugv, "trigger")]
        if not times or times[0] <= trace.t[0]:
            continue
        begin = max(times[0] - BEFORE_S, float(trace.t[0]))
        error = np.linalg.norm(trace.reference(ugv) - trace.position(ugv), axis=1)
        before, after = np.interp([begin, times[0]], trace.t, error)
        drift = float(after - before) / (times[0] - begin)
        optima = [optimal_threshold(drift, each, *costs) if drift > 0.0 and each > 0.0 else None
                  for each in (rule.noise_m_sqrt_s, noise)]  # fmt: skip
        extra = None
        if optima[1] is not None:
            more = bayes_risk(zeta, drift, noise, *costs) - bayes_risk(optima[1], drift, noise, *costs)
            extra = max(round(float(more), DIGITS), 0.0)
        found[f"{trace.run} {ugv}"] = Measured(times[0], drift, noise, zeta, optima[0], optima[1], extra)
    return found
