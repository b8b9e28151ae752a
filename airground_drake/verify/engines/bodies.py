"""Bodies that are not where the law steers them: what that costs in distance, and how they move between two rows.

Written again from the scenario's keys and from recorded signals; nothing of the running code is used.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.scenario.schema import Control, Uav, Ugv


class Room(NamedTuple):
    """What a robot's plant takes: lengths in m, times in s, speed in m/s."""

    body_m: float  # how far the body may be from the steered point within a period, dip included
    lag_s: float  # time constant
    delay_s: float  # of its commands
    speed_m_s: float  # limit of its commands
    drift_m: float = 0.0  # what missing its commands, by w at most, costs in distance: w / A
    slip_m: float = 0.0  # what it costs in one period: w h
    drawn_m: float = 0.0  # part of `body_m` by which the body is drawn after the steered point, as a trailer

    @property
    def rolling_m(self) -> float:
        """How far the body may be from the steered point in all."""
        return self.body_m + (self.lag_s + self.delay_s) * self.speed_m_s

    @property
    def is_nothing(self) -> bool:
        """Whether it takes no distance."""
        return not (self.rolling_m or self.drift_m)


def room_of(robot: Ugv | Uav, control: Control) -> Room:
    """What the plant of a robot takes."""
    body = lag = delay = drift = drawn = 0.0
    period_s = control.period_s
    for plant in robot.plant:
        body += plant.cover_m
        drift += plant.drift_m_s
        if plant.kind == "unicycle":
            body += plant.hand_point_m + _dip_m(plant.hand_point_m, robot.max_speed_m_s, period_s, _turning(plant))
            drawn += 0.0 if plant.backwards else plant.hand_point_m
        lag += plant.time_constant_s * (plant.kind == "lag")
        delay += plant.delay_s * (plant.kind == "delay")
    restored_m = drift / control.avoidance_gain_1_s if drift else 0.0
    return Room(body, lag, delay, robot.max_speed_m_s, restored_m, drift * period_s, drawn)


def _turning(plant: object) -> float:
    """Turning limit by the limits of turns and of wheels, rad/s."""
    turn, base, wheel = (getattr(plant, key) for key in ("max_turn_rad_s", "wheel_base_m", "max_wheel_speed_m_s"))
    return min(turn or math.inf, 2.0 * wheel / base if wheel and base else math.inf)


def _dip_m(hand_m: float, speed_m_s: float, period_s: float, most_rad_s: float) -> float:
    """Largest |omega| ||w|| h^2 / 8: the hand point goes at ||w|| along an arc whose chord is V h at most."""
    step = speed_m_s * period_s
    turn = most_rad_s * period_s
    if step <= 2.0 * hand_m:
        turn = min(turn, 2.0 * math.asin(step / (2.0 * hand_m)))
    return step * turn / 8.0 * (0.5 * turn / math.sin(0.5 * turn)) if turn else 0.0


def law_m(safe_m: float, one: Room, other: Room | None, *, passive: bool) -> float:
    """Distance that the law must keep for the bodies to keep `safe_m`, m; `other` is None beside an obstacle."""
    bodies = one.body_m + one.drift_m + (other.body_m + other.drift_m if other else 0.0)
    if passive:
        return safe_m + one.rolling_m + one.drift_m
    if other is None and one.drawn_m:
        return math.hypot(safe_m, one.drawn_m) + bodies - one.drawn_m
    if not (one.lag_s or one.delay_s or (other and (other.lag_s or other.delay_s))):
        return safe_m + bodies
    if other is None:
        return math.hypot(safe_m, one.lag_s * one.speed_m_s) + bodies
    late = safe_m + min(one.speed_m_s, other.speed_m_s) * abs(one.delay_s - other.delay_s)
    both = one.speed_m_s + other.speed_m_s
    choices = []
    for tau in (0.0, one.lag_s, other.lag_s):
        apart = sum(abs(each.lag_s - tau) * each.speed_m_s for each in (one, other))
        choices.append(apart + math.hypot(late, tau * both))
    return min(choices) + bodies


def kept_m(points_m: float, one: Room, other: Room | None) -> float:
    """Distance that bodies keep where their steered points keep `points_m`, m: the inverse of `law_m`, not passive."""
    # -inf where nothing is promised: within tau V of a set, say, the body may be anywhere beside it.
    left = points_m - one.body_m - one.drift_m - (other.body_m + other.drift_m if other else 0.0)
    if other is None:
        behind = one.drawn_m or one.lag_s * one.speed_m_s
        return _leg(left + one.drawn_m, behind)
    late = min(one.speed_m_s, other.speed_m_s) * abs(one.delay_s - other.delay_s)
    both = one.speed_m_s + other.speed_m_s
    found = []
    for tau in (0.0, one.lag_s, other.lag_s):
        apart = sum(abs(each.lag_s - tau) * each.speed_m_s for each in (one, other))
        found.append(_leg(left - apart, tau * both) - late)
    return max(found)


def _leg(hypotenuse: float, leg: float) -> float:
    """The other leg of a right-angled triangle, from below; -inf if there is none."""
    if leg == 0.0:
        return hypotenuse
    if hypotenuse < leg:
        return -math.inf
    return max(math.sqrt((hypotenuse - leg) * (hypotenuse + leg)) * (1.0 - 1e-15), 0.0)


def arc_m(start: Array, end: Array, turned_rad: Array) -> Array:
    """How far arcs leave their chords, (...), m: from places (..., 3), m, with headings that turn by (...), rad."""
    chord = np.linalg.norm(end - start, axis=-1)
    return np.asarray(0.5 * chord * np.abs(np.tan(0.25 * turned_rad)))


def on_arc(start: Array, end: Array, turned_rad: float, shares: Array) -> Array:
    """Places on an arc at shares (n,) of its time, (n, 3), m; its ends are (3,), m, and it turns by an angle, rad."""
    half = 0.5 * turned_rad
    ratio = np.sin(shares * half) / math.sin(half) if half else shares
    turn, chord = (shares - 1.0) * half, end - start
    along = np.stack([
        np.cos(turn) * chord[0] - np.sin(turn) * chord[1], np.sin(turn) * chord[0] + np.cos(turn) * chord[1],
        np.full(len(shares), chord[2]),
    ], axis=1)  # fmt: skip
    return np.asarray(start + ratio[:, None] * along)


def lagging_m(before: Array, after: Array, lasting_s: Array, lag_s: float) -> Array:
    """How far a body with a lag leaves the straight line, (...), m, from its velocities at both ends, (..., 3), m/s."""
    # Its acceleration is at most ||v - u|| / tau, and ||v - u|| falls by exp(-s / tau) in s seconds.
    gone = -np.expm1(-lasting_s / lag_s)
    short = np.divide(np.linalg.norm(after - before, axis=-1), gone, out=np.zeros_like(gone), where=gone > 0.0)
    return np.asarray(short / lag_s * np.square(lasting_s) / 8.0)


def on_lag(
    ends: tuple[Array, Array], velocity: tuple[Array, Array], lasting_s: float, lag_s: float, at: Array
) -> Array:
    """Places of such a body at shares (n,) of a time, s, (n, 3), m, from places and velocities at its ends, (3,)."""
    (start, end), (before, after) = ends, velocity
    gone = -math.expm1(-lasting_s / lag_s)
    part = -np.expm1(-at * lasting_s / lag_s) / gone
    behind = lag_s * (after - before)
    return np.asarray(start + at[:, None] * (end - start + behind) - part[:, None] * behind)


def unicycle_m(steered: Array, heading: Array, command: Array, since_s: Array, hand_m: float, period_s: float) -> Array:
    """Axle and heading, (T, 4), of a unicycle under chord steering."""
    # The hand point goes from where the straight line of the command began to where that line is after a period, while
    # the heading turns at a constant rate by 2 beta, tan(beta) = b h / (2 l + a h): see `model.plants.steering`.
    # steered: (T, 3), m; heading: (T,), rad; command: (T, 3), m/s
    # since_s: time since that sample, (T,), s.
    # hand_m: l.
    # period_s: h.
    cos, sin = np.cos(heading), np.sin(heading)
    a, b = cos * command[:, 0] + sin * command[:, 1], cos * command[:, 1] - sin * command[:, 0]
    # the axle's chord over a whole period points beta to the left of the heading, and ends l behind the hand point
    turn = 2.0 * np.where(b == 0.0, 0.0, np.arctan2(b * period_s, 2.0 * hand_m + a * period_s))
    ahead, left = a * period_s + hand_m * (1.0 - np.cos(turn)), b * period_s - hand_m * np.sin(turn)
    whole = np.copysign(np.hypot(ahead, left), ahead * np.cos(0.5 * turn) + left * np.sin(0.5 * turn))
    part = since_s / period_s
    ratio = np.where(turn == 0.0, part, np.sin(0.5 * part * turn) / np.where(turn == 0.0, 1.0, np.sin(0.5 * turn)))
    now, along = heading + part * turn, heading + 0.5 * part * turn
    begun = steered[:, :2] - since_s[:, None] * command[:, :2]
    flat = begun - hand_m * np.column_stack([cos, sin])
    flat = flat + (whole * ratio)[:, None] * np.column_stack([np.cos(along), np.sin(along)])
    return np.column_stack([flat, steered[:, 2] - since_s * command[:, 2], now])


def following_m_s(command: Array, lasting_s: Array, lag_s: float) -> Array:
    """Velocities at T rows of a body at rest at first that follows commands (T, 3), m/s, in force up to each row."""
    found, kept = np.zeros_like(command), np.exp(-np.append(0.0, lasting_s) / lag_s)
    for k in range(1, len(command)):
        found[k] = command[k] + kept[k] * (found[k - 1] - command[k])
    return found
