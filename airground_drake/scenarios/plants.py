"""The plants of a scenario's robots, for the world and, independently of it, for claims."""

from __future__ import annotations

from airground_drake.scenarios.schema import Uav, Ugv
from airground_drake.world.plant import FirstOrder, Plant


def plant_of(robot: Ugv | Uav) -> Plant:
    """How a robot moves under its commands."""
    return FirstOrder()
