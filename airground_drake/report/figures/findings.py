"""Figures of findings about the paper: for finding 1 from the runs, for others from report.json alone."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure as Drawing

from airground_drake.base.arrays import Array
from airground_drake.model.trigger.bayes import decision_time, optimal_threshold
from airground_drake.report.figures.panels import MAX_TABLE_ROWS, Figure, Table, panel, spread
from airground_drake.report.figures.timelines import nearest_distance
from airground_drake.report.metrics import closest_obstacle
from airground_drake.report.view import canvas
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify.finding import Chart

POINTS = 200
MAX_RUNS = 5  # runs whose distances are compared: as many as there are marks
NAME_CHARS = 24  # longest name that fits beside the axes
MARKERS = "os^Dv"


def draw(items: Sequence[Mapping[str, Any]]) -> list[Figure]:
    with canvas.style():
        return [of_finding(PICTURES[item["id"]](item), item["id"]) for item in items if item["id"] in PICTURES]


def recursion(scenario: Scenario, traces: Mapping[str, Trace]) -> Figure | None:
    """Item 1: distances under (5) as printed and by the augmented projector; None unless the runs have both."""
    printed = [name for name in traces if scenario.runs[name].composition.startswith("recursion")]
    methods = {scenario.runs[name].method for name in printed}
    augmented = [name for name in traces if name not in printed and scenario.runs[name].method in methods]
    runs = {name: traces[name] for name in [*augmented, *printed][:MAX_RUNS]}
    least = [near for trace in runs.values() for ugv in trace.ugvs if (near := closest_obstacle(trace, ugv))]
    if not (printed and augmented and least):
        return None
    robot = min(least, key=lambda near: near.value).first
    lines, marks = {}, {}
    for name, trace in runs.items():
        how = f"{name}: {scenario.runs[name].composition.replace('_', ' ')}"
        lines[how] = trace.t, nearest_distance(trace, robot)
        if near := closest_obstacle(trace, robot):
            lines["safe distance"] = np.array([0.0, trace.t[-1]]), np.full(2, near.safe_distance_m)
            marks[f"closest, {name}"] = near.t_s, near.value
    title = f"Distance of {robot} to the nearest obstacle"
    return of_finding(Chart(title, "time, s", "distance, m", lines, marks), 1)


def time(item: Mapping[str, Any]) -> Chart:
    """Item 3: mean decision time over the initial deviation, as printed and corrected."""
    known = item["evidence"]
    zeta, drift, noise = known["zeta_m"], known["drift_m_s"], known["noise_m_sqrt_s"]
    deviation = np.linspace(-0.99, 0.99, POINTS) * zeta / max(drift, 1.0)
    return Chart(
        "Mean decision time (17) over the initial deviation", "initial deviation, m", "time, s",
        {
            "corrected, metres": _curve(lambda y: decision_time(zeta, drift, noise, y), deviation),
            "as printed": _curve(lambda y: decision_time(zeta, drift, noise, y * drift), deviation),
        },
        {"by finite differences": (known["deviation_m"], known["exact_mean_exit_time_s"])},
    )  # fmt: skip


def optimum(item: Mapping[str, Any]) -> Chart:
    """Item 4: the threshold over the drift, Bayes-optimal and by (19) as printed, and Table 1's."""
    known, zeta = item["evidence"], item["paper"]["zeta_m"]
    right, printed = item["ours"]["drift_m_s"], item["paper"]["drift_m_s"]
    noise, c1, c2 = known["noise_m_sqrt_s"], known["c1_1_s"], known["c2"]
    drift = np.geomspace(0.3, 3.0 * max(right, default=10.0), POINTS)
    return Chart(
        "Threshold over the drift, Bayes-optimal and by (19) as printed", "drift, m/s", "threshold, m",
        {
            "Bayes-optimal": _curve(lambda a: optimal_threshold(a, noise, c1, c2), drift),
            "(19) as printed": _curve(lambda a: optimal_threshold(a, noise, c2, c1), drift),
            "Table 1": (drift, np.full(POINTS, zeta)),
        },
        {f"{a:.3g} m/s": (a, zeta) for a in (*right, *printed)}, log="x",
    )  # fmt: skip


def first_passage(item: Mapping[str, Any]) -> Chart:
    """Item 5: when noise alone reaches either threshold, over its intensity, and the paper's trigger."""
    known, at = item["evidence"], item["evidence"]["noise_m_sqrt_s"]
    noise = np.geomspace(0.05 * at, 2.0 * at, POINTS)
    return Chart(
        "Mean time in which noise alone reaches either threshold", "noise intensity, m/√s", "time, s",
        {
            "noise alone": (noise, (known["zeta_m"] / noise) ** 2),
            "the paper's trigger": (noise, np.full(POINTS, item["paper"]["trigger_s"])),
        },
        {f"{at:g}, finite differences": (at, known["by_finite_differences_s"])}, log="xy",
    )  # fmt: skip


def due(item: Mapping[str, Any]) -> Chart:
    """Item 6: how far the reference is from the stalled UGV, at the printed and at the scenario's speed."""
    known = item["evidence"]
    travelled, distance = (np.array(known["reference"][key]) for key in ("travelled_m", "distance_m"))
    zeta, due_s = known["zeta_m"], known["trigger_at_printed_speed_s"]
    speeds = known["reference_travelled_m"] / due_s, known["scenario_speed_m_s"]
    last = travelled[-1] / min(speeds)
    return Chart(
        "Distance of the reference from the stalled UGV", "time, s", "distance, m",
        {f"at {speed:g} m/s": (travelled / speed, distance) for speed in speeds}
        | {"threshold": (np.array([0.0, last]), np.array([zeta, zeta]))},
        {f"due at {speeds[0]:g} m/s": (due_s, zeta), "the paper's trigger": (item["paper"], zeta)},
    )  # fmt: skip


def sides(item: Mapping[str, Any]) -> Chart:
    """Item 7: the ways of UGV2 with either sign of its preset."""
    ways = {f"x = {known['preset_x_m']:g} m": np.array(known["way_m"]) for known in item["evidence"].values()}
    return Chart(
        "Ways of UGV2", "y, m", "x, m",
        {f"preset {name}": (way[:, 1], way[:, 0]) for name, way in ways.items()},
        {f"end, {name}": (way[-1, 1], way[-1, 0]) for name, way in ways.items()},
    )  # fmt: skip


def intrusion(item: Mapping[str, Any]) -> Chart:
    """Item 10: distance to the nearest obstacle under either gatekeeper."""
    known, safe = item["evidence"]["distance_to_the_nearest_obstacle"], item["evidence"]["safe_distance_m"]
    t = np.array(known["t_s"])
    gaps = {name.removesuffix("_m"): np.array(gap) for name, gap in known.items() if name != "t_s"}
    return Chart(
        "Distance to the nearest obstacle", "time, s", "distance, m",
        {name: (t, gap) for name, gap in gaps.items()} | {"safe distance": (t, np.full(len(t), safe))},
        {f"closest, {name}": (float(t[gap.argmin()]), float(gap.min())) for name, gap in gaps.items()},
    )  # fmt: skip


def task_error(item: Mapping[str, Any]) -> Chart:
    """Item 11: the task error that (26) counts along the horizon, without and with the kinematics."""
    known = item["evidence"]["task_error"]
    names = {"printed_m": "as printed, either", "accept_m": "with (23), accept", "refuse_m": "with (23), refuse"}
    lines = {name: (np.array(known["t_s"]), np.array(known[key])) for key, name in names.items()}
    return Chart("Task error along the horizon", "time from the decision, s", "task error, m", lines)


def speeds(item: Mapping[str, Any]) -> Chart:
    """Item 17: when the trigger is due over the reference's speed, and what the paper reports."""
    travelled = item["evidence"]["reference_travelled_at_the_trigger_m"]
    printed = item["paper"]
    ours = item["ours"]
    speed = np.linspace(0.8 * min(ours["speed_m_s"].values()), 1.2 * printed["speed_m_s"], 100)
    reported = {f"reported, {name}": (ours["speed_m_s"][name], at) for name, at in printed["trigger_s"].items()}
    return Chart(
        "Trigger over the reference's speed", "speed, m/s", "trigger, s",
        {f"after {travelled:.4g} m": (speed, travelled / speed)},
        reported | {"Table 1's speed": (printed["speed_m_s"], travelled / printed["speed_m_s"])},
    )  # fmt: skip


def one_or_two(item: Mapping[str, Any]) -> Chart:
    """Item 18: mean decision time over the drift, with two thresholds and with the trigger's single one."""
    known = item["evidence"]["Table 1, drift assumed"]
    zeta, noise, at = known["zeta_m"], known["noise_m_sqrt_s"], known["drift_m_s"]
    drift = np.geomspace(0.1 * at, 10.0 * at, POINTS)
    two = _curve(lambda a: decision_time(zeta, a, noise), drift)
    return Chart(
        "Mean decision time over the drift, with one threshold and with two", "drift, m/s", "time, s",
        {"one threshold": (drift, zeta / drift), "two thresholds, (17)": two},
        {f"{name}, finite differences": (at, known[f"time_of_{key}_s"])
         for name, key in (("one", "one_threshold"), ("two", "two_thresholds"))}, log="xy",
    )  # fmt: skip


def _curve(value: Callable[[float], float], x: Array) -> tuple[Array, Array]:
    return x, np.array([value(point) for point in x])


# By number of the finding. Those of 2 and 9 are charts of claims.
PICTURES: dict[int, Callable[[Mapping[str, Any]], Chart]] = {
    3: time, 4: optimum, 5: first_passage, 6: due, 7: sides, 10: intrusion, 11: task_error, 17: speeds, 18: one_or_two,
}  # fmt: skip


def of_finding(chart: Chart, number: int) -> Figure:
    """The figure beside finding `number` about the paper; call it inside `canvas.style`."""
    marked, name = _marked(chart), f"audit-{number}"
    return of_chart(replace(chart, caption=marked and f"{marked}."), name, f"Finding {number}", beside=name)


def of_chart(chart: Chart, name: str, heading: str, beside: str) -> Figure:
    """The figure with this identifier and heading, at a place of the page; call it inside `canvas.style`."""
    text = f"Up: {chart.y}. Across: {chart.x}. {_marked(chart)}".rstrip()
    rows = []
    for line, (x, y) in chart.lines.items():
        rows += [(line, f"{x[k]:.4g}", f"{y[k]:.4g}") for k in spread(len(x), MAX_TABLE_ROWS // len(chart.lines))]
    rows += [(mark, f"{x:.4g}", f"{y:.4g}") for mark, (x, y) in chart.marks.items()]
    table = Table(f"{chart.title}, some of its points", ("line", chart.x, chart.y), tuple(rows))
    drawn = panel(_drawing(chart), name, chart.title, text, heading, table)
    return Figure(name, chart.title, chart.caption, (drawn,), beside=beside)


def _marked(chart: Chart) -> str:
    return "; ".join(f"{mark}: ({x:.3g}, {y:.3g})" for mark, (x, y) in chart.marks.items())


def _drawing(chart: Chart) -> Drawing:
    drawing = Drawing(figsize=(canvas.WIDE_IN, 2.3))
    axes = drawing.add_axes((0.14, 0.19, 0.43, 0.78))
    across, up = (np.log10 if axis in chart.log else np.asarray for axis in "xy")
    for position, (name, (x, y)) in enumerate(chart.lines.items()):
        look, label = canvas.look(position), canvas.short(name, NAME_CHARS)
        axes.plot(across(x), up(y), color=look.color, linestyle=look.dash, label=label)
    for marker, (name, at) in zip(MARKERS, chart.marks.items(), strict=False):
        axes.plot(
            across(at[0]), up(at[1]), label=canvas.short(name, NAME_CHARS), color=canvas.INK, linestyle="none",
            marker=marker, markersize=7, markerfacecolor="none", markeredgewidth=1.6, zorder=5,
        )  # fmt: skip
    axes.margins(0.04, 0.07)
    axes.set(xlim=axes.get_xlim(), ylim=axes.get_ylim())
    canvas.rule(axes, chart.x, chart.y, chart.log)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=8.5, handlelength=1.6)
    return drawing
