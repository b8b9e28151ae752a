"""How far bodies may be off the straight lines between their recorded places, from the numbers of their plants.

A first-order robot moves on these lines. For others the theorems of Plants.v bound what leaves them:

- the axle of a unicycle runs on arcs, off their chords by |omega| |v| h^2 / 8 at most;
- a body with lag tau accelerates by 2 V / tau at most, and is off by V h^2 / (4 tau);
- a body with a delay alone moves on straight lines.
"""

from fractions import Fraction

import numpy as np

from airground_drake.model.plants.budget import Bounds, law_distance
from airground_drake.scenario.plants import bounds_of
from airground_drake.sim.trace import Trace

# A dip is rounded down by so much, m: the sum of a budget then is no more than its floating-point value. A dip is the
# bound of an arc that is not attained, by far more.
ROUNDED_M = Fraction(1, 2**45)


def speed_m_s(trace: Trace, robot: str) -> float:
    """The limit of a robot's commands, or the fastest one of the run if that is faster."""
    return max(trace.scenario.robots[robot].max_speed_m_s, float(np.linalg.norm(trace.chosen(robot), axis=1).max()))


def bounds(trace: Trace, robot: str) -> Bounds:
    """How far a robot's body may be from the point that the law steers, with the commands of a run."""
    return trace.plant(robot).bounds(speed_m_s(trace, robot))


def off_lines_m(trace: Trace, robot: str) -> Fraction:
    """How far a robot's body may be off the straight lines between its recorded places, m."""
    limits = bounds(trace, robot)
    lagging = limits.speed_m_s * trace.scenario.control.period_s**2 / (4.0 * limits.lag_s) if limits.lag_s else 0.0
    return Fraction(limits.dip_m) + Fraction(lagging)


def off_steered_m(trace: Trace, robot: str) -> Fraction:
    """How far a robot's body may be off the straight lines of the point that the law steers, m."""
    limits = bounds(trace, robot)
    room = Fraction(limits.cover_m) + Fraction(limits.dip_m)
    return max(room - ROUNDED_M, Fraction(0))


def is_late(trace: Trace, robot: str) -> bool:
    """Whether a lag or a delay keeps a robot's body from where the law steers it."""
    return bounds(trace, robot).late


def law_m(trace: Trace, distance_m: Fraction, first: str, second: str) -> Fraction:
    """The distance that the law keeps between two steered points, or one and a set at rest, m."""
    robots, control = trace.scenario.robots, trace.scenario.control
    both = [
        bounds_of(robots[name], control.period_s, trace.scenario.seen(name))
        for name in (first, second)
        if name in robots
    ]
    if all(plant.exact for plant in both):
        return distance_m
    return Fraction(float(law_distance(float(distance_m), *both, gain=control.avoidance_gain_1_s)))
