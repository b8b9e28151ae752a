"""Which UGVs stand: the planner notes at every instant where each UGV came to a halt, and when."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from airground_drake.base.arrays import Array

STANDS_S = 1.0
"""A UGV stands once it has kept to one place for this long, s."""
STANDS_M = 0.1
"""One place: no farther than this from where it came to a halt, m; for slow UGVs it is less."""
STANDS_SHARE = 0.1
"""Of what a UGV can do in `STANDS_S`: one place is no larger than this."""
NOT_WATCHED = -1.0
"""Since when, s, before a UGV has been watched."""


def room(max_speed: Array) -> Array:
    """How large one place is for UGVs with these speed limits, (n,), m/s: radii, (n,), m."""
    return np.minimum(STANDS_M, STANDS_SHARE * STANDS_S * max_speed)


@njit(cache=True)
def watched(halts: Array, t: float, positions: Array, room: Array) -> Array:
    """Halts of n UGVs at time t, s.

    Args:
        halts: before: place, m, world frame, and since when, s, per UGV, (4n,).
        t: time, s.
        positions: of the UGVs first, (3n + ...,), m, world frame.
        room: see `room`, (n,), m.
    """
    found = halts.copy()
    for i in range(len(room)):
        away = 0.0
        for a in range(3):
            away += (positions[3 * i + a] - halts[4 * i + a]) ** 2
        if halts[4 * i + 3] == NOT_WATCHED or np.sqrt(away) > room[i]:
            found[4 * i : 4 * i + 3] = positions[3 * i : 3 * i + 3]
            found[4 * i + 3] = t
    return found


def standing(halts: Array, t: float) -> npt.NDArray[np.bool_]:
    """Which UGVs stand at time t, s, (n,)."""
    return t - halts[3::4] >= STANDS_S
