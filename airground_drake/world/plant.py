"""How a body moves: a robot under a velocity command that is held for a period, an obstacle by its script.

`systems.plant` makes the Drake systems.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Protocol

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.world.motion import PeriodMotion

if TYPE_CHECKING:
    from airground_drake.geometry.motion import Motion


class Plant(Protocol):
    """The motion of a robot, period by period; the leading dimensions (...) are periods.

    Attributes:
        kind: name under which a scenario and `systems.plant` know it.
    """

    kind: ClassVar[str]

    def step(self, position: Array, velocity: Array, period_s: Array | float) -> Array:
        """Where a velocity (..., 3), m/s, leads to in periods (...,), s, from positions (..., 3), m: (..., 3), m."""

    def motion(self, start: Array, end: Array, period_s: Array | float) -> PeriodMotion:
        """How it moves between its positions at the two ends of a period, (..., 3), m."""

    def reach(self, speed_m_s: float, period_s: float) -> float:
        """Largest distance from the straight line of the commanded velocity in a period, m."""


class _Straight:
    """A body that moves on a straight line in each period."""

    def step(self, position: Array, velocity: Array, period_s: Array | float) -> Array:
        """Exact."""
        return position + np.asarray(period_s)[..., None] * velocity

    def motion(self, start: Array, end: Array, period_s: Array | float) -> PeriodMotion:
        """Exact."""
        return PeriodMotion(start, end)

    def reach(self, speed_m_s: float, period_s: float) -> float:
        """0."""
        return 0.0


@dataclass(frozen=True)
class FirstOrder(_Straight):
    """p_dot = v: it moves as it is told."""

    kind: ClassVar[str] = "first_order"


@dataclass(frozen=True, eq=False)
class Scripted(_Straight):
    """A motion that is given: nobody commands it.

    Attributes:
        script: where it is, straight between its vertices, which are at control samples.
        announced: whether the robots' predictions know that.
    """

    kind: ClassVar[str] = "scripted"
    script: Motion
    announced: bool = False
