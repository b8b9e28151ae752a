"""Pictures of findings about the paper, from their evidence in report.json alone; modules as in `report.audit`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from airground_drake.report.figures import canvas
from airground_drake.report.figures.findings import formulas, runs, thresholds
from airground_drake.report.figures.findings.lines import Lines
from airground_drake.report.figures.findings.products import Products
from airground_drake.report.figures.panels import Figure

PICTURES: dict[int, Callable[[Mapping[str, Any]], Lines | Products]] = {
    2: thresholds.risk,
    3: thresholds.time,
    4: thresholds.optimum,
    5: thresholds.first_passage,
    6: runs.due,
    7: runs.sides,
    8: formulas.shapes,
    10: runs.intrusion,
    11: runs.task_error,
    12: formulas.feed_forward,
    13: formulas.centroid,
    14: formulas.sums,
    15: formulas.dimensions,
    16: formulas.null_space,
    17: formulas.speeds,
    18: thresholds.one_or_two,
}
"""By number of the finding. Those of 1 and 9 are drawn from runs and from ZENO-REFINE."""


def draw(items: Sequence[Mapping[str, Any]]) -> list[Figure]:
    """A figure beside each finding that has a picture of its own."""
    with canvas.style():
        return [PICTURES[item["id"]](item).figure(item["id"]) for item in items if item["id"] in PICTURES]
