"""Pictures of the findings about tasks, their composition and the optimal control problem."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from airground_drake.report.figures.findings.lines import Lines
from airground_drake.report.figures.findings.products import Factor, Products


def shapes(item: Mapping[str, Any]) -> Products:
    """Item 8: what (3) multiplies, as printed and corrected."""
    known = item["evidence"]
    inverse = Factor("J⁺", np.array(known["J^+"]))
    printed, corrected = (
        Factor(f"rate of {name}", np.ones((known[f"shape_of_rate_of_{name}"][0], 1))) for name in ("rho", "sigma")
    )
    products = {"as printed": (inverse, printed), "corrected": (inverse, corrected)}
    return Products("What (3) multiplies, for the avoidance task", products)


def feed_forward(item: Mapping[str, Any]) -> Lines:
    """Item 12: both sides of (6) over the velocity, for some error: they meet where there is a solution."""
    known = item["evidence"]
    correction, solution = known["gain_1_s"] * known["error_m"], known["velocities_m_s"]["corrected"][0]
    v = np.linspace(0.0, 2.0 * solution, 50)
    return Lines(
        f"Both sides of (6), J = I, for an error of {known['error_m']:g} m", "velocity, m/s", "side of (6), m/s",
        {
            "left, v": (v, v),
            "right, as printed": (v, v + correction),
            "right, corrected": (v, np.full(len(v), known["desired_rate_m_s"] + correction)),
        },
        {"solution, corrected": (solution, solution)},
    )  # fmt: skip


def centroid(item: Mapping[str, Any]) -> Lines:
    """Item 13: the task value (9) over the UAV's own position."""
    known = item["evidence"]["task_values"]
    x = np.array(known["uav_x_m"])
    lines = {
        name.replace("_", " ").removesuffix(" m"): (x, np.array(known[name]))
        for name in ("as_printed_m", "corrected_m")
    }
    return Lines("Task value (9) over the UAV's position", "x of the UAV, m", "task value, m", lines)


def sums(item: Mapping[str, Any]) -> Lines:
    """Item 14: what the sum (27a) makes of the integrand 1, over the number of stages."""
    known = item["evidence"]
    stages = np.array(known["sums"]["stages"])
    return Lines(
        "The cost of the integrand 1 over the number of stages", "stages N", "sum",
        {
            "as printed": (stages, np.array(known["sums"]["as_printed"])),
            "corrected, s": (stages, np.array(known["sums"]["corrected_s"])),
        },
        {
            f"printed, N = {known['stages']}": (known["stages"], item["paper"]),
            "integral, s": (known["stages"], known["integral_s"]),
        },
    )  # fmt: skip


def dimensions(item: Mapping[str, Any]) -> Lines:
    """Item 15: total dimension of the tasks over the lowest one's, where rule (3) admits it and where not."""
    known = item["evidence"]
    lowest, total = np.array(known["totals"]["lowest_task"]), np.array(known["totals"]["total"])
    admitted = np.array(known["totals"]["admitted"])
    return Lines(
        f"Total dimension of the tasks, {known['higher_tasks']} of them taken", "dimension of the lowest task",
        "total dimension",
        {
            "rule (3) admits": (lowest[admitted], total[admitted]),
            "rule (3) excludes": (lowest[~admitted], total[~admitted]),
            "n, of the velocity": (lowest, np.full(len(lowest), known["n"])),
        },
        {"example": (known["lowest_task"], known["total"])},
    )  # fmt: skip


def null_space(item: Mapping[str, Any]) -> Lines:
    """Item 16: what is left of the own task's velocity, in whichever direction it is, under an intervention."""
    known = item["evidence"]
    angle = np.linspace(0.0, 2.0 * np.pi, 73)
    own = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)])
    one, left = (np.array(known[key]) @ own for key in ("projector_for_one_direction", "projector"))
    return Lines(
        "What is left of the own task's velocity of 1 m/s under an intervention", "x, m/s", "y, m/s",
        {"own, any direction": (own[0], own[1]), "left: y intervened on": (one[0], one[1])},
        {"left: position, J = I": (float(left[0, 0]), float(left[1, 0]))},
    )  # fmt: skip


def speeds(item: Mapping[str, Any]) -> Lines:
    """Item 17: when the trigger is due over the reference's speed, and what the paper reports."""
    known, printed, ours = item["evidence"]["reference_travelled_at_the_trigger_m"], item["paper"], item["ours"]
    speed = np.linspace(0.8 * min(ours["speed_m_s"].values()), 1.2 * printed["speed_m_s"], 100)
    reported = {f"reported, {name}": (ours["speed_m_s"][name], at) for name, at in printed["trigger_s"].items()}
    return Lines(
        "Trigger over the reference's speed", "speed, m/s", "trigger, s",
        {f"{name}, {way:.3g} m": (speed, way / speed) for name, way in known.items()},
        reported | {"Table 1's speed": (printed["speed_m_s"], known["case_a"] / printed["speed_m_s"])},
    )  # fmt: skip
