"""What a scenario demands of its robots, in plain numpy: nothing here comes from the code that is tested."""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.scenario.schema import Scenario


class Inequalities(NamedTuple):
    """n.v >= b for each of R robots and each of K things, obstacles first; b is -inf where nothing is asked."""

    distance: Array
    normal: Array
    bound: Array


@dataclass(frozen=True)
class Demands:
    """Distances and shares by robot (the UAV last) and thing (the obstacles, then the robots).

    Attributes:
        robots: names, R of them.
        obstacles: (m, 3), m.
        mobility: (R, 3), 0 where a robot cannot move.
        max_speed: (R,), m/s.
        safe: of centres, (R, m + R), m.
        share: of an inequality, (R, m + R).
        gain: A, 1/s.
        period: h, s.
        reach: sensing range, m.
    """

    robots: tuple[str, ...]
    obstacles: Array
    mobility: Array
    max_speed: Array
    safe: Array
    share: Array
    gain: float
    period: float
    reach: float

    @classmethod
    def of(cls, scenario: Scenario) -> Self:
        ugvs, uav, control = list(scenario.ugvs.values()), scenario.uav, scenario.control
        obstacles, count = list(scenario.obstacles.values()), len(ugvs) + 1
        radius = np.array([*(ugv.radius_m for ugv in ugvs), uav.radius_m])
        between = np.full((count, count), scenario.safe_distance.ugv_m)
        between[-1, :] = between[:, -1] = scenario.safe_distance.air_ground_m
        beside = np.full((count, len(obstacles)), scenario.safe_distance.obstacle_m)
        radii = np.array([*(obstacle.radius_m for obstacle in obstacles), *radius])
        return cls(
            robots=(*scenario.ugvs, uav.name),
            obstacles=np.array([obstacle.position_m for obstacle in obstacles], dtype=np.float64).reshape(-1, 3),
            mobility=np.array([[1.0, 1.0, 0.0]] * len(ugvs) + [[1.0, 1.0, 1.0]]),
            max_speed=np.array([*(ugv.max_speed_m_s for ugv in ugvs), uav.max_speed_m_s]),
            safe=np.hstack([beside, between]) + radius[:, None] + radii,
            share=np.hstack([np.ones_like(beside), np.full_like(between, 0.5)]),
            gain=control.avoidance_gain_1_s,
            period=control.period_s,
            reach=control.sensing_range_m,
        )

    def inequalities(self, positions: Array) -> Inequalities:
        offset = positions[:, None] - np.vstack([self.obstacles, positions])
        distance = np.linalg.norm(offset, axis=-1)
        normal = offset / np.where(distance > 0.0, distance, 1.0)[..., None] * self.mobility[:, None]
        lacking = self.safe - distance
        bound = self.share * lacking * np.where(lacking >= 0.0, self.gain, 1.0 / self.period)
        own = np.eye(len(positions), distance.shape[1], len(self.obstacles), dtype=np.bool_)
        return Inequalities(distance, normal, np.where(own | (distance > self.reach), -np.inf, bound))


def limited(velocity: Array, most: Array) -> Array:
    speed = np.linalg.norm(velocity, axis=1)
    found: Array = velocity * np.where(speed > most, most / np.maximum(speed, 1e-300), 1.0)[:, None]
    return found


def unit(rng: np.random.Generator, count: int) -> Array:
    found = rng.normal(size=(count, 3))
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    return found
