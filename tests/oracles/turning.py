"""What unicycles and cars can do of their commands, written again: many at once, limits found by halving."""

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.sim.trace import Trace

UNLIMITED = np.array([0.0, np.inf, 0.0, np.inf, np.nan])
"""The numbers of a robot that does not turn: hand point, m, turning limit, rad/s, wheel base, m, wheel speed, m/s, and
the largest angle of a command to the heading, rad; NaN: any."""
HALVINGS = 60
OUTSIDE_M_S = 1e-12
"""A command outside what a robot can follow by no more is on its edge but for rounding, m/s."""


def numbers_of(trace: Trace, ugv: str) -> Array:
    for plant in trace.scenario.ugvs[ugv].plant:
        if plant.kind == "unicycle":
            turn, wheel = plant.max_turn_rad_s or np.inf, plant.max_wheel_speed_m_s or np.inf
            aside = np.nan if plant.backwards else 0.5 * np.pi
            return np.array([plant.hand_point_m, turn, plant.wheel_base_m, wheel, aside])
        if plant.kind == "ackermann":
            aside = np.arctan(plant.hand_point_m * np.tan(plant.max_steering_rad) / plant.wheelbase_m)
            return np.array([plant.hand_point_m, np.inf, 0.0, np.inf, aside])
    return UNLIMITED


def edges(heading: Array, numbers: Array) -> tuple[Array, Array]:
    """Half-planes normal.v >= bound of commands that robots with headings (B,), rad, can follow: (B, 2, 3), (B, 2)."""
    aside = np.broadcast_to(numbers, (len(heading), 5))[:, 4]
    bound = np.repeat(np.where(np.isnan(aside), -np.inf, 0.0)[:, None], 2, axis=1)
    towards = heading[:, None] + np.array([1.0, -1.0]) * (np.nan_to_num(aside) - 0.5 * np.pi)[:, None]
    return np.stack([np.cos(towards), np.sin(towards), np.zeros_like(towards)], axis=2), bound


def rates(command: Array, heading: Array, numbers: Array, period_s: float) -> tuple[Array, Array]:
    """Speed of the axle, m/s, and turning rate, rad/s, (B,) each, that lead the hand point where commands (B, 3) do."""
    hand = numbers[..., 0]
    ahead, left = (
        command[:, 0] * np.cos(heading) + command[:, 1] * np.sin(heading),
        command[:, 1] * np.cos(heading) - command[:, 0] * np.sin(heading),
    )
    half = np.where(left == 0.0, 0.0, np.arctan2(left * period_s, 2.0 * hand + ahead * period_s))
    chord = ahead * np.cos(half) + left * np.sin(half)
    return chord / np.sinc(half / np.pi), 2.0 * half / period_s


def able(command: Array, heading: Array, numbers: Array, period_s: float) -> Array:
    """Commands (B, 3), m/s, shortened as far as the limits (B, 5) of robots with headings (B,), rad, ask for."""
    numbers, heading = np.broadcast_to(numbers, (len(command), 5)), np.broadcast_to(heading, len(command))
    normal, bound = edges(heading, numbers)
    command = np.where(
        (np.einsum("bkd,bd->bk", normal, command) < bound - OUTSIDE_M_S).any(axis=1)[:, None], 0.0, command
    )
    turns = np.flatnonzero(numbers[:, 0] > 0.0)
    if not len(turns):
        return command
    few, at, by = command[turns], heading[turns], numbers[turns]

    def possible(share: Array) -> Array:
        speed, turning = rates(share[:, None] * few, at, by, period_s)
        wheel = np.abs(speed) + 0.5 * by[:, 2] * np.abs(turning)
        return np.asarray((np.abs(turning) <= by[:, 1] * (1.0 + 1e-12)) & (wheel <= by[:, 3] * (1.0 + 1e-12)))

    low, high = np.zeros(len(few)), np.ones(len(few))
    whole = possible(high)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        met = possible(middle)
        low, high = np.where(met, middle, low), np.where(met, high, middle)
    found = command.copy()
    found[turns] = np.where(whole, 1.0, low)[:, None] * few
    return found
