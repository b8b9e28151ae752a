"""LeafSystems: thin shells that give the pure maths named ports, rates and state."""

from airground_drake.systems.controllers import UavController, UgvController
from airground_drake.systems.decision import DecisionBlock, DecisionVariable, EventTrigger
from airground_drake.systems.gatekeeper import DirectAcceptance, Gatekeeper
from airground_drake.systems.intervention import InterventionPlanner
from airground_drake.systems.monitor import Laws, Monitor, Rule, Violation
from airground_drake.systems.plant import VelocityDisturbance

__all__ = [
    "DecisionBlock",
    "DecisionVariable",
    "DirectAcceptance",
    "EventTrigger",
    "Gatekeeper",
    "InterventionPlanner",
    "Laws",
    "Monitor",
    "Rule",
    "UavController",
    "UgvController",
    "VelocityDisturbance",
    "Violation",
]
