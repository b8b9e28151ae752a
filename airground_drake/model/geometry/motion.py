"""Timed polylines: the preset trajectory of a UGV, and the motion that an intervention asks for."""

from bisect import bisect_right
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from airground_drake.base.arrays import Array, read_only
from airground_drake.base.history import Immutable


@dataclass(frozen=True, eq=False)
class Motion(Immutable):
    """Piecewise-linear motion through positions at given times; at rest before the first and after the last.

    Immutable, and therefore shared rather than copied when a Context is.

    Attributes:
        times: (M,), s, strictly increasing.
        positions: (M, 3), m, world frame.
        slopes: velocities from each vertex to the next, (M - 1, 3), m/s.
    """

    times: Array
    positions: Array
    slopes: Array = field(init=False, repr=False)
    _times: list[float] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        times, positions = read_only(self.times), read_only(self.positions)
        if times.ndim != 1 or len(times) == 0 or positions.shape != (len(times), 3):
            raise ValueError(f"a motion needs times (M,) and positions (M, 3), got {times.shape}, {positions.shape}")
        if not (np.isfinite(times).all() and np.isfinite(positions).all()):
            raise ValueError("a motion needs finite times and positions")
        with np.errstate(all="raise", under="ignore"):
            steps = times[1:] - times[:-1]  # `np.diff` takes ten times as long, and motions are made by the thousand
            if not (steps > 0.0).all():
                raise ValueError("the times of a motion must increase strictly")
            slopes = (positions[1:] - positions[:-1]) / steps[:, None]
        slopes.setflags(write=False)
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "positions", positions)
        object.__setattr__(self, "slopes", slopes)
        object.__setattr__(self, "_times", times.tolist())

    @classmethod
    def at_speed(cls, waypoints: Array, speed: float, start: float = 0.0) -> Self:
        """Travel waypoints (M, 3) m at constant speed, m/s, from time `start`, s.

        Raises:
            ValueError: if consecutive waypoints coincide or the speed is not positive.
        """
        if not speed > 0.0:
            raise ValueError(f"the speed must be positive, got {speed!r} m/s")
        points = np.asarray(waypoints, dtype=np.float64)
        lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
        return cls(start + np.concatenate([[0.0], np.cumsum(lengths)]) / speed, points)

    @property
    def end(self) -> float:
        """Time of the last vertex, s."""
        return float(self.times[-1])

    @property
    def max_speed(self) -> float:
        """Largest speed, m/s."""
        return float(np.linalg.norm(self.slopes, axis=1).max(initial=0.0))

    def at(self, t: float) -> tuple[Array, Array]:
        """Position (3,) m and velocity (3,) m/s at time t (at a vertex: the velocity after it)."""
        k = bisect_right(self._times, t) - 1
        if k < 0 or k >= len(self._times) - 1:
            return self.positions[max(k, 0)], np.zeros(3)
        slope: Array = self.slopes[k]
        return self.positions[k] + (t - self._times[k]) * slope, slope

    def sample(self, t: Array) -> Array:
        """Positions at times (k,): (k, 3) m."""
        return np.column_stack([np.interp(t, self.times, self.positions[:, axis]) for axis in range(3)])
