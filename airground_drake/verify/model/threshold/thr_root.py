"""THR-ROOT: the Bayes threshold as the one root of (19), by ball arithmetic."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any

from airground_drake.components import threshold
from airground_drake.decision.bayes import optimal_threshold
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.engines.ball_arithmetic import (
    bracket,
    conclude,
    enclose,
    evaluate,
)
from airground_drake.verify.engines.smt import solve
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.threshold.constants import FLOAT_TOLERANCE, Rule, ThresholdRule, running_threshold
from airground_drake.verify.model.threshold.expressions import INCREASING, ONE_ROOT, RESIDUAL

CVC5_LIMIT_S = 5.0

UNIQUE_SMT2 = f"""; two roots of (19) for any drift, noise, c1, c2: must be unsatisfiable
(set-logic QF_NRAT)
{"".join(f"(declare-const {v} Real){chr(10)}" for v in ("drift", "noise", "c1", "c2", "u", "v"))}\
{"".join(f"(assert (> {v} 0.0)){chr(10)}" for v in ("drift", "noise", "c1", "c2", "u"))}\
(assert (< u v))
(assert (= (* c1 noise noise (+ (/ (- (exp u) (exp (- u))) 2.0) u)) (* c2 drift drift)))
(assert (= (* c1 noise noise (+ (/ (- (exp v) (exp (- v))) 2.0) v)) (* c2 drift drift)))
(check-sat)
"""


class ThrRoot(ModelClaim):
    """THR-ROOT."""

    id = "THR-ROOT"
    summary = "The threshold equation has exactly one solution, and the program finds it."
    statement = "The threshold equation, with c2/c1 on the right, has exactly one root, and the code returns it."
    formula = "noise^2/drift^2 (sinh u + u) = c2/c1 for one u > 0 only; zeta = u noise^2/(2 drift)"
    latex = (
        r"\frac{\sigma^2}{\mu^2} (\sinh u + u) = \frac{c_2}{c_1} \text{ for one } u > 0 \text{ only}, \quad "
        r"\zeta = \frac{u \sigma^2}{2 \mu}",
    )
    method = (
        "Ball arithmetic (256 bits) decides the signs of f(u) = k (sinh u + u) - r at two rational points at most "
        "1e-12 apart (relative); f' = k (cosh u + 1) > 0 leaves no second root. The value of `optimal_threshold` "
        "must lie between the points to within 1e-12 (relative). cvc5 is asked besides whether any drift, noise, c1 "
        "and c2 have two roots; its answer is reported, and only a contradiction counts."
    )
    equations = "(19) with c2/c1 for the printed c1/c2"
    assumptions = (
        "Constants are the decimals that the scenario's numbers print as.",
        "With a fixed threshold the root is not in force; it then says which threshold the rule's numbers ask for.",
    )
    does_not_establish = (
        "That the root minimises anything (THR-OPT), that drift and noise of the rule describe a robot, or that a "
        "decision variable follows (15) at all."
    )

    exercised_by = "statements of the proof"
    kept = False

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """The numbers of the threshold rule and the threshold in force."""
        rule = scenario.decision.threshold
        return {
            "rule": rule.rule,
            "drift_m_s": rule.drift_m_s,
            "noise_m_sqrt_s": rule.noise_m_sqrt_s,
            "c1_1_s": rule.c1_1_s,
            "c2": rule.c2,
            "zeta_m": threshold(scenario),
        }

    def check(self, inputs: dict[str, Any]) -> Finding:
        """Enclose the root and look for the code's in it."""
        return judge_root(inputs, optimal_threshold)


def judge_root(inputs: dict[str, Any], rule: Rule, shift: int = 0) -> Finding:
    """THR-ROOT for the threshold that `rule` computes; `shift` moves the enclosure by multiples of its width."""
    constants = ThresholdRule.of(inputs)
    low, high = enclose(RESIDUAL, constants.values, Fraction(0))
    low, high = low + shift * (high - low), high + shift * (high - low)
    zeta = constants.zeta(low), constants.zeta(high)
    statements = [INCREASING, *bracket("root", "f changes its sign here.", RESIDUAL, constants.values, (low, high))]
    running = running_threshold(inputs, rule)
    in_force = Fraction(inputs["zeta_m"]) if inputs["rule"] == "bayes" else running
    outside = max(max(zeta[0] - value, value - zeta[1]) for value in (running, in_force))
    [cvc5] = solve([UNIQUE_SMT2], "cvc5", CVC5_LIMIT_S)
    evidence = {
        "running_threshold_m": float(running),
        "cvc5_on_two_roots": cvc5.answer,
        "cvc5_says": {"unsat": "no constants have two roots", "sat": "contradicts"}.get(cvc5.answer, "undecided"),
    }
    finding = conclude(
        statements,
        constants.values,
        {"u": (low, high), "zeta_m": zeta},
        ONE_ROOT,
        margin=float(FLOAT_TOLERANCE * zeta[1] - outside),
        unit="m",
        evidence=evidence,
        scripts={"two_roots.smt2": UNIQUE_SMT2},
    )
    quantity = "what the running threshold leaves of the distance by which it may be outside of the enclosure"
    finding = replace(finding, quantity=quantity)
    if cvc5.answer == "sat":
        return replace(finding, status="error")
    if finding.status == "proved" and outside > FLOAT_TOLERANCE * zeta[1]:
        found = {"running_threshold_m": float(running), "enclosure_m": [float(end) for end in zeta]}
        residual = float(evaluate(RESIDUAL, constants.at(u=constants.u(running))).mid())
        return replace(finding, status="refuted", counterexample={**found, "residual_of_the_equation_s": residual})
    return finding
