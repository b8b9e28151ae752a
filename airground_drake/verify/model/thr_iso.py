"""THR-ISO: no crossing between two updates is missed, and none is invented (proofs/Isolation.v)."""

from __future__ import annotations

from typing import Any

from airground_drake.base.exact import decimal
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.model.levels import levels_of
from airground_drake.verify.model.theorem import Hypothesis, TheoremClaim


class ThrIso(TheoremClaim):
    """THR-ISO."""

    id = "THR-ISO"
    summary = "No crossing of the threshold slips through between two updates, and none is invented."
    statement = (
        "Between two updates no crossing of a level is missed, however briefly the decision variable is beyond it, and "
        "none is invented: its largest value is at an end, and its least value has a closed form."
    )
    formula = (
        "x(s) = ||e0 + s (e1 - e0)|| + n0 + s (n1 - n0), s in [0, 1]: max x = max(x(0), x(1)); min x is the least of "
        "x(0), x(1) and p w + const where that lies in the step, p the distance of the line from the origin, "
        "w = sqrt(1 - k^2), k = (n1 - n0)/||e1 - e0||"
    )
    latex = (
        r"x(s) = \lVert e_0 + s (e_1 - e_0) \rVert + n_0 + s (n_1 - n_0), \quad s \in [0, 1]",
        r"\max x = \max(x(0), x(1)), \quad \min x = \min(x(0), x(1), p w + \text{const})",
        r"w = \sqrt{1 - k^2}, \quad k = \frac{n_1 - n_0}{\lVert e_1 - e_0 \rVert}, \quad p \text{ the "
        r"distance of the line from the origin}",
    )
    method = (
        "Theorems in Coq. Checked here: noise is updated at control samples only, so that it is linear between two "
        "updates. Within a step the least value so far never rises and the largest never falls, so a due transition "
        "stays due until the step ends. Drake then sees the witness change its sign and isolates it. Tests compare "
        "the running trigger with dense sampling."
    )
    equations = "(15), (20)"
    assumptions = (
        "Within a step of the simulator positions, references between corners, and noise are linear in time.",
        "Drake isolates a witness that has changed its sign over a step; crossings are then late by 1e-6 s at most "
        "(THR-TRIG measures it), and by 1e-9 s in steps shorter than that, which are not looked into.",
        "Rounding: x may miss a level by 1e-13 of the largest number in the step.",
    )
    does_not_establish = (
        "That the transitions themselves are right (ZENO-PROOF), or anything about a Wiener path between the noise "
        "samples. Two crossings closer than the isolation, 1e-6 s, may be taken at one instant."
    )

    theorems = ("Isolation.largest_at_an_end", "Isolation.nowhere_below", "Isolation.attained")
    margin_of = "threshold in force"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """The trigger's levels, m, and dwell, s; the periods of noise and control, s."""
        periods = {"noise_period_s": scenario.decision.noise_period_s, "period_s": scenario.control.period_s}
        return {**levels_of(scenario), **{name: float(value) for name, value in periods.items()}}

    def hypotheses(self, inputs: dict[str, Any]) -> list[Hypothesis]:
        """The threshold is positive, and noise changes its rate at control samples only."""
        steps = decimal(inputs["noise_period_s"]) / decimal(inputs["period_s"])
        says = f"the noise period is a whole number of control periods: {float(steps):g}"
        return [
            Hypothesis.of(self.margin_of, "the threshold is above 0", decimal(inputs["zeta_m"]), "m", strict=True),
            Hypothesis.of("noise periods beside control samples", says, -(steps % 1)),
            Hypothesis.of("control periods in a noise period", "there is at least one", steps - 1),
        ]
