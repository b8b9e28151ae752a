"""The figure of ZENO-REFINE: triggers against the noise step, bare threshold and automaton."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from airground_drake.report.figures.findings.lines import Lines
from airground_drake.report.figures.panels import Figure
from airground_drake.view import canvas

FEWEST = 0.05
"""Smaller mean counts are drawn as this one: the axis is logarithmic."""


def draw(evidence: Mapping[str, Any]) -> Figure | None:
    """The figure from the finding's evidence; None without evidence."""
    if not evidence.get("fit"):
        return None
    counts = {
        "bare threshold": evidence["bare"]["mean"],
        "bare, theory": evidence["expected_bare"],
        "automaton": evidence["automaton"]["mean"],
    }
    steps = np.array(evidence["dt_s"])
    shown = Lines(
        "Triggers under refinement of the noise step", "noise step, s", "triggers per path",
        {name: (steps, np.maximum(count, FEWEST)) for name, count in counts.items()}, log="xy",
    )  # fmt: skip
    exponents = (
        f"{name}: exponent {fit['exponent']:.3f}, {100 * evidence['level']:g} % interval "
        f"[{fit['interval'][0]:.3f}, {fit['interval'][1]:.3f}]"
        for name, fit in (("Bare threshold", evidence["fit"]["bare"]), ("automaton", evidence["fit"]["automaton"]))
    )
    caption = (
        f"The task error stays at the threshold; means of {evidence['paths']} paths of {evidence['duration_s']:.3g} s. "
        "With finer noise the bare threshold triggers without bound, like one over the square root of the step; the "
        f"automaton does not. {'; '.join(exponents)}."
    )
    with canvas.style():
        return shown.plate("refinement", "", caption, beside="ZENO-REFINE")
