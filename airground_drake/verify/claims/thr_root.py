"""THR-ROOT: the Bayes threshold as the one root of (19) (coq/Threshold.v), enclosed by two signs."""

from dataclasses import asdict
from fractions import Fraction
from typing import Any

from airground_drake.base.exact import decimal
from airground_drake.model.trigger.bayes import optimal_threshold, threshold
from airground_drake.scenario.schema import Scenario
from airground_drake.verify.engines.signs import RootInterval, ThresholdRule, value
from airground_drake.verify.model.levels import NUMBERS
from airground_drake.verify.model.theorem import Hypothesis, TheoremClaim

# The program's threshold may be this far outside its enclosure, relative to it: rounding errs by some 1e-15.
FLOAT_TOLERANCE = Fraction(1, 10**12)


class ThrRoot(TheoremClaim):
    id = "THR-ROOT"
    summary = "The threshold equation has exactly one solution, and the program finds it."
    statement = "The threshold equation, with c2/c1 on the right, has exactly one root, and the code returns it."
    latex = (
        r"\frac{\sigma^2}{\mu^2} (\sinh u + u) = \frac{c_2}{c_1} \text{ for one } u > 0 \text{ only}, \quad "
        r"\zeta = \frac{u \sigma^2}{2 \mu}",
    )
    method = (
        "Theorems in Coq: the left side increases strictly, so there is one root, and two points with different signs "
        "enclose it. Ball arithmetic (256 bits) decides both signs, at rational points at most 1e-12 apart (relative). "
        "The value of `optimal_threshold` must lie between the points to within 1e-12 (relative)."
    )
    equations = "(19) with c2/c1 for the printed c1/c2"
    assumptions = (
        "Constants are the decimal numbers as which the scenario's values print.",
        "With a fixed threshold the root is not in force; it is then the threshold that the rule's numbers would give.",
    )
    does_not_establish = (
        "That the root minimises anything (THR-OPT), that drift and noise of the rule describe a robot, or that a "
        "decision variable follows (15) at all."
    )

    theorems = ("Threshold.increasing", "Threshold.exactly_one", "Threshold.enclosed")
    margin_of = "threshold against its enclosure"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        rule = scenario.decision.threshold
        numbers = {name: getattr(rule, name) for name in NUMBERS}
        return {"rule": rule.rule, **numbers, "zeta_m": threshold(**asdict(rule))}

    def hypotheses(self, inputs: dict[str, Any]) -> list[Hypothesis]:
        rule = rule_of(inputs)
        root = rule.root
        judged = [Fraction(self.computed(inputs))]
        if inputs["rule"] == "bayes":
            judged.append(Fraction(inputs["zeta_m"]))
        low, high = rule.zeta(root.low), rule.zeta(root.high)
        says = "the program's threshold is between the points, to within 1e-12"
        outside = max(max(low - zeta, zeta - high) for zeta in judged)
        return [
            *(
                Hypothesis.of(name, f"{name} is above 0", number, strict=True)
                for name, number in rule._asdict().items()
            ),
            *two_signs("(19)", root),
            Hypothesis.of(self.margin_of, says, FLOAT_TOLERANCE * high - outside, "m"),
        ]

    def numbers(self, inputs: dict[str, Any]) -> dict[str, Any]:
        rule = rule_of(inputs)
        return {"enclosures": as_floats(rule, rule.root), "computed_threshold_m": self.computed(inputs)}

    def counterexample(self, inputs: dict[str, Any], broken: Hypothesis) -> dict[str, Any] | None:
        if broken.hypothesis != self.margin_of:
            return None
        rule, zeta = rule_of(inputs), self.computed(inputs)
        residual = value(rule.residual(rule.c2 / rule.c1), rule.u(Fraction(zeta)))
        return {"computed_threshold_m": zeta, "residual_of_the_equation_s": float(residual.mid())}

    def computed(self, inputs: dict[str, Any]) -> float:
        """The threshold that the program computes for these numbers, m."""
        return float(optimal_threshold(*(inputs[name] for name in NUMBERS)))


def rule_of(inputs: dict[str, Any]) -> ThresholdRule:
    """The threshold rule of a claim's inputs, exactly."""
    return ThresholdRule(*(decimal(inputs[name]) for name in NUMBERS))


def two_signs(what: str, ends: RootInterval) -> list[Hypothesis]:
    """That a function is below 0 at the lower end of an enclosure, and above 0 at the upper one."""
    signs = zip(("below", "above"), ends[:2], (-ends.signs[0], ends.signs[1]), strict=True)
    return [
        Hypothesis.of(f"sign of {what}", f"{what} is {side} 0 at u = {float(u)!r}", Fraction(right), strict=True)
        for side, u, right in signs
    ]


def as_floats(rule: ThresholdRule, root: RootInterval, prefix: str = "") -> dict[str, list[float]]:
    """The enclosures of u and of the threshold, m."""
    return {f"{prefix}u": [float(u) for u in root[:2]], f"{prefix}zeta_m": [float(rule.zeta(u)) for u in root[:2]]}
