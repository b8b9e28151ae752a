"""Makes a trace from positions, velocities and held signals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from airground_drake.base.arrays import Array
from airground_drake.run.trace import DECISION_COLUMNS, SCHEMA, Trace
from airground_drake.verify.runs.demands import demanded

HELD = ("noise_m", "decision_variable_m", "mode", "triggers", "triggered_at_s", "released_at_s", "accepted")
"""Columns of a UGV after its reference."""


def laid_out(
    scenario: dict[str, Any],
    run: str,
    t: Array,
    position: Array,
    velocity: Array,
    held: Mapping[str, Array],
    events: Sequence[dict[str, Any]] = (),
    decisions: Sequence[dict[str, Any]] = (),
    timings: dict[str, Any] | None = None,
) -> Trace:
    """A trace.

    Args:
        scenario: as resolved.
        run: name of the run.
        t: times of the rows, (T,), s.
        position: of all robots, UAV last, (T, n + 1, 3), m.
        velocity: held up to a row, (T, n + 1, 3), m/s.
        held: of the UGVs, by column, (T, n); 0, or -1 for a time, where a column is left out.
        events: in any order.
        decisions: what is known of each.
        timings: as measured.
    """
    ugvs = list(scenario["ugvs"])
    robots = [*ugvs, scenario["uav"]["name"]]
    columns = {"t_s": t}
    for name, values in (("{}_m", position), ("v{}_m_s", velocity)):
        columns |= {f"{r}.{name.format(a)}": values[:, i, k] for i, r in enumerate(robots) for k, a in enumerate("xyz")}
    for i, ugv in enumerate(ugvs):
        reference = np.array([reference_at(scenario["ugvs"][ugv]["preset"], time) for time in t])
        columns |= {f"{ugv}.ref_{axis}_m": reference[:, k] for k, axis in enumerate("xyz")}
        for name in HELD:
            left_out = np.full(len(t), -1.0 if name.endswith("_at_s") else 0.0)
            columns[f"{ugv}.{name}"] = held[name][:, i] if name in held else left_out
    of_run = scenario["runs"][run]
    meta = {"schema": SCHEMA, "run": run, "method": of_run["method"], "composition": of_run["composition"], "seed": 0}
    meta |= {"robots": robots, "ugvs": ugvs, "zeta_m": scenario["decision"]["threshold"]["zeta_m"], "faults": []}
    meta |= {"scenario": scenario, "events": sorted(events, key=lambda event: float(event["t_s"]))}
    return rebuilt(Trace(meta, pd.DataFrame(columns), decision_table(decisions), timings or {}))


def rebuilt(trace: Trace) -> Trace:
    """A copy whose controllers were built with what its scenario demands."""
    built = {name: as_read_back(parameters) for name, parameters in demanded(trace).items()}
    return replace(trace, meta=trace.meta | {"controllers": built})


def as_read_back(parameters: dict[str, Any]) -> dict[str, Any]:
    """Parameters of a controller as `systems.controllers.read_back` writes them."""
    found = {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in parameters.items()}
    return found | {key: [[value, 1] for value in found[key]] for key in ("safe_m", "share")}


def decision_table(decisions: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """Recorded decisions; what is left out is empty, or -1."""
    empty = {name: "" if kind == "str" else -1.0 for name, kind in DECISION_COLUMNS.items()}
    return pd.DataFrame([empty | each for each in decisions], columns=list(DECISION_COLUMNS)).astype(DECISION_COLUMNS)


def reference_at(preset: dict[str, Any], t: float) -> list[float]:
    """Where a preset is, at its speed along its waypoints."""
    left = preset["speed_m_s"] * t
    for a, b in pairwise(preset["waypoints_m"]):
        length = math.dist(a, b)
        if left < length:
            return [p + (q - p) * left / length for p, q in zip(a, b, strict=True)]
        left -= length
    return list(preset["waypoints_m"][-1])
