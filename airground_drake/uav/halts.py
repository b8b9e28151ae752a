"""Which UGVs stand still: at every planning instant, the place and time of each UGV's last halt are updated."""

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit

STANDS_S = 1.0  # a UGV stands once it has stayed at one place for this long, s
STANDS_M = 0.1  # radius of one place, m; it is smaller for slow UGVs
STANDS_SHARE = 0.1  # largest radius of one place, as a share of the distance that a UGV can travel in `STANDS_S`
NOT_WATCHED = -1.0  # time of the halt, s, before the first instant


def room(max_speed: Array) -> Array:
    """Radii within which UGVs with these speed limits, (n,), m/s, count as standing, (n,), m."""
    return np.minimum(STANDS_M, STANDS_SHARE * STANDS_S * max_speed)


@njit(cache=True)
def watched(halts: Array, t: float, positions: Array, room: Array) -> Array:
    """Halts of n UGVs at time t, s, (4n,); `positions` (3n + ...,), m; `room` (n,), m."""
    # halts: place, m, world frame, and time, s, of each UGV's halt as noted before, (4n,).
    updated = halts.copy()
    for i in range(len(room)):
        away = 0.0
        for a in range(3):
            away += (positions[3 * i + a] - halts[4 * i + a]) ** 2
        if halts[4 * i + 3] == NOT_WATCHED or np.sqrt(away) > room[i]:
            for a in range(3):
                updated[4 * i + a] = positions[3 * i + a]
            updated[4 * i + 3] = t
    return updated


def standing(halts: Array, t: float) -> npt.NDArray[np.bool_]:
    """Which UGVs stand at time t, s, (n,)."""
    return t - halts[3::4] >= STANDS_S
