"""The room that a body takes up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.world.motion import PeriodMotion


class Shape(Protocol):
    """A closed convex set that a body fills around its centre."""

    @property
    def radius_m(self) -> float:
        """Radius of the smallest ball around the centre that holds it, m."""

    def distance(self, offset: Array) -> Array:
        """Distance, (...,), m, of its surface from points at offsets (..., 3), m, from its centre."""

    def least_distance(self, motion: PeriodMotion) -> Array:
        """Least such distance, (...,), m, of a point that moves relative to its centre."""


@dataclass(frozen=True)
class Ball:
    """A ball; for a robot in the plane, a disc; with the default radius, a point. Inside, distances are negative.

    Attributes:
        radius_m: m.
    """

    radius_m: float = 0.0

    def distance(self, offset: Array) -> Array:
        """See `Shape`."""
        return np.asarray(np.linalg.norm(offset, axis=-1) - self.radius_m)

    def least_distance(self, motion: PeriodMotion) -> Array:
        """See `Shape`."""
        return motion.least_distance()[0] - self.radius_m
