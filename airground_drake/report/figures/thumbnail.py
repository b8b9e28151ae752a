"""A run in a picture of a few hundred bytes: paths from above, obstacles."""

from __future__ import annotations

from airground_drake.report.figures import svg
from airground_drake.report.figures.canvas import LOOKS, thin
from airground_drake.run.trace import Trace
from airground_drake.scenarios.picture import picture

MAX_POINTS, MAX_UGVS = 400, 20


def draw(trace: Trace, prefix: str) -> str:
    """Inline SVG of the paths of the first UGVs of a run.

    Args:
        trace: the run.
        prefix: unique in the page.
    """
    ways = {ugv: trace.position(ugv)[:, :2] for ugv in trace.ugvs[:MAX_UGVS]}
    paths = {ugv: way[thin(way, MAX_POINTS)] for ugv, way in ways.items()}
    drawn = picture(trace.scenario, paths, [look.color for look in LOOKS])
    says = "Paths of the UGVs from above; crosses: targets; grey: obstacles in their safe circles."
    return svg.inline(drawn, prefix, f"Run {trace.run}", says, natural_size=True)
