"""THR-ISO: no crossing between two updates is missed, and none is invented.

The obligations and the comparison with the running system are in `isolation.py`; what is proved is the formula of
`decision.excursion`, what is compared is `systems.decision.EventTrigger`. Certificates: `obligations.json` and an
SMT-LIB script for each.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from airground_drake.components import make_trigger, threshold
from airground_drake.decision.trigger import Trigger
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.engines.prover import LIMIT_S, discharge, finding, proved_again
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.trigger.isolation import conformance, obligations


class ThrIso(ModelClaim):
    """THR-ISO."""

    id = "THR-ISO"
    summary = "No crossing of the threshold slips through between two updates, and none is invented."
    statement = (
        "Between two updates no crossing of a level is missed, however briefly the decision variable is beyond it, and "
        "none is invented: at the end of a simulation step the trigger knows the least and the largest value that the "
        "variable had in the step."
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
        "Convexity and Cauchy's inequality as polynomial implications with exact certificates; z3 and cvc5 on the "
        "negations. The running `EventTrigger`, its witness and its update, is compared on random steps, most of them "
        "with an end or a minimum close to a level, with extremes found by search in 256 bits. As the least value so "
        "far never rises within a step and the largest never falls, what has become due stays due until the step "
        "ends, so that Drake sees the witness change its sign and isolates it."
    )
    equations = "(15), (20)"
    assumptions = (
        "Within a step of the simulator positions, references between corners, and noise are linear in time.",
        "Drake isolates a witness that has changed its sign over a step; crossings are then late by 1e-6 s at most "
        "(THR-TRIG measures it), and by 1e-9 s in steps shorter than that, which are not looked into.",
        "Rounding: x may miss a level by 1e-13 of the largest number in the step.",
    )
    does_not_establish = (
        "That the transitions themselves are right (ZENO-PROOF reads them off), or anything about a Wiener path "
        "between the noise samples. Two crossings closer than the isolation, 1e-6 s, may be taken at one instant."
    )

    exercised_by = "obligations of the proof"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """The running trigger's levels, m, and dwell, s."""
        trigger = make_trigger(scenario, threshold(scenario))
        levels = {"zeta_m": float(trigger.zeta), "released_below_m": float(trigger.release)}
        return {**levels, "dwell_s": float(trigger.dwell)}

    def check(self, inputs: dict[str, Any]) -> Finding:
        """Discharge the obligations, compare the running system."""
        return judge(Trigger(inputs["zeta_m"], inputs["released_below_m"], inputs["dwell_s"]))

    def takes(self, inputs: dict[str, Any], finding: Finding) -> bool:
        """The obligations once more, by expansion."""
        return proved_again(finding, obligations())


def judge(trigger: Trigger) -> Finding:
    """The finding for a trigger, with the systems as they run."""
    compared = conformance(trigger)
    found = finding(discharge(obligations(), LIMIT_S), conformance=compared)
    if found.status == "proved" and compared["missed"] + compared["spurious"]:
        return replace(found, status="refuted", counterexample=compared["first"])
    return found
