"""Obstacles as outlines of their convex parts: see `model.geometry.outline`."""

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.model.geometry.outline import SPEED, balls, prism, prisms, stacked
from airground_drake.scenario.schema import MapObstacle, Obstacle, Scenario
from airground_drake.scenario.shapes import convex_parts, corners_of_map


def outlines_of(scenario: Scenario, obstacle: Obstacle) -> Array:
    """The outlines of an obstacle's convex parts, (k, W), with the distance that robots keep, m, and its speed, m/s."""
    # They are in the world frame; those of an obstacle that moves are about the origin of its frame.
    gap = gap_m(scenario, obstacle)
    if isinstance(obstacle, MapObstacle):
        return prisms(corners_of_map(obstacle.cells), top=obstacle.height_m, gap=gap)
    parts = convex_parts(obstacle)
    if parts is None:
        rows = balls(obstacle.position_m or np.zeros(3), obstacle.radius_m, gap)
    else:
        rows = stacked(prism(part, top=obstacle.height_m, radius=obstacle.radius_m, gap=gap) for part in parts)
    rows[:, SPEED] = obstacle.expected_speed_m_s
    return rows


def gap_m(scenario: Scenario, obstacle: Obstacle) -> float:
    """The distance that robots keep from an obstacle's surface, m."""
    safe = scenario.safe_distance
    return obstacle.distance_m or (obstacle.expected_speed_m_s and safe.moving_m) or safe.obstacle_m
