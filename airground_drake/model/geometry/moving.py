"""`Motion.at` compiled for controllers; `motion.py` itself must not need numba, since policies' processes load it."""

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.base.compiling import njit


@njit(cache=True)
def at(times: Array, positions: Array, slopes: Array, t: float) -> tuple[Array, Array]:
    """Position (3,) m and velocity (3,) m/s of a motion at time t, s; the arrays are those of `Motion`."""
    k = int(np.searchsorted(times, t, side="right")) - 1
    inside = 0 <= k < len(times) - 1
    place, rate = np.empty(3), np.zeros(3)
    for a in range(3):
        if inside:
            place[a], rate[a] = positions[k, a] + (t - times[k]) * slopes[k, a], slopes[k, a]
        else:
            place[a] = positions[max(k, 0), a]
    return place, rate
