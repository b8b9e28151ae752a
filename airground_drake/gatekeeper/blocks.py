"""Blocks of stages: a plan makes one choice per block."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def block_of_stage(stages: int, blocks: int) -> npt.NDArray[np.int64]:
    """Block (N,) that each stage belongs to: lengths differ by one stage at most, none is empty."""
    used = min(blocks, stages)
    block: npt.NDArray[np.int64] = np.arange(stages, dtype=np.int64) * used // stages
    return block
