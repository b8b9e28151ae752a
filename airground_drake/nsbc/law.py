"""The UGVs' control law: avoidance (7)-(8), tracking (6) and intervention (14), composed as (5) or (20)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from airground_drake.arrays import Array
from airground_drake.nsbc.avoidance import Avoidance, HalfSpaces, limit_speed
from airground_drake.nsbc.tasks import PositionTask


class Intervention(NamedTuple):
    """What an accepted intervention asks of one UGV now, (12)-(13).

    Attributes:
        wanted: where it is to be, (3,), m, world frame.
        rate: velocity of that place, (3,), m/s.
        chosen: J_int^+ J_int, projector onto the directions in which the UAV intervenes, (3, 3).
    """

    wanted: Array
    rate: Array
    chosen: Array


@dataclass(frozen=True)
class UgvLaw:
    """The numbers of the UGVs' control law, and the law.

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

    def velocity(
        self,
        position: Array,
        target: PositionTask,
        asked: Sequence[Intervention | None],
        spaces: HalfSpaces,
        mobility: Array,
        max_speed: Array,
    ) -> Array:
        """Commands of n UGVs, (n, 3), m/s.

        Without an accepted intervention: tracking below avoidance. With one: `intervention_on_top` puts it above
        that composite, as (20) does; otherwise it is the task below avoidance, and tracking fills its null space, so
        that no intervention can break an avoidance inequality.

        Args:
            position: (n, 3), m, world frame.
            target: the UGVs' own task (6).
            asked: per UGV, what the accepted intervention asks for, or None.
            spaces: avoidance inequalities at these positions.
            mobility: (n, 3), 1 where a robot can move, else 0.
            max_speed: (n,), m/s.
        """
        own = limit_speed(target.velocity(position) * mobility, max_speed)
        composite = self.avoidance.apply(own, spaces)
        for i, intervention in enumerate(asked):
            if intervention is None:
                continue
            row = slice(i, i + 1)
            below = composite[i] if self.intervention_on_top else own[i]
            task = mobility[i] * self._intervened(intervention, position[i], below, mobility[i])
            if not np.isfinite(task).all():  # the planner sends no such thing; nothing to follow then
                continue
            velocity = limit_speed(task[None], max_speed[row])
            if not self.intervention_on_top:
                velocity = self.avoidance.apply(velocity, HalfSpaces(spaces.normal[row], spaces.bound[row]))
            composite[i] = velocity[0]
        return composite

    def _intervened(self, intervention: Intervention, position: Array, below: Array, mobility: Array) -> Array:
        """Eq (20): v_int + (I - J_int^+ J_int) v, with v_int of (14), for one UGV; (3,), m/s."""
        wanted, rate, chosen = intervention
        asked = mobility * (rate + self.intervention_gain * (wanted - position))
        return below + chosen @ (asked - below)
