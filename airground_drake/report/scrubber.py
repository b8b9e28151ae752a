"""The time slider of the trajectory figure: where each robot is in its drawing at any time.

`templates/scrubber.js` moves marks over the drawings, which are complete without it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure as Drawing

from airground_drake.base.arrays import Array
from airground_drake.report.figures.canvas import UAV_LOOK, look
from airground_drake.run.trace import Trace
from airground_drake.view.stage import states

SAMPLES = 121
"""Number of times, evenly spread over the run, for which the page has the places; the script interpolates."""
PER_UNIT = 10
"""Places are whole numbers of this fraction of a unit of the drawing."""


def tracks(drawing: Drawing, trace: Trace, ugvs: Sequence[str]) -> dict[str, Any]:
    """Places of the UAV and of some UGVs in a drawing of the ground plane, as JSON that `scrubber.js` reads.

    Args:
        drawing: with one pair of axes, over x and y in m; already drawn, so that the axes are in their final place.
        trace: the run.
        ugvs: their names, in the order of their looks.
    """
    t = np.linspace(0.0, float(trace.t[-1]), SAMPLES)
    robots = [*zip(ugvs, map(look, range(len(ugvs))), strict=True), *((uav, UAV_LOOK) for uav in trace.uavs)]
    return {
        "end": round(float(trace.t[-1]), 3),
        "scale": PER_UNIT,
        "robots": [
            {
                "name": name,
                "color": appearance.color,
                "states": "".join(map(str, states(trace, name, t))) if name in trace.ugvs else "0" * SAMPLES,
                "places": _places(drawing, np.column_stack([np.interp(t, trace.t, x) for x in trace.position(name).T])),
            }
            for name, appearance in robots
        ],
    }


def _places(drawing: Drawing, positions: Array) -> list[int]:
    """Positions (T, 3), m, in the drawing as SVG: x and y in turn, PER_UNIT parts of a point, y downwards."""
    pixels = drawing.axes[0].transData.transform(positions[:, :2])
    points = pixels * 72.0 / drawing.dpi
    points[:, 1] = drawing.get_figheight() * 72.0 - points[:, 1]
    places: list[int] = np.round(points * PER_UNIT).astype(int).ravel().tolist()
    return places
