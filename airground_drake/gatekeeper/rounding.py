"""Sum-up rounding, eqs (28)-(29), for two modes."""

from __future__ import annotations

import numpy as np

from airground_drake.base.arrays import Array


def sum_up_rounding(relaxed: Array) -> Array:
    """Round relaxed accept variables (N,) in [0, 1] to {0, 1} so that their running sums stay close.

    At each stage the mode with the larger accumulated deficit (28) is chosen; ties go to accepting, the mode
    with the lower index, as (29) has it. The running sums then differ by at most 1/2.
    """
    binary = np.zeros(len(relaxed))
    deficit = 0.0  # sum of relaxed up to this stage minus sum of binary before it
    for k, share in enumerate(relaxed.tolist()):
        deficit += share
        # the other mode's deficit is (k + 1 - sum relaxed) - (k - sum binary) = 1 - deficit
        if deficit >= 1.0 - deficit:
            binary[k] = 1.0
            deficit -= 1.0
    return binary


def rounding_deviation(relaxed: Array, binary: Array, dt: float) -> float:
    """max over k of |dt * sum_{r <= k} (relaxed - binary)|, s."""
    return float(dt * np.abs(np.cumsum(relaxed - binary)).max(initial=0.0))
