"""What there is in a run, and where and in which state at each frame: all that a replay shows, from the trace alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from airground_drake.arrays import Array
from airground_drake.registry import METHODS
from airground_drake.replay.proposals import Sent, sent
from airground_drake.scenarios.schema import Obstacle, Scenario, Uav, Ugv
from airground_drake.trace import Trace

FRAMES_PER_S = 30
"""Frames in a second of simulated time."""

STATES = ("own task", "triggered", "intervened")
"""What a robot does: follow its own task; the same, with its trigger set; carry out a proposal. By index."""
OWN, TRIGGERED, INTERVENED = range(3)

MAX_NAMED_OBSTACLES = 8
"""If there are more obstacles, their names are not shown."""

SMALLEST, LARGEST = 0.006, 0.018
"""Radius of what is a point, as a share of the larger side of the scene: between these."""
OF_SAFE_DISTANCE = 0.4
"""Its share of the least safe distance on the ground: two points that keep it are drawn apart."""


@dataclass(frozen=True)
class Body:
    """A robot: `radius_m` as drawn; positions (F, 3), m; states (F,), indices of STATES; where it is to arrive."""

    name: str
    kind: str
    radius_m: float
    positions: Array
    states: npt.NDArray[np.intp]
    target_m: Array


@dataclass(frozen=True)
class Pillar:
    """An obstacle: `radius_m` as drawn; UGVs have to stay `safe_m` away from its centre, with their whole bodies."""

    name: str
    centre_m: Array
    radius_m: float
    safe_m: float
    known_to_uav: bool


@dataclass(frozen=True)
class Scene:
    """A run. `times_s` (F,) are those of the frames, the last one the end; `low_m` and `high_m` bound what is shown.

    `mark_m` is the radius of what is a point, as drawn.
    """

    scenario: str
    run: str
    says: str
    times_s: Array
    robots: tuple[Body, ...]
    obstacles: tuple[Pillar, ...]
    phantoms_m: Array
    proposals: tuple[Sent, ...]
    events: tuple[Mapping[str, Any], ...]
    low_m: Array
    high_m: Array
    mark_m: float


def scene(trace: Trace, scenario: Scenario) -> Scene:
    """The scene of a run.

    Args:
        trace: the run.
        scenario: what was simulated; that of the trace.

    Raises:
        TraceError: if the trace lacks a column or holds numbers that are not finite.
    """
    times = frame_times(trace.t)
    low, high = _bounds(trace, scenario)
    extent = float((high - low)[:2].max())
    apart = min(scenario.safe_distance.obstacle_m, scenario.safe_distance.ugv_m)
    mark = min(max(SMALLEST * extent, OF_SAFE_DISTANCE * apart), LARGEST * extent)
    specs: dict[str, Ugv | Uav] = {**scenario.ugvs, scenario.uav.name: scenario.uav}
    robots = tuple(
        Body(
            name,
            "UGV" if name in scenario.ugvs else "UAV",
            max(mark, radius_m(specs[name])),
            np.column_stack([np.interp(times, trace.t, axis) for axis in trace.position(name).T]),
            states(trace, name, times) if name in scenario.ugvs else np.zeros(len(times), dtype=np.intp),
            np.array(specs[name].target_m),
        )
        for name in trace.robots
    )
    obstacles = tuple(
        Pillar(
            name, np.array(spec.position_m), max(mark, radius_m(spec)), safe_m(scenario, spec), spec.known_to_uav
        )
        for name, spec in scenario.obstacles.items()
    )  # fmt: skip
    method = str(trace.meta["method"])
    return Scene(
        scenario.name,
        trace.run,
        f"method ({method}), {METHODS[method].says}",
        times,
        robots,
        obstacles,
        np.reshape(scenario.uav.phantoms_m, (-1, 3)),
        sent(trace),
        tuple(trace.events),
        low,
        high,
        mark,
    )


def frame_times(t: Array) -> Array:
    """Times of the frames, (F,), s, of a run with rows at times (T,): from 0 on, and the end."""
    return np.minimum(np.arange(np.ceil(t[-1] * FRAMES_PER_S - 1e-6) + 1) / FRAMES_PER_S, t[-1])


def radius_m(spec: object) -> float:
    """Radius of a robot or an obstacle, m; 0 for a point."""
    return float(getattr(spec, "radius_m", 0.0))


def safe_m(scenario: Scenario, obstacle: Obstacle) -> float:
    """How far UGVs have to stay from the centre of an obstacle, with their whole bodies, m: d and its radius."""
    return scenario.safe_distance.obstacle_m + radius_m(obstacle)


def states(trace: Trace, ugv: str, times: Array) -> npt.NDArray[np.intp]:
    """Indices of STATES (F,) at times (F,), s: what was in force just before each."""
    rows = np.minimum(np.searchsorted(trace.t, times - 1e-9), len(trace.t) - 1)
    accepted, mode = trace.column(f"{ugv}.accepted")[rows], trace.column(f"{ugv}.mode")[rows]
    return np.where(accepted > 0, INTERVENED, np.where(mode == 1, TRIGGERED, OWN))


def _bounds(trace: Trace, scenario: Scenario) -> tuple[Array, Array]:
    """The corners of a box with all robots, targets, and obstacles with their safe cylinders, (3,) each, m."""
    points = [trace.position(robot) for robot in trace.robots]
    points += [np.array([spec.target_m]) for spec in scenario.ugvs.values()]
    for spec in scenario.obstacles.values():
        reach = np.array([1.0, 1.0, 0.0]) * safe_m(scenario, spec)
        points += [np.array([spec.position_m]) - reach, np.array([spec.position_m]) + reach]
    every = np.concatenate([*points, np.zeros((1, 3)) + points[0][0] * [1.0, 1.0, 0.0]])
    return every.min(axis=0), np.maximum(every.max(axis=0), every.min(axis=0) + 1.0)
