"""Some of the hostile proposals of the benchmark."""

from __future__ import annotations

import hostile


def test_no_proposal_brings_d_below_the_safe_distance() -> None:
    worst, accepted, below = hostile.at_decision_level(seed=0, proposals=150)
    assert worst >= -1e-9
    assert accepted > below > 0  # the measure sees what comes of proposals that (c) accepts


def test_a_run_with_a_hostile_uav_keeps_the_distance_and_the_bound() -> None:
    certified, executed, _, stolen, bound = hostile.whole_run(seed=1)
    assert certified >= -1e-9
    assert executed > 0
    assert stolen <= bound
