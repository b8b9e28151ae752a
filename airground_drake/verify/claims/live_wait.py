"""LIVE-WAIT: no UAV keeps a UGV from its own task for longer than a bound (coq/Patience.v)."""

from typing import Any

from airground_drake.base.exact import decimal
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify.model.theorem import Hypothesis, TheoremClaim
from airground_drake.verify.runs.proposals import below_avoidance


class LiveWait(TheoremClaim):
    id = "LIVE-WAIT"
    summary = "A UAV keeps a UGV from its own task for at most a bounded time; then the UGV rests."
    statement = (
        "Under method (d) a UAV keeps a UGV from its own task for at most a bounded time. Then the UGV follows its own"
        " task until it has rested. This holds for any proposals, withdrawals, maps and causes that the UAV sends, and"
        " for any delay or loss of messages."
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
        "How often a UAV does so: it may do so again after each rest. That an accepted intervention is useful, that "
        "the UGV makes progress on its own, or that refused proposals cost only messages. SAFE-GATE is about safety."
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
