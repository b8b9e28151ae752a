"""The motion of an obstacle that moves, from its waypoints."""

import math
from itertools import chain, cycle, pairwise

import numpy as np

from airground_drake.model.geometry.motion import Motion
from airground_drake.scenario.schema import Moves

PERIODS = 1e-9  # share of a control period that counts as rounding


def course(moves: Moves, period_s: float, until_s: float) -> Motion:
    """Where the origin of the obstacle's frame is, up to a time, s; then it rests."""
    # Every leg takes a whole number of control periods, so that the motion is straight between control samples.
    corners = [np.array(corner) for corner in moves.waypoints_m]
    ahead = list(pairwise(corners))
    back = {"stop": [], "reverse": list(pairwise(corners[::-1])), "loop": [(corners[-1], corners[0])]}[moves.at_end]
    legs = cycle(ahead + back) if back else chain(ahead)
    steps, places = [_periods(moves.start_s, period_s)], [corners[0]]
    for begin, end in legs:
        if steps[-1] * period_s >= until_s:
            break
        steps.append(steps[-1] + max(1, _periods(math.dist(begin, end) / moves.speed_m_s, period_s)))
        places.append(end)
    return Motion(period_s * np.array(steps, dtype=np.float64), np.array(places))


def _periods(time_s: float, period_s: float) -> int:
    return math.ceil(time_s / period_s * (1.0 - PERIODS))
