"""Event-triggered UAV-to-UGV intervention on Drake, with verification reports.

    from airground_drake import load, simulate
    from airground_drake.verify import verify

    scenario = load("case_a")
    verdicts = verify(simulate(scenario, "d"))

`build_diagram(scenario)` gives the Drake Diagram; `python -m airground_drake.report case_a` does everything.
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
    from airground_drake.run.simulation import simulate
    from airground_drake.run.trace import Trace
    from airground_drake.scenarios.load import load
    from airground_drake.scenarios.schema import Scenario
    from airground_drake.systems.diagram import build_diagram
    from airground_drake.view.plane import plot

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
    "plot",
    "simulate",
]

_HOME = {
    "AirgroundError": "base.errors",
    "PluginError": "base.errors",
    "Scenario": "scenarios.schema",
    "ScenarioError": "base.errors",
    "SimulationError": "base.errors",
    "Trace": "run.trace",
    "TraceError": "base.errors",
    "UnknownNameError": "base.errors",
    "build_diagram": "systems.diagram",
    "load": "scenarios.load",
    "plot": "view.plane",
    "simulate": "run.simulation",
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
