"""Ackermann: a car, whose front wheels steer; it turns at a least radius, and never on the spot."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator

from airground_drake.base.arrays import Array
from airground_drake.base.values import SMALLEST, Heading, Number, Positive, as_float, wanted
from airground_drake.model.plants.plant import Keys, Plant, Premise, Recorded, Setting
from airground_drake.model.plants.steering import RADIUS
from airground_drake.model.plants.unicycle import Ahead, Unicycle, may_swing_round

_LOCK = wanted("an angle in rad above 0 and below pi / 2 = 1.5708", ge=SMALLEST, le=0.5 * math.pi - SMALLEST)


@dataclass(slots=True, kw_only=True)
class AckermannKeys(Keys):
    """A car (UGVs) with a hand point ahead of its rear axle. It never drives backwards or turns on the spot.

    Commands must point ahead, within atan(hand_point_m / R) of the heading. Here R = wheelbase_m /
    tan(max_steering_rad) is its least turning radius; the law has two more inequalities for this. A car whose target is
    beside or behind it, closer than it can turn, stands for ever.
    """

    kind: Literal["ackermann"]
    """A car."""
    hand_point_m: Ahead
    """Distance of the hand point ahead of the rear axle."""
    wheelbase_m: Positive
    """Distance of the axles."""
    max_steering_rad: Annotated[Number, _LOCK, BeforeValidator(as_float)]
    """Largest angle of the front wheels, of the middle between them."""
    heading_rad: Heading = 0.0
    """Heading at the start, counter-clockwise from x."""
    alone: ClassVar[str] = "no theorem covers another combination; chord steering needs a body that obeys at once"

    def made(self, period_s: float, after: Plant | None) -> "Ackermann":
        radius = self.wheelbase_m / math.tan(self.max_steering_rad)
        return Ackermann(self.hand_point_m, period_s, self.heading_rad, backwards=False, radius_m=radius)

    def problems(self, setting: Setting) -> Iterator[tuple[str, object, str]]:
        if setting.flies:
            yield "kind", self.kind, "another kind: a UAV is no car"
        if allowed := may_swing_round(self.made(setting.period_s, None), setting.max_speed_m_s):
            yield "hand_point_m", self.hand_point_m, allowed


@dataclass(frozen=True)
class Ackermann(Unicycle):
    """A unicycle that never drives backwards, with a least turning radius R: it follows commands with R |b| <= l a."""

    radius_m: float = 0.0  # R

    @property
    def theorems(self) -> tuple[str, ...]:
        return (*super().theorems, "Turning.car")

    @property
    def steering(self) -> Array:
        numbers = super().steering
        numbers[RADIUS] = self.radius_m
        return numbers

    def trails(self, speed_m_s: float) -> bool:
        return True  # behind every motion that turns at once

    def premises(self, run: Recorded) -> Iterator[Premise]:
        yield from super().premises(run)
        t, _, rate, speed = self.driven(run)
        yield Premise("least turning radius", "m/s", t, speed - self.radius_m * np.asarray(rate))
