"""Which pairs of a run come too near, in exact arithmetic: Coq stops at the first pair that it refuses."""

from dataclasses import dataclass
from fractions import Fraction
from math import sqrt

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.verify.proofs.export import Demand, Recorded
from airground_drake.verify.proofs.separating import Prism, Vector, apart

SCREEN_M = 1e-6  # largest error of floating-point distances, m; steps that come near by less are computed exactly


@dataclass(frozen=True)
class TooNear:
    """A pair that comes nearer than it may."""

    demand: Demand  # the pair, and the distance that it is to keep
    least_m: float  # least distance of its surfaces; below 0 they overlap
    short_m: float  # by how much that is too little
    t_s: float  # when the pair is so near

    def __str__(self) -> str:
        """The pair, its distance and the time."""
        pair = " and ".join(self.demand.called)
        wanted = f"{self.short_m:.3g} m less than {float(self.demand.required_m):g} m"
        return f"{pair} are {self.least_m:.6g} m apart at {self.t_s:.6g} s, {wanted}"


def too_near(run: Recorded) -> list[TooNear]:
    """All pairs that do not keep their distance at all times of the run, in the order of its demands."""
    return [worst for demand in run.demands if (worst := _worst(run, demand)) is not None]


def _worst(run: Recorded, demand: Demand) -> TooNear | None:
    """The least distance of a pair, if it is too small."""
    unit, way = run.unit, run.way(demand)
    rows = np.array(way, dtype=np.float64)
    near = (float(demand.safe_m) + SCREEN_M) * unit
    steps = [
        (apart(prism, way[row], way[row + 1])[0] / unit**2, row, prism)
        for prism in run.prisms(demand)
        for row in _near(prism, rows, near)
    ]
    squared, row, prism = min(steps, default=(demand.safe_m**2, 0, None), key=lambda step: step[0])
    if prism is None or squared >= demand.safe_m**2:
        return None
    apart_m = sqrt(squared)
    short_m = float(demand.safe_m**2 - squared) / (float(demand.safe_m) + apart_m)  # d - D, without cancellation
    t_s = run.times[row] + _when(prism, way[row], way[row + 1]) * (run.times[row + 1] - run.times[row])
    return TooNear(demand, apart_m - float(demand.radii_m), short_m, float(t_s))


def _near(prism: Prism, rows: Array, reach: float) -> list[int]:
    """The rows, (k, 3), from which the next step may come nearer to a set than `reach`; all in parts."""
    steps = np.linalg.norm(np.diff(rows, axis=0), axis=1)
    apart = np.linalg.norm(rows - prism.nearest(rows), axis=1)[:-1]
    rows_near: list[int] = np.flatnonzero(apart - steps < reach).tolist()
    return rows_near


def _when(prism: Prism, begin: Vector, end: Vector) -> Fraction:
    """Where on the way from one place to another a set is nearest, from 0 to 1; to a hundredth."""
    places = np.linspace(np.array(begin, dtype=np.float64), np.array(end, dtype=np.float64), 101)
    return Fraction(int(np.argmin(np.linalg.norm(places - prism.nearest(places), axis=1))), 100)
