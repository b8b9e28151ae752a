"""LeafSystems: thin wrappers that give the pure maths named ports, rates and state."""

from airground_drake.sim.blocks.channel import Downlink, Uplink
from airground_drake.sim.blocks.controllers import UavController, UgvController
from airground_drake.sim.blocks.decision import DecisionBlock, DecisionVariable, EventTrigger
from airground_drake.sim.blocks.gatekeeper import DirectAcceptance, Gatekeeper
from airground_drake.sim.blocks.intervention import AllProposals, InterventionPlanner
from airground_drake.sim.blocks.monitor import Laws, Monitor, Rule, Violation
from airground_drake.sim.blocks.plant import VelocityDisturbance
from airground_drake.sim.blocks.sensing import PositionSensing

__all__ = [
    "AllProposals",
    "DecisionBlock",
    "DecisionVariable",
    "DirectAcceptance",
    "Downlink",
    "EventTrigger",
    "Gatekeeper",
    "InterventionPlanner",
    "Laws",
    "Monitor",
    "PositionSensing",
    "Rule",
    "UavController",
    "UgvController",
    "Uplink",
    "VelocityDisturbance",
    "Violation",
]
