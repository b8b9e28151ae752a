"""Optimal reciprocal collision avoidance (ORCA) on a course, through PyRVO (`pip install '.[bench]'`).

Robots are discs of half the safe distance between two of them; an obstacle is a regular polygon around the disc that
is left of its safe distance when the robot's radius is taken off. A robot prefers the velocity of the UGVs' own task:
that of its preset trajectory plus a share of the way back to it. All positions and velocities are exact, and every
robot runs ORCA: it has no UAV, no trigger and no messages.
"""

from __future__ import annotations

import numpy as np
from maps import MAX_M_S, PRESET_M_S, SAFE_M, Array, Course

STEP_S = 0.05
MOTION_GAIN_1_S = 2.0
"""Control period, s, and gain, 1/s, of the UGVs' own task: those of the scenarios."""

HORIZON_S = 5.0
"""Time horizon with respect to robots and obstacles, s."""

NEIGHBOUR_M = 15.0
CORNERS = 24

TILT = 1e-3
"""Angle, rad, by which preferred velocities are turned, to the left or the right at random: without it robots on a line
never pass each other."""


def run(course: Course) -> tuple[Array, Array]:
    """Simulate.

    Returns:
        Times, (T,), s, and positions of the robots, (n, T, 3), m.

    Raises:
        ImportError: if PyRVO is not installed.
    """
    from pyrvo import RVOSimulator  # an extra

    radius = SAFE_M / 2.0
    simulator = RVOSimulator(STEP_S, NEIGHBOUR_M, course.ugvs, HORIZON_S, HORIZON_S, radius, MAX_M_S)
    for start in course.starts:
        simulator.add_agent(tuple(start.tolist()))
    for centre in course.obstacles:
        simulator.add_obstacle([tuple(corner) for corner in _polygon(centre, SAFE_M - radius).tolist()])
    simulator.process_obstacles()
    rng = np.random.default_rng(course.seed)
    tilts = TILT * rng.choice([-1.0, 1.0], course.ugvs)
    way = course.targets - course.starts
    length = np.linalg.norm(way, axis=1)
    count = round(course.duration_s / STEP_S)
    positions = np.zeros((course.ugvs, count + 1, 3))
    positions[:, 0, :2] = course.starts
    for k in range(count):
        t = k * STEP_S
        for i in range(course.ugvs):
            share = min(t * PRESET_M_S / length[i], 1.0)
            rate = PRESET_M_S * way[i] / length[i] if share < 1.0 else np.zeros(2)
            error = course.starts[i] + share * way[i] - positions[i, k, :2]
            simulator.set_agent_pref_velocity(i, tuple(_limited(_turned(rate + MOTION_GAIN_1_S * error, tilts[i]))))
        simulator.do_step()
        for i in range(course.ugvs):
            positions[i, k + 1, :2] = simulator.get_agent_position(i).to_tuple()
    return STEP_S * np.arange(count + 1), positions


def _polygon(centre: Array, radius: float) -> Array:
    """Corners, counter-clockwise, of a regular polygon around a disc, (CORNERS, 2), m."""
    angles = 2.0 * np.pi * np.arange(CORNERS) / CORNERS
    return centre + radius / np.cos(np.pi / CORNERS) * np.column_stack([np.cos(angles), np.sin(angles)])


def _turned(velocity: Array, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * velocity[0] - s * velocity[1], s * velocity[0] + c * velocity[1]])


def _limited(velocity: Array) -> list[float]:
    speed = float(np.linalg.norm(velocity))
    return (velocity if speed <= MAX_M_S else velocity * (MAX_M_S / speed)).tolist()
