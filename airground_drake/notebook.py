"""Formatters of scenarios, traces, verdicts and diagrams for IPython notebooks.

They are separate so that the classes shown need not know about pictures. `import airground_drake` in a notebook calls
`register`.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # a notebook that shows such an object has imported its module
    from pydrake.systems.framework import Diagram

    from airground_drake.scenario.schema import Scenario
    from airground_drake.sim.trace import Trace
    from airground_drake.verify.claim import Verdict


def scenario_html(scenario: Scenario) -> str:
    """Title, a map with the preset trajectories, robots and runs."""
    from airground_drake.base.registry import METHODS
    from airground_drake.report.view.plane import thumbnail

    ugvs = [
        f"{name} from {_place(ugv.start_m)} to {_place(ugv.target_m)}, at most {ugv.max_speed_m_s:g} m/s"
        for name, ugv in scenario.ugvs.items()
    ]
    lines = [f"run {name}: ({run.method}) {METHODS[run.method].says}" for name, run in scenario.runs.items()]
    uavs = [f"{name}, the UAV" for name in scenario.aerial]
    listed = "".join(f"<li>{escape(line)}</li>" for line in (*ugvs, *uavs, *lines))
    title = f"<p><b>{escape(scenario.title or scenario.name)}</b> {escape(repr(scenario))}</p>"
    return f"{title}{_element(thumbnail(scenario))}<ul>{listed}</ul>"


def trace_html(trace: Trace) -> str:
    """The line of `repr` and a table of the events."""
    import pandas as pd

    rows = [(f"{event['t_s']:.3f}", event["robot"], event["kind"]) for event in trace.events]
    table = pd.DataFrame(rows, columns=["time, s", "robot", "event"]).to_html(index=False, border=0)
    return f"<p>{escape(repr(trace))}</p>{table}"


def verdict_html(verdict: Verdict) -> str:
    """The line of `repr`, the claim's statement, and what it does not establish."""
    claim = verdict.claim
    says = (repr(verdict), claim.statement, f"Does not establish: {claim.does_not_establish}")
    return "".join(f"<p>{escape(line)}</p>" for line in says)


def diagram_html(diagram: Diagram) -> str | None:
    """The picture of a scenario's diagram; None for other Drake diagrams."""
    from airground_drake.sim import graphviz

    return _element(graphviz.svg(graphviz.dot(diagram))) if graphviz.has_layers(diagram) else None


# What is shown of objects, by the module and the name of their class.
SHOWN = {
    "airground_drake.scenario.schema:Scenario": scenario_html,
    "airground_drake.sim.trace:Trace": trace_html,
    "airground_drake.verify.claim:Verdict": verdict_html,
    "pydrake.systems.framework:Diagram": diagram_html,
}


def register() -> None:
    """Tell IPython, if this process is one of its shells."""
    shell = sys.modules["IPython"].get_ipython()
    if shell is not None:
        for place, show in SHOWN.items():
            shell.display_formatter.formatters["text/html"].for_type_by_name(*place.split(":"), show)


def _element(document: str) -> str:
    """An SVG document without what comes before its element."""
    return document[document.index("<svg") :]


def _place(at: Sequence[float]) -> str:
    return f"({at[0]:g}, {at[1]:g}) m"
