"""Events of a run, from its signals and decisions: trigger, release, proposal, accept, refuse, arrival, collision."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Obstacle, Uav, Ugv


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
    previous: dict[int, str] = {}
    for row in trace.decisions[["t_s", "robot", "policy", "number", "decision", "status"]].to_dict("records"):
        if previous.get(row["number"]) != row["decision"]:
            previous[row["number"]] = row["decision"]
            add(row["t_s"], row["robot"], row["decision"], policy=row["policy"], status=row["status"])
    for robot in trace.robots:
        _add_arrival(trace, robot, add)
        _add_collisions(trace, robot, add)
    return sorted(found, key=lambda event: (event["t_s"], order[event["robot"]]))


def _add_arrival(trace: Trace, robot: str, add: Any) -> None:
    """The time from which on the robot stays within the arrival tolerance of its target."""
    scenario = trace.scenario
    away = np.linalg.norm(trace.position(robot) - np.array(scenario.robots[robot].target_m), axis=1)
    outside = np.flatnonzero(away > scenario.arrival_tolerance_m)
    first = int(outside[-1]) + 1 if len(outside) else 0
    if first < len(away):
        add(trace.t[first], robot, "arrival")


def _add_collisions(trace: Trace, robot: str, add: Any) -> None:
    """Visits within collision distance, from surface to surface, of obstacles and of robots that are listed later."""
    scenario, position = trace.scenario, trace.position(robot)
    bodies, own = scenario.robots, scenario.robots[robot].radius_m
    low, high = position.min(axis=0), position.max(axis=0)  # the box around its way

    def within(body: Ugv | Uav | Obstacle) -> float:
        return scenario.safe_distance.collision_m + (own + body.radius_m)

    names, there = list(scenario.obstacles), list(scenario.obstacles.values())
    places = np.array([body.position_m for body in there], dtype=np.float64).reshape(-1, 3)
    beside = np.linalg.norm(np.maximum(np.maximum(low - places, places - high), 0.0), axis=1)
    for k in np.flatnonzero(beside <= [within(body) for body in there]):
        for row in visits(position - places[k], within(there[k])):
            add(trace.t[row], robot, "collision", obstacle=names[k])
    for other in trace.robots[trace.robots.index(robot) + 1 :]:
        way = trace.position(other)
        apart = np.maximum(np.maximum(low - way.max(axis=0), way.min(axis=0) - high), 0.0)
        if np.linalg.norm(apart) <= within(bodies[other]):
            for row in visits(position - way, within(bodies[other])):
                add(trace.t[row], robot, "collision", other=other)


def visits(apart: Array, within: float) -> npt.NDArray[np.intp]:
    """Rows, (K,), at which visits within a distance begin, m.

    Args:
        apart: relative positions, (T, 3), m; straight from row to row. A visit between two rows is given by the
            first of them.
        within: the distance, m.
    """
    near = np.linalg.norm(apart, axis=1) < within
    start, step = apart[:-1], np.diff(apart, axis=0)
    length = np.maximum(np.square(step).sum(axis=1), np.finfo(np.float64).tiny)
    share = np.clip(-(start * step).sum(axis=1) / length, 0.0, 1.0)
    passes = np.linalg.norm(start + share[:, None] * step, axis=1) < within
    enters = near & ~np.append(False, near[:-1])
    return np.flatnonzero(enters | np.append(passes & ~near[:-1] & ~near[1:], False))
