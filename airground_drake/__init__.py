"""Event-triggered UAV-to-UGV intervention on Drake, with verification reports.

    scenario, digest = load("case_a")
    trace = simulate(scenario, "d")
    verdicts = verify(trace)

`build_diagram(scenario)` gives the Drake Diagram; `python -m airground_drake.report case_a` does everything.
"""

from airground_drake.diagram import build_diagram
from airground_drake.errors import AirgroundError, ScenarioError, TraceError
from airground_drake.scenarios.load import load
from airground_drake.scenarios.schema import Scenario
from airground_drake.simulation import simulate
from airground_drake.trace import Trace
from airground_drake.verify import verify

__all__ = [
    "AirgroundError",
    "Scenario",
    "ScenarioError",
    "Trace",
    "TraceError",
    "build_diagram",
    "load",
    "simulate",
    "verify",
]
