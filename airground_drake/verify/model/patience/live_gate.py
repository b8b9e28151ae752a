"""LIVE-GATE: an accepted intervention that goes as predicted is never given back, and ends in time.

The tracking error between prediction and run is a contraction with an input; obligations in `tracking_obligations`,
the running gatekeeper and the running control law in `tracking_runs`. Certificates: `obligations.json` and an SMT-LIB
script for each obligation.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from airground_drake.components import make_law, make_patience
from airground_drake.gatekeeper.patience import Patience
from airground_drake.registry import METHODS
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.engines.prover import LIMIT_S, discharge, finding, proved_again
from airground_drake.verify.finding import Finding
from airground_drake.verify.model.patience.tracking_obligations import Tracking, obligations
from airground_drake.verify.model.patience.tracking_runs import runs


class LiveGate(ModelClaim):
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
        "Where the intervention has every direction of the plane, the difference e between run and prediction obeys "
        "e' = (1 - Lambda h) e + h w, w what else moves the UGV in the run, less what does in the prediction: e is "
        "bounded by b. Within a ball of radius lag_m, with room, no avoidance inequality can bind, so that both are "
        "the same law. Polynomial implications with exact certificates, z3 and cvc5; what is late and what is over is "
        "read off the running `Patience`. The running gatekeeper and the running control law are run on random ways "
        "with room, disturbed by the most that is allowed: nothing may be given back. The report counts how many "
        "accepted interventions of its runs under (d) met the premise, from acceptance until they were given back or "
        "withdrawn."
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
        "The UAV does not withdraw the proposal. Rounding is not counted.",
    )
    does_not_establish = (
        "That a proposal is accepted, or goes as predicted: that depends on the others. Where the premise was not met, "
        "LIVE-PROG says what came of it, and LIVE-WAIT bounds the time."
    )

    exercised_by = "obligations of the proof"

    def inputs(self, scenario: Scenario) -> dict[str, Any]:
        """Gains, period, speed limits and the running patience's numbers."""
        law, patience = make_law(scenario, METHODS["d"]), make_patience(scenario)
        return {
            "intervention_gain_1_s": float(law.intervention_gain),
            "motion_gain_1_s": float(law.motion_gain),
            "avoidance_gain_1_s": float(law.avoidance.gain),
            "control_period_s": float(law.avoidance.period),
            "sensing_range_m": float(law.avoidance.sensing_range),
            "period_s": float(scenario.gatekeeper.period_s),
            "max_speed_m_s": max(float(ugv.max_speed_m_s) for ugv in scenario.ugvs.values()),
            "obstacle_m": _widest_m(scenario),
            "tries": int(patience.most),
            "rest_s": float(patience.rest),
            "longest_s": float(patience.longest),
            "lag_m": float(patience.lag),
            "behind_s": float(patience.behind),
        }

    def check(self, inputs: dict[str, Any]) -> Finding:
        """Prove, and run."""
        return judge(Tracking(), Patience, inputs)

    def takes(self, inputs: dict[str, Any], finding: Finding) -> bool:
        """The obligations once more, by expansion."""
        return proved_again(finding, obligations(Tracking(), Patience))


def _widest_m(scenario: Scenario) -> float:
    """The largest distance that the centre of a UGV has to keep from that of an obstacle, m."""
    of_ugvs = max(ugv.radius_m for ugv in scenario.ugvs.values())
    of_obstacles = max((obstacle.radius_m for obstacle in scenario.obstacles.values()), default=0.0)
    return float(scenario.safe_distance.obstacle_m + (of_ugvs + of_obstacles))


def judge(tracking: Tracking, kind: type[Patience], inputs: dict[str, Any]) -> Finding:
    """The finding for a kind of tracking and of patience."""
    patience = kind(*(inputs[name] for name in ("tries", "rest_s", "longest_s", "lag_m", "behind_s")))
    found = finding(discharge(obligations(tracking, kind), LIMIT_S))
    ran = runs(patience, inputs)
    evidence = {**found.evidence, "disturbance_m_s": inputs["intervention_gain_1_s"] * inputs["lag_m"], "runs": ran}
    given_back = [row for row in ran if row["given_back"]]
    if found.status != "proved":
        return replace(found, evidence=evidence)
    if given_back or inputs["intervention_gain_1_s"] * inputs["control_period_s"] > 1.0:
        return replace(found, status="error", evidence=evidence)  # the running code is not what was proved
    return replace(
        found, evidence=evidence, margin=inputs["lag_m"] - max(row["largest_excess_m"] for row in ran), unit="m",
        quantity="lag allowed above the predicted one, less the largest that a disturbed run had",
    )  # fmt: skip
