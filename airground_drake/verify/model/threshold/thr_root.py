"""THR-ROOT and THR-OPT: the Bayes threshold as the root of (19) and as the minimiser of (16), by ball arithmetic.

With u = 2 zeta drift / noise^2, k = noise^2 / drift^2 (s) and r = c2 / c1 (s), (19) with its right-hand side the
right way up is f(u) = k (sinh u + u) - r = 0, and dB/dzeta is f(u) times something positive: both claims rest on
the signs of elementary functions at rational points and on a few identities. Certificates as in `statements`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, Literal

from scipy.optimize import brentq

from airground_drake.decision.bayes import bayes_risk, optimal_threshold
from airground_drake.diagram import threshold
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.claim import Finding, ModelClaim
from airground_drake.verify.engines.ball_arithmetic import (
    Derivative,
    Statement,
    bracket,
    conclude,
    enclose,
    evaluate,
    sign,
)
from airground_drake.verify.engines.obligation import rational
from airground_drake.verify.engines.smt import solve

FLOAT_TOLERANCE = 1e-12
"""The running threshold may be this far outside its enclosure, relative to it: rounding errs by some 1e-15."""
RISK_TOLERANCE = 1e-9
"""The running Bayes risk may differ by this from the certified function, relative to it (cancellation at small u)."""
CVC5_LIMIT_S = 5.0

SINH = "((exp(u)-exp(-u))/2)"
RESIDUAL = f"k*({SINH}+u)-r"
RISK = "c1*k/2*u*(exp(u)-1)/(exp(u)+1)+c2/(exp(u)+1)"
"""B of (16) without initial deviation; B with a deviation is this plus BIAS, w = 2 deviation drift / noise^2."""
BIAS = "(1-exp(-w))*(c1*k*u-c2)/(exp(u)-exp(-u))-c1*k*w/2"
SLOPE_AT_ROOT = "c1/drift*(1-exp(-w))*(exp(u)+1)/(exp(u)-1)"
"""dB/dzeta, 1/(m), where f(u) = 0: (c1/drift) (1 - exp(-w)) coth(u/2)."""
DRIFT_LEVEL = f"({SINH}+u)/u**2-m"
DRIFT_TURN = f"u*(exp(u)+exp(-u))/2-u-2*{SINH}"

_FACTOR = "q/(q+1)**2*(c1*k*((q-1/q)/2+u)-c2)"

INCREASING = Derivative(
    "increasing",
    "f' = k (exp(u) + 1)^2 / (2 exp(u)), which is positive: f has at most one root.",
    "k*((q-1/q)/2+u)-r",
    {"u": "1", "q": "q"},
    "k*(q+1)**2/(2*q)",
    {"k": 1, "r": 1, "u": 1, "q": 3},
)
FACTORISATION = Derivative(
    "factorisation",
    "dB/du = c1 exp(u) / (exp(u) + 1)^2 f(u): dB/dzeta has the sign of f.",
    "c1*k/2*u*(q-1)/(q+1)+c2/(q+1)",
    {"u": "1", "q": "q"},
    _FACTOR,
    {"c1": 1, "c2": 1, "k": 1, "u": 1, "q": 4},
)
BIASED = Derivative(
    "biased",
    "With b = 1 - exp(-w) for an initial deviation, dB/du is b c1 k coth(u/2) / 2 where f(u) = 0: not 0 unless b is.",
    "c1*k/2*u*(q-1)/(q+1)+c2/(q+1)+b*(c1*k*u-c2)/(q-1/q)",
    {"u": "1", "q": "q"},
    f"{_FACTOR}-(c1*k*((q-1/q)/2+u)-c2)*b*(q+1/q)/(q-1/q)**2+b*c1*k*(q+1)/(2*(q-1))",
    {"b": 1, "c1": 1, "c2": 1, "k": 1, "u": 1, "q": 12},
)
TURNING = Derivative(
    "turning",
    "(sinh u + u)/u^2 has the derivative (u cosh u - u - 2 sinh u)/u^3.",
    "((q-1/q)/2+u)/u**2",
    {"u": "1", "q": "q"},
    "(u*(q+1/q)/2-u-(q-1/q))/u**3",
    {"u": 6, "q": 4},
)

UNIQUE_SMT2 = f"""; two roots of (19) for any drift, noise, c1, c2: must be unsatisfiable
(set-logic QF_NRAT)
{"".join(f"(declare-const {v} Real){chr(10)}" for v in ("drift", "noise", "c1", "c2", "u", "v"))}\
{"".join(f"(assert (> {v} 0.0)){chr(10)}" for v in ("drift", "noise", "c1", "c2", "u"))}\
(assert (< u v))
(assert (= (* c1 noise noise (+ (/ (- (exp u) (exp (- u))) 2.0) u)) (* c2 drift drift)))
(assert (= (* c1 noise noise (+ (/ (- (exp v) (exp (- v))) 2.0) v)) (* c2 drift drift)))
(check-sat)
"""


@dataclass(frozen=True)
class Constants:
    """The threshold rule's numbers as rationals (the decimals that they print as)."""

    drift: Fraction
    noise: Fraction
    c1: Fraction
    c2: Fraction

    @classmethod
    def of(cls, inputs: Mapping[str, Any]) -> Constants:
        """From a claim's inputs."""
        return cls(*(Fraction(rational(inputs[name])) for name in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2")))

    @property
    def values(self) -> dict[str, Fraction]:
        """By the names that the expressions use."""
        k = self.noise**2 / self.drift**2
        return {"k": k, "r": self.c2 / self.c1, "c1": self.c1, "c2": self.c2, "drift": self.drift}

    def zeta(self, u: Fraction) -> Fraction:
        """Threshold, m, at u."""
        return u * self.noise**2 / (2 * self.drift)

    def u(self, zeta: Fraction) -> Fraction:
        """2 zeta drift / noise^2 of a length, m."""
        return zeta * 2 * self.drift / self.noise**2

    def at(self, **more: Fraction) -> dict[str, Fraction]:
        """All values and some more."""
        return {**self.values, **more}


class ThrRoot(ModelClaim):
    """THR-ROOT."""

    id = "THR-ROOT"
    statement = "The threshold equation, with c2/c1 on the right, has exactly one root, and the code returns it."
    formula = "noise^2/drift^2 (sinh u + u) = c2/c1 for one u > 0 only; zeta = u noise^2/(2 drift)"
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
        return _root(inputs, optimal_threshold)


class ThrOpt(ModelClaim):
    """THR-OPT."""

    id = "THR-OPT"
    statement = (
        "Without initial deviation the root of the threshold equation is the only minimiser of the Bayes risk over all "
        "zeta > 0; the root of the printed equation is not one. With initial deviations of +-zeta/2 the risk is not "
        "stationary at that root."
    )
    formula = (
        "dB/dzeta = (c1 drift/noise^2) / (1 + cosh u) f(u), so dB/dzeta < 0 below the root and > 0 above it; "
        "B(printed root) > B(root); dB/dzeta = (c1/drift) (1 - exp(-2 y0 drift/noise^2)) coth(u/2) at the root for y0"
    )
    method = (
        "The factorisation of dB/du is an identity of rational functions in u and exp(u), shown by symbolic "
        "differentiation; f increases (THR-ROOT). Everything else is signs by ball arithmetic at rational points. The "
        "differentiated risk is compared with the running `bayes_risk`. The drifts for which the threshold in force "
        "solves the equation are enclosed, all of them: (sinh u + u)/u^2 falls to one minimum and rises again."
    )
    equations = "(16)-(19)"
    assumptions = (
        "(17) and (18) with the initial deviation in seconds, that is divided by the drift (THR-DDM).",
        "Constants are the decimals that the scenario's numbers print as; the drift is constant.",
    )
    does_not_establish = (
        "That minimising this risk is the right aim, that c1, c2, drift and noise are well chosen, or which threshold "
        "minimises the risk with an initial deviation. For c1 = c2 the printed equation has the same root."
    )

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """As THR-ROOT."""
        return ThrRoot().inputs(scenario)

    def check(self, inputs: dict[str, Any]) -> Finding:
        """Signs of dB/dzeta around the running threshold, the printed root, the deviations and the drifts."""
        return _optimum(inputs, optimal_threshold)


Rule = Callable[[float, float, float, float], float]
"""Threshold, m, from drift, noise, c1 and c2."""

ONE_ROOT = (
    "f(0) = -r < 0, f is continuous, and f' > 0 by `increasing`: exactly one root in all u > 0.",
    "By `root_below` and `root_above` it lies between the ends of the enclosure of u; zeta = u noise^2 / (2 drift).",
)
MINIMUM = (
    "By `factorisation`, q = exp(u) and du/dzeta = 2 drift/noise^2 > 0, dB/dzeta has the sign of f at every u > 0; f "
    "increases: B falls up to the root and rises beyond it.",
    "`printed_*` enclose the root of the printed equation in v; `printed_slope` is f at the end of that enclosure "
    "next to the root, and `printed_risk` the difference in B of the ends next to each other: B is monotone between.",
    "By `biased`, dB/dzeta at the root with deviation y0, w = 2 y0 drift/noise^2, is (c1/drift) (1 - exp(-w)) "
    "coth(u/2), whose size falls with u: `ahead_*` (w > 0) and `behind_*` (w < 0) bound it on the whole enclosure.",
    "zeta in force solves the equation for the drift u noise^2/(2 zeta) where (sinh u + u)/u^2 = m, m = ratio "
    "noise^2/(4 zeta^2). By `turning` it falls or rises with u cosh u - u - 2 sinh u = -2 u + sum over j >= 1 of "
    "(2 j - 1)/(2 j + 1)! u^(2 j + 1), which divided by u increases: one minimum, by `turn_*`, so one root on each "
    "side of it if the minimum is below m and none if it is above.",
)


def _root(inputs: dict[str, Any], rule: Rule, shift: int = 0) -> Finding:
    """THR-ROOT for the threshold that `rule` computes; `shift` moves the enclosure by multiples of its width."""
    constants = Constants.of(inputs)
    low, high = enclose(RESIDUAL, constants.values, Fraction(0))
    low, high = low + shift * (high - low), high + shift * (high - low)
    zeta = constants.zeta(low), constants.zeta(high)
    statements = [INCREASING, *bracket("root", "f changes its sign here.", RESIDUAL, constants.values, (low, high))]
    running = _running(inputs, rule)
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
    if cvc5.answer == "sat":
        return replace(finding, status="error")
    if finding.status == "proved" and outside > FLOAT_TOLERANCE * zeta[1]:
        found = {"running_threshold_m": float(running), "enclosure_m": [float(end) for end in zeta]}
        residual = float(evaluate(RESIDUAL, constants.at(u=constants.u(running))).mid())
        return replace(finding, status="refuted", counterexample={**found, "residual_of_the_equation_s": residual})
    return finding


def _optimum(
    inputs: dict[str, Any],
    rule: Rule,
    factorisation: Derivative = FACTORISATION,
    stationary_with_deviation: bool = False,
) -> Finding:
    """THR-OPT for the threshold that `rule` computes; the last two are for mutants."""
    constants = Constants.of(inputs)
    root = enclose(RESIDUAL, constants.values, Fraction(0))
    running = _running(inputs, rule)
    around = [constants.u(running) * (1 + side * Fraction(FLOAT_TOLERANCE)) for side in (-1, 1)]
    statements: list[Statement] = [INCREASING, factorisation, BIASED, TURNING]
    statements += bracket("root", "f changes its sign here.", RESIDUAL, constants.values, root)
    statements += bracket(
        "running", "dB/dzeta changes its sign at the code's zeta.", RESIDUAL, constants.values, around
    )
    printed, enclosures, gap = _printed(constants, root)
    deviations, slopes = _deviations(constants, root, stationary_with_deviation)
    drifts, solutions = _drifts(constants, Fraction(rational(inputs["zeta_m"])))
    zeta = [constants.zeta(u) for u in root]
    finding = conclude(
        [*statements, *printed, *deviations, *drifts],
        constants.values,
        {"u": root, "zeta_m": zeta, **enclosures, **slopes, **solutions},
        (*ONE_ROOT, *MINIMUM),
        margin=gap,
        unit="" if gap is None else "risk",
        evidence=_replay(inputs, running, float(zeta[0])),
    )
    if finding.status == "proved" and finding.evidence["risk_difference_to_the_running_code"] > RISK_TOLERANCE:
        return replace(finding, status="error")
    if finding.counterexample is not None:
        return replace(finding, counterexample=finding.counterexample | _replay(inputs, running, float(zeta[0])))
    return finding


def _printed(
    constants: Constants, root: tuple[Fraction, Fraction]
) -> tuple[list[Statement], dict[str, tuple[Fraction, Fraction]], float | None]:
    """That the root of the printed equation is elsewhere and worse, its enclosures, and by how much at least."""
    if constants.c1 == constants.c2:
        return [], {}, None
    swapped = constants.at(r=constants.c1 / constants.c2)
    ends = enclose(RESIDUAL, swapped, Fraction(0))
    too_low = constants.c1 < constants.c2
    v, u = (ends[1], root[0]) if too_low else (ends[0], root[1])  # the ends next to each other
    difference = f"({RISK.replace('u', 'v')})-({RISK})"
    slope: Literal["<", ">"] = "<" if too_low else ">"
    statements = [
        *bracket("printed", "The printed equation has its root here.", RESIDUAL, swapped, ends),
        sign("printed_slope", "dB/dzeta is not 0 at the printed root.", RESIDUAL, constants.at(u=v), slope),
        sign("printed_risk", "B there is above that at the root.", difference, constants.at(u=u, v=v), ">"),
    ]
    gap = float(evaluate(difference, constants.at(u=u, v=v)).lower())
    zeta = (constants.zeta(ends[0]), constants.zeta(ends[1]))
    return statements, {"printed_u": ends, "printed_zeta_m": zeta}, gap


def _deviations(
    constants: Constants, root: tuple[Fraction, Fraction], stationary: bool
) -> tuple[list[Statement], dict[str, tuple[Fraction, Fraction]]]:
    """Bounds of dB/dzeta, 1/m, at the root with initial deviations of +-zeta/2 (for a mutant: that it is 0)."""
    statements: list[Statement] = []
    slopes = {}
    for name, w in (("ahead", root[0] / 2), ("behind", -root[0] / 2)):
        middle = Fraction(float(evaluate(SLOPE_AT_ROOT, constants.at(u=root[0], w=w)).mid()))
        low, high = sorted(middle * (1 + side * Fraction(1, 10**9)) for side in (-1, 1))
        if stationary:
            low, high = -Fraction(1, 10**9), Fraction(1, 10**9)
        slopes[f"{name}_slope_1_m"] = (low, high)
        for side, bound, u, relation in (("from", low, root[w > 0], ">"), ("to", high, root[w < 0], "<")):
            values = constants.at(u=u, w=w, bound=bound)
            says = f"dB/dzeta at the root with a deviation of {'-' if w < 0 else ''}zeta/2 is {relation} this, 1/m."
            statements.append(sign(f"{name}_{side}", says, f"{SLOPE_AT_ROOT}-bound", values, relation))  # type: ignore[arg-type]
    return statements, slopes


def _drifts(constants: Constants, zeta: Fraction) -> tuple[list[Statement], dict[str, tuple[Fraction, Fraction]]]:
    """All drifts, m/s, for which zeta, m, solves the equation: with c2/c1, and as printed."""
    turn = enclose(DRIFT_TURN, {}, Fraction(1), Fraction(4))
    statements = bracket("turn", "(sinh u + u)/u^2 has its minimum here.", DRIFT_TURN, {}, turn)
    enclosures = {}
    for name, ratio in (("drift", constants.c2 / constants.c1), ("printed_drift", constants.c1 / constants.c2)):
        m = {"m": ratio * constants.noise**2 / (4 * zeta**2)}
        if evaluate(DRIFT_LEVEL, m | {"u": turn[0]}) > 0:
            says, values = "zeta in force is optimal for no drift.", {**m, "u": turn[0], "v": turn[1]}
            statements.append(sign(f"{name}_none", says, f"({SINH}+u)/v**2-m", values, ">"))
            continue
        low = enclose(DRIFT_LEVEL, m, Fraction(0), turn[0], rising=False)
        high = enclose(DRIFT_LEVEL, m, turn[1])
        for side, ends in (("low", low), ("high", high)):
            says = "zeta in force solves the equation for the drift u noise^2/(2 zeta)."
            statements += bracket(f"{name}_{side}", says, DRIFT_LEVEL, m, ends, rising=side == "high")
            drift = [u * constants.noise**2 / (2 * zeta) for u in ends]
            enclosures[f"{name}_{side}_m_s"] = (drift[0], drift[1])
    return statements, enclosures


def _running(inputs: Mapping[str, Any], rule: Rule) -> Fraction:
    """The threshold, m, that the code computes, exactly as it stands in the computer."""
    return Fraction(rule(inputs["drift_m_s"], inputs["noise_m_sqrt_s"], inputs["c1_1_s"], inputs["c2"]))


def _replay(inputs: Mapping[str, Any], running: Fraction, root: float) -> dict[str, Any]:
    """The running Bayes risk at the root and at the code's threshold, and how far it is from the certified one."""
    constants = Constants.of(inputs)
    drift, noise, c1, c2 = (inputs[name] for name in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2"))
    differences = []
    for scale, share in ((0.3, 0.0), (1.0, 0.0), (3.0, 0.0), (1.0, 0.5), (1.0, -0.5)):
        zeta, deviation = scale * root, share * scale * root
        u, w = constants.u(Fraction(zeta)), constants.u(Fraction(deviation))
        exact = float(evaluate(f"{RISK}+{BIAS}", constants.at(u=u, w=w)).mid())
        differences.append(abs(bayes_risk(zeta, drift, noise, c1, c2, deviation) / exact - 1.0))
    step = 1e-4 * root
    above, below = (bayes_risk(root + side * step, drift, noise, c1, c2, 0.5 * root) for side in (1, -1))
    return {
        "risk_difference_to_the_running_code": max(differences),
        "risk_at_the_root": bayes_risk(root, drift, noise, c1, c2),
        "threshold_judged_m": float(running),
        "risk_at_the_threshold_judged": bayes_risk(float(running), drift, noise, c1, c2),
        "threshold_in_force_m": inputs["zeta_m"],
        "risk_at_the_threshold_in_force": bayes_risk(inputs["zeta_m"], drift, noise, c1, c2),
        "difference_quotient_with_deviation_ahead_1_m": (above - below) / (2.0 * step),
    }


def _swapped(drift: float, noise: float, c1: float, c2: float) -> float:
    """(19) as printed."""
    return optimal_threshold(drift, noise, c2, c1)


def _subtracted(drift: float, noise: float, c1: float, c2: float) -> float:
    """(19) with sinh u - u."""
    level = c2 / c1 * drift**2 / noise**2
    upper = 2.0 + 2.0 * math.asinh(level) + level
    return float(brentq(lambda u: math.sinh(u) - u - level, 0.0, upper)) * noise**2 / (2.0 * drift)


MUTANTS: dict[str, Callable[[dict[str, Any]], Finding]] = {
    "THR-ROOT: the code solves (19) as printed, c1/c2": lambda inputs: _root(inputs, _swapped),
    "THR-ROOT: the code solves (19) with sinh u - u": lambda inputs: _root(inputs, _subtracted),
    "THR-ROOT: an enclosure that misses the root": lambda inputs: _root(inputs, optimal_threshold, shift=2),
    "THR-OPT: the threshold of (19) as printed, c1/c2": lambda inputs: _optimum(inputs, _swapped),
    "THR-OPT: the threshold with sinh u - u": lambda inputs: _optimum(inputs, _subtracted),
    "THR-OPT: dB/dzeta with a wrong sign": lambda inputs: _optimum(
        inputs, optimal_threshold, replace(FACTORISATION, derivative=FACTORISATION.derivative.replace("+u)", "-u)"))
    ),
    "THR-OPT: (19) with an initial deviation": lambda inputs: _optimum(
        inputs, optimal_threshold, stationary_with_deviation=True
    ),
}
"""Broken variants by name: each must be refuted (the first and the fourth cannot be where c1 = c2)."""
