"""The robots' control law (6), (8)-(11), (14), (20), written again in numpy for many samples at once: B of them.

Velocities in m/s, positions in m, world frame. Nothing of the running code is used.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Control
from airground_drake.verify.engines.shortfalls import demanded
from airground_drake.verify.runs.pairs import around, places_of
from airground_drake.verify.runs.projection import closest, least_violation, shortened

PLANE = np.array([1.0, 1.0, 0.0])
"""Directions in which a UGV can move."""
ON_TOP = ("b", "c")
"""Methods that put an accepted intervention above the avoidance inequalities, as (20) does."""
MARGIN_M_S = 1e-12
"""The law's closest velocity keeps its inequalities by this much, m/s. Without it the corner of two nearly parallel
inequalities (a robot squeezed between an obstacle and another robot) is elsewhere by far more."""


class Inequalities(NamedTuple):
    """normal_k.v >= bound_k for K points: normals (B, K, 3), bounds (B, K), -inf beyond the sensing range."""

    normal: Array
    bound: Array


class Asked(NamedTuple):
    """Accepted interventions: wanted places (B, 3), their rates (B, 3), J_int^+ J_int (B, 3, 3)."""

    wanted: Array
    rate: Array
    chosen: Array


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


def inequalities_of(trace: Trace, robot: str, samples: npt.NDArray[np.intp]) -> Inequalities:
    """The inequalities of a robot at rows (B,) of its run, beside the bodies of `around` in their order."""
    places, beside = places_of(trace), around(trace, robot)
    others = [np.broadcast_to(places[other], (len(trace.t), 3))[samples] for other, _ in beside]
    found = inequalities(
        places[robot][samples],
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


def limited(velocity: Array, limit: Array | float) -> Array:
    """Velocities (B, 3) shortened to a speed limit, a number or (B,)."""
    speed = np.sqrt(np.square(velocity).sum(axis=1))
    return np.asarray(velocity * np.minimum(1.0, limit / np.maximum(speed, 1e-300))[:, None])


def avoiding(below: Array, given: Inequalities, composition: str, *, planar: bool) -> Array:
    """The avoidance tasks above velocities (B, 3): the closest ones, or (5) as printed for `recursion_*`."""
    velocity = below.copy()
    missed = (spare(given, below) < 0.0).any(axis=1)
    if not missed.any():
        return velocity
    normal, bound = given.normal[missed], given.bound[missed]
    if composition != "augmented":
        velocity[missed] = [
            _recursion(*one, nearest_first=composition == "recursion_nearest")
            for one in zip(below[missed], normal, bound, strict=True)
        ]
        return velocity
    axes = 2 if planar else 3
    level = bound + MARGIN_M_S
    found, met = closest(below[missed, :axes], normal[:, :, :axes], level)
    if not met.all():
        found[~met] = least_violation(normal[~met, :, :axes], level[~met])
    velocity[missed, :axes] = shortened(found, normal[:, :, :axes], bound)
    return velocity


def _recursion(below: Array, normal: Array, bound: Array, *, nearest_first: bool) -> Array:
    """(5), level by level from the lowest priority: each task corrects what the levels below it want."""
    order = np.arange(len(bound))[::-1]  # the one listed first has the highest priority
    if nearest_first:  # the most demanding has it; of two that demand the same, the one listed first
        order = order[np.argsort(bound[order], kind="stable")]
    velocity = below.copy()
    for k in order:
        lacking, squared = bound[k] - normal[k] @ velocity, normal[k] @ normal[k]
        if lacking > 0.0 and squared > 0.0:
            velocity += normal[k] * (lacking / squared)
    return velocity


def tracking(position: Array, preset: Array, rate: Array, gain: float, limit: Array | float) -> Array:
    """A UGV's own task (6), within its speed limit."""
    return limited(PLANE * (rate + gain * (preset - position)), limit)


def intervened(position: Array, below: Array, asked: Asked, gain: float, limit: Array | float) -> Array:
    """(14) above the velocities below it, (20): v_int + (I - J^+ J) v, within the speed limit."""
    wish = PLANE * (asked.rate + gain * (asked.wanted - position))
    return limited(PLANE * (below + np.einsum("bij,bj->bi", asked.chosen, wish - below)), limit)


def commanded(
    trace: Trace,
    position: Array,
    own: Array,
    given: Inequalities,
    rows: npt.NDArray[np.intp],
    asked: Asked,
    limit: Array,
) -> Array:
    """A UGV's commands by the law of a run, (B, 3): avoidance, and the interventions that are executed, (20).

    Args:
        trace: the run: its method says what has priority.
        position: (B, 3).
        own: its own task (6), (B, 3).
        given: its avoidance inequalities.
        rows: those in which an intervention is executed, (E,).
        asked: the E interventions.
        limit: speed limits, (B,).
    """
    composition, gain = trace.meta["composition"], trace.scenario.control.intervention_gain_1_s
    if trace.meta["method"] in ON_TOP:
        velocity = avoiding(own, given, composition, planar=True)
        velocity[rows] = intervened(position[rows], velocity[rows], asked, gain, limit[rows])
        return velocity
    task = own.copy()
    task[rows] = intervened(position[rows], own[rows], asked, gain, limit[rows])
    return avoiding(task, given, composition, planar=True)


def selected(selection: Array) -> Array:
    """J_int^+ J_int, (3, 3), of J_int given as its numbers in C order."""
    jacobian = selection.reshape(-1, 3)
    return np.asarray(np.linalg.pinv(jacobian) @ jacobian)
