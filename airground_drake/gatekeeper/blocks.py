"""Plans with a minimum dwell: constant on B blocks of stages."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

MOST_BLOCKS = 20
"""2^20 plans are what an enumeration can still do."""


def check_blocks(blocks: int) -> int:
    """The same number.

    Raises:
        ValueError: if it is not from 1 to `MOST_BLOCKS`.
    """
    if not 1 <= blocks <= MOST_BLOCKS:
        raise ValueError(f"blocks: {blocks}, allowed: 1 to {MOST_BLOCKS}")
    return blocks


def block_of_stage(stages: int, blocks: int) -> npt.NDArray[np.int64]:
    """Block (N,) that each stage belongs to: lengths differ by one stage at most, none is empty."""
    used = min(blocks, stages)
    block: npt.NDArray[np.int64] = np.arange(stages, dtype=np.int64) * used // stages
    return block


def block_starts(block: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """First stage of each block, and N, (B + 1,), from the block (N,) of each stage."""
    return np.searchsorted(block, np.arange(block[-1] + 2)).astype(np.int64)
