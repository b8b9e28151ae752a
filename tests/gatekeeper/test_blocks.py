"""Plans with a minimum dwell."""

from __future__ import annotations

import numpy as np

from airground_drake.gatekeeper.binary_program import block_of_stage


def test_blocks_cover_all_stages() -> None:
    for stages in range(1, 70):
        block = block_of_stage(stages, 10)
        counts = np.bincount(block)
        assert len(block) == stages
        assert len(counts) == min(10, stages)
        assert counts.max() - counts.min() <= 1
        assert (np.diff(block) >= 0).all()
