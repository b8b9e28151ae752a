"""Unicycle: a differential drive, steered by its hand point."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator

from airground_drake.base.arrays import Array
from airground_drake.base.exact import decimal
from airground_drake.base.values import SMALLEST, Heading, NotNegative, Number, YesNo, as_float, wanted
from airground_drake.model.plants.budget import Bounds
from airground_drake.model.plants.plant import HEADING, PLACE, Keys, Need, Plant, Premise, Recorded, Setting
from airground_drake.model.plants.steering import FORWARD, HALF_BASE, HAND, NUMBERS, TURN, WHEEL, along, heading_after

_AHEAD = wanted("more than 0 m: the law steers a point ahead of the axle", ge=SMALLEST)
Ahead = Annotated[Number, _AHEAD, BeforeValidator(as_float)]


@dataclass(slots=True, kw_only=True)
class UnicycleKeys(Keys):
    """A differential drive (UGVs), controlled by a hand point ahead of its axle.

    The hand point can move in any direction, and arrives exactly at the commanded point. Commands that need too fast a
    turn or wheel are shortened.
    """

    kind: Literal["unicycle"]
    """A unicycle."""
    hand_point_m: Ahead
    """Distance of the hand point ahead of the axle."""
    heading_rad: Heading = 0.0
    """Heading at the start, counter-clockwise from x."""
    max_turn_rad_s: NotNegative = 0.0
    """Turning limit; 0: none."""
    wheel_base_m: NotNegative = 0.0
    """Distance of its wheels."""
    max_wheel_speed_m_s: NotNegative = 0.0
    """Speed limit of a wheel; 0: none."""
    backwards: YesNo = True
    """Whether it may drive backwards. If not, the law keeps less distance from what is at rest; but a robot can stand
    for ever if its target is straight behind it, or if it would have to turn towards a wall."""
    alone: ClassVar[str] = "no theorem covers another combination; chord steering needs a body that obeys at once"

    def made(self, period_s: float, after: Plant | None) -> "Unicycle":
        limits = self.max_turn_rad_s or math.inf, self.wheel_base_m, self.max_wheel_speed_m_s or math.inf
        return Unicycle(self.hand_point_m, period_s, self.heading_rad, *limits, self.backwards)

    def problems(self, setting: Setting) -> Iterator[tuple[str, object, str]]:
        """It drives, its wheels have both numbers, and its axle cannot swing round within a period."""
        if setting.flies:
            yield "kind", self.kind, "another kind: a UAV is no unicycle"
        if bool(self.wheel_base_m) != bool(self.max_wheel_speed_m_s):
            missing = "max_wheel_speed_m_s" if self.wheel_base_m else "wheel_base_m"
            yield missing, 0.0, "more than 0: wheel_base_m and max_wheel_speed_m_s go together"
        if allowed := may_swing_round(self.made(setting.period_s, None), setting.max_speed_m_s):
            yield "hand_point_m", self.hand_point_m, allowed


@dataclass(frozen=True)
class Unicycle(Plant):
    """A differential drive: see `model.plants.steering`. Its memory is its heading, rad."""

    hand_m: float  # distance l of the hand point ahead of the axle
    period_s: float  # control period
    heading_rad: float = 0.0  # at the start
    max_turn_rad_s: float = math.inf  # turning limit
    wheel_base_m: float = 0.0  # distance of the wheels
    max_wheel_m_s: float = math.inf  # speed limit of a wheel
    backwards: bool = True  # whether it may drive backwards

    signals: ClassVar[tuple[str, ...]] = (*PLACE, HEADING)
    cover_key: ClassVar[str] = "hand_point_m"
    passive_theorems: ClassVar[tuple[str, ...]] = ("Mixed.unicycle_chord",)
    unproved: ClassVar[str] = ""

    @property
    def theorems(self) -> tuple[str, ...]:
        chords = ("Plants.chord", "Turning.chord_turns", "Turning.shortened_chord", "Turning.shortened")
        return chords if self.backwards else (*chords, "Plants.forwards")

    @property
    def steering(self) -> Array:
        numbers = np.zeros(NUMBERS)
        numbers[HAND], numbers[TURN] = self.hand_m, self.max_turn_rad_s
        numbers[HALF_BASE], numbers[WHEEL] = 0.5 * self.wheel_base_m, self.max_wheel_m_s
        numbers[FORWARD] = not self.backwards
        return numbers

    @property
    def limit_rad_s(self) -> float:
        """The fastest turn that turning limit and wheels allow."""
        wheels = 2.0 * self.max_wheel_m_s / self.wheel_base_m if self.wheel_base_m else math.inf
        return min(self.max_turn_rad_s, wheels)

    def trails(self, speed_m_s: float) -> bool:
        """Whether the hand point cannot move in every direction at this speed."""
        wheel_m_s = speed_m_s * math.hypot(1.0, 0.5 * self.wheel_base_m / self.hand_m)
        return self.max_turn_rad_s * self.hand_m < speed_m_s or self.max_wheel_m_s < wheel_m_s

    def turning_rad_s(self, speed_m_s: float) -> float:
        """The fastest turn under commands up to a speed: its limit, or (2/h) asin(V h / (2 l)) if that is less."""
        sine = speed_m_s * self.period_s / (2.0 * self.hand_m)
        most = math.inf if sine > 1.0 else 2.0 / self.period_s * math.asin(sine)
        return min(most, self.limit_rad_s)

    def steered(self, start: Array) -> Array:
        ahead = np.array([math.cos(self.heading_rad), math.sin(self.heading_rad), 0.0])
        return start + self.hand_m * ahead

    def bounds(self, speed_m_s: float) -> Bounds:
        """Cover l. The hand point runs through an arc with a chord of at most V h: dip omega V h^2 / (8 sinc)."""
        # An axle that never goes backwards is drawn after the hand point.
        half = 0.5 * self.turning_rad_s(speed_m_s) * self.period_s
        dip = math.inf  # if it could swing round
        if half < math.pi:
            dip = 0.25 * half * speed_m_s * self.period_s / (math.sin(half) / half if half else 1.0)
        return Bounds(cover_m=self.hand_m, dip_m=dip, speed_m_s=speed_m_s, drawn=not self.backwards)

    def needs(self, speed_m_s: float) -> Iterator[Need]:
        """A hand point ahead, and turns of less than half a circle in a period."""
        hand, h = decimal(self.hand_m), decimal(self.period_s)
        yield Need("l", "the hand point is ahead of the axle", hand, "m", strict=True)
        fast, limit = 2 * hand - decimal(speed_m_s) * h, self.limit_rad_s
        half = Fraction(314159265358979, 10**14) - decimal(limit) * h if limit < math.inf else Fraction(-1)
        says = "V h is at most 2 l, or omega_max h is below pi"
        yield Need("turn in a period", says, max(fast, half), strict=fast < 0)

    def memory(self) -> Array:
        return np.array([self.heading_rad])

    def remembered(self, memory: Array, command: Array, elapsed_s: float) -> Array:
        return np.array([heading_after(float(memory[0]), command, elapsed_s, self.hand_m, self.period_s)])

    def at(self, memory: Array, base: Array, command: Array, elapsed_s: float) -> Array:
        """Axle and heading, exact."""
        state: Array = along(base, command, float(memory[0]), elapsed_s, self.hand_m, self.period_s)
        return state

    def bends_m(self, t_s: Array, signals: Array) -> Array:
        """The sagitta of each arc."""
        ways, turned = np.diff(signals[:, :3], axis=0), np.diff(signals[:, 3])
        return np.asarray(0.5 * np.linalg.norm(ways, axis=-1) * np.abs(np.tan(0.25 * turned)))

    def between(self, t_s: Array, signals: Array, shares: Array) -> Array:
        """On an arc."""
        start, end = signals[:, :3]
        half = 0.5 * float(signals[1, 3] - signals[0, 3])
        ratio = np.sin(shares * half) / math.sin(half) if half else shares
        turn, way = (shares - 1.0) * half, end - start
        turned = np.stack([
            np.cos(turn) * way[0] - np.sin(turn) * way[1], np.sin(turn) * way[0] + np.cos(turn) * way[1],
            np.full(len(shares), way[2]),
        ], axis=1)  # fmt: skip
        return np.asarray(start + ratio[:, None] * turned)

    def driven(self, run: Recorded) -> tuple[Array, Array, Array, Array]:
        """When each period begins and how long it lasts, s, turning rates, rad/s, and speeds along arcs, m/s."""
        begun, ended = run.signals[run.first], run.signals[run.last]
        t, lasting, turned = run.t_s[run.first], run.t_s[run.last] - run.t_s[run.first], ended[:, 3] - begun[:, 3]
        chords = np.linalg.norm((ended - begun)[:, :3], axis=1)
        return t, lasting, np.abs(turned) / lasting, chords / lasting / np.sinc(0.5 * turned / np.pi)

    def premises(self, run: Recorded) -> Iterator[Premise]:
        """Limits of turns, wheels and dips, and that it never drives backwards if it may not."""
        begun, ended = run.signals[run.first], run.signals[run.last]
        t, lasting, rate, speed = self.driven(run)
        if not self.backwards:
            middle = 0.5 * (begun[:, 3] + ended[:, 3])
            gone = np.einsum("ka,ka->k", (ended - begun)[:, :2], np.column_stack([np.cos(middle), np.sin(middle)]))
            yield Premise("never backwards", "m/s", t, gone / lasting)
        if self.max_turn_rad_s < math.inf:
            yield Premise("turning limit", "rad/s", t, self.max_turn_rad_s - rate)
        if self.wheel_base_m:
            spare = self.max_wheel_m_s - speed - 0.5 * self.wheel_base_m * rate
            yield Premise("wheel speeds", "m/s", t, spare)
        dips = rate * np.hypot(speed, self.hand_m * rate) * lasting**2 / 8.0
        yield Premise("dip of the hand point", "m", t, self.bounds(run.max_speed_m_s).dip_m - dips)


def may_swing_round(plant: Unicycle, speed_m_s: float) -> str:
    """The allowed values, if the axle could swing round within a period with this hand point; otherwise ''."""
    h, least = plant.period_s, 0.5 * speed_m_s * plant.period_s
    if plant.hand_m >= least or plant.limit_rad_s * h < math.pi:
        return ""
    return (
        f"at least max_speed_m_s * control.period_s / 2 = {least:.9g} m, or a turning limit below pi / period_s = "
        f"{math.pi / h:.6g} rad/s: else the axle could swing round within a period"
    )
