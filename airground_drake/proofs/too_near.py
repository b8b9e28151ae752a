"""Which pairs of a run come too near, in exact arithmetic: Coq stops at the first pair that it refuses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from math import sqrt

import numpy as np

from airground_drake.proofs.export import Demand, Place, Recorded

SCREEN_M = 1e-6
"""Largest error of floating-point distances, m; steps that come near by less are computed exactly."""


@dataclass(frozen=True)
class TooNear:
    """A pair that comes nearer than it may.

    Attributes:
        demand: the pair, and the distance that it is to keep.
        least_m: least distance of its surfaces; below 0 they overlap.
        short_m: by how much that is too little.
        t_s: when the pair is so near.
    """

    demand: Demand
    least_m: float
    short_m: float
    t_s: float

    def __str__(self) -> str:
        """The pair, its distance and the time."""
        pair = f"{self.demand.first} and {self.demand.second}"
        wanted = f"{self.short_m:.3g} m less than {float(self.demand.required_m):g} m"
        return f"{pair} are {self.least_m:.6g} m apart at {self.t_s:.6g} s, {wanted}"


def too_near(run: Recorded) -> list[TooNear]:
    """All pairs that do not keep their distance at all times of the run, in the order of its demands.

    Bodies move straight from row to row, as in the theorem.
    """
    return [found for demand in run.demands if (found := _worst(run, demand)) is not None]


def _worst(run: Recorded, demand: Demand) -> TooNear | None:
    """The least distance of a pair, if it is too small."""
    rows = len(run.times)
    first, second = (_at_all_rows(run.places[name], rows) for name in (demand.first, demand.second))
    nearest = min(_steps(first, second, float(demand.safe_m)), default=None)
    if nearest is None or nearest[0] >= demand.safe_m**2:
        return None
    squared, row, fraction = nearest
    apart_m = sqrt(squared)
    short_m = float(demand.safe_m**2 - squared) / (float(demand.safe_m) + apart_m)  # d - D, without cancellation
    t_s = run.times[row] + fraction * (run.times[row + 1] - run.times[row])
    return TooNear(demand, apart_m - float(demand.radii_m), short_m, float(t_s))


def _at_all_rows(places: tuple[Place, ...], rows: int) -> tuple[Place, ...]:
    return places * rows if len(places) == 1 else places


def _steps(
    first: tuple[Place, ...], second: tuple[Place, ...], safe_m: float
) -> Iterator[tuple[Fraction, int, Fraction]]:
    """The steps that may come too near: least squared distance, m^2; row at which it begins; where in it, from 0 to 1.

    On a step the relative position is r + s w; its square is least at s = -r.w / w.w, cut to [0, 1].
    """
    relative = np.array(first, dtype=np.float64) - np.array(second, dtype=np.float64)
    begin, step = relative[:-1], np.diff(relative, axis=0)
    near = np.linalg.norm(begin, axis=1) - np.linalg.norm(step, axis=1) < safe_m + SCREEN_M
    for row in np.flatnonzero(near).tolist():
        r, end = ([a - b for a, b in zip(first[k], second[k], strict=True)] for k in (row, row + 1))
        w = [b - a for a, b in zip(r, end, strict=True)]
        length = sum(c * c for c in w)
        s = Fraction(-sum(a * b for a, b in zip(r, w, strict=True)), length) if length else Fraction(0)
        s = min(max(s, Fraction(0)), Fraction(1))
        yield sum(((a + s * b) ** 2 for a, b in zip(r, w, strict=True)), Fraction(0)), row, s
