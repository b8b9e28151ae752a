"""Pictures of the findings about (15)-(20) and Table 1's threshold."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from airground_drake.decision.bayes import bayes_risk, decision_time, optimal_threshold
from airground_drake.report.figures.findings.lines import Lines

POINTS = 200


def risk(item: Mapping[str, Any]) -> Lines:
    """Item 2: the Bayes risk over the threshold, and where the printed and the corrected (19) put it."""
    known = item["evidence"]
    constants = known["drift_m_s"], known["noise_m_sqrt_s"], known["c1_1_s"], known["c2"]
    zeta = np.linspace(0.02, 2.5 * item["ours"]["root_m"], POINTS)
    marks = {
        "root as printed, c1/c2": (item["paper"]["root_m"], item["paper"]["risk"]),
        "root with c2/c1": (item["ours"]["root_m"], item["ours"]["risk"]),
    }
    curve = np.array([bayes_risk(z, *constants) for z in zeta])
    return Lines(
        "Bayes risk (16) over the threshold", "threshold, m", "Bayes risk", {"risk (16)": (zeta, curve)}, marks
    )


def time(item: Mapping[str, Any]) -> Lines:
    """Item 3: mean decision time over the initial deviation, as printed and corrected."""
    known = item["evidence"]
    zeta, drift, noise = known["zeta_m"], known["drift_m_s"], known["noise_m_sqrt_s"]
    reach = 0.99 * zeta / max(drift, 1.0)
    deviation = np.linspace(-reach, reach, POINTS)
    exact = np.array([decision_time(zeta, drift, noise, y) for y in deviation])
    printed = np.array([decision_time(zeta, drift, noise, y * drift) for y in deviation])
    return Lines(
        "Mean decision time (17) over the initial deviation", "initial deviation, m", "time, s",
        {"corrected, metres": (deviation, exact), "as printed": (deviation, printed)},
        {"by finite differences": (known["deviation_m"], known["exact_mean_exit_time_s"])},
    )  # fmt: skip


def optimum(item: Mapping[str, Any]) -> Lines:
    """Item 4: the threshold over the drift, Bayes-optimal and by (19) as printed, and Table 1's."""
    known, zeta = item["evidence"], item["paper"]["zeta_m"]
    right, printed = item["ours"]["drift_m_s"], item["paper"]["drift_m_s"]
    drift = np.geomspace(0.3, 3.0 * max(right, default=10.0), POINTS)
    noise, c1, c2 = known["noise_m_sqrt_s"], known["c1_1_s"], known["c2"]
    best = np.array([optimal_threshold(a, noise, c1, c2) for a in drift])
    root = np.array([optimal_threshold(a, noise, c2, c1) for a in drift])
    return Lines(
        "Threshold over the drift, Bayes-optimal and by (19) as printed", "drift, m/s", "threshold, m",
        {
            "Bayes-optimal": (drift, best), "(19) as printed": (drift, root),
            "Table 1": (drift, np.full(POINTS, zeta)),
        },
        {f"{a:.3g} m/s": (a, zeta) for a in (*right, *printed)}, log="x",
    )  # fmt: skip


def first_passage(item: Mapping[str, Any]) -> Lines:
    """Item 5: when noise alone reaches either threshold, over its intensity, and the paper's trigger."""
    known, printed = item["evidence"], item["paper"]["trigger_s"]
    zeta, at = known["zeta_m"], known["noise_m_sqrt_s"]
    noise = np.geomspace(0.05 * at, 2.0 * at, POINTS)
    return Lines(
        "Mean time in which noise alone reaches either threshold", "noise intensity, m/√s", "time, s",
        {"noise alone": (noise, (zeta / noise) ** 2), "the paper's trigger": (noise, np.full(POINTS, printed))},
        {f"{at:g}, finite differences": (at, known["by_finite_differences_s"])}, log="xy",
    )  # fmt: skip


def one_or_two(item: Mapping[str, Any]) -> Lines:
    """Item 18: mean decision time over the drift, with two thresholds and with the one that the trigger has."""
    known = item["evidence"]["Table 1, drift assumed"]
    zeta, noise, at = known["zeta_m"], known["noise_m_sqrt_s"], known["drift_m_s"]
    drift = np.geomspace(0.1 * at, 10.0 * at, POINTS)
    two = np.array([decision_time(zeta, a, noise) for a in drift])
    return Lines(
        "Mean decision time over the drift, with one threshold and with two", "drift, m/s", "time, s",
        {"one threshold": (drift, zeta / drift), "two thresholds, (17)": (drift, two)},
        {
            "one, finite differences": (at, known["time_of_one_threshold_s"]),
            "two, finite differences": (at, known["time_of_two_thresholds_s"]),
        }, log="xy",
    )  # fmt: skip
