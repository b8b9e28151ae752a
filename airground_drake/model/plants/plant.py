"""Motion models: robots under velocity commands held for a period, and scripted obstacles.

The law steers a point of each robot. Under every plant that point, from sample to sample, moves as the command says.
Within a period it may leave the straight line by a *dip*, and the body may be elsewhere, within a *cover*: see
`model.plants.budget`. The straight line is the *base*: a first-order robot that starts where the steered point is. So
Drake integrates the base exactly, and the rest is in closed form: a *memory* (state) at each control sample, and the
signals of the body from base, command and memory. `sim.blocks.plant` makes the Drake systems.

A plant is one file: its keys in a scenario (`Keys`) and all that others ask of it (`Plant`). A line of
`base.registry.PLANTS` gives it its name.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar, NamedTuple

import numpy as np

from airground_drake.base.arrays import Array, Indices
from airground_drake.model.plants.budget import Bounds

# Signals of a body off its steered point: its position, world frame.
PLACE = ("body_x_m", "body_y_m", "body_z_m")
HEADING = "heading_rad"  # the signal of a body that has one


class Setting(NamedTuple):
    """Values on which the rules of a plant's keys may depend."""

    period_s: float  # control period
    gain_1_s: float  # of avoidance
    max_speed_m_s: float  # of the robot
    flies: bool  # whether it is the UAV


@dataclass(slots=True, kw_only=True)
class Keys:
    """The keys of a plant in a scenario: a base class of dataclasses whose fields are the keys."""

    kind: str  # its name; it chooses among the classes
    is_own: ClassVar[bool] = False  # whether it is a class of the user's
    may_be_late: ClassVar[bool] = False  # whether it may follow a delay in a list
    alone: ClassVar[str] = ""  # why it combines with no other plant, if not only for lack of a theorem

    def made(self, period_s: float, after: Plant | None) -> Plant:
        """The plant, with a control period, s; `after` gets its commands, if it may precede one."""
        raise NotImplementedError

    def precedes(self, other: Keys) -> bool:
        """Whether a list may have the other plant after this one."""
        return False

    def problems(self, setting: Setting) -> Iterator[tuple[str, object, str]]:
        """Key, value and allowed values, for keys that contradict each other."""
        yield from ()


class Recorded(NamedTuple):
    """The record of a robot in a run: T rows, K whole control periods, S control samples."""

    t_s: Array  # (T,)
    signals: Array  # those of its plant, (T, k)
    first: Indices  # the row at which each period begins, (K,)
    last: Indices  # the row at which it ends, (K,)
    sampled_s: Array  # times of the control samples, (S,)
    measured: Array  # what is measured of its plant, (S, m)
    max_speed_m_s: float  # of its commands


class Premise(NamedTuple):
    """A hypothesis of a plant's theorems about a run: it holds where margins are at least 0."""

    name: str
    unit: str
    t_s: Array  # (K,)
    margin: Array  # (K,)


class Need(NamedTuple):
    """A hypothesis of a plant's theorems about its parameters: the margin is at least 0, or above 0."""

    symbol: str
    says: str
    margin: Fraction
    unit: str = ""
    strict: bool = False


class Plant:
    """The motion of a robot, period by period. This base class follows commands exactly."""

    # Names of the quantities that a run measures in each control period (for plants with unknown motion).
    measured: ClassVar[tuple[str, ...]] = ()
    # The scenario's key of its cover.
    cover_key: ClassVar[str] = "cover_m"
    # Theorems about it beside an obstacle that may move.
    passive_theorems: ClassVar[tuple[str, ...]] = ()
    # Why no theorem covers a recorded run with it; '' if one does (`verify/proofs/export.py` has its bounds).
    unproved: ClassVar[str] = "no theorem is about such a body"

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the body's recorded signals, with units, position first; empty if the body is the steered point."""
        return ()

    @property
    def theorems(self) -> tuple[str, ...]:
        """Names of the theorems about it."""
        return ()

    @property
    def steering(self) -> Array | None:
        """Parameters of `model.plants.steering` for shortening commands; None: no limit."""
        return None

    def trails(self, speed_m_s: float) -> bool:
        """Whether the body may fall behind a motion of its steered point at a speed."""
        return bool(self.signals)

    def steered(self, start: Array) -> Array:
        """The point that the law steers, (3,), m, of a body at rest at `start`, (3,), m."""
        return start

    def bounds(self, speed_m_s: float) -> Bounds:
        """Bounds of the body's deviation from the steered point, with commands up to a speed, m/s."""
        return Bounds(speed_m_s=speed_m_s)

    def needs(self, speed_m_s: float) -> Iterator[Need]:
        """Hypotheses of the theorems about its parameters, with commands up to a speed, m/s."""
        yield from ()

    def memory(self) -> Array:
        """The memory of a body at rest, (k,)."""
        return np.empty(0)

    def remembered(self, memory: Array, command: Array, elapsed_s: float) -> Array:
        """The memory, (k,), after a command (3,), m/s, of a time, s, in all a period."""
        return memory

    def at(self, memory: Array, base: Array, command: Array, elapsed_s: float) -> Array:
        """The body's signals a time, s, after a sample: from the memory there, and base (3,), m, and command now."""
        return np.empty(0)

    def bends_m(self, t_s: Array, signals: Array) -> Array:
        """How far the body may be from the straight line between two rows, (T - 1,), m; signals (T, k)."""
        return np.zeros(len(t_s) - 1)

    def between(self, t_s: Array, signals: Array, shares: Array) -> Array:
        """Places at shares (n,) of the time between two rows, (n, 3), m; times (2,), s, and signals (2, k)."""
        start, end = signals[:, :3]
        return np.asarray(start + shares[:, None] * (end - start))

    def premises(self, run: Recorded) -> Iterator[Premise]:
        """Hypotheses of its theorems along a run."""
        yield from ()
