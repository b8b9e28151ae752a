"""Optimal reciprocal collision avoidance (ORCA) through PyRVO (`pip install '.[bench]'`): on courses and among people.

Robots are discs of half the safe distance between two of them; an obstacle is a polygon around all that is left of its
safe distance when the robot's radius is taken off. A robot prefers the velocity of the UGVs' own task: that of its
preset trajectory plus a share of the way back to it. All positions and velocities are exact, and every robot runs ORCA:
it has no UAV, no trigger and no messages. People are agents whose motion is given; robots expect them to give way, too.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from maps import MAX_M_S, PRESET_M_S, SAFE_M, Array, Course

from airground_drake.model.geometry.motion import Motion
from airground_drake.scenario.schema import Scenario

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


class Traffic(NamedTuple):
    """Robots, and what is around them.

    Attributes:
        starts: of the n robots, (n, 2), m.
        radius: of the discs that are kept apart, m.
        max_speed: speed limit, m/s.
        preset: place, (2,), m, and velocity, (2,), m/s, of the preset trajectory of a robot at a time, s.
        polygons: obstacles, corners counter-clockwise, (n, 2), m; clockwise: the robots are inside.
        people: where people are at the steps, (k, T + 1, 2), m.
        of_people: radius of their discs, m.
        seed: of the tilt.
    """

    starts: Array
    radius: float
    max_speed: float
    preset: Callable[[int, float], tuple[Array, Array]]
    polygons: Sequence[Array]
    people: Array
    of_people: float
    seed: int


def presets_of(scenario: Scenario) -> Callable[[int, float], tuple[Array, Array]]:
    """The preset trajectories of its UGVs, as of `Traffic`."""
    given = [ugv.preset for ugv in scenario.ugvs.values()]
    presets = [Motion.at_speed(np.array(preset.waypoints_m), preset.speed_m_s) for preset in given]

    def preset(i: int, t: float) -> tuple[Array, Array]:
        place, rate = presets[i].at(t)
        return place[:2], rate[:2]

    return preset


def box(low: Array, high: Array) -> Array:
    """Corners, counter-clockwise, of a rectangle between two of them, (4, 2), m."""
    return np.array([low, [high[0], low[1]], high, [low[0], high[1]]])


def run(course: Course) -> tuple[Array, Array]:
    """Simulate a course.

    Returns:
        Times, (T,), s, and positions of the robots, (n, T, 3), m.

    Raises:
        ImportError: if PyRVO is not installed.
    """
    way = course.targets - course.starts
    length = np.linalg.norm(way, axis=1)

    def preset(i: int, t: float) -> tuple[Array, Array]:
        share = min(t * PRESET_M_S / length[i], 1.0)
        rate = PRESET_M_S * way[i] / length[i] if share < 1.0 else np.zeros(2)
        return course.starts[i] + share * way[i], rate

    radius, nobody = SAFE_M / 2.0, np.empty((0, 1, 2))
    discs = [_polygon(centre, SAFE_M - radius) for centre in course.obstacles]
    return driven(Traffic(course.starts, radius, MAX_M_S, preset, discs, nobody, 0.0, course.seed), course.duration_s)


def driven(given: Traffic, duration_s: float) -> tuple[Array, Array]:
    """Simulate; the result is that of `run`."""
    from pyrvo import RVOSimulator  # an extra

    robots, agents = len(given.starts), len(given.starts) + len(given.people)
    simulator = RVOSimulator(STEP_S, NEIGHBOUR_M, agents, HORIZON_S, HORIZON_S, given.radius, given.max_speed)
    for start in [*given.starts, *given.people[:, 0]]:
        simulator.add_agent(tuple(start.tolist()))
    for k in range(robots, agents):
        simulator.set_agent_radius(k, given.of_people)
    for corners in given.polygons:
        simulator.add_obstacle([tuple(corner) for corner in corners.tolist()])
    simulator.process_obstacles()
    tilts = TILT * np.random.default_rng(given.seed).choice([-1.0, 1.0], robots)
    count = round(duration_s / STEP_S)
    positions = np.zeros((robots, count + 1, 3))
    positions[:, 0, :2] = given.starts
    velocities = np.diff(given.people, axis=1) / STEP_S
    for k in range(count):
        for i in range(robots):
            place, rate = given.preset(i, k * STEP_S)
            wish = _turned(rate + MOTION_GAIN_1_S * (place - positions[i, k, :2]), tilts[i])
            simulator.set_agent_pref_velocity(i, tuple(_limited(wish, given.max_speed)))
        for j in range(robots, agents):
            here, velocity = (tuple(each[j - robots, k].tolist()) for each in (given.people, velocities))
            simulator.set_agent_position(j, here)
            simulator.set_agent_velocity(j, velocity)
            simulator.set_agent_pref_velocity(j, velocity)
        simulator.do_step()
        for i in range(robots):
            positions[i, k + 1, :2] = simulator.get_agent_position(i).to_tuple()
    return STEP_S * np.arange(count + 1), positions


def _polygon(centre: Array, radius: float) -> Array:
    """Corners, counter-clockwise, of a regular polygon around a disc, (CORNERS, 2), m."""
    angles = 2.0 * np.pi * np.arange(CORNERS) / CORNERS
    return centre + radius / np.cos(np.pi / CORNERS) * np.column_stack([np.cos(angles), np.sin(angles)])


def _turned(velocity: Array, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * velocity[0] - s * velocity[1], s * velocity[0] + c * velocity[1]])


def _limited(velocity: Array, most: float) -> list[float]:
    speed = float(np.linalg.norm(velocity))
    return (velocity if speed <= most else velocity * (most / speed)).tolist()
