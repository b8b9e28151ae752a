"""The figure that compares runs by recursion (5) as printed with runs by the augmented projector."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from airground_drake.report.figures import timelines
from airground_drake.report.figures.panels import Figure, panel, series
from airground_drake.report.metrics import closest_obstacle
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace

MAX_RUNS = 6


def draw(scenario: Scenario, traces: Mapping[str, Trace]) -> Figure | None:
    """Distances by both compositions; None unless the runs have both."""
    printed = [name for name in traces if scenario.runs[name].composition.startswith("recursion")]
    methods = {scenario.runs[name].method for name in printed}
    augmented = [name for name in traces if name not in printed and scenario.runs[name].method in methods]
    if not printed or not augmented:
        return None
    runs = {name: traces[name] for name in [*augmented, *printed][:MAX_RUNS]}
    first = runs[augmented[0]]
    minima = {(name, ugv): closest_obstacle(trace, ugv) for name, trace in runs.items() for ugv in first.ugvs}
    if None in minima.values():  # no obstacle was there
        return None
    (_, robot), _ = min(minima.items(), key=lambda item: item[1].value_m if item[1] else np.inf)
    worst = {name: minima[name, robot] for name in runs}
    required = " or ".join(f"{d:g} m" for d in sorted({at.required_m for at in worst.values() if at}))
    listed = "; ".join(f"{_how(scenario, name)}: {at.value_m:.3f} m" for name, at in worst.items() if at)
    text = f"{robot}, smallest distance to an obstacle: {listed}; safe distance {required}."
    heading = f"Distance of {robot} to the nearest obstacle"
    gaps = {
        f"run {name}": np.interp(first.t, trace.t, timelines.nearest_distance(trace, robot))
        for name, trace in runs.items()
    }
    drawn = panel(
        timelines.compared_distances(runs, robot), "recursion-gaps", f"{heading}, {' and '.join(runs)}", text, heading,
        series(first, f"{heading}, m", gaps),
    )  # fmt: skip
    return Figure("recursion", "Recursion (5) against the augmented projector", text, (drawn,), beside="audit-1")


def _how(scenario: Scenario, run: str) -> str:
    """A run and its composition, in words."""
    composition = scenario.runs[run].composition
    printed = f"recursion (5), {composition.removeprefix('recursion_')} first"
    return f"run {run} ({printed if composition.startswith('recursion_') else composition})"
