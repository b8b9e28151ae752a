"""The robots and obstacles of a scenario, as large as they are drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.decision.trigger import Mode
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Obstacle, Scenario, Uav, Ugv
from airground_drake.view.looks import OBSTACLE_COLOR, UNSEEN_COLOR

STATES = ("own task", "triggered", "intervened")
"""A robot follows its own task, follows it while its trigger is set, or executes a proposal."""
OWN, TRIGGERED, INTERVENED = range(3)

SMALLEST, LARGEST = 0.006, 0.018
"""Smallest and largest radius with which a point is drawn, as shares of the larger side of the scene."""
OF_SAFE_DISTANCE = 0.4
"""Radius of a point as a share of the least safe distance on the ground: points that keep it are drawn apart."""


@dataclass(frozen=True)
class Robot:
    """A robot: `kind` is UGV or UAV, `radius_m` as drawn, `target_m` (3,)."""

    name: str
    kind: str
    radius_m: float
    target_m: Array


@dataclass(frozen=True)
class Pillar:
    """An obstacle: `radius_m` as drawn; the surfaces of UGVs have to stay `safe_m` away from its centre."""

    name: str
    centre_m: Array
    radius_m: float
    safe_m: float
    known_to_uav: bool
    appears_s: float = 0.0

    @property
    def color(self) -> str:
        """#rrggbb."""
        return OBSTACLE_COLOR if self.known_to_uav else UNSEEN_COLOR


@dataclass(frozen=True)
class Stage:
    """A scenario before anything moves.

    `low_m` and `high_m` (3,) bound what is shown. `mark_m` is the radius with which a point is drawn. `phantoms_m`
    (P, 3) are the obstacles that only the UAV's map has.
    """

    robots: tuple[Robot, ...]
    obstacles: tuple[Pillar, ...]
    phantoms_m: Array
    low_m: Array
    high_m: Array
    mark_m: float


def stage(scenario: Scenario, visited_m: Array | None = None) -> Stage:
    """The stage of a scenario; it contains the positions `visited_m` (M, 3), m; default: the starts."""
    specs: dict[str, Ugv | Uav] = {**scenario.ugvs, scenario.uav.name: scenario.uav}
    if visited_m is None:
        visited_m = np.array([spec.start_m for spec in specs.values()])
    low, high = _bounds(scenario, visited_m)
    extent = float((high - low)[:2].max())
    apart = min(scenario.safe_distance.obstacle_m, scenario.safe_distance.ugv_m)
    mark = min(max(SMALLEST * extent, OF_SAFE_DISTANCE * apart), LARGEST * extent)
    robots = tuple(
        Robot(name, "UGV" if name in scenario.ugvs else "UAV", max(mark, spec.radius_m), np.array(spec.target_m))
        for name, spec in specs.items()
    )
    obstacles = tuple(
        Pillar(
            name, np.array(spec.position_m), max(mark, spec.radius_m), safe_m(scenario, spec), spec.known_to_uav,
            spec.appears_s,
        )
        for name, spec in scenario.obstacles.items()
    )  # fmt: skip
    return Stage(robots, obstacles, np.reshape(scenario.uav.phantoms_m, (-1, 3)), low, high, mark)


def stage_of(trace: Trace, scenario: Scenario) -> Stage:
    """The stage of a run of a scenario."""
    return stage(scenario, np.concatenate([trace.position(robot) for robot in trace.robots]))


def safe_m(scenario: Scenario, obstacle: Obstacle) -> float:
    """Distance that the surfaces of UGVs must keep from the centre of an obstacle, m: d and its radius."""
    return scenario.safe_distance.obstacle_m + obstacle.radius_m


def states(trace: Trace, ugv: str, times: Array) -> npt.NDArray[np.intp]:
    """Indices of STATES (F,) in force just before times (F,), s."""
    rows = np.minimum(np.searchsorted(trace.t, times - 1e-9), len(trace.t) - 1)
    return states_of(trace.executing(ugv)[rows], trace.column(f"{ugv}.mode")[rows])


def states_of(executing: Array, mode: Array) -> npt.NDArray[np.intp]:
    """Indices of STATES, from numbers of the proposals executed (-1: none) and the trigger's modes, of equal shapes."""
    return np.where(executing >= 0, INTERVENED, np.where(mode == Mode.INTERVENING, TRIGGERED, OWN))


def _bounds(scenario: Scenario, visited_m: Array) -> tuple[Array, Array]:
    """Corners (3,), m, of a box around positions (M, 3), m, the targets and the obstacles' safe cylinders."""
    points = [visited_m, np.array([spec.target_m for spec in scenario.ugvs.values()])]
    for spec in scenario.obstacles.values():
        reach = np.array([1.0, 1.0, 0.0]) * safe_m(scenario, spec)
        points.append(np.array([spec.position_m]) + np.outer([-1.0, 1.0], reach))
    every = np.concatenate([*points, visited_m[:1] * [1.0, 1.0, 0.0]])
    return every.min(axis=0), np.maximum(every.max(axis=0), every.min(axis=0) + 1.0)
