"""A run in a picture of a few hundred bytes: paths from above, obstacles."""

from __future__ import annotations

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.report.figures import svg
from airground_drake.report.figures.canvas import look, thin
from airground_drake.run.trace import Trace

WIDTH, HEIGHT, EDGE = 160.0, 120.0, 6.0
MAX_POINTS, MAX_UGVS = 240, 20


def draw(trace: Trace, prefix: str) -> str:
    """Inline SVG of the paths of the first UGVs of a run.

    Args:
        trace: the run.
        prefix: unique in the page.
    """
    ugvs = trace.ugvs[:MAX_UGVS]
    paths = {ugv: trace.position(ugv)[:, :2] for ugv in ugvs}
    obstacles = [np.asarray(each.position_m[:2]) for each in trace.scenario.obstacles.values()]
    low, high = (edge(np.vstack(list(paths.values())), axis=0) for edge in (np.min, np.max))
    scale = min((WIDTH - 2 * EDGE) / max(high[0] - low[0], 1.0), (HEIGHT - 2 * EDGE) / max(high[1] - low[1], 1.0))

    def pixels(points: Array) -> Array:
        """Points (T, 2), m, in the picture, whose y axis points down."""
        return np.array([WIDTH, HEIGHT]) / 2 + (points - (low + high) / 2) * scale * [1.0, -1.0]

    shapes = [_dot(pixels(at), "#777777") for at in obstacles]
    for i, path in enumerate(paths.values()):
        points = pixels(path[thin(path, MAX_POINTS)])
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        shapes.append(f"<polyline points='{line}' fill='none' stroke='{look(i).color}' stroke-width='2'/>")
        shapes.append(_dot(points[-1], look(i).color))
    picture = f"<svg xmlns='{svg.NAMESPACE}' viewBox='0 0 {WIDTH:g} {HEIGHT:g}' width='160' height='120'>"
    says = "Paths of the UGVs from above; grey: obstacles."
    return svg.inline(f"{picture}{''.join(shapes)}</svg>", prefix, f"Run {trace.run}", says, natural_size=True)


def _dot(at: Array, color: str) -> str:
    return f"<circle cx='{at[0]:.1f}' cy='{at[1]:.1f}' r='3' fill='{color}'/>"
