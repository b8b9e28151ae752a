"""Notes on what is allowed and seldom meant."""

from typing import Any

import pytest

from airground_drake.scenario.load import load
from airground_drake.scenario.notes import notes
from airground_drake.scenario.shipped import shipped

SMALL = (
    "safe_distance.obstacle_m = 2 m: the paper's values, which are large for UGVs with a radius of 0.2 m; set your own"
)
NARROW = {
    "ugvs.ugv1.target_m": [4, 0, 0], "ugvs.ugv1.preset.waypoints_m": [[0, 0, 0], [4, 0, 0]],
    "obstacles.rock.position_m": [2, 3, 0],
}  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, []),
        ({"ugvs.ugv1.radius_m": 0.2}, [SMALL]),
        ({"ugvs.ugv1.radius_m": 0.2, "safe_distance.obstacle_m": 0.3}, []),
        (NARROW, [SMALL.replace("UGVs with a radius of 0.2 m", "a field of 4 m")]),
        (
            {"ugvs.ugv1.max_speed_m_s": 60, "control.sensing_range_m": 20},
            ["ugv1 has max_speed_m_s = 60; speeds are in m/s: this is 216 km/h"],
        ),
    ],
)
def test_small_robots_and_worlds_with_the_papers_distances_and_great_speeds_are_noted(
    changes: dict[str, Any], said: list[str]
) -> None:
    assert [*notes(load("minimal", changes))] == said


@pytest.mark.parametrize(("delay_s", "gap_m", "said"), [(0.3, 8, 0), (0.6, 8, 1), (0.3, 1.5, 1), (0.6, 1.5, 2)])
def test_ugvs_that_can_block_each_other_with_old_positions_are_noted(delay_s: float, gap_m: float, said: int) -> None:
    """At 2 m/s and 0.05 s the age of positions costs 0.7 m or 1.3 m; 1 m is to be kept."""
    changes = {"control.law": "asynchronous", "channel": {"ugvs": {"delay_s": delay_s}}}
    changes |= {
        "runs": {"d": {"method": "d"}},
        "ugvs.ugv1.start_m": [-gap_m / 2, 0.0, 0.0],
        "ugvs.ugv2.start_m": [gap_m / 2, 0.0, 0.0],
    }
    told = [*notes(load("swap", changes))]
    assert len(told) == said
    assert ("they can block each other for ever" in "".join(told)) == (delay_s == 0.6)
    assert ("they may only separate" in "".join(told)) == (gap_m == 1.5)


def test_shipped_scenarios_have_no_notes_but_the_one_that_is_small() -> None:
    assert {name for name in shipped() for _ in notes(load(name))} == {"dwell"}
