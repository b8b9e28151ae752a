"""Event-triggered UAV-to-UGV intervention on Drake, with verification reports.

    from airground_drake import load, simulate
    from airground_drake.verify import verify

    scenario, digest = load("case_a")
    verdicts = verify(simulate(scenario, "d"))

`build_diagram(scenario)` gives the Drake Diagram; `python -m airground_drake.report case_a` does everything.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from airground_drake.diagram import build_diagram
    from airground_drake.errors import (
        AirgroundError,
        PluginError,
        ScenarioError,
        SimulationError,
        TraceError,
        UnknownNameError,
    )
    from airground_drake.scenarios.load import load
    from airground_drake.scenarios.schema import Scenario
    from airground_drake.simulation import simulate
    from airground_drake.trace import Trace

__all__ = [
    "AirgroundError",
    "PluginError",
    "Scenario",
    "ScenarioError",
    "SimulationError",
    "Trace",
    "TraceError",
    "UnknownNameError",
    "build_diagram",
    "load",
    "simulate",
]

_HOME = {
    "AirgroundError": "errors",
    "PluginError": "errors",
    "Scenario": "scenarios.schema",
    "ScenarioError": "errors",
    "SimulationError": "errors",
    "Trace": "trace",
    "TraceError": "errors",
    "UnknownNameError": "errors",
    "build_diagram": "diagram",
    "load": "scenarios.load",
    "simulate": "simulation",
}


def __getattr__(name: str) -> Any:
    """Import on first use, so that `airground_drake.check` and the solvers' processes load no Drake."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
