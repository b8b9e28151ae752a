"""The trigger of a scenario, read from the scenario."""

from dataclasses import asdict
from typing import Any

from airground_drake.model.trigger.automaton import Trigger
from airground_drake.model.trigger.bayes import threshold
from airground_drake.scenario.schema import Scenario

LEVELS = ("zeta_m", "released_below_m", "dwell_s")
NUMBERS = ("drift_m_s", "noise_m_sqrt_s", "c1_1_s", "c2")  # the numbers of a threshold rule


def levels_of(scenario: Scenario) -> dict[str, float]:
    """Threshold and release level, m, and the dwell in force, s."""
    levels = scenario.decision.levels(threshold(**asdict(scenario.decision.threshold)))
    return dict(zip(LEVELS, map(float, levels), strict=True))


def trigger_of(inputs: dict[str, Any]) -> Trigger:
    return Trigger(*(inputs[name] for name in LEVELS))
