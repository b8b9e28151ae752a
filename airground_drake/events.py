"""Events of a run, from its signals and decisions: trigger, release, proposal, accept, refuse, arrival, collision."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from airground_drake.trace import Trace


def extract(trace: Trace, sent: Iterable[tuple[str, float, str]]) -> list[dict[str, Any]]:
    """All events of a run by time, from its signals and decisions.

    Args:
        trace: the run.
        sent: proposals as (robot, time of issue in s, policy).
    """
    t, order = trace.t, {robot: k for k, robot in enumerate(trace.robots)}
    found: list[dict[str, Any]] = []

    def add(time_s: float, robot: str, kind: str, **more: Any) -> None:
        where = [float(np.interp(time_s, t, trace.column(f"{robot}.{axis}_m"))) for axis in "xyz"]
        found.append({"t_s": float(time_s), "robot": robot, "kind": kind, "position_m": where, **more})

    for ugv in trace.ugvs:
        for kind, name in (("trigger", "triggered_at_s"), ("release", "released_at_s")):
            for when in np.unique(trace.column(f"{ugv}.{name}")):
                if when >= 0.0:
                    add(when, ugv, kind)
    for ugv, issued, policy in sent:
        add(issued, ugv, "proposal", policy=policy)
    previous: dict[tuple[str, float], str] = {}
    for row in trace.decisions[["t_s", "robot", "policy", "issued_s", "decision", "status"]].to_dict("records"):
        key = (row["robot"], row["issued_s"])
        if previous.get(key) != row["decision"]:
            previous[key] = row["decision"]
            add(row["t_s"], row["robot"], row["decision"], policy=row["policy"], status=row["status"])
    for robot in trace.robots:
        _add_arrival(trace, robot, add)
        _add_collisions(trace, robot, add)
    return sorted(found, key=lambda event: (event["t_s"], order[event["robot"]]))


def _add_arrival(trace: Trace, robot: str, add: Any) -> None:
    """The time from which on the robot stays within the arrival tolerance of its target."""
    scenario = trace.scenario
    spec = scenario["ugvs"].get(robot, scenario["uav"])
    away = np.linalg.norm(trace.position(robot) - np.array(spec["target_m"]), axis=1)
    outside = np.flatnonzero(away > scenario["arrival_tolerance_m"])
    first = int(outside[-1]) + 1 if len(outside) else 0
    if first < len(away):
        add(trace.t[first], robot, "arrival")


def _add_collisions(trace: Trace, robot: str, add: Any) -> None:
    """The first row of each visit within collision distance of an obstacle, from surface to surface."""
    scenario, position = trace.scenario, trace.position(robot)
    own = scenario["ugvs"].get(robot, scenario["uav"])["radius_m"]
    names, bodies = list(scenario["obstacles"]), scenario["obstacles"].values()
    places = np.array([body["position_m"] for body in bodies], dtype=np.float64).reshape(-1, 3)
    within = [scenario["safe_distance"]["collision_m"] + (own + obstacle["radius_m"]) for obstacle in bodies]
    beside = np.maximum(np.maximum(position.min(axis=0) - places, places - position.max(axis=0)), 0.0)
    for k in np.flatnonzero(np.linalg.norm(beside, axis=1) <= within):  # of the box around all its rows
        hit = np.linalg.norm(position - places[k], axis=1) < within[k]
        for row in np.flatnonzero(hit & ~np.append(False, hit[:-1])):
            add(trace.t[row], robot, "collision", obstacle=names[k])
