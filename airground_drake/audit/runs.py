"""Findings about the paper that the runs of a report show (numbered as in docs/paper.md)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.report.metrics import closest_obstacle
from airground_drake.report.reproduction import MEASURES
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Preset, Reproduction, Scenario

PRINTED_SPEED_M_S = 1.0
"""Reference speed of Table 1, [3.3, 1t, 0]."""
REFERENCE_POINTS = 121
"""Points of the reference's way that a finding keeps for its figure."""


def findings(scenario: Scenario, traces: Mapping[str, Trace]) -> list[dict[str, Any]]:
    """Audit items with evidence in these runs: `id`, `finding`, `paper`, `ours`, `evidence`."""
    return [item for item in (_recursion(scenario, traces), _timing(scenario, traces)) if item]


def _recursion(scenario: Scenario, traces: Mapping[str, Trace]) -> dict[str, Any] | None:
    """Item 1: recursion (5) as printed neither keeps the distance nor stalls; the augmented projector does both."""
    printed = {name for name in traces if scenario.runs[name].composition.startswith("recursion")}
    methods = {scenario.runs[name].method for name in printed}
    compared = [name for name in traces if name in printed or scenario.runs[name].method in methods]
    if not printed or len(compared) == len(printed):
        return None
    d = scenario.safe_distance.obstacle_m
    evidence: dict[str, dict[str, Any]] = {}
    margin_m = {"printed": math.inf, "augmented": math.inf}
    stalls = {"printed": False, "augmented": False}
    for name in compared:
        trace = traces[name]
        nearest = min(
            ((found, robot) for robot in trace.ugvs if (found := closest_obstacle(trace, robot))), default=None
        )
        if nearest is None:
            return None
        (value, t_s, obstacle, _), robot = nearest
        stalled = {ugv: at for ugv in trace.ugvs if (at := MEASURES["stall_position"](trace, ugv))}
        kind = "printed" if name in printed else "augmented"
        margin_m[kind] = min(margin_m[kind], value - d)
        stalls[kind] = stalls[kind] or bool(stalled)
        evidence[name] = {
            "composition": scenario.runs[name].composition,
            "robot": robot,
            "obstacle": obstacle,
            "min_distance_m": value,
            "t_s": t_s,
            "margin_m": value - d,
            "stalls_m": stalled,
        }
    row = _row(scenario, "stall_position")
    return {
        "id": 1,
        "finding": (
            f"Two obstacles active at once: recursion (5) as printed {_kept(margin_m['printed'], d)} and "
            f"{_stalled(stalls['printed'])}; the augmented projector {_kept(margin_m['augmented'], d)} and "
            f"{_stalled(stalls['augmented'])}."
        ),
        "paper": {"stall_position_m": row.paper} if row else None,
        "ours": {name: entry["min_distance_m"] for name, entry in evidence.items()},
        "unit": "m",
        "where": "(5)",
        "demonstrated": margin_m["printed"] < -1e-9 <= margin_m["augmented"]
        and stalls["augmented"]
        and not stalls["printed"],
        "evidence": evidence,
    }


def _kept(margin_m: float, d: float) -> str:
    if margin_m < -1e-9:
        return f"comes {-margin_m:.3g} m inside the safe distance of {d:g} m"
    return f"keeps the safe distance of {d:g} m"


def _stalled(stalls: bool) -> str:
    return "stalls" if stalls else "does not stall"


def _timing(scenario: Scenario, traces: Mapping[str, Trace]) -> dict[str, Any] | None:
    """Item 6: when a noise-free trigger is due, by geometry, at the printed and at the scenario's speed."""
    row = _row(scenario, "trigger_time")
    for name, run in scenario.runs.items():
        for robot in run.stalls_m:
            if name not in traces or row is None or not row.paper or robot != row.robot:
                continue
            stall = MEASURES["stall_position"](traces[name], robot)
            preset = scenario.ugvs[robot].preset
            zeta = float(traces[name].meta["zeta_m"])
            travelled = _leaves_ball(preset, stall, zeta) if stall else None
            if travelled is None:
                continue
            reach = np.linspace(0.0, 1.2 * travelled, REFERENCE_POINTS)
            measured = MEASURES["trigger_time"](traces[row.run], robot) if row.run in traces else []
            return {
                "id": 6,
                "finding": (
                    f"Without noise the reference is zeta away from the stalled {robot} after {travelled:.3f} m: at "
                    f"{travelled / PRINTED_SPEED_M_S:.2f} s with the printed {PRINTED_SPEED_M_S:g} m/s, at "
                    f"{travelled / preset.speed_m_s:.2f} s with this scenario's {preset.speed_m_s:g} m/s."
                ),
                "paper": row.paper[0],
                "ours": travelled / preset.speed_m_s,
                "unit": "s",
                "where": "Table 1",
                "demonstrated": not math.isclose(travelled / PRINTED_SPEED_M_S, row.paper[0], abs_tol=0.05),
                "evidence": {
                    "run": name,
                    "robot": robot,
                    "stall_position_m": stall,
                    "zeta_m": zeta,
                    "reference_travelled_m": travelled,
                    "trigger_at_printed_speed_s": travelled / PRINTED_SPEED_M_S,
                    "trigger_at_scenario_speed_s": travelled / preset.speed_m_s,
                    "scenario_speed_m_s": preset.speed_m_s,
                    "speed_that_gives_the_paper_s_time_m_s": travelled / row.paper[0],
                    "reference": {"travelled_m": reach.tolist(), "distance_m": _distances(preset, reach, stall)},
                    "measured_trigger": {"run": row.run, "t_s": measured[0]} if measured else None,
                },
            }
    return None


def _leaves_ball(preset: Preset, centre: list[float], radius: float) -> float | None:
    """Distance travelled along a preset trajectory when it last leaves the ball, m; None if it never does.

    On each leg p + u e (e a unit vector, u in m) the crossings solve ||p + u e - centre|| = radius; the larger
    root is where the ball is left.
    """
    left, begin = None, 0.0
    for p, q in zip(preset.waypoints_m[:-1], preset.waypoints_m[1:], strict=True):
        length = math.dist(p[:2], q[:2])
        if length == 0.0:
            continue
        ex, ey = (q[0] - p[0]) / length, (q[1] - p[1]) / length
        rx, ry = p[0] - centre[0], p[1] - centre[1]
        along = rx * ex + ry * ey
        discriminant = along**2 - (rx**2 + ry**2 - radius**2)
        if discriminant > 0.0 and 0.0 <= (u := -along + math.sqrt(discriminant)) <= length:
            left = begin + u
        begin += length
    return left


def _distances(preset: Preset, travelled: Array, centre: list[float]) -> list[float]:
    """Distances (T,), m, of a point from a preset trajectory after the travelled lengths (T,), m."""
    points = np.array(preset.waypoints_m)[:, :2]
    ends = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    at = np.stack([np.interp(travelled, ends, points[:, axis]) for axis in (0, 1)], axis=1)
    return [float(d) for d in np.linalg.norm(at - np.array(centre[:2]), axis=1)]


def _row(scenario: Scenario, measure: str) -> Reproduction | None:
    return next((row for row in scenario.reproduction if row.measure == measure), None)
