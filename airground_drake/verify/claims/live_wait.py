"""LIVE-WAIT: no UAV keeps a UGV from its own task for longer than a bound (coq/Patience.v)."""

from typing import Any

from airground_drake.base.exact import decimal
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify.model.theorem import Hypothesis, TheoremClaim
from airground_drake.verify.runs.proposals import below_avoidance


class LiveWait(TheoremClaim):
    id = "LIVE-WAIT"
    summary = "No UAV keeps a UGV from its own task for longer than a bound at a time; then the UGV rests."
    statement = (
        "Under method (d) a UAV keeps a UGV from its own task for a bounded time at most. Then the UGV is on its own "
        "until it has rested. This holds whatever the UAV proposes, withdraws, says of its map or names as its cause, "
        "and whatever a channel does to its messages."
    )
    latex: tuple[str, ...] = (
        r"\text{time executed between two rests} \le N (\tau_{\text{longest}} + h), \quad N \text{ tries}, \; "
        r"h \text{ the period of the gatekeeper}",
    )
    method = (
        "Theorems in Coq, by induction over any messages at any samples; the bounds follow from the scenario. Tests "
        "compare the transitions of the running `Patience` with the theorem's, and attack running gatekeepers that "
        "believe every prediction. LIVE-HYP checks tries and times on every run under (d)."
    )
    equations = "(20)"
    assumptions: tuple[str, ...] = (
        "The gatekeeper is sampled every period, and the controller executes what it accepts at its next sample.",
        "Rounding of times, 1e-15 s, is not counted.",
    )
    does_not_establish = (
        "How often a UAV does so: after each rest it may again. Nor that an accepted intervention is useful, that the "
        "UGV gets anywhere on its own, or that refused proposals cost only messages. Safety is SAFE-GATE."
    )

    theorems: tuple[str, ...] = ("Patience.bounded",)
    about_the_law = True
    margin_of = "longest intervention allowed"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        gate = scenario.gatekeeper
        return {
            "tries": int(gate.tries),
            "rest_s": float(gate.rest_s),
            "longest_s": float(gate.longest_s),
            "period_s": float(gate.period_s),
        }

    def hypotheses(self, inputs: dict[str, Any]) -> list[Hypothesis]:
        longest, period = decimal(inputs["longest_s"]), decimal(inputs["period_s"])
        return [
            Hypothesis.of(self.margin_of, "the longest intervention takes more than 0 s", longest, "s", strict=True),
            Hypothesis.of("gatekeeper's period", "the gatekeeper's period is above 0", period, "s", strict=True),
        ]

    def numbers(self, inputs: dict[str, Any]) -> dict[str, Any]:
        bound = inputs["tries"] * (decimal(inputs["longest_s"]) + decimal(inputs["period_s"]))
        return {"bound_s": float(bound)}

    def seen_in(self, trace: Trace) -> tuple[int, int]:
        return below_avoidance(trace)
