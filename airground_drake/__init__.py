"""Event-triggered UAV-to-UGV intervention on Drake, with verification reports.

    from airground_drake import judge, load, simulate

    scenario = load("case_a")
    findings = judge(simulate(scenario, "d"))

`build_diagram(scenario)` gives the Drake Diagram; `write_report(scenario, folder)` and `python -m
airground_drake.report case_a` simulate, judge and write the report.
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from airground_drake.base.errors import (
        AirgroundError,
        PluginError,
        ScenarioError,
        SimulationError,
        TraceError,
        UnknownNameError,
    )
    from airground_drake.model.geometry.motion import Motion
    from airground_drake.report.make import write_report
    from airground_drake.report.view.plane import plot
    from airground_drake.scenario.load import load
    from airground_drake.scenario.schema import Scenario
    from airground_drake.sim.diagram import build_diagram
    from airground_drake.sim.simulation import simulate
    from airground_drake.sim.trace import Trace
    from airground_drake.study.campaign.sweep import sweep
    from airground_drake.uav.policy import Observation, Policy, Proposal
    from airground_drake.verify.claim import TraceClaim
    from airground_drake.verify.finding import Finding
    from airground_drake.verify.judging import judge

__all__ = [
    "AirgroundError",
    "Finding",
    "Motion",
    "Observation",
    "PluginError",
    "Policy",
    "Proposal",
    "Scenario",
    "ScenarioError",
    "SimulationError",
    "Trace",
    "TraceClaim",
    "TraceError",
    "UnknownNameError",
    "build_diagram",
    "judge",
    "load",
    "plot",
    "simulate",
    "sweep",
    "write_report",
]

_HOME = {
    "AirgroundError": "base.errors",
    "Finding": "verify.finding",
    "Motion": "model.geometry.motion",
    "Observation": "uav.policy",
    "PluginError": "base.errors",
    "Policy": "uav.policy",
    "Proposal": "uav.policy",
    "Scenario": "scenario.schema",
    "ScenarioError": "base.errors",
    "SimulationError": "base.errors",
    "Trace": "sim.trace",
    "TraceClaim": "verify.claim",
    "TraceError": "base.errors",
    "UnknownNameError": "base.errors",
    "build_diagram": "sim.diagram",
    "judge": "verify.judging",
    "load": "scenario.load",
    "plot": "report.view.plane",
    "simulate": "sim.simulation",
    "sweep": "study.campaign.sweep",
    "write_report": "report.make",
}


def __getattr__(name: str) -> Any:
    """Import on first use, so that `airground_drake.check` and the solvers' processes load no Drake."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)


if "IPython" in sys.modules:
    import_module(f"{__name__}.notebook").register()
