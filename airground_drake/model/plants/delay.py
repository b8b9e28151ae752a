"""Delay: commands take effect later."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.exact import is_multiple
from airground_drake.base.values import Positive
from airground_drake.model.plants.budget import Bounds
from airground_drake.model.plants.first_order import FirstOrder
from airground_drake.model.plants.plant import PLACE, Keys, Need, Plant, Premise, Recorded, Setting


@dataclass(slots=True, kw_only=True)
class DelayKeys(Keys):
    """Commands take effect after a delay; the law steers the point reached after all pending commands."""

    kind: Literal["delay"]
    """A delay; in a list a lag may follow it."""
    delay_s: Positive
    """A whole number of control periods."""

    def precedes(self, other: Keys) -> bool:
        return other.may_be_late

    def made(self, period_s: float, after: Plant | None) -> "Delay":
        return Delay(round(self.delay_s / period_s), period_s, after or FirstOrder())

    def problems(self, setting: Setting) -> Iterator[tuple[str, object, str]]:
        if not is_multiple(self.delay_s, setting.period_s):
            allowed = f"a whole multiple of control.period_s = {setting.period_s:.9g} s, more than 0"
            yield "delay_s", self.delay_s, allowed


@dataclass(frozen=True)
class Delay(Plant):
    """A body whose commands take effect after some periods.

    The law steers the point reached after all pending commands. The memory consists of the pending commands, the oldest
    first, m/s, and then the memory of `after`.
    """

    periods: int  # the delay, in control periods
    period_s: float  # control period
    after: Plant = field(default_factory=FirstOrder)  # gets the delayed commands

    passive_theorems: ClassVar[tuple[str, ...]] = ("Mixed.delayed",)
    unproved: ClassVar[str] = ""

    @property
    def signals(self) -> tuple[str, ...]:
        return self.after.signals or PLACE

    @property
    def theorems(self) -> tuple[str, ...]:
        return ("Plants.delay", *self.after.theorems)

    def bounds(self, speed_m_s: float) -> Bounds:
        return self.after.bounds(speed_m_s)._replace(delay_s=self.periods * self.period_s)

    def needs(self, speed_m_s: float) -> Iterator[Need]:
        return self.after.needs(speed_m_s)

    def memory(self) -> Array:
        """No pending commands."""
        return np.concatenate([np.zeros(3 * self.periods), self.after.memory()])

    def remembered(self, memory: Array, command: Array, elapsed_s: float) -> Array:
        """The oldest command takes effect, and the new one becomes pending."""
        if elapsed_s == 0.0:
            return memory
        under_way = memory[3 : 3 * self.periods], command
        return np.concatenate([*under_way, self.after.remembered(*self._of_after(memory), elapsed_s)])

    def at(self, memory: Array, base: Array, command: Array, elapsed_s: float) -> Array:
        """Exact: the steered point minus the motion of all pending commands."""
        coming = memory[: 3 * self.periods].reshape(-1, 3)
        inner, now = self._of_after(memory)
        behind = base - elapsed_s * command - self.period_s * coming.sum(axis=0) + elapsed_s * now
        return self.after.at(inner, behind, now, elapsed_s) if self.after.signals else behind

    def bends_m(self, t_s: Array, signals: Array) -> Array:
        return self.after.bends_m(t_s, signals)

    def between(self, t_s: Array, signals: Array, shares: Array) -> Array:
        return self.after.between(t_s, signals, shares)

    def premises(self, run: Recorded) -> Iterator[Premise]:
        return self.after.premises(run)

    def _of_after(self, memory: Array) -> tuple[Array, Array]:
        """The memory of the plant `after` the delay, and the command that takes effect now."""
        return memory[3 * self.periods :], memory[:3]
