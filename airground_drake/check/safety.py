"""SAFE-TRACE and SAFE-HYP: the distances of a run, and the hypotheses of the invariance proof along it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from .rules import SMALL, Found
from .run import Run
from .scenario import Pair


@lru_cache(maxsize=4096)
def least_distance_m(run: Run, pair: Pair) -> float:
    """Least distance of a pair over continuous time.

    On a segment the relative position is r + s w, 0 <= s <= 1; |r + s w|^2 is least at s = -r.w / w.w.
    """
    relative = run.position_m[pair.robot] - run.position_m[pair.other]
    r, w = relative[:-1], np.diff(relative, axis=0)
    ww = (w * w).sum(axis=1)
    s = np.clip(-(r * w).sum(axis=1) / np.where(ww > 0.0, ww, 1.0), 0.0, 1.0)
    return float(np.linalg.norm(r + s[:, None] * w, axis=1).min())


def safe_trace(run: Run) -> Found:
    """SAFE-TRACE: ||p_i(t) - q_j(t)|| >= d_ij at every time, for every pair.

    A pair puts the claim to the test if it comes so near that one period at the speed limits could break it.
    """
    margin, least, most = np.inf, 0, 0
    for pair in run.pairs:
        closing = pair.closing_m_s * run.scenario["control"]["period_s"]
        if run.apart_m[pair.robot, pair.other] - pair.safe_m > max(margin, closing + SMALL):
            continue  # neither the nearest pair nor near enough to count
        of_pair = least_distance_m(run, pair) - pair.safe_m
        margin = min(margin, of_pair)
        least += of_pair - closing < -SMALL
        most += of_pair - closing <= SMALL
    return Found("holds" if margin >= -SMALL else "refuted", float(margin), (least, most))
