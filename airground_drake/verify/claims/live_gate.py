"""LIVE-GATE: an accepted intervention is not reversed without news, and ends in time (coq/Patience.v)."""

from typing import Any

from airground_drake.sim.trace import Trace
from airground_drake.verify.claims.live_wait import LiveWait
from airground_drake.verify.runs.passive import beside
from airground_drake.verify.runs.proposals import Acceptance, acceptances


class LiveGate(LiveWait):
    id = "LIVE-GATE"
    summary = "An accepted intervention is completed, unless a new obstacle is sensed."
    statement = (
        "Under method (d) a UGV ends an accepted intervention early only if it senses an obstacle that it did not know"
        " when it accepted. Otherwise the intervention ends with its motion, or after the longest time allowed."
    )
    latex = (
        r"\text{accepted}(t) \text{ for } t_0 \le t < \min(t_{\text{motion}}, t_0 + \tau_{\text{longest}})",
        r"t_{\text{over}} \le \min(t_{\text{motion}}, t_0 + \tau_{\text{longest}}) + h, \quad "
        r"h \text{ the period of the gatekeeper}",
    )
    method = (
        "Theorems in Coq about the transitions of an acceptance. Tests compare the transitions of the running "
        "`Patience` with the theorem's, and disturb the running gatekeeper and control law. LIVE-HYP checks the "
        "hypotheses on every run under (d). The report counts the acceptances without a new obstacle, and without an "
        "obstacle in range that may move."
    )
    equations = "(20)"
    assumptions = (
        "No obstacle is sensed that the UGV did not know at its acceptance. Obstacles in range stand still: an "
        "intervention beside one that may move is not counted.",
        "The UAV does not withdraw the proposal. It withdraws all parts of a joint plan when one UGV refuses its part.",
        "The gatekeeper is sampled every period. Rounding of times is not counted.",
    )
    does_not_establish = (
        "That a proposal is accepted, or that the UGV moves as predicted, which depends on the other robots. LIVE-WAIT"
        " bounds the time."
    )

    theorems = ("Patience.kept", "Patience.over_in_time")

    def numbers(self, inputs: dict[str, Any]) -> dict[str, Any]:
        return {"over_after_s": float(inputs["longest_s"] + inputs["period_s"])}

    def seen_in(self, trace: Trace) -> tuple[int, int]:
        """The number of acceptances without a new obstacle or one in range that may move, and of all."""
        accepted = [acceptance for of_ugv in acceptances(trace).values() for acceptance in of_ugv]
        met = [acceptance for acceptance in accepted if not (acceptance.news_s or _beside_a_mover(trace, acceptance))]
        return len(met), len(accepted)


def _beside_a_mover(trace: Trace, acceptance: Acceptance) -> bool:
    """Whether an obstacle that may move was within sensing range of the UGV while it executed the proposal."""
    for periods in beside(trace):
        t_s = trace.t[periods.row]
        meanwhile = (t_s >= acceptance.t_s) & (t_s <= acceptance.end_s)
        in_range = periods.apart_m <= trace.scenario.control.sensing_range_m
        if periods.pair.first == acceptance.on.ugv and (meanwhile & in_range).any():
            return True
    return False
