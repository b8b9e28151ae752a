"""Lag: the body's velocity follows the command with a time constant."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.values import Positive
from airground_drake.model.plants.budget import Bounds
from airground_drake.model.plants.plant import PLACE, Keys, Plant, Premise, Recorded


@dataclass(slots=True, kw_only=True)
class LagKeys(Keys):
    """Its velocity follows the command with a time constant; the law steers p + tau v."""

    kind: Literal["lag"]
    """A lag."""
    time_constant_s: Positive
    """Time constant tau."""
    may_be_late: ClassVar[bool] = True

    def made(self, period_s: float, after: Plant | None) -> "Lag":
        return Lag(self.time_constant_s)


@dataclass(frozen=True)
class Lag(Plant):
    """tau v_dot = u - v. Its memory is v, m/s."""

    time_s: float  # tau

    signals: ClassVar[tuple[str, ...]] = (*PLACE, "body_vx_m_s", "body_vy_m_s", "body_vz_m_s")
    theorems: ClassVar[tuple[str, ...]] = ("Plants.lag", "Plants.lag_speed", "Plants.lag_pair", "Plants.lag_needs")
    passive_theorems: ClassVar[tuple[str, ...]] = ("Mixed.lagging",)
    unproved: ClassVar[str] = ""

    def bounds(self, speed_m_s: float) -> Bounds:
        return Bounds(lag_s=self.time_s, speed_m_s=speed_m_s)

    def memory(self) -> Array:
        return np.zeros(3)

    def remembered(self, memory: Array, command: Array, elapsed_s: float) -> Array:
        return command + math.exp(-elapsed_s / self.time_s) * (memory - command)

    def at(self, memory: Array, base: Array, command: Array, elapsed_s: float) -> Array:
        """Place and velocity, exact: p = z - tau v."""
        velocity = self.remembered(memory, command, elapsed_s)
        return np.concatenate([base - self.time_s * velocity, velocity])

    def bends_m(self, t_s: Array, signals: Array) -> Array:
        """Computed from the velocities at both ends."""
        # Its acceleration is at most ||v - u|| / tau, and ||v - u|| falls by exp(-s / tau) in s seconds.
        lasting, change = np.diff(t_s), np.linalg.norm(np.diff(signals[:, 3:], axis=0), axis=1)
        gone = -np.expm1(-lasting / self.time_s)
        short = np.divide(change, gone, out=np.zeros_like(gone), where=gone > 0.0)
        return np.asarray(short / self.time_s * np.square(lasting) / 8.0)

    def between(self, t_s: Array, signals: Array, shares: Array) -> Array:
        """Solution of the lag's equation, from positions and velocities at both ends."""
        lasting = float(t_s[1] - t_s[0])
        if lasting <= 0.0:
            return super().between(t_s, signals, shares)
        (start, end), (before, after) = signals[:, :3], signals[:, 3:]
        gone = -math.expm1(-lasting / self.time_s)
        part = -np.expm1(-shares * lasting / self.time_s) / gone
        behind = self.time_s * (after - before)
        return np.asarray(start + shares[:, None] * (end - start + behind) - part[:, None] * behind)

    def premises(self, run: Recorded) -> Iterator[Premise]:
        spare = run.max_speed_m_s - np.linalg.norm(run.signals[:, 3:], axis=1)
        yield Premise("speed of the body", "m/s", run.t_s, spare)
