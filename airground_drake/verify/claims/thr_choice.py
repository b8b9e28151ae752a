"""THR-CHOICE: whether the threshold in force is optimal for the scenario's numbers, and for its runs."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from airground_drake.base.statuses import Status
from airground_drake.model.trigger.bayes import bayes_risk, optimal_threshold, printed_threshold
from airground_drake.scenario.schema import Scenario, Threshold
from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.claims.thr_quality import drift_of
from airground_drake.verify.claims.thr_root import ThrRoot, rule_of
from airground_drake.verify.finding import Chart, Finding
from airground_drake.verify.model.levels import NUMBERS
from airground_drake.verify.runs.triggers import task_error

# A threshold is the optimum if it differs by this share at most: it then costs less than 1e-11 of the risk.
EQUAL = 1e-6

POINTS = 200  # of the chart
BEYOND = 1.6  # length of its axis, relative to the largest mark
DIGITS = 12  # decimals of a difference of risks: it is rounded in floating point

Row = dict[str, float]


class ThrChoice(ModelClaim):
    id = "THR-CHOICE"
    subject = "choice of the threshold"
    summary = "The threshold in force is optimal for the scenario's own numbers, or the user declared it."
    statement = (
        "The threshold in force minimises the Bayes risk for the scenario's own c1, c2, drift and noise, or the user "
        "declared it: the rule `fixed` takes a number, the rule `printed` takes (19) as the paper prints it."
    )
    latex = (
        r"\text{rule bayes: } B(\zeta) = \min_z B(z), \quad \text{otherwise } B(\zeta) - \min_z B(z) \text{ is shown}",
    )
    method = (
        "The optimum is the root of (19) with c2/c1, enclosed by two signs in ball arithmetic (THR-ROOT, THR-OPT). The "
        "threshold in force equals it to 1e-6 (relative), or it is declared. A declared threshold cannot be refuted, "
        "so it counts as not tested. For each run the report shows the drift of the task error in the last second "
        "before it first reached the threshold, the noise, the optimum for both, and the cost of the threshold in "
        "force."
    )
    equations = "(16)-(20), Table 1"
    assumptions = ("Drift and noise of the rule are those that the user assumes; (16)-(18) without initial deviation.",)
    does_not_establish = (
        "That the assumed drift and noise agree with the runs: compare the rows of the runs. A declared threshold need"
        " not be optimal. The risk does not measure the benefit of an intervention."
    )
    expected: Status = "holds"
    exercised_by = "thresholds that are, or must be, the optimum"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        return ThrRoot().inputs(scenario)

    def check(self, inputs: dict[str, Any]) -> Finding:
        numbers = [inputs[name] for name in NUMBERS]
        rule, zeta = rule_of(inputs), float(inputs["zeta_m"])
        optimum = float(rule.zeta(rule.root.low))
        least, risk = (float(bayes_risk(at, *numbers)) for at in (optimum, zeta))
        off = abs(zeta - optimum)
        optimal = off <= EQUAL * optimum
        evidence = {
            "kind": "optimal" if optimal else "declared",
            "rule": inputs["rule"],
            "threshold_in_force_m": zeta,
            "optimal_threshold_m": optimum,
            "threshold_as_printed_in_19_m": float(printed_threshold(*numbers)),
            "risk_in_force": risk,
            "least_risk": least,
            "extra_risk": max(round(risk - least, DIGITS), 0.0),
        }
        chart = _chart(evidence, numbers)
        if not optimal and inputs["rule"] != "bayes":
            return Finding("holds", evidence=evidence, exercised=0, figure=chart)
        return Finding(
            "holds" if optimal else "refuted",
            margin=EQUAL * optimum - off,
            unit="m",
            quantity="tolerance left between threshold and optimum",
            counterexample=None if optimal else evidence,
            evidence=evidence,
            exercised=1,
            figure=chart,
        )

    def seen_in(self, trace: Trace) -> dict[str, Row]:
        """The optimal threshold for drift and noise of UGVs whose task error reached the threshold, by `run UGV`."""
        decision, zeta = trace.scenario.decision, float(trace.meta["zeta_m"])
        drifts = {ugv: drift_of(task_error(trace, ugv), zeta) for ugv in trace.ugvs}
        return {
            f"{trace.run} {ugv}": measured(zeta, drift, decision.noise_m_sqrt_s, decision.threshold)
            for ugv, drift in drifts.items()
            if drift is not None
        }

    def with_runs(self, finding: Finding, seen: Sequence[dict[str, Row]]) -> Finding:
        if "extra_risk" not in finding.evidence:
            return finding
        runs = {name: row for of_run in seen for name, row in of_run.items()}
        return replace(finding, evidence=finding.evidence | {"runs": runs})


def _chart(evidence: dict[str, Any], numbers: Sequence[float]) -> Chart:
    """The Bayes risk over the threshold; the threshold in force, the optimal one, and that by (19) as printed."""
    places = {
        "in force": evidence["threshold_in_force_m"],
        "optimal": evidence["optimal_threshold_m"],
        "(19) as printed": evidence["threshold_as_printed_in_19_m"],
    }
    zeta = np.linspace(0.0, BEYOND * max(places.values()), POINTS + 1)[1:]
    drift, noise, *_ = numbers
    return Chart(
        "Bayes risk (16) over the threshold",
        "threshold, m",
        "Bayes risk",
        {"risk (16)": (zeta, np.array([bayes_risk(at, *numbers) for at in zeta]))},
        {name: (at, float(bayes_risk(at, *numbers))) for name, at in places.items()},
        caption=f"The threshold in force is {places['in force']:.4g} m ({evidence['kind']}). The curve assumes "
        f"a drift of {drift:g} m/s and a noise of {noise:g} m/√s.",
    )


def measured(zeta: float, drift: float, noise: float, rule: Threshold) -> Row:
    """The evaluation of a threshold, m, for a positive drift, m/s, a noise, m/sqrt(s), and the costs of a rule."""
    optimum, extra = 0.0, rule.c1_1_s * zeta / drift  # without noise: decided after zeta / drift, never wrongly
    if noise > 0.0:
        numbers = drift, noise, rule.c1_1_s, rule.c2
        optimum = optimal_threshold(*numbers)
        extra = max(round(float(bayes_risk(zeta, *numbers) - bayes_risk(optimum, *numbers)), DIGITS), 0.0)
    return {
        "drift_m_s": drift, "noise_m_sqrt_s": noise, "threshold_m": zeta,
        "optimum_m": optimum,  # for this drift and this noise; 0 without noise
        "extra_risk": extra,  # of the threshold in force against this optimum, with the scenario's c1 and c2
    }  # fmt: skip
