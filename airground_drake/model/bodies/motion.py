"""The motion of a centre during one or several periods."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.model.plants.plant import Plant

SAME_S = 1e-9  # times closer than this are one instant, s


class PeriodMotion(NamedTuple):
    """A centre within `off_m` of a point in uniform straight motion; exact if `off_m` is 0."""

    start: Array  # position at the beginning of the period, (..., 3), m
    end: Array  # position at its end, (..., 3), m
    off_m: float = 0.0  # largest distance from the straight line, m

    def seen_from(self, other: PeriodMotion) -> PeriodMotion:
        """This motion relative to another centre that moves during the same periods."""
        return PeriodMotion(self.start - other.start, self.end - other.end, self.off_m + other.off_m)

    @property
    def box(self) -> tuple[Array, Array]:
        """Two opposite corners, (3,), m, of a box around the motion of all periods."""
        places = np.concatenate([self.start.reshape(-1, 3), self.end.reshape(-1, 3)])
        return places.min(axis=0) - self.off_m, places.max(axis=0) + self.off_m

    def least_distance(self) -> tuple[Array, Array]:
        # The squared distance is a convex parabola of the share s of the period that has passed. It is least at s =
        # clip(-start.w / ||w||^2, 0, 1) with w = end - start.
        # Returns a lower bound of the distance, (...,), m, exact if `off_m` is 0, and the first share of the period,
        # (...,), at which the straight motion is nearest.
        change = self.end - self.start
        squared = np.einsum("...i,...i->...", change, change)
        along = -np.einsum("...i,...i->...", self.start, change)
        share = np.clip(np.divide(along, squared, out=np.zeros_like(squared), where=squared > 0.0), 0.0, 1.0)
        distance = np.linalg.norm(self.start + share[..., None] * change, axis=-1)
        return (np.maximum(distance - self.off_m, 0.0) if self.off_m else distance), share


def followed(plant: Plant, t_s: Array, base: Array, command: Array, samples: Collection[int], period_s: float) -> Array:
    """Signals (T, k) at T rows of a body that follows commands from rest, as computed by the Drake block."""
    # base: (T, 3), m; command: in force up to each row, (T, 3), m/s; samples: rows at which another one is chosen
    memory, since = plant.memory(), t_s[0]
    signals = [plant.at(memory, base[0], command[0], 0.0)]
    for row in range(1, len(t_s)):
        elapsed = float(t_s[row] - since)
        elapsed = period_s if abs(elapsed - period_s) <= SAME_S else elapsed
        signals.append(plant.at(memory, base[row], command[row], elapsed))
        if row in samples:
            memory, since = plant.remembered(memory, command[row], elapsed), t_s[row]
    return np.array(signals)
