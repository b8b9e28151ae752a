"""Findings about the paper that the runs of a report show (numbered as in docs/paper.md)."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.report.audit.item import Item, item
from airground_drake.report.metrics import closest_obstacle
from airground_drake.report.reproduction import MEASURES
from airground_drake.scenario.schema import Preset, Reproduction, Scenario
from airground_drake.sim.trace import Trace
from airground_drake.verify.engines.geometry import travelled

PRINTED_SPEED_M_S = 1.0  # reference speed of Table 1, [3.3, 1t, 0]
REFERENCE_POINTS = 121  # points of the reference's way that a finding keeps for its figure


def of_runs(scenario: Scenario, traces: Mapping[str, Trace]) -> list[Item]:
    return [item for item in (_recursion(scenario, traces), _timing(scenario, traces)) if item]


def _recursion(scenario: Scenario, traces: Mapping[str, Trace]) -> Item | None:
    """Item 1: recursion (5) as printed neither keeps the distance nor stalls; the augmented projector does both."""
    printed = {name for name in traces if scenario.runs[name].composition.startswith("recursion")}
    methods = {scenario.runs[name].method for name in printed}
    compared = [name for name in traces if name in printed or scenario.runs[name].method in methods]
    if not printed or len(compared) == len(printed):
        return None
    d = scenario.safe_distance.obstacle_m
    evidence: dict[str, dict[str, Any]] = {}
    for name in compared:
        trace = traces[name]
        nearest_of = [near for robot in trace.ugvs if (near := closest_obstacle(trace, robot))]
        if not nearest_of:
            return None
        nearest = min(nearest_of, key=lambda near: (near.value, near.t_s))
        evidence[name] = {
            "composition": scenario.runs[name].composition,
            "robot": nearest.first,
            "obstacle": nearest.second,
            "min_distance_m": nearest.value,
            "t_s": nearest.t_s,
            "margin_m": nearest.value - d,
            "stalls_m": {ugv: at for ugv in trace.ugvs if (at := MEASURES["stall_position"](trace, ugv))},
        }
    theirs, ours = ([evidence[name] for name in compared if (name in printed) == own] for own in (True, False))
    row = _row(scenario, "stall_position")
    return item(
        1, "(5)",
        f"Two obstacles active at once: recursion (5) as printed {_did(theirs, d)}; "
        f"the augmented projector {_did(ours, d)}.",
        {"stall_position_m": row.paper} if row else None,
        {name: entry["min_distance_m"] for name, entry in evidence.items()},
        _least(theirs) < -1e-9 <= _least(ours) and _stalls(ours) and not _stalls(theirs),
        evidence, unit="m",
    )  # fmt: skip


def _least(entries: Sequence[Mapping[str, Any]]) -> float:
    return min(float(entry["margin_m"]) for entry in entries)


def _stalls(entries: Sequence[Mapping[str, Any]]) -> bool:
    return any(entry["stalls_m"] for entry in entries)


def _did(entries: Sequence[Mapping[str, Any]], d: float) -> str:
    margin_m = _least(entries)
    short = f"comes {-margin_m:.3g} m inside the safe distance of {d:g} m"
    kept = short if margin_m < -1e-9 else f"keeps the safe distance of {d:g} m"
    return f"{kept} and {'stalls' if _stalls(entries) else 'does not stall'}"


def _timing(scenario: Scenario, traces: Mapping[str, Trace]) -> Item | None:
    """Item 6: when a noise-free trigger is due, by geometry, at the printed and at the scenario's speed."""
    row = _row(scenario, "trigger_time")
    if row is None or not row.paper:
        return None
    robot, printed_s = row.robot, row.paper[0]
    for name, run in scenario.runs.items():
        if name not in traces or robot not in run.stalls_m:
            continue
        preset, zeta = scenario.ugvs[robot].preset, float(traces[name].meta["zeta_m"])
        stall = MEASURES["stall_position"](traces[name], robot)
        length = leaves_ball(preset, stall, zeta) if stall else None
        if length is None:
            continue
        reach = np.linspace(0.0, 1.2 * length, REFERENCE_POINTS)
        measured = MEASURES["trigger_time"](traces[row.run], robot) if row.run in traces else []
        due_s, ours_s = length / PRINTED_SPEED_M_S, length / preset.speed_m_s
        return item(
            6, "Table 1",
            f"Without noise the reference is zeta away from the stalled {robot} after {length:.3f} m: at "
            f"{due_s:.2f} s with the printed {PRINTED_SPEED_M_S:g} m/s, at {ours_s:.2f} s with this scenario's "
            f"{preset.speed_m_s:g} m/s.",
            printed_s, ours_s, not math.isclose(due_s, printed_s, abs_tol=0.05),
            {
                "run": name, "robot": robot, "stall_position_m": stall, "zeta_m": zeta,
                "reference_travelled_m": length, "trigger_at_printed_speed_s": due_s,
                "trigger_at_scenario_speed_s": ours_s, "scenario_speed_m_s": preset.speed_m_s,
                "speed_that_gives_the_paper_s_time_m_s": length / printed_s,
                "reference": {"travelled_m": reach.tolist(), "distance_m": _distances(preset, reach, stall)},
                "measured_trigger": {"run": row.run, "t_s": measured[0]} if measured else None,
            },
            unit="s",
        )  # fmt: skip
    return None


def leaves_ball(preset: Preset, centre: list[float], radius: float) -> float | None:
    """Distance travelled along a preset trajectory when it last leaves the ball, m; None if it never does."""
    # On each leg p + u e (e a unit vector, u in m) the crossings solve ||p + u e - centre|| = radius; the larger root
    # is where the ball is left.
    left, begin = None, 0.0
    points = np.array(preset.waypoints_m)[:, :2]
    for p, q in pairwise(points):
        if (length := math.dist(p, q)) == 0.0:
            continue
        offset = p - centre[:2]
        along = float(offset @ (q - p)) / length
        discriminant = along**2 - (float(offset @ offset) - radius**2)
        if discriminant > 0.0 and 0.0 <= (u := -along + math.sqrt(discriminant)) <= length:
            left = begin + u
        begin += length
    return left


def _distances(preset: Preset, lengths: Array, centre: list[float]) -> list[float]:
    """Distances (T,), m, of a point from a preset trajectory after the travelled lengths (T,), m."""
    at = travelled(np.array(preset.waypoints_m)[:, :2], 1.0, lengths)
    return [float(d) for d in np.linalg.norm(at - np.array(centre[:2]), axis=1)]


def _row(scenario: Scenario, measure: str) -> Reproduction | None:
    return next((row for row in scenario.reproduction if row.measure == measure), None)
