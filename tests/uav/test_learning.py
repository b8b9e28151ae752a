"""A random course on which two UGVs block each other beside obstacles that the UAV does not know (four UGVs, seed 105).

As long as the UAV learns of obstacles from refusals alone, it sends the same accepted plan again and again, until the
UGVs have used up their tries: they arrive after 57 s in place of 30 s.
"""

import maps
import numpy as np
import pytest

from airground_drake.scenario.load import from_data
from airground_drake.sim.simulation import simulate


@pytest.mark.slow
def test_the_uav_learns_of_obstacles_from_ugvs_that_have_accepted() -> None:
    course, random = maps.draw(105, 4), np.random.default_rng(105)
    data = maps.scenario_of(course, [{"name": "coordinate", "parameters": {}}]) | {"duration_s": 40.0}
    for obstacle in data["obstacles"].values():
        obstacle["known_to_uav"] = bool(random.random() >= 0.5)
    trace = simulate(from_data(data, course.name), "d")
    ends = np.array([trace.position(ugv)[-1, :2] for ugv in trace.ugvs])
    assert np.linalg.norm(ends - course.targets, axis=1).max() < 0.1
    assert len(trace.proposals) < 10
