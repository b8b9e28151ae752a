"""The avoidance inequalities (7)-(8), (11), written independently in numpy for all samples of a run at once.

Velocities in m/s, positions in m, world frame. The controllers' code is not used.
"""

from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array, Indices
from airground_drake.scenario.schema import Control
from airground_drake.sim.trace import Trace, per_trace
from airground_drake.verify.engines.shortfalls import demanded
from airground_drake.verify.runs.old_positions import heard_places, unsure_m
from airground_drake.verify.runs.pairs import contacts, is_planar, pairs_beside, parts_of

PLANE = np.array([1.0, 1.0, 0.0])  # directions in which a UGV can move
BINDING_M_S = 1e-9  # an avoidance inequality binds where a command has no more than this to spare, m/s
ON_TOP = ("b", "c")  # methods with accepted interventions above the avoidance inequalities, as in (20)


class Inequalities(NamedTuple):
    """Inequalities normal.v >= bound of a robot along its run, C of them."""

    # Sorted by control sample, then in the order of the controller: barriers at rest, robots, barriers that move.

    sample: Indices  # number of the control sample, (C,)
    column: Indices  # what is avoided, (C,): its number in `avoided`
    normal: Array  # (C, 3)
    distance: Array  # distance from the avoided body, or from its last known position, (C,), m
    bound: Array  # (C,), m/s

    def slack(self, velocity: Array) -> Array:
        """Slack of the velocities at the control samples, (S, 3), in each inequality, (C,), m/s."""
        return np.asarray(np.einsum("cd,cd->c", self.normal, velocity[self.sample]) - self.bound)


@per_trace
def avoided(trace: Trace) -> list[str]:
    """The bodies that robots avoid: for each part in `pairs.parts_of` its barrier, then the robots."""
    parts = parts_of(trace)
    return [*(parts.names[owner] for owner in parts.owner.tolist()), *trace.robots]


def least_speeds(distance: Array, safe: Array, share: Array, control: Control, speed: Array | float = 0.0) -> Array:
    """Set-based avoidance (7)-(8), (11): n.v >= share A (d - D) where D <= d, else n.v >= share (d - D) / h."""
    # Beside a body that may move with V > 0 it is n.v >= -(D - d - V h) / h, and never more than n.v >= 0.
    # distance, safe: m; speed: m/s
    # Returns the bounds, (...), m/s; -inf where D > R: no inequality applies there.
    period = control.period_s
    bound = share * demanded(safe - distance, control.avoidance_gain_1_s, 1.0 / period)
    passive = np.minimum(-(distance - safe - speed * period) / period, 0.0)
    return np.where(distance <= control.sensing_range_m, np.where(np.asarray(speed) > 0.0, passive, bound), -np.inf)


def _towards_unsure(
    normal: Array, bound: Array, distance: Array, excess: Array, unsure: Array, period_s: float, *, planar: bool
) -> tuple[Indices, Array, Array]:
    """The inequalities, with those for uncertain places in their own form: origins, normals, bounds."""
    # Too near to such a place the velocity stays in a cone, between two lines in the plane. If no direction is sure to
    # lead away no velocity is allowed: the two inequalities contradict each other.
    k = np.arange(len(bound))
    bound = np.where(unsure > 0.0, -excess / period_s, bound)
    cone = (unsure > 0.0) & (excess < 0.0)
    rows = np.concatenate([k[~cone], k[cone], k[cone]])
    side = np.repeat([0.0, 1.0, -1.0], [(~cone).sum(), cone.sum(), cone.sum()])
    cosine = np.abs(side) * (np.minimum(unsure[rows] / np.maximum(distance[rows], 1e-300), 1.0) if planar else 1.0)
    normal, bound = normal[rows], np.where(cone[rows], 0.0, bound[rows])
    sine, turned = np.sqrt(1.0 - cosine**2), np.stack([-normal[:, 1], normal[:, 0], np.zeros(len(rows))], axis=1)
    normal = sine[:, None] * normal + (side * cosine)[:, None] * turned
    lost = (side != 0.0) & (cosine == 1.0)
    normal[lost], bound[lost] = side[lost, None] * [1.0, 0.0, 0.0], 1.0
    return rows, normal, bound


def inequalities_of(trace: Trace, robot: str) -> Inequalities:
    """The inequalities of a robot at the control samples of its run, for all bodies that it saw within its range."""
    samples = trace.sample_rows
    parts = parts_of(trace)
    control = trace.scenario.control
    planar, pairs = is_planar(trace, robot), pairs_beside(trace, robot)
    own = trace.as_seen(robot, robot)
    others = [name for name in trace.robots if name != robot]
    near = contacts(trace, own, samples, control.sensing_range_m, planar=planar)
    there = [
        heard_places(trace, robot, name) if pairs[name].asynchronous else trace.as_seen(robot, name) for name in others
    ]
    old = [unsure_m(trace, robot, name) if pairs[name].asynchronous else np.zeros(len(own)) for name in others]
    offset, unsure = own[:, None] - np.stack(there, axis=1), np.stack(old, axis=1)
    apart = np.sqrt(np.square(offset).sum(axis=2))
    sample, other = np.nonzero((apart <= control.sensing_range_m) | (unsure > 0.0))
    apart, offset, unsure = apart[sample, other], offset[sample, other], unsure[sample, other]
    beside = [*(pairs[name] for name in parts.names), *(pairs[name] for name in others)]
    which = np.append(parts.owner[near.core], len(parts.names) + other)
    safe, share, speed = (
        np.array([getattr(pair, name) for pair in beside])[which] for name in ("law_m", "share", "speed_m_s")
    )
    normal = np.concatenate([near.away.normal, offset / np.where(apart > 0.0, apart, 1.0)[:, None]])
    normal *= PLANE if planar else 1.0
    distance = np.append(near.away.distance, apart)
    bound = least_speeds(distance, safe, share, control, speed)
    when = np.append(near.place, sample)
    number = np.array([trace.robots.index(name) for name in others], dtype=np.intp)
    column = np.append(near.core, len(parts.owner) + number[other])
    unsure = np.append(np.where(speed[: len(near.core)] > 0.0, trace.scenario.position_error_m, 0.0), unsure)
    if unsure.any():
        excess = distance - safe - np.where(speed > 0.0, speed * control.period_s, unsure)
        k, normal, bound = _towards_unsure(normal, bound, distance, excess, unsure, control.period_s, planar=planar)
        when, column, distance = when[k], column[k], distance[k]
    moves = np.array([trace.scenario.barriers[name].moves is not None for name in parts.names], dtype=np.bool_)
    rank = np.concatenate([np.where(moves[parts.owner], 2, 0), np.ones(len(trace.robots), dtype=np.intp)])
    order = np.lexsort([column, rank[column], when])
    return Inequalities(when[order], column[order], normal[order], distance[order], bound[order])
