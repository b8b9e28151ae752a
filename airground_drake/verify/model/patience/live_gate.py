"""LIVE-GATE: an accepted intervention that goes as predicted is never given back, and ends in time (proofs/Gate.v).

The difference e between run and prediction obeys e' = (1 - Lambda h) e + h w: w is what else moves the UGV in the run,
less what does in the prediction.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.model.patience.live_wait import LiveWait
from airground_drake.verify.model.theorem import Hypothesis, TheoremClaim, decimal


class LiveGate(TheoremClaim):
    """LIVE-GATE."""

    id = "LIVE-GATE"
    summary = "An accepted intervention that goes as predicted is carried through to its end."
    statement = (
        "Under method (d) an accepted intervention that leaves no direction of the plane to the UGV's own task is "
        "never given back before its time, and is over when its motion is, as long as no obstacle is sensed that was "
        "not known at its acceptance, and whatever else moves the UGV differs little from the prediction: other "
        "robots, contact, corners of the motion, disturbances."
    )
    formula = (
        "J^+ J = I in the plane; e = p - predicted, e' = (1 - Lambda h) e + h w; b' = (1 - Lambda h) b + h ||w||, b = "
        "||e|| at the acceptance; if b <= lag_m at every sample: |p - predicted| <= lag_m, so lag <= predicted lag + "
        "lag_m: never late; over by t0 + length / speed + h for a motion of that length at that speed, if that is no "
        "more than longest_s. b <= lag_m where ||w|| <= Lambda lag_m, as where predicted distances are >= d + v h + "
        "lag_m (robots: d + 2 v h + lag_m) and |disturbance| <= Lambda lag_m; w = 0 where all is as predicted"
    )
    latex = (
        r"J^+ J = I \text{ in the plane}, \quad e = p - p_{\text{predicted}}, \quad e_{k+1} = (1 - \Lambda h) e_k + h "
        r"w_k",
        r"b_{k+1} = (1 - \Lambda h) b_k + h \lVert w_k \rVert, \quad b_0 = \lVert e_0 \rVert, \quad b_k \le \ell "
        r"\text{ for all } k",
        r"\Rightarrow \; \lVert p - p_{\text{predicted}} \rVert \le \ell \text{ at every sample}, \quad "
        r"\text{lag} \le \text{lag}_{\text{predicted}} + \ell",
        r"t_{\text{over}} \le t_0 + \frac{\text{length}}{\text{speed}} + h \quad \text{if that is no more "
        r"than } t_0 + \tau_{\text{longest}}",
    )
    method = (
        "Theorems in Coq: the difference stays within b; where w is at most Lambda lag_m, b stays within lag_m; with "
        "room no inequality binds, so that run and prediction follow the same law. Checked here: the gain times the "
        "control period is at most 1, and the lag allowed is above 0. The report counts how many accepted "
        "interventions of its runs under (d) met the premise, from acceptance until they were given back or withdrawn. "
        "Tests disturb the running gatekeeper and control law by the most that is allowed."
    )
    equations = "(14), (20)"
    assumptions = (
        "J^+ J is the identity in the plane, as in every proposal of a `BehaviourDatabase`. Along a direction that is "
        "left to the own task that one's gain acts, not Lambda, and the UGV may be pushed out of the room. LIVE-PROG "
        "counts the accepted proposals of a run that leave one (`leave_a_direction`).",
        "No obstacle is sensed that the UGV did not know at its acceptance.",
        "b <= lag_m: what avoidance and the speed limit change of the command in the run (other robots where they are) "
        "differs little from what they change in the prediction (other robots where they are predicted). So does the "
        "rate of the motion from that of the motion sampled every period (the same but at its corners).",
        "A UGV that is on time at every sample is never late: `Patience` gives back only what has been behind for "
        "longer than behind_s.",
        "The UAV does not withdraw the proposal. Rounding is not counted.",
    )
    does_not_establish = (
        "That a proposal is accepted, or goes as predicted: that depends on the others. Where the premise was not met, "
        "LIVE-PROG says what came of it, and LIVE-WAIT bounds the time."
    )

    theorems = ("Gate.tracking_bounded", "Gate.tracking_contracts", "Gate.room")
    margin_of = "1 less gain times period"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """The gain of an intervention, the control period, and the numbers of a UGV's patience."""
        control = scenario.control
        gains = {"intervention_gain_1_s": control.intervention_gain_1_s, "control_period_s": control.period_s}
        return {**{name: float(value) for name, value in gains.items()}, **LiveWait().inputs(scenario)}

    def hypotheses(self, inputs: dict[str, Any]) -> list[Hypothesis]:
        """Lambda h is at most 1; lag and time behind are above 0."""
        gain, h = decimal(inputs["intervention_gain_1_s"]), decimal(inputs["control_period_s"])
        lag, behind = decimal(inputs["lag_m"]), decimal(inputs["behind_s"])
        return [
            Hypothesis(self.margin_of, f"Lambda h = {float(gain * h):g} is at most 1", Fraction(1) - gain * h),
            Hypothesis("gain", "the gain Lambda is not negative", gain, "1/s"),
            Hypothesis("period", "the control period is above 0", h, "s", strict=True),
            Hypothesis("lag allowed", "the lag allowed is above 0", lag, "m", strict=True),
            Hypothesis("time behind", "the time for which a UGV may be behind is above 0", behind, "s", strict=True),
        ]

    def numbers(self, inputs: dict[str, Any]) -> dict[str, Any]:
        """The disturbance, m/s, under which b stays within the lag allowed."""
        return {"disturbance_m_s": float(decimal(inputs["intervention_gain_1_s"]) * decimal(inputs["lag_m"]))}
