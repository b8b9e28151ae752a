"""The paths of a run in two reports in one drawing: before thin and dashed, after in the same colour, thick."""

from __future__ import annotations

import numpy as np

from airground_drake.base.errors import TraceError
from airground_drake.report.figures import canvas, maps
from airground_drake.report.figures.panels import Figure, Table, panel
from airground_drake.run.trace import Trace


def draw(run: str, position: int, before: Trace, after: Trace) -> Figure:
    """The paths of the UGVs that differ most, with their ends and their largest decision variables.

    Args:
        run: its name.
        position: number of the figure in the page.
        before: from the older report.
        after: from the newer report.

    Raises:
        TraceError: if a trace cannot be used, or the two have no UGV in common.
    """
    ugvs = [ugv for ugv in after.scenario.ugvs if ugv in before.ugvs and ugv in after.ugvs]
    if not ugvs:
        raise TraceError("the reports have no UGV of the scenario in common")
    apart = {ugv: _apart(before, after, ugv) for ugv in ugvs}
    drawn = sorted(ugvs, key=lambda ugv: -apart[ugv])[: len(canvas.LOOKS)]
    rows = tuple(
        (
            ugv,
            f"{apart[ugv]:.4g}",
            *("({:.3f}, {:.3f})".format(*trace.position(ugv)[-1, :2]) for trace in (before, after)),
            *(f"{trace.column(f'{ugv}.decision_variable_m').max():.4g}" for trace in (before, after)),
        )
        for ugv in drawn
    )
    ends, largest = ("ends before, m", "ends after, m"), ("largest x before, m", "largest x after, m")
    columns = ("UGV", "farthest apart, m", *ends, *largest)
    left_out = f" The {len(drawn)} of {len(ugvs)} UGVs that differ most." if len(drawn) < len(ugvs) else ""
    says = f"Before dashed and thin, after solid and thick.{left_out}"
    table = Table(f"Run {run}; x: decision variable", columns, rows)
    with canvas.style():
        drawing = maps.two_versions(before, after, drawn)
        shown = panel(drawing, f"paths-{position}", f"Paths of run {run}", says, "Paths, from above", table)
    return Figure(f"run-{position}", f"Run {run}", says, (shown,))


def _apart(before: Trace, after: Trace, ugv: str) -> float:
    """Largest distance between the positions of a UGV at the same time, m, while both runs last."""
    t = after.t[after.t <= before.t[-1]]
    was = np.column_stack([np.interp(t, before.t, axis) for axis in before.position(ugv).T])
    return float(np.linalg.norm(after.position(ugv)[: len(t)] - was, axis=1).max(initial=0.0))
