"""Draws the paths of a run on matplotlib axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from airground_drake.run.trace import Trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def paths(trace: Trace, axes: Axes | None = None) -> Axes:
    """Draw a run in the ground plane, in m: paths, starts o, targets x, obstacles in their safe circles.

    Args:
        trace: the run.
        axes: where to draw; default: those of a new figure of pyplot.

    Returns:
        The axes.

    Raises:
        TraceError: if the trace lacks a column or holds numbers that are not finite.
    """
    from matplotlib.patches import Circle

    if axes is None:
        from matplotlib import pyplot

        _, axes = pyplot.subplots()
    scenario = trace.scenario
    for name, obstacle in scenario.obstacles.items():
        (x, y, _), radius = obstacle.position_m, obstacle.radius_m
        safe = radius + scenario.safe_distance.obstacle_m
        axes.add_patch(Circle((x, y), safe, fill=False, linestyle=":", color="0.5"))
        axes.add_patch(Circle((x, y), max(radius, 0.05), color="0.3"))
        axes.annotate(name, (x, y))
    for robot in trace.robots:
        path = trace.position(robot)
        (line,) = axes.plot(*path[:, :2].T, linestyle="-" if robot in trace.ugvs else "--", label=robot)
        axes.plot(*path[0, :2], marker="o", markerfacecolor="white", color=line.get_color())
        if robot in trace.ugvs:
            target = np.asarray(scenario.ugvs[robot].target_m)
            axes.plot(*target[:2], marker="x", color=line.get_color())
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x, m", ylabel="y, m", title=f"{scenario.name}, run {trace.run}")
    axes.legend()
    return axes
