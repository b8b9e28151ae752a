"""THR-OPT: the Bayes threshold as the minimiser of the Bayes risk (16), by ball arithmetic."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any, Literal

from airground_drake.decision.bayes import bayes_risk, optimal_threshold
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.engines.ball_arithmetic import (
    Derivative,
    Relation,
    Statement,
    bracket,
    conclude,
    enclose,
    evaluate,
    sign,
)
from airground_drake.verify.engines.obligation import rational
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.threshold.constants import FLOAT_TOLERANCE, Rule, ThresholdRule, running_threshold
from airground_drake.verify.model.threshold.expressions import (
    BIAS,
    BIASED,
    DRIFT_LEVEL,
    DRIFT_TURN,
    INCREASING,
    MINIMUM,
    ONE_ROOT,
    RESIDUAL,
    SINH,
    SLOPE_AT_ROOT,
    TURNING,
    factorisation,
    risk,
)
from airground_drake.verify.model.threshold.thr_root import ThrRoot

RISK_TOLERANCE = 1e-9
"""The running Bayes risk may differ by this from the certified function, relative to it (cancellation at small u)."""


class ThrOpt(ModelClaim):
    """THR-OPT."""

    id = "THR-OPT"
    summary = "The threshold of least Bayes risk is the root of the corrected equation, not of the printed one."
    statement = (
        "Without initial deviation the root of the threshold equation is the only minimiser of the Bayes risk over all "
        "zeta > 0; the root of the printed equation is not one. With initial deviations of +-zeta/2 the risk is not "
        "stationary at that root."
    )
    formula = (
        "dB/dzeta = (c1 drift/noise^2) / (1 + cosh u) f(u), so dB/dzeta < 0 below the root and > 0 above it; "
        "B(printed root) > B(root); dB/dzeta = (c1/drift) (1 - exp(-2 y0 drift/noise^2)) coth(u/2) at the root for y0"
    )
    latex = (
        r"\frac{d B}{d \zeta} = \frac{c_1 \mu / \sigma^2}{1 + \cosh u} f(u) \quad \text{is negative below the "
        r"root, positive above it}",
        r"B(\zeta_{\text{printed}}) > B(\zeta_{\text{root}})",
        r"\frac{d B}{d \zeta} = \frac{c_1}{\mu} (1 - e^{-2 y_0 \mu / \sigma^2}) \coth \frac{u}{2} \quad "
        r"\text{at the root for } y_0",
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

    exercised_by = "statements of the proof"
    kept = False

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """As THR-ROOT."""
        return ThrRoot().inputs(scenario)

    def check(self, inputs: dict[str, Any]) -> Finding:
        """Signs of dB/dzeta around the running threshold, the printed root, the deviations and the drifts."""
        return judge_optimum(inputs, optimal_threshold)


def judge_optimum(
    inputs: dict[str, Any],
    rule: Rule,
    dB: Derivative | None = None,
    stationary_with_deviation: bool = False,
) -> Finding:
    """THR-OPT for the threshold that `rule` computes; for mutants: another dB/du, or that the slopes are 0."""
    constants = ThresholdRule.of(inputs)
    root = enclose(RESIDUAL, constants.values, Fraction(0))
    running = running_threshold(inputs, rule)
    around = [constants.u(running) * (1 + side * Fraction(FLOAT_TOLERANCE)) for side in (-1, 1)]
    statements: list[Statement] = [INCREASING, dB or factorisation(), BIASED, TURNING]
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
    finding = replace(finding, quantity="risk at the printed form's root above that at the minimiser")
    if finding.status == "proved" and finding.evidence["risk_difference_to_the_running_code"] > RISK_TOLERANCE:
        return replace(finding, status="error")
    if finding.counterexample is not None:
        return replace(finding, counterexample=finding.counterexample | _replay(inputs, running, float(zeta[0])))
    return finding


def _printed(
    constants: ThresholdRule, root: tuple[Fraction, Fraction]
) -> tuple[list[Statement], dict[str, tuple[Fraction, Fraction]], float | None]:
    """That the root of the printed equation is elsewhere and worse, its enclosures, and by how much at least."""
    if constants.c1 == constants.c2:
        return [], {}, None
    swapped = constants.at(r=constants.c1 / constants.c2)
    ends = enclose(RESIDUAL, swapped, Fraction(0))
    too_low = constants.c1 < constants.c2
    v, u = (ends[1], root[0]) if too_low else (ends[0], root[1])  # the ends next to each other
    difference = f"({risk('v')})-({risk()})"
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
    constants: ThresholdRule, root: tuple[Fraction, Fraction], stationary: bool
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
        sides: list[tuple[str, Fraction, Fraction, Relation]] = [
            ("from", low, root[w > 0], ">"), ("to", high, root[w < 0], "<")
        ]  # fmt: skip
        for side, bound, u, relation in sides:
            values = constants.at(u=u, w=w, bound=bound)
            says = f"dB/dzeta at the root with a deviation of {'-' if w < 0 else ''}zeta/2 is {relation} this, 1/m."
            statements.append(sign(f"{name}_{side}", says, f"{SLOPE_AT_ROOT}-bound", values, relation))
    return statements, slopes


def _drifts(constants: ThresholdRule, zeta: Fraction) -> tuple[list[Statement], dict[str, tuple[Fraction, Fraction]]]:
    """All drifts, m/s, for which zeta, m, solves the equation: with c2/c1, and as printed."""
    turn = enclose(DRIFT_TURN, {}, Fraction(1), Fraction(4))
    statements = bracket("turn", "(sinh u + u)/u^2 has its minimum here.", DRIFT_TURN, {}, turn)
    enclosures = {}
    for name, ratio in (("drift", constants.c2 / constants.c1), ("printed_drift", constants.c1 / constants.c2)):
        m = {"m": ratio * constants.noise**2 / (4 * zeta**2)}
        if evaluate(DRIFT_LEVEL, m | {"u": turn[0]}) > 0:
            says = "zeta in force is optimal for no drift."
            values = {**m, "u": turn[0], "v": turn[1]}
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


def _replay(inputs: Mapping[str, Any], running: Fraction, root: float) -> dict[str, Any]:
    """The running Bayes risk at the root and at the code's threshold, and how far it is from the certified one."""
    constants = ThresholdRule.of(inputs)
    drift, noise, c1, c2 = (inputs[name] for name in ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2"))
    differences = []
    for scale, share in ((0.3, 0.0), (1.0, 0.0), (3.0, 0.0), (1.0, 0.5), (1.0, -0.5)):
        zeta, deviation = scale * root, share * scale * root
        u, w = constants.u(Fraction(zeta)), constants.u(Fraction(deviation))
        exact = float(evaluate(f"{risk()}+{BIAS}", constants.at(u=u, w=w)).mid())
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
