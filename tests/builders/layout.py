"""Makes a trace from positions, velocities and held signals."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd

from airground_drake.base.arrays import Array
from airground_drake.sim.recording import sample_rows
from airground_drake.sim.tables import DECISION_COLUMNS, DECISION_LISTS, MESSAGE_COLUMNS, SCHEMA, typed
from airground_drake.sim.trace import Trace
from airground_drake.verify.engines.outlines import COUNT, MIDDLE
from airground_drake.verify.runs.demands import OUTLINES, demanded

HELD = ("noise_m", "decision_variable_m", "mode", "triggers", "triggered_at_s", "released_at_s")
"""Columns of a UGV after its position."""


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
    """Positions and velocities (T, n + 1, 3), UAV last; `held`, of the UGVs, by column, (T, n), else 0 or -1."""
    ugvs = list(scenario["ugvs"])
    robots = [*ugvs, scenario["uav"]["name"]]
    at = sample_rows(t, scenario["control"]["period_s"]) if len(t) > 1 else np.zeros(0, dtype=np.intp)
    columns, sampled = {"t_s": t}, {"t_s": t[at]}
    for i, robot in enumerate(robots):
        columns |= {f"{robot}.{axis}_m": position[:, i, k] for k, axis in enumerate("xyz")}
        sampled |= {f"{robot}.v{axis}_m_s": velocity[at + 1, i, k] for k, axis in enumerate("xyz")}
    for i, ugv in enumerate(ugvs):
        preset = scenario["ugvs"][ugv]["preset"]
        reference, soon = (np.array([reference_at(preset, s) for s in t[at] + d]).reshape(-1, 3) for d in (0.0, 1e-6))
        sampled |= {f"{ugv}.ref_{axis}_m": reference[:, k] for k, axis in enumerate("xyz")}
        sampled |= {f"{ugv}.ref_v{axis}_m_s": (soon - reference)[:, k] / 1e-6 for k, axis in enumerate("xyz")}
        sampled[f"{ugv}.executing"] = held["executing"][at + 1, i] if "executing" in held else np.full(len(at), -1.0)
        for name in HELD:
            left_out = np.full(len(t), -1.0 if name.endswith("_at_s") else 0.0)
            columns[f"{ugv}.{name}"] = held[name][:, i] if name in held else left_out
    of_run = scenario["runs"][run]
    meta = {"schema": SCHEMA, "run": run, "method": of_run["method"], "composition": of_run["composition"], "seed": 0}
    meta |= {"robots": robots, "ugvs": ugvs, "zeta_m": scenario["decision"]["threshold"]["zeta_m"], "faults": []}
    meta |= {"scenario": scenario, "events": sorted(events, key=lambda event: float(event["t_s"]))}
    decided = [{"answer": k} | each for k, each in enumerate(decisions)]
    tables = pd.DataFrame(columns), pd.DataFrame(sampled), decision_table(decided)
    return rebuilt(Trace(meta, *tables, timings or {}, messages=message_table(meta["events"], decided, robots[-1])))


def rebuilt(trace: Trace) -> Trace:
    built = {name: as_read_back(parameters) for name, parameters in demanded(trace).items()}
    return replace(trace, meta=trace.meta | {"controllers": built})


def as_read_back(parameters: dict[str, Any]) -> dict[str, Any]:
    """Parameters of a controller as `sim.blocks.controllers.read_back` writes them."""
    found = {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in parameters.items()}
    found |= {key: _with_circles(found[key]) for key in OUTLINES if key in found}
    return found | {key: [[value, 1] for value in found[key]] for key in ("safe_m", "share")}


def _with_circles(numbers: list[float]) -> list[float]:
    found, begin = list[float](), 0
    while begin < len(numbers):
        head = numbers[begin : begin + MIDDLE]
        begin += MIDDLE + 2 * int(head[COUNT])
        corners = np.array(numbers[begin - 2 * int(head[COUNT]) : begin]).reshape(-1, 2)
        middle = corners.mean(axis=0)
        extent = float(np.hypot(*(corners - middle).T).max())
        found += [*head, *middle.tolist(), extent, *corners.ravel().tolist()]
    return found


def decision_table(decisions: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """Recorded decisions; what is left out is empty, or -1."""
    empty: dict[str, Any] = {name: "" if kind == "str" else -1.0 for name, kind in DECISION_COLUMNS.items()}
    empty |= {name: [] for name in DECISION_LISTS}
    return typed([empty | each for each in decisions], DECISION_COLUMNS, *DECISION_LISTS)


def message_table(events: Sequence[dict[str, Any]], decisions: Sequence[dict[str, Any]], uav: str) -> pd.DataFrame:
    """A message for each proposal among the events, and for each decision; each is read when it is sent."""
    proposed = enumerate(event for event in events if event["kind"] == "proposal")
    sent = [("proposal", k, uav, e["robot"], k, e["t_s"]) for k, e in proposed]
    sent += [("answer", d["answer"], d["robot"], uav, d.get("number", 0), d["t_s"]) for d in decisions]
    names = ("kind", "number", "sender", "receiver", "about", "sent_s")
    rows = [dict(zip(names, each, strict=True)) for each in sent]
    at_once = ({"attempt": 0, "copy": 0, "received_s": row["sent_s"], "read_s": row["sent_s"]} for row in rows)
    return typed([row | more for row, more in zip(rows, at_once, strict=True)], MESSAGE_COLUMNS)


def reference_at(preset: dict[str, Any], t: float) -> list[float]:
    left = preset["speed_m_s"] * t
    for a, b in pairwise(preset["waypoints_m"]):
        length = math.dist(a, b)
        if left < length:
            return [p + (q - p) * left / length for p, q in zip(a, b, strict=True)]
        left -= length
    return list(preset["waypoints_m"][-1])
