"""The figure of ZENO-REFINE: triggers against the noise step, bare threshold and automaton."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure as Drawing

from airground_drake.report.figures import canvas
from airground_drake.report.figures.panels import Figure, Table, panel

_SERIES: dict[str, str] = {"bare": "bare threshold", "automaton": "automaton"}


def draw(evidence: Mapping[str, Any]) -> Figure | None:
    """The figure, from the finding's evidence alone; None without it."""
    if not evidence.get("fit"):
        return None
    steps = np.array(evidence["dt_s"])
    exponents = {
        name: f"exponent {evidence['fit'][name]['exponent']:.3f}, {100 * evidence['level']:g} % interval "
        f"[{evidence['fit'][name]['interval'][0]:.3f}, {evidence['fit'][name]['interval'][1]:.3f}]"
        for name in _SERIES
    }
    text = "; ".join(f"{words}: {exponents[name]}" for name, words in _SERIES.items())
    columns = ("noise step, s", *(f"{words}: mean, standard error" for words in _SERIES.values()), "bare, theory")
    rows = tuple(
        (
            f"{step:.3g}",
            *(f"{evidence[name]['mean'][k]:.2f} ± {evidence[name]['standard_error'][k]:.2f}" for name in _SERIES),
            f"{evidence['expected_bare'][k]:.2f}",
        )
        for k, step in enumerate(steps)
    )
    title, heading = (
        "Triggers under refinement of the noise step",
        f"Mean of {evidence['paths']} paths of {evidence['duration_s']:.3g} s",
    )
    table = Table(f"{title}, triggers per path", columns, rows)
    with canvas.style():
        drawn = panel(_counts(steps, evidence), "refinement", title, text, heading, table)
    caption = (
        "The task error stays at the threshold; each step to the right halves the noise step. The bare threshold's "
        f"count grows like one over the square root of the step, ours levels off. {text[0].upper()}{text[1:]}."
    )
    return Figure("refinement", title, caption, (drawn,), beside="ZENO-REFINE")


def _counts(steps: Any, evidence: Mapping[str, Any]) -> Drawing:
    """log2 of the mean count against the number of halvings: a slope of 1/2 is an exponent of -1/2."""
    drawing = Drawing(figsize=(canvas.WIDE_IN, 2.6))
    axes = drawing.add_axes((0.15, 0.2, 0.5, 0.75))
    halvings = np.log2(steps[0] / steps)
    labels, lowest, highest = [], 0.0, 1.0
    for position, (name, words) in enumerate(_SERIES.items()):
        look, mean = canvas.look(position), np.array(evidence[name]["mean"])
        spread = 2.0 * np.array(evidence[name]["standard_error"])
        low, high = np.log2(np.maximum(mean - spread, 0.05)), np.log2(mean + spread)
        axes.plot(halvings, np.log2(mean), color=look.color, linestyle="none", marker=look.marker, markersize=4.5)
        axes.vlines(halvings, low, high, color=look.color, linewidth=1.0)
        fitted = np.log2(evidence["fit"][name]["at_dt"])
        axes.plot(halvings, fitted, color=look.color, linestyle=look.dash, linewidth=1.2)
        labels.append((float(fitted[-1]), f"{words} ({evidence['fit'][name]['exponent']:.2f})", look.color))
        lowest, highest = min(lowest, float(low.min())), max(highest, float(high.max()))
    axes.set_xlim(-0.3, halvings[-1] + 0.3)
    axes.set_ylim(lowest - 0.3, highest + 0.3)
    canvas.rule(axes, f"halvings of the noise step from {steps[0]:.3g} s", "log2 of triggers")
    canvas.label_right(axes, labels)
    return drawing
