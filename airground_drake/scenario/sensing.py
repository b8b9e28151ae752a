"""Bounded errors of measured positions: what robots publish, and where the UAV sees UGVs."""

import math
import random
from dataclasses import replace
from functools import lru_cache

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.model.bodies.kinds import ROBOTS
from airground_drake.model.bodies.motion import SAME_S
from airground_drake.model.bodies.world import World
from airground_drake.model.geometry import convex
from airground_drake.scenario.schema import Faults, Scenario, Sensing

TURN_S = 0.5  # after so long an adversary may change between away and sideways
SAME_M = 1e-9
WITHIN = 1.0 - 1e-9  # errors stay within this share of their bound, so that rounding does not lead beyond it


@lru_cache(maxsize=100_000)
def _knot(seed: int, who: str, number: int, axes: int) -> tuple[tuple[float, ...], float]:
    """A place in the unit ball of some axes, and a further number in [0, 1), that depend on nothing else."""
    draw = random.Random(f"{seed}/{who}/{number}")
    direction = [draw.gauss(0.0, 1.0) for _ in range(axes)]
    length = draw.random() ** (1.0 / axes) / math.hypot(*direction)
    return tuple(length * part for part in direction), draw.random()


class Errors:
    """The errors of a scenario's measured positions: functions of the seed, the robot, the time and true places."""

    def __init__(self, given: Sensing, world: World) -> None:
        self._given, self._world = given, world
        self._axes = [int(body.mobility.sum()) for body in world.moving]
        self._robots = world.select(*ROBOTS)
        self._near = world.around(self._robots)

    def published(self, t: float, places: Array) -> Array:
        """What the robots publish at time t, s, when the bodies that move are at places (M, 3), m: (M, 3), m."""
        seen = places.copy()
        if self._given.position_error_m:
            for i in range(self._robots.start, self._robots.stop):
                seen[i] += WITHIN * self._given.position_error_m * self._unit(i, t, places)
        return seen

    def view_of(self, robot: str, t: float, places: Array) -> Array:
        """Where a robot measures the bodies that move, (M, 3), m: itself as published, other robots with own errors."""
        seen, by = places.copy(), self._world.index(robot)
        for i in range(self._robots.start, self._robots.stop) if self._given.position_error_m else ():
            error = self._unit(i, t, places, None if i == by else by)
            seen[i] += WITHIN * self._given.position_error_m * error
        return seen

    def seen_by_uav(self, t: float, places: Array) -> Array:
        """Where the UAV sees the bodies that move, to plan with, (M, 3), m."""
        seen, ugvs = places.copy(), self._world.select("ugv")
        for i in range(ugvs.start, ugvs.stop) if self._given.uav_error_m else ():
            seen[i] += WITHIN * self._given.uav_error_m * self._drawn(i, t, "uav")
        return seen

    def _unit(self, i: int, t: float, places: Array, by: int | None = None) -> Array:
        """The error over its bound, (3,), of robot i as it publishes it, or as another robot measures it."""
        how, who = self._given.errors, self._world.moving[i].name
        if by is not None:
            who = f"{who} by {self._world.moving[by].name}"
        if how == "drawn":
            return self._drawn(i, t, "" if by is None else f"by {self._world.moving[by].name}")
        away = places[i] - (self._nearest(i, places) if by is None else places[by])
        away[self._axes[i] :] = 0.0
        length = float(np.linalg.norm(away))
        away = away / length if length else np.array([1.0, 0.0, 0.0])
        (first, *_), chance = _knot(self._given.seed, f"adversary {who}", int((t + SAME_S) / TURN_S), 1)
        if how == "away" or (how == "adversarial" and chance < 0.5):
            return away
        side = np.array([-away[1], away[0], 0.0]) * math.copysign(1.0, first)
        return side / max(float(np.linalg.norm(side)), 1e-12)

    def _drawn(self, i: int, t: float, by: str) -> Array:
        """A place in the unit ball that changes linearly between draws, (3,)."""
        share = t / self._given.correlation_s
        number = math.floor(share)
        who, axes = f"{by}/{self._world.moving[i].name}", self._axes[i]
        (before, _), (after, _) = (_knot(self._given.seed, who, k, axes) for k in (number, number + 1))
        error = np.zeros(3)
        error[:axes] = np.array(before) + (share - number) * (np.array(after) - np.array(before))
        return error

    def _nearest(self, i: int, places: Array) -> Array:
        """The point, (3,), m, of another robot or an obstacle at rest to which robot i has the least to spare."""
        own, near = places[i], self._near
        others = near.carrier[near.others[i]]
        spare = np.concatenate([
            convex.distances(near.still, own, self._axes[i] == 2), np.linalg.norm(places[others] - own, axis=1)
        ]) - near.distance[i]  # fmt: skip
        k = int(np.argmax(spare <= spare.min() + SAME_M))  # of those as near, the first: whatever the rounding
        if k >= len(near.still):
            return np.asarray(places[others[k - len(near.still)]])
        return np.asarray(convex.nearest_points(near.still[[k]], own[None])[0, 0])


def errors_of(scenario: Scenario, world: World) -> Errors | None:
    """The errors of a scenario's measured positions with those beyond their bound; None: it measures nothing."""
    if scenario.sensing is None:
        return None
    beyond_m = (scenario.faults or Faults()).position_error_m
    return Errors(replace(scenario.sensing, position_error_m=scenario.position_error_m + beyond_m), world)
