"""The figure that compares runs by recursion (5) as printed with runs by the augmented projector."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.report.figures import maps, timelines
from airground_drake.report.figures.panels import Figure, panel, series
from airground_drake.report.metrics import closest_obstacle
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Scenario
from airground_drake.verify.runs.pairs import centres_of
from airground_drake.view.plane import Frame

MAX_RUNS = 6


def draw(scenario: Scenario, traces: Mapping[str, Trace]) -> Figure | None:
    """Paths and distances by both compositions; None unless the runs have both."""
    printed = [name for name in traces if scenario.runs[name].composition.startswith("recursion")]
    methods = {scenario.runs[name].method for name in printed}
    augmented = [name for name in traces if name not in printed and scenario.runs[name].method in methods]
    if not printed or not augmented or not scenario.obstacles:
        return None
    runs = {name: traces[name] for name in [*augmented, *printed][:MAX_RUNS]}
    first = runs[augmented[0]]
    minima = {(name, ugv): closest_obstacle(trace, ugv) for name, trace in runs.items() for ugv in first.ugvs}
    (_, robot), _ = min(minima.items(), key=lambda item: item[1].value if item[1] else np.inf)
    gaps = {name: timelines.nearest_distance(trace, robot) for name, trace in runs.items()}
    d = scenario.safe_distance.obstacle_m
    frame = _frame(runs, robot, gaps)
    worst = {name: minima[name, robot] for name in runs}
    listed = "; ".join(f"{_how(scenario, name)}: {at.value:.3f} m" for name, at in worst.items() if at)
    text = f"{robot}, smallest distance to an obstacle: {listed}; safe distance {d:g} m."
    drawings = (
        ("paths", "Paths near the obstacles", maps.compared_paths(runs, robot, frame)),
        ("gaps", "Distance to the nearest obstacle", timelines.compared_distances(runs, robot)),
    )
    tables = (
        {
            f"run {name} {axis}": np.interp(first.t, trace.t, trace.position(robot)[:, k])
            for name, trace in runs.items()
            for k, axis in enumerate("xy")
        },
        {f"run {name}": np.interp(first.t, runs[name].t, gap) for name, gap in gaps.items()},
    )
    panels = tuple(
        panel(
            drawing, f"recursion-{key}", f"{heading} of {robot}, {' and '.join(runs)}", text, heading,
            series(first, f"{heading} of {robot}, m", columns),
        )
        for (key, heading, drawing), columns in zip(drawings, tables, strict=True)
    )  # fmt: skip
    return Figure("recursion", "Recursion (5) against the augmented projector", text, panels, beside="audit-1")


def _how(scenario: Scenario, run: str) -> str:
    """A run and its composition, in words."""
    composition = scenario.runs[run].composition
    printed = f"recursion (5), {composition.removeprefix('recursion_')} first"
    return f"run {run} ({printed if composition.startswith('recursion_') else composition})"


def _frame(runs: Mapping[str, Trace], robot: str, gaps: Mapping[str, Array]) -> Frame:
    """The rectangle around the closest approaches of the runs and the two nearest obstacles."""
    closest = np.array([trace.position(robot)[int(gaps[name].argmin()), :2] for name, trace in runs.items()])
    first = next(iter(runs.values()))
    centres = centres_of(first)[:, :2]
    reach = np.linalg.norm(centres - closest.mean(axis=0), axis=1)
    points = np.concatenate([closest, centres[np.argsort(reach, kind="stable")[:2]]])
    pad = 0.4 * float(first.scenario.safe_distance.obstacle_m)
    (left, bottom), (right, top) = points.min(axis=0) - pad, points.max(axis=0) + pad
    return Frame(left, right, bottom, top)
