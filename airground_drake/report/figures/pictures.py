"""Pictures of findings about the paper, from their evidence in report.json alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure as Drawing

from airground_drake.arrays import Array
from airground_drake.decision.bayes import bayes_risk, decision_time, optimal_threshold
from airground_drake.report.figures import canvas, svg
from airground_drake.report.figures.panels import MAX_TABLE_ROWS, Figure, Panel, Table

POINTS = 200


class Lines(NamedTuple):
    """A drawing of lines, each by its name, and of marked points."""

    title: str
    x: str
    y: str
    lines: Mapping[str, tuple[Array, Array]]
    marks: Mapping[str, tuple[float, float]]


def draw(items: Sequence[Mapping[str, Any]]) -> list[Figure]:
    """A figure beside each finding that has a picture of its own."""
    with canvas.style():
        return [_figure(item["id"], PICTURES[item["id"]](item)) for item in items if item["id"] in PICTURES]


def _risk(item: Mapping[str, Any]) -> Lines:
    """Item 2: the Bayes risk over the threshold, and where the printed and the corrected (19) put it."""
    known = item["evidence"]
    constants = known["drift_m_s"], known["noise_m_sqrt_s"], known["c1_1_s"], known["c2"]
    zeta = np.linspace(0.02, 2.5 * item["ours"]["root_m"], POINTS)
    risk = np.array([bayes_risk(z, *constants) for z in zeta])
    marks = {
        "root as printed, c1/c2": (item["paper"]["root_m"], item["paper"]["risk"]),
        "root with c2/c1": (item["ours"]["root_m"], item["ours"]["risk"]),
    }
    return Lines("Bayes risk (16) over the threshold", "threshold, m", "Bayes risk", {"risk (16)": (zeta, risk)}, marks)


def _time(item: Mapping[str, Any]) -> Lines:
    """Item 3: mean decision time over the initial deviation, as printed and corrected."""
    known = item["evidence"]
    zeta, drift, noise = known["zeta_m"], known["drift_m_s"], known["noise_m_sqrt_s"]
    reach = 0.99 * zeta / max(drift, 1.0)
    deviation = np.linspace(-reach, reach, POINTS)
    exact = np.array([decision_time(zeta, drift, noise, y) for y in deviation])
    printed = np.array([decision_time(zeta, drift, noise, y * drift) for y in deviation])
    marks = {"exact, by finite differences": (known["deviation_m"], known["exact_mean_exit_time_s"])}
    return Lines(
        "Mean decision time (17) over the initial deviation", "initial deviation, m", "time, s",
        {"metres": (deviation, exact), "as printed": (deviation, printed)}, marks,
    )  # fmt: skip


def _optimum(item: Mapping[str, Any]) -> Lines:
    """Item 4: the Bayes-optimal threshold over the drift, and the printed one."""
    known, zeta = item["evidence"], item["paper"]["zeta_m"]
    drift = np.geomspace(0.3, 3.0 * max(item["ours"]["drift_m_s"], default=10.0), POINTS)
    best = np.array([optimal_threshold(a, known["noise_m_sqrt_s"], known["c1_1_s"], known["c2"]) for a in drift])
    marks = {f"{a:.3g} m/s": (float(np.log10(a)), zeta) for a in item["ours"]["drift_m_s"]}
    across = np.log10(drift)
    return Lines(
        "Bayes-optimal threshold over the drift", "log10 of the drift in m/s", "threshold, m",
        {"optimal": (across, best), "Table 1": (across, np.full(POINTS, zeta))}, marks,
    )  # fmt: skip


def _sides(item: Mapping[str, Any]) -> Lines:
    """Item 7: the ways of UGV2 with either sign of its preset."""
    ways = {f"x = {known['preset_x_m']:g} m": np.array(known["way_m"]) for known in item["evidence"].values()}
    ends = {f"end of x = {known['preset_x_m']:g} m": tuple(known["way_m"][-1]) for known in item["evidence"].values()}
    return Lines("Ways of UGV2", "y, m", "x, m", {name: (way[:, 1], way[:, 0]) for name, way in ways.items()},
                 {name: (y, x) for name, (x, y) in ends.items()})  # fmt: skip


def _intrusion(item: Mapping[str, Any]) -> Lines:
    """Item 10: distance to the nearest obstacle under either gatekeeper."""
    known = item["evidence"]["distance_to_the_nearest_obstacle"]
    t = np.array(known["t_s"])
    lines = {name.removesuffix("_m"): (t, np.array(gap)) for name, gap in known.items() if name != "t_s"}
    d = item["evidence"]["safe_distance_m"]
    return Lines(
        "Distance to the nearest obstacle",
        "time, s",
        "distance, m",
        lines | {"safe distance": (t, np.full(len(t), d))},
        {},
    )


PICTURES: dict[int, Callable[[Mapping[str, Any]], Lines]] = {
    2: _risk, 3: _time, 4: _optimum, 7: _sides, 10: _intrusion,
}  # fmt: skip
"""By number of the finding. Those of 1 and 9 are drawn from runs and from ZENO-REFINE."""


def _figure(number: int, drawn: Lines) -> Figure:
    name = f"audit-{number}"
    says = "; ".join(f"{mark}: ({x:.3g}, {y:.3g})" for mark, (x, y) in drawn.marks.items())
    text = f"{drawn.y[0].upper()}{drawn.y[1:]}, over {drawn.x}. {says}".rstrip()
    rows = []
    for line, (x, y) in drawn.lines.items():
        chosen = np.unique(np.linspace(0, len(x) - 1, MAX_TABLE_ROWS // len(drawn.lines)).round().astype(int))
        rows += [(line, f"{x[k]:.4g}", f"{y[k]:.4g}") for k in chosen]
    panel = Panel(
        f"Finding {number}",
        svg.inline(canvas.svg(_drawing(drawn)), name, drawn.title, text),
        Table(f"{drawn.title}, some of its points", ("line", drawn.x, drawn.y), tuple(rows)),
    )
    return Figure(name, drawn.title, says and f"{says}.", (panel,), beside=name)


def _drawing(drawn: Lines) -> Drawing:
    drawing = Drawing(figsize=(canvas.WIDE_IN, 2.3))
    axes = drawing.add_axes((0.125, 0.19, 0.6, 0.78))
    every = np.concatenate([y for _, y in drawn.lines.values()])
    across = np.concatenate([x for x, _ in drawn.lines.values()])
    labels = []
    for position, (name, (x, y)) in enumerate(drawn.lines.items()):
        look = canvas.look(position)
        axes.plot(x, y, color=look.color, linestyle=look.dash)
        labels.append((float(y[-1]), canvas.short(name, 26), look.color))
    for at in drawn.marks.values():
        axes.plot(
            *at, marker="o", markersize=8, markerfacecolor="none", markeredgewidth=1.6, color=canvas.INK, zorder=5
        )
    pad = 0.06 * float(np.ptp(every) or 1.0)
    axes.set_xlim(float(across.min()), float(across.max()))
    axes.set_ylim(float(every.min()) - pad, float(every.max()) + pad)
    canvas.rule(axes, drawn.x, drawn.y)
    canvas.label_right(axes, labels)
    return drawing
