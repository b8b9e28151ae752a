"""What must hold for any team, drawn at random."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground_drake import simulate
from airground_drake.study.testing import assert_holds
from airground_drake.study.testing.strategies import policies, scenarios


@pytest.mark.filterwarnings("ignore::airground_drake.study.testing.NotExercisedWarning")  # not every draw is dangerous
@settings(max_examples=5, deadline=None)
@given(
    scenarios(
        ugvs=st.integers(1, 3),
        methods=st.just("d"),
        policies=policies(("hostile", "towards")),
        durations=st.integers(1, 8).map(float),
    )
)
def test_distances_are_kept_whatever_the_uav_wants(scenario):
    assert_holds(simulate(scenario, "d"), "SAFE-TRACE", "SAFE-HYP", "THR-TRIG")
