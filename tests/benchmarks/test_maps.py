"""Random courses: the same each time, well-formed, and with the walls that they say."""

import maps
import numpy as np
import pytest
from feasible import shortest_length
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.scenario.load import from_data
from airground_drake.scenario.validate import check

POLICIES = [{"name": "detour", "parameters": {"speed_m_s": maps.DETOUR_M_S}}]


@given(seed=st.integers(0, 10**6), ugvs=st.sampled_from([1, 2, 4, 8]), density=st.sampled_from([0.0, 1.0, 3.0]))
@examples(8)
def test_a_course_is_a_valid_scenario(seed: int, ugvs: int, density: float) -> None:
    course = maps.draw(seed, ugvs, density)
    scenario = from_data(maps.scenario_of(course, POLICIES), "drawn")
    check(scenario, "drawn")
    assert list(scenario.runs) == ["a", "b", "c", "d"]
    assert len(scenario.ugvs) == ugvs
    again = maps.draw(seed, ugvs, density)
    assert np.array_equal(course.obstacles, again.obstacles)
    assert np.array_equal(course.starts, again.starts)
    if ugvs == 1:
        assert 4 * density <= len(course.obstacles) <= 9 * density


def test_walls_are_all_around_and_other_numbers_of_ugvs_are_refused() -> None:
    course = maps.draw(3, 1, 0.0, walls=True)
    start, target = course.starts[0], course.targets[0]
    assert shortest_length(start, target, course.obstacles, maps.SAFE_M) == pytest.approx(20.0)
    for outside in ([10.0, 20.0], [10.0, -20.0], [-20.0, 0.0], [40.0, 0.0]):
        assert np.isinf(shortest_length(start, np.array(outside), course.obstacles, maps.SAFE_M))

    with pytest.raises(ValueError, match="3 UGVs: one of 1, 2, 4, 8"):
        maps.draw(0, 3)
