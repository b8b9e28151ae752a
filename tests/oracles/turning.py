"""What unicycles can do of their commands, written again: many commands at once, limits found by halving."""

from __future__ import annotations

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.sim.trace import Trace

UNLIMITED = np.array([0.0, np.inf, 0.0, np.inf])
"""The numbers of a robot that is no unicycle: hand point, m, turning limit, rad/s, wheel base, m, wheel speed, m/s."""
HALVINGS = 60


def numbers_of(trace: Trace, ugv: str) -> Array:
    """These numbers of a UGV, (4,)."""
    for plant in trace.scenario.ugvs[ugv].plant:
        if plant.kind == "unicycle":
            turn, wheel = plant.max_turn_rad_s or np.inf, plant.max_wheel_speed_m_s or np.inf
            return np.array([plant.hand_point_m, turn, plant.wheel_base_m, wheel])
    return UNLIMITED


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
    """Commands (B, 3), m/s, shortened as far as the limits (B, 4) of unicycles with headings (B,), rad, ask for."""
    numbers = np.broadcast_to(numbers, (len(command), 4))
    turns = np.flatnonzero(numbers[:, 0] > 0.0)
    if not len(turns):
        return command
    few, at, by = command[turns], np.broadcast_to(heading, len(command))[turns], numbers[turns]

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
