"""The avoidance inequalities (7)-(8), (11), written again in numpy for many samples at once: B of them.

Velocities in m/s, positions in m, world frame. Nothing of the running code is used.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Control
from airground_drake.verify.engines.shortfalls import demanded
from airground_drake.verify.runs.pairs import around, places_of

PLANE = np.array([1.0, 1.0, 0.0])
"""Directions in which a UGV can move."""
ON_TOP = ("b", "c")
"""Methods that put an accepted intervention above the avoidance inequalities, as (20) does."""


class Inequalities(NamedTuple):
    """normal_k.v >= bound_k for K points: normals (B, K, 3), bounds (B, K), -inf beyond the sensing range."""

    normal: Array
    bound: Array


def inequalities(
    position: Array, centre: Array, safe: Array, share: Array, control: Control, *, planar: bool
) -> Inequalities:
    """Set-based avoidance (7)-(8), (11): n.v >= share A (d - D) where D <= d, else n.v >= share (d - D) / h.

    Args:
        position: (B, 3).
        centre: points to keep away from, (B, K, 3).
        safe: distances d, (K,) or (B, K).
        share: of each inequality, (K,) or (B, K).
        control: A, h and sensing range of the scenario.
        planar: whether the robot cannot use the z component of n.
    """
    offset = position[:, None] - centre
    distance = np.sqrt(np.square(offset).sum(axis=2))
    normal = offset / np.where(distance > 0.0, distance, 1.0)[..., None] * (PLANE if planar else 1.0)
    bound = share * demanded(safe - distance, control.avoidance_gain_1_s, 1.0 / control.period_s)
    return Inequalities(normal, np.where(distance <= control.sensing_range_m, bound, -np.inf))


def inequalities_of(trace: Trace, robot: str, *, as_seen: bool = False) -> Inequalities:
    """The inequalities of a robot at the control samples of its run, beside the bodies of `around` in their order.

    They are those of the true positions, or of the positions that the robot saw.
    """
    places, beside, samples = places_of(trace), around(trace, robot), trace.sample_rows

    def place(body: str) -> Array:
        if as_seen and body in trace.robots:
            return trace.as_seen(robot, body)
        return np.broadcast_to(places[body], (len(trace.t), 3))[samples]

    others = [place(other) for other, _ in beside]
    found = inequalities(
        place(robot),
        np.stack(others, axis=1) if others else np.empty((len(samples), 0, 3)),
        np.array([pair.safe_m for _, pair in beside]),
        np.array([pair.share for _, pair in beside]),
        trace.scenario.control,
        planar=robot in trace.ugvs,
    )
    there = samples[:, None] >= np.array([pair.row for _, pair in beside])
    return found._replace(bound=np.where(there, found.bound, -np.inf))


def spare(given: Inequalities, velocity: Array) -> Array:
    """Slack of velocities (B, 3) in each inequality, (B, K), m/s; inf beyond the sensing range."""
    return np.asarray(np.einsum("bkd,bd->bk", given.normal, velocity) - given.bound)
