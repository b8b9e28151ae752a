"""How a body moves: a robot under a velocity command that is held for a period, an obstacle by its script.

The law steers a point of each robot. Under every plant here that point, from sample to sample, moves as the command
says. Within a period it may leave the straight line by a *dip*, and the body may be elsewhere, within a *cover*: see
`model.plants.budget`. The straight line is the *base*: a first-order robot that starts where the steered point is.
So Drake integrates the base exactly, and all else is in closed form: a *memory* at each control sample, and the signals
of the body from base, command and memory. `sim.blocks.plant` makes the Drake systems.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Protocol

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.model.plants.budget import Bounds
from airground_drake.model.plants.steering import FORWARD, HALF_BASE, HAND, NUMBERS, TURN, WHEEL, along, turned

if TYPE_CHECKING:
    from airground_drake.model.geometry.motion import Motion

# Signals of a body that is not where the law steers it: its position, world frame.
PLACE = ("body_x_m", "body_y_m", "body_z_m")


class Plant(Protocol):
    """The motion of a robot, period by period; the leading dimensions (...) are periods.

    Attributes:
        kind: name under which a scenario and `sim.blocks.plant` know it.
        signals: names of what is recorded of the body besides the steered point; they end in their units. Empty: the
            body is the steered point.
    """

    kind: ClassVar[str]

    @property
    def signals(self) -> tuple[str, ...]:
        """See above."""

    def step(self, position: Array, velocity: Array, period_s: Array | float) -> Array:
        """Where a velocity (..., 3), m/s, leads to in periods (...,), s, from positions (..., 3), m: (..., 3), m."""

    def steered(self, start: Array) -> Array:
        """The point that the law steers, (3,), m, of a body at rest at `start`, (3,), m."""

    def bounds(self, speed_m_s: float) -> Bounds:
        """How far the body may be from where the law steers it, with commands up to a speed, m/s."""

    def memory(self) -> Array:
        """What is remembered of a body at rest, (k,)."""

    def remembered(self, memory: Array, command: Array, elapsed_s: float) -> Array:
        """The memory, (k,), after a command (3,), m/s, of a time, s, in all a period."""

    def at(self, memory: Array, base: Array, command: Array, elapsed_s: float) -> Array:
        """The signals of the body, s after the last sample: from the memory then, and base (3,), m, and command now."""


class _Straight:
    """A steered point that moves on a straight line in each period, and is the body."""

    @property
    def signals(self) -> tuple[str, ...]:
        """None."""
        return ()

    def step(self, position: Array, velocity: Array, period_s: Array | float) -> Array:
        """Exact."""
        return position + np.asarray(period_s)[..., None] * velocity

    def steered(self, start: Array) -> Array:
        """The body itself."""
        return start

    def bounds(self, speed_m_s: float) -> Bounds:
        """Nothing to account for."""
        return Bounds(speed_m_s=speed_m_s)

    def memory(self) -> Array:
        """Nothing."""
        return np.empty(0)

    def remembered(self, memory: Array, command: Array, elapsed_s: float) -> Array:
        """Nothing."""
        return memory

    def at(self, memory: Array, base: Array, command: Array, elapsed_s: float) -> Array:
        """Nothing."""
        return np.empty(0)


@dataclass(frozen=True)
class FirstOrder(_Straight):
    """p_dot = v: it moves as it is told."""

    kind: ClassVar[str] = "first_order"


@dataclass(frozen=True)
class Unicycle(_Straight):
    """A differential drive, steered by its hand point: see `model.plants.steering`. Its memory is its heading, rad.

    Attributes:
        hand_m: distance l of the hand point ahead of the axle, m.
        period_s: control period, s.
        heading_rad: at the start.
        max_turn_rad_s: turning limit.
        wheel_base_m: distance of the wheels, m.
        max_wheel_m_s: speed limit of a wheel.
        backwards: whether it may drive backwards.
    """

    kind: ClassVar[str] = "unicycle"
    hand_m: float
    period_s: float
    heading_rad: float = 0.0
    max_turn_rad_s: float = math.inf
    wheel_base_m: float = 0.0
    max_wheel_m_s: float = math.inf
    backwards: bool = True

    @property
    def signals(self) -> tuple[str, ...]:
        """Axle and heading."""
        return (*PLACE, "heading_rad")

    @property
    def steering(self) -> Array:
        """Numbers for `model.plants.steering`, (5,)."""
        found = np.zeros(NUMBERS)
        found[HAND], found[TURN] = self.hand_m, self.max_turn_rad_s
        found[HALF_BASE], found[WHEEL] = 0.5 * self.wheel_base_m, self.max_wheel_m_s
        found[FORWARD] = not self.backwards
        return found

    def turning_rad_s(self, speed_m_s: float) -> float:
        """The fastest turn under commands up to a speed: its limit, or (2/h) asin(V h / (2 l)) if that is less."""
        sine = speed_m_s * self.period_s / (2.0 * self.hand_m)
        most = math.inf if sine > 1.0 else 2.0 / self.period_s * math.asin(sine)
        wheels = 2.0 * self.max_wheel_m_s / self.wheel_base_m if self.wheel_base_m else math.inf
        return min(most, self.max_turn_rad_s, wheels)

    def steered(self, start: Array) -> Array:
        """The hand point."""
        ahead = np.array([math.cos(self.heading_rad), math.sin(self.heading_rad), 0.0])
        return start + self.hand_m * ahead

    def bounds(self, speed_m_s: float) -> Bounds:
        """Cover l. The hand point runs through an arc with a chord of at most V h: dip omega V h^2 / (8 sinc)."""
        # An axle that never goes backwards is drawn after the hand point.
        half = 0.5 * self.turning_rad_s(speed_m_s) * self.period_s
        sinc = math.sin(half) / half if half else 1.0
        dip = 0.25 * half * speed_m_s * self.period_s / sinc
        return Bounds(cover_m=self.hand_m, dip_m=dip, speed_m_s=speed_m_s, drawn=not self.backwards)

    def memory(self) -> Array:
        """The heading."""
        return np.array([self.heading_rad])

    def remembered(self, memory: Array, command: Array, elapsed_s: float) -> Array:
        """The heading after a turn."""
        return np.array([turned(float(memory[0]), command, elapsed_s, self.hand_m, self.period_s)])

    def at(self, memory: Array, base: Array, command: Array, elapsed_s: float) -> Array:
        """Axle and heading, exact."""
        found: Array = along(base, command, float(memory[0]), elapsed_s, self.hand_m, self.period_s)
        return found


@dataclass(frozen=True)
class Lag(_Straight):
    """tau v_dot = u - v: the body's velocity follows the command. The law steers p + tau v. Its memory is v, m/s.

    Attributes:
        time_s: tau.
    """

    kind: ClassVar[str] = "lag"
    time_s: float

    @property
    def signals(self) -> tuple[str, ...]:
        """Place and velocity."""
        return (*PLACE, "body_vx_m_s", "body_vy_m_s", "body_vz_m_s")

    def bounds(self, speed_m_s: float) -> Bounds:
        """The lag."""
        return Bounds(lag_s=self.time_s, speed_m_s=speed_m_s)

    def memory(self) -> Array:
        """At rest."""
        return np.zeros(3)

    def remembered(self, memory: Array, command: Array, elapsed_s: float) -> Array:
        """The velocity, exact."""
        return command + math.exp(-elapsed_s / self.time_s) * (memory - command)

    def at(self, memory: Array, base: Array, command: Array, elapsed_s: float) -> Array:
        """Place and velocity, exact: p = z - tau v."""
        velocity = self.remembered(memory, command, elapsed_s)
        return np.concatenate([base - self.time_s * velocity, velocity])


@dataclass(frozen=True)
class Delay(_Straight):
    """A body whose commands take effect after some periods. The law steers where it will be when all are carried out.

    Its memory are the commands under way, the oldest first, m/s, and then that of `after`.

    Attributes:
        periods: the delay, in control periods.
        period_s: control period, s.
        after: the plant that gets the delayed commands.
    """

    kind: ClassVar[str] = "delay"
    periods: int
    period_s: float
    after: FirstOrder | Lag = field(default_factory=FirstOrder)

    @property
    def signals(self) -> tuple[str, ...]:
        """Those of `after`, or the place."""
        return self.after.signals or PLACE

    def bounds(self, speed_m_s: float) -> Bounds:
        """The delay, and the bounds of `after`."""
        return self.after.bounds(speed_m_s)._replace(delay_s=self.periods * self.period_s)

    def memory(self) -> Array:
        """No command is under way."""
        return np.concatenate([np.zeros(3 * self.periods), self.after.memory()])

    def remembered(self, memory: Array, command: Array, elapsed_s: float) -> Array:
        """The oldest command has taken effect, and the new one is under way."""
        if elapsed_s == 0.0:
            return memory
        under_way = memory[3 : 3 * self.periods], command
        return np.concatenate([*under_way, self.after.remembered(*self._of_after(memory), elapsed_s)])

    def at(self, memory: Array, base: Array, command: Array, elapsed_s: float) -> Array:
        """Exact: all commands under way are still to come."""
        coming = memory[: 3 * self.periods].reshape(-1, 3)
        inner, now = self._of_after(memory)
        behind = base - elapsed_s * command - self.period_s * coming.sum(axis=0) + elapsed_s * now
        return self.after.at(inner, behind, now, elapsed_s) if self.after.signals else behind

    def _of_after(self, memory: Array) -> tuple[Array, Array]:
        """The memory of `after`, and the command that takes effect now."""
        return memory[3 * self.periods :], memory[:3]


@dataclass(frozen=True)
class Own(_Straight):
    """A Drake System of the user's, whose motion is not known here."""

    # `sim.blocks.plant` makes it and looks at its ports.
    # Its steered point gets to within `drift_m_s` times the control period of where its command leads in each period,
    # and its body stays within `cover_m` of the straight line between the places of that point at the period's ends. A
    # run measures both. Predictions go where the command leads.

    kind: ClassVar[str] = "own"
    name: str  # of its class, `module:Class` or `file.py:Class`
    drift_m_s: float  # declared
    cover_m: float  # declared
    parameters: Mapping[str, float] = field(default_factory=dict)  # of its class

    @property
    def signals(self) -> tuple[str, ...]:
        """Place."""
        return PLACE

    def bounds(self, speed_m_s: float) -> Bounds:
        """What is declared."""
        return Bounds(cover_m=self.cover_m, drift_m_s=self.drift_m_s, speed_m_s=speed_m_s)


@dataclass(frozen=True, eq=False)
class Scripted(_Straight):
    """A motion that is given: nobody commands it."""

    kind: ClassVar[str] = "scripted"
    script: Motion  # where it is, straight between its vertices, which are at control samples
    announced: bool = False  # whether the robots' predictions know that
