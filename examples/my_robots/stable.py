from fractions import Fraction
from typing import Any

from airground_drake import Finding, Scenario
from airground_drake.verify.claim import ModelClaim


class Stable(ModelClaim):
    """STABLE."""

    id = "STABLE"
    statement = "Sampled tracking does not overshoot: B h <= 1."
    formula = "B h <= 1"
    method = "Exact arithmetic."
    equations = "(6)"
    assumptions = ("Zero-order hold.",)
    does_not_establish = "Anything about avoidance."

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """The gain, 1/s, and the control period, s."""
        return {"gain_1_s": scenario.control.motion_gain_1_s, "period_s": scenario.control.period_s}

    def check(self, inputs: dict[str, Any]) -> Finding:
        """One product."""
        spare = 1 - Fraction(repr(inputs["gain_1_s"])) * Fraction(repr(inputs["period_s"]))
        status = "proved" if spare >= 0 else "refuted"
        return Finding(status, margin=float(spare), unit="1", quantity="1 less gain times period")
