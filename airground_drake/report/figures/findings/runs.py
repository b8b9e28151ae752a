"""Pictures of the findings that runs show."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from airground_drake.report.figures.findings.lines import Lines


def due(item: Mapping[str, Any]) -> Lines:
    """Item 6: how far the reference is from the stalled UGV, at the printed and at the scenario's speed."""
    known = item["evidence"]
    travelled, distance = (np.array(known["reference"][key]) for key in ("travelled_m", "distance_m"))
    zeta, due_s = known["zeta_m"], known["trigger_at_printed_speed_s"]
    speeds = known["reference_travelled_m"] / due_s, known["scenario_speed_m_s"]
    last = travelled[-1] / min(speeds)
    return Lines(
        "Distance of the reference from the stalled UGV", "time, s", "distance, m",
        {f"at {speed:g} m/s": (travelled / speed, distance) for speed in speeds}
        | {"threshold": (np.array([0.0, last]), np.array([zeta, zeta]))},
        {f"due at {speeds[0]:g} m/s": (due_s, zeta), "the paper's trigger": (item["paper"], zeta)},
    )  # fmt: skip


def sides(item: Mapping[str, Any]) -> Lines:
    """Item 7: the ways of UGV2 with either sign of its preset."""
    ways = {f"preset x = {known['preset_x_m']:g} m": np.array(known["way_m"]) for known in item["evidence"].values()}
    return Lines(
        "Ways of UGV2", "y, m", "x, m",
        {name: (way[:, 1], way[:, 0]) for name, way in ways.items()},
        {f"end, {name.removeprefix('preset ')}": (way[-1, 1], way[-1, 0]) for name, way in ways.items()},
    )  # fmt: skip


def intrusion(item: Mapping[str, Any]) -> Lines:
    """Item 10: distance to the nearest obstacle under either gatekeeper."""
    runs = item["evidence"]
    known = runs["distance_to_the_nearest_obstacle"]
    t = np.array(known["t_s"])
    gaps = {name.removesuffix("_m"): np.array(gap) for name, gap in known.items() if name != "t_s"}
    lines = {name: (t, gap) for name, gap in gaps.items()}
    return Lines(
        "Distance to the nearest obstacle", "time, s", "distance, m",
        lines | {"safe distance": (t, np.full(len(t), runs["safe_distance_m"]))},
        {f"closest, {name}": (float(t[gap.argmin()]), float(gap.min())) for name, gap in gaps.items()},
    )  # fmt: skip


def task_error(item: Mapping[str, Any]) -> Lines:
    """Item 11: the task error that (26) counts along the horizon, without and with the kinematics."""
    known = item["evidence"]["task_error"]
    t = np.array(known["t_s"])
    names = {"printed_m": "as printed, either", "accept_m": "with (23), accept", "refuse_m": "with (23), refuse"}
    lines = {name: (t, np.array(known[key])) for key, name in names.items()}
    return Lines("Task error along the horizon", "time from the decision, s", "task error, m", lines)
