"""Event-triggered UAV-to-UGV intervention on Drake, with verification reports.

    from airground_drake import judge, load, simulate

    scenario = load("case_a")
    findings = judge(simulate(scenario, "d"))

`build_diagram(scenario)` gives the Drake Diagram; `write_report(scenario, folder)` and
`python -m airground_drake.report case_a` do everything.
"""

from __future__ import annotations

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
    from airground_drake.campaign.sweep import sweep
    from airground_drake.geometry.motion import Motion
    from airground_drake.intervention.policy import Observation, Policy, Proposal
    from airground_drake.report.make import write_report
    from airground_drake.run.simulation import simulate
    from airground_drake.run.trace import Trace
    from airground_drake.scenarios.load import load
    from airground_drake.scenarios.schema import Scenario
    from airground_drake.systems.diagram import build_diagram
    from airground_drake.verify.claim import TraceClaim
    from airground_drake.verify.finding import Finding
    from airground_drake.verify.judging import judge
    from airground_drake.view.plane import plot

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
    "Motion": "geometry.motion",
    "Observation": "intervention.policy",
    "PluginError": "base.errors",
    "Policy": "intervention.policy",
    "Proposal": "intervention.policy",
    "Scenario": "scenarios.schema",
    "ScenarioError": "base.errors",
    "SimulationError": "base.errors",
    "Trace": "run.trace",
    "TraceClaim": "verify.claim",
    "TraceError": "base.errors",
    "UnknownNameError": "base.errors",
    "build_diagram": "systems.diagram",
    "judge": "verify.judging",
    "load": "scenarios.load",
    "plot": "view.plane",
    "simulate": "run.simulation",
    "sweep": "campaign.sweep",
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
