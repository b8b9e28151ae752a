"""THR-OPT: the Bayes threshold as the minimiser of the Bayes risk (16) (coq/Threshold.v)."""

from fractions import Fraction
from typing import Any

from airground_drake.base.exact import decimal
from airground_drake.model.trigger.bayes import bayes_risk
from airground_drake.scenario.schema import Scenario
from airground_drake.verify.claims.thr_root import ThrRoot, as_floats, rule_of, two_signs
from airground_drake.verify.engines.signs import RootInterval, ThresholdRule, ball, enclose, sign, value
from airground_drake.verify.model.levels import NUMBERS
from airground_drake.verify.model.theorem import Hypothesis, TheoremClaim

PRINTED = "Threshold.printed_is_worse"


class ThrOpt(TheoremClaim):
    id = "THR-OPT"
    summary = "The threshold of least Bayes risk is the root of the corrected equation."
    statement = (
        "Without initial deviation the root of the threshold equation is the only minimiser of the Bayes risk over all "
        "zeta; the root of the printed equation has a higher risk, unless c1 = c2: then it is the same root. With any "
        "initial deviation smaller than the root, the risk is lower at some other threshold."
    )
    latex = (
        r"B(\zeta) > B(\zeta_{\text{root}}) \text{ for every } \zeta \ne \zeta_{\text{root}}, \quad "
        r"c_1 \ne c_2 \; \Rightarrow \; B(\zeta_{\text{printed}}) > B(\zeta_{\text{root}})",
        r"0 < |y_0| < \zeta_{\text{root}} \; \Rightarrow \; B(\zeta, y_0) < B(\zeta_{\text{root}}, y_0) "
        r"\text{ for some } \zeta",
    )
    method = (
        "Theorems in Coq. Signs in ball arithmetic enclose both roots, and give a lower bound of the additional risk "
        "at the printed root. The drifts for which the threshold in force solves the equation, at most two, are "
        "enclosed as well."
    )
    equations = "(16)-(19)"
    assumptions = (
        "(17) and (18) with the initial deviation in seconds, that is divided by the drift (THR-DDM).",
        "Constants are the decimal numbers as which the scenario's values print; the drift is constant.",
    )
    does_not_establish = (
        "That minimising this risk is the right aim, that c1, c2, drift and noise are well chosen, or which threshold "
        "minimises the risk with an initial deviation."
    )

    theorems = (
        "Threshold.least",
        PRINTED,
        "Threshold.not_least_with_deviation",
        "Threshold.at_most_two_drifts",
    )
    margin_of = "risk at the printed form's root above that at the minimiser"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        return ThrRoot().inputs(scenario)

    def cited(self, inputs: dict[str, Any]) -> tuple[str, ...]:
        """All theorems, but the one about the printed equation only if c1 and c2 differ."""
        rule = rule_of(inputs)
        return tuple(name for name in self.theorems if name != PRINTED or rule.c1 != rule.c2)

    def hypotheses(self, inputs: dict[str, Any]) -> list[Hypothesis]:
        rule = rule_of(inputs)
        of_root = ThrRoot().hypotheses(inputs)
        if rule.c1 == rule.c2:
            return [*of_root, Hypothesis.of(self.margin_of, "c1 = c2: both equations have the same root", Fraction(0))]
        printed = rule.printed_root
        return [
            *of_root,
            *two_signs("the printed (19)", printed),
            Hypothesis.of(self.margin_of, "the risk at the printed root is higher", _gap(rule, printed), strict=True),
        ]

    def numbers(self, inputs: dict[str, Any]) -> dict[str, Any]:
        rule, zeta = rule_of(inputs), inputs["zeta_m"]
        root, printed = rule.root, rule.printed_root
        numbers = [inputs[name] for name in NUMBERS]
        return {
            "enclosures": as_floats(rule, root) | as_floats(rule, printed, "printed_"),
            "optimal_for_drifts_m_s": _drifts(rule, decimal(zeta)),
            "threshold_in_force_m": zeta,
            "risk_at_the_root": float(bayes_risk(float(rule.zeta(root.low)), *numbers)),
            "risk_at_the_threshold_in_force": float(bayes_risk(zeta, *numbers)),
        }


def _gap(rule: ThresholdRule, printed: RootInterval) -> Fraction:
    """A lower bound of the risk at the printed root less that at the root: of the ends next to each other."""
    root = rule.root
    v, u = (printed.high, root.low) if rule.c1 < rule.c2 else (printed.low, root.high)
    return Fraction(float((value(rule.risk, v) - value(rule.risk, u)).lower()))


def _drifts(rule: ThresholdRule, zeta: Fraction) -> list[list[float]]:
    """Enclosures of the drifts, m/s, for which zeta, m, solves the equation: two, or none."""
    # The equation is (sinh u + u)/u^2 = m at the drift u noise^2 / (2 zeta), m = c2/c1 noise^2/(4 zeta^2). The left
    # side falls to its least value, near u = 2.4, and rises again: there are at most two
    # (`Threshold.at_most_two_drifts`).
    m = rule.c2 / rule.c1 * rule.noise**2 / (4 * zeta**2)

    def level(u: Any) -> Any:
        return (u.sinh() + u) / u**2 - ball(m)

    turn = enclose(lambda u: u * u.cosh() - u - 2 * u.sinh(), Fraction(1), Fraction(4))
    if sign(level, turn.low) > 0:
        return []
    return [
        [float(u * rule.noise**2 / (2 * zeta)) for u in ends[:2]]
        for ends in (enclose(level, Fraction(1, 2**200), turn.low), enclose(level, turn.high))
    ]
