"""The UGVs' control law: avoidance (7)-(8), tracking (6) and intervention (14), composed as (5) or (20).

The tasks (6) and (14) are of the form (4) with the position as value (1) and the identity as Jacobian (2).

Compiled, and written once: the controllers command by it (`UgvLaw.velocity`), and the gatekeeper rolls it out
(`command`, called in `ugv/rollout.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array, Flags
from airground_drake.base.compiling import njit
from airground_drake.model.bodies.world import Neighbours
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.model.law.kernels import Layer, avoid_one, fill_half_spaces, is_finite, limit_one, yielding
from airground_drake.model.plants.steering import EDGES, NUMBERS, keep_ahead


class AcceptedMotion(NamedTuple):
    """The demand of an accepted intervention on one UGV now, (12)-(13)."""

    wanted: Array  # desired position, (3,), m, world frame
    rate: Array  # its velocity, (3,), m/s
    chosen: Array  # J_int^+ J_int, projector onto the directions in which the UAV intervenes, (3, 3)


class Numbers(NamedTuple):
    """The parameters of `UgvLaw` for numba."""

    motion_gain: float
    intervention_gain: float
    intervention_on_top: bool
    layer: Layer


class UgvState(NamedTuple):
    """A UGV's position, (3,), m, mobility, (3,), 1 where it can move, else 0, and speed limit, m/s."""

    position: Array
    mobility: Array
    max_speed: float


class Tracking(NamedTuple):
    """A UGV's own task (6): desired position, (3,), m, and its velocity, (3,), m/s."""

    target: Array
    rate: Array


@dataclass(frozen=True)
class UgvLaw:
    """The UGVs' control law.

    Attributes:
        avoidance: the set-based layer.
        motion_gain: B of (6), 1/s.
        intervention_gain: Lambda of (14), 1/s.
        intervention_on_top: priorities of (20) (methods (b), (c)); False: avoidance above the intervention.
    """

    avoidance: Avoidance
    motion_gain: float
    intervention_gain: float
    intervention_on_top: bool

    def with_gains(self, avoidance: float, motion: float, intervention: float) -> UgvLaw:
        """The law with other gains, 1/s."""
        if (avoidance, motion, intervention) == (self.avoidance.gain, self.motion_gain, self.intervention_gain):
            return self
        layer = replace(self.avoidance, gain=avoidance)
        return replace(self, avoidance=layer, motion_gain=motion, intervention_gain=intervention)

    @cached_property
    def numbers(self) -> Numbers:
        """For compiled code."""
        gains = float(self.motion_gain), float(self.intervention_gain)
        return Numbers(*gains, self.intervention_on_top, self.avoidance.layer)

    def velocity(
        self,
        positions: Array,
        near: Neighbours,
        target: Array,
        rate: Array,
        asked: Sequence[AcceptedMotion | None],
        steered: tuple[Array, Array] | None = None,
    ) -> Array:
        """Commands of n UGVs, (n, 3), m/s: `command` for each.

        Args:
            positions: of all bodies that move, (M, 3), m, world frame.
            near: the UGVs and what is around them.
            target: of the UGVs' own task (6), (n, 3), m.
            rate: velocity of the target, (n, 3), m/s.
            asked: per UGV, what the accepted intervention asks for, or None.
            steered: of unicycles, the headings (n,), rad, and the numbers of their steering, (n, 6): those that never
                drive backwards get no command to. None: there is no unicycle.
        """
        count = len(target)
        executing, chosen = np.zeros(count, dtype=np.bool_), np.zeros((count, 3, 3))
        wanted, wanted_rate = np.zeros((2, count, 3))
        for i, motion in enumerate(asked):
            if motion is not None:
                executing[i] = True
                wanted[i], wanted_rate[i], chosen[i] = motion
        every = AcceptedMotion(wanted, wanted_rate, chosen)
        headings, steering = (np.zeros(count), np.zeros((count, NUMBERS))) if steered is None else steered
        track = Tracking(target, rate)
        velocity: Array = commands(self.numbers, near, positions, track, every, executing, headings, steering)
        return velocity


@njit(cache=True, inline="always")
def command(
    law: Numbers,
    ugv: UgvState,
    track: Tracking,
    asked: AcceptedMotion,
    executing: bool,
    normal: Array,
    bound: Array,
    retreat: Array,
) -> Array:
    """Command of one UGV, (3,), m/s.

    Without an accepted intervention: tracking below avoidance. With one: `intervention_on_top` puts it above that
    composite, as (20) does; otherwise it is the task below avoidance, and tracking fills its null space, so that no
    intervention can break an avoidance inequality.

    A task below avoidance yields to obstacles that may move: see `kernels.yielding`. `asked` counts only if
    `executing`. The avoidance inequalities at this position are `normal`, (K, 3), and `bound`, (K,), m/s; `retreat`,
    (K,), m/s, as in `kernels.fill_half_spaces`.
    """
    own, composition = np.empty(3), law.layer.composition
    for a in range(3):
        own[a] = ugv.mobility[a] * (track.rate[a] + law.motion_gain * (track.target[a] - ugv.position[a]))
    limit_one(own, ugv.max_speed)
    if not executing or law.intervention_on_top:
        own = yielding(own, normal, retreat, ugv.max_speed)
    if not executing:
        return avoid_one(own, normal, bound, composition, ugv.max_speed)
    below = avoid_one(own, normal, bound, composition, ugv.max_speed) if law.intervention_on_top else own
    task = below.copy()  # (20): v_int + (I - J_int^+ J_int) v, with v_int of (14)
    for b in range(3):
        wish = ugv.mobility[b] * (asked.rate[b] + law.intervention_gain * (asked.wanted[b] - ugv.position[b]))
        for a in range(3):
            task[a] += asked.chosen[a, b] * (wish - below[b])
    for a in range(3):
        task[a] *= ugv.mobility[a]
    if not is_finite(task):  # the planner never sends such numbers
        task = below
    limit_one(task, ugv.max_speed)
    if law.intervention_on_top:
        return task
    return avoid_one(yielding(task, normal, retreat, ugv.max_speed), normal, bound, composition, ugv.max_speed)


@njit(cache=True)
def commands(
    law: Numbers,
    near: Neighbours,
    positions: Array,
    track: Tracking,
    asked: AcceptedMotion,
    executing: Flags,
    headings: Array,
    steering: Array,
) -> Array:
    """`command` for n UGVs, (n, 3), m/s; the fields of `track` and `asked` have a row per UGV, or a matrix."""
    # Reading an array of a named tuple within the loop would count references.
    members, carrier, others, still, parts, distance, share, mobility, max_speed = near
    target, rate = track
    wanted, wanted_rate, chosen = asked
    velocity = np.empty(target.shape)
    most = 2 * distance.shape[1] + EDGES
    normal, bound, which, retreat = np.empty((most, 3)), np.empty(most), np.empty(most, np.intp), np.empty(most)
    for i in range(len(target)):
        ugv = UgvState(positions[members[i]], mobility[i], max_speed[i])
        count = fill_half_spaces(
            ugv.position, ugv.mobility, still, parts, carrier, others[i], positions, distance[i], share[i],
            law.layer, which, normal, bound, retreat,
        )  # fmt: skip
        count = keep_ahead(headings[i], steering[i], normal, bound, retreat, count)
        task, own = AcceptedMotion(wanted[i], wanted_rate[i], chosen[i]), Tracking(target[i], rate[i])
        safe = command(law, ugv, own, task, executing[i], normal[:count], bound[:count], retreat[:count])
        for a in range(3):
            velocity[i, a] = safe[a]
    return velocity
