"""Pictures of findings about the paper, from their evidence in report.json alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from airground_drake.report.figures.findings.pictures import PICTURES
from airground_drake.report.figures.panels import Figure
from airground_drake.view import canvas


def draw(items: Sequence[Mapping[str, Any]]) -> list[Figure]:
    """A figure beside each finding that has a picture of its own."""
    with canvas.style():
        return [PICTURES[item["id"]](item).figure(item["id"]) for item in items if item["id"] in PICTURES]
