"""Figures of claims about the model, from their inputs and their evidence."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from airground_drake.model.trigger.bayes import bayes_risk
from airground_drake.report.figures.lines import Lines
from airground_drake.report.figures.panels import Figure
from airground_drake.report.view import canvas

POINTS = 200
BEYOND = 1.6  # length of the axis, relative to the largest mark
FEWEST = 0.05  # smaller mean counts are drawn as this one: the axis is logarithmic


def bayes_risks(inputs: Mapping[str, Any], evidence: Mapping[str, Any]) -> Figure | None:
    """THR-CHOICE: the Bayes risk over the threshold; threshold in force, optimal, and by (19) as printed."""
    # None without evidence.
    if "optimal_threshold_m" not in evidence:
        return None
    constants = inputs["drift_m_s"], inputs["noise_m_sqrt_s"], inputs["c1_1_s"], inputs["c2"]
    places = {
        "in force": evidence["threshold_in_force_m"],
        "optimal": evidence["optimal_threshold_m"],
        "(19) as printed": evidence["threshold_as_printed_in_19_m"],
    }
    zeta = np.linspace(0.0, BEYOND * max(places.values()), POINTS + 1)[1:]
    risk = np.array([bayes_risk(each, *constants) for each in zeta])
    shown = Lines(
        "Bayes risk (16) over the threshold", "threshold, m", "Bayes risk", {"risk (16)": (zeta, risk)},
        {name: (each, bayes_risk(each, *constants)) for name, each in places.items()},
    )  # fmt: skip
    caption = (
        f"The threshold in force is {places['in force']:.4g} m ({evidence['kind']}). The curve assumes a drift of "
        f"{constants[0]:g} m/s and a noise of {constants[1]:g} m/√s."
    )
    with canvas.style():
        return shown.plate("threshold-choice", "", caption)


def refinement(evidence: Mapping[str, Any]) -> Figure | None:
    """ZENO-REFINE: triggers against the noise step, bare threshold and automaton; None without evidence."""
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
