"""The trigger of a scenario, read from the scenario."""

from typing import Any

from airground_drake.model.trigger.automaton import Trigger
from airground_drake.model.trigger.bayes import COMPUTED
from airground_drake.scenario.schema import Scenario

NUMBERS = ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2")  # the numbers of a threshold rule


def levels_of(scenario: Scenario) -> dict[str, float]:
    """Threshold and release level, m, and the dwell in force, s; the bare trigger has no release level and no dwell."""
    decision = scenario.decision
    zeta = float(threshold_m(scenario))
    if decision.trigger == "bare":
        return {"zeta_m": zeta, "released_below_m": zeta, "dwell_s": 0.0}
    return {"zeta_m": zeta, "released_below_m": float(decision.release_m), "dwell_s": float(decision.min_inter_event_s)}


def threshold_m(scenario: Scenario) -> float:
    """The decision threshold in force, m: the fixed one, or what its rule computes."""
    rule = scenario.decision.threshold
    if rule.rule in COMPUTED:
        return COMPUTED[rule.rule](rule.drift_m_s, rule.noise_m_sqrt_s, rule.c1_1_s, rule.c2)
    return rule.zeta_m


def trigger_of(inputs: dict[str, Any]) -> Trigger:
    return Trigger(inputs["zeta_m"], inputs["released_below_m"], inputs["dwell_s"])
