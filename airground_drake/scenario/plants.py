"""The plants of a scenario's robots, for the world and, independently of it, for claims."""

from __future__ import annotations

import math

from airground_drake.model.plants.plant import Delay, FirstOrder, Lag, Own, Plant, Unicycle
from airground_drake.scenario.schema import Plant as Given
from airground_drake.scenario.schema import Uav, Ugv


def plant_of(robot: Ugv | Uav, period_s: float) -> Plant:
    """How a robot moves under its commands, with a control period, s."""
    first, *after = robot.plant or [Given()]
    if first.kind == "delay":
        inner = _plant(after[0], period_s) if after else FirstOrder()
        assert isinstance(inner, FirstOrder | Lag)
        return Delay(round(first.delay_s / period_s), period_s, inner)
    return _plant(first, period_s)


def _plant(given: Given, period_s: float) -> Plant:
    if given.is_own:
        return Own(given.kind, given.drift_m_s, given.cover_m, given.parameters)
    if given.kind == "unicycle":
        limits = given.max_turn_rad_s or math.inf, given.wheel_base_m, given.max_wheel_speed_m_s or math.inf
        return Unicycle(given.hand_point_m, period_s, given.heading_rad, *limits, given.backwards)
    return Lag(given.time_constant_s) if given.kind == "lag" else FirstOrder()
