"""Positions and states at each frame."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from report.cases import make_scenario

from airground_drake.report.replay import scene as scenes
from airground_drake.report.replay.scene import FRAMES_PER_S, Scene
from airground_drake.report.view.stage import INTERVENED, OWN, TRIGGERED
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.trace import Trace


@given(st.floats(0.01, 100.0))
def test_frames_go_from_0_to_the_end(end: float) -> None:
    times = scenes.frame_times(np.array([0.0, end]))
    assert (times[0], times[-1]) == (0.0, end)
    assert (np.diff(times) > 0).all()
    assert np.diff(times).max() <= 1.0 / FRAMES_PER_S + 1e-6


def test_robots_are_where_the_trace_has_them(scene: Scene, trace: Trace) -> None:
    assert [(body.name, body.kind) for body in scene.robots] == [("ugv1", "UGV"), ("ugv2", "UGV"), ("uav", "UAV")]
    for body in scene.robots:
        there = [np.interp(scene.times_s, trace.t, axis) for axis in trace.position(body.name).T]
        assert body.positions == pytest.approx(np.transpose(there), abs=1e-12)


def test_states(scene: Scene, trace: Trace, scenario: Scenario) -> None:
    by_time = dict(zip(scene.times_s.round(3), scene.robots[0].states, strict=True))
    assert [by_time[t] for t in (14.0, 15.0, 18.0)] == [OWN, INTERVENED, OWN]
    assert not scene.robots[-1].states.any()
    alone = replace(trace, samples=trace.samples.assign(**{"ugv1.executing": -1.0}))
    assert {*scenes.scene(alone, scenario).robots[0].states} == {OWN, TRIGGERED}


def test_bodies_are_drawn_as_large_as_they_are(trace: Trace) -> None:
    wide = make_scenario()
    wide.obstacles["obstacle_1"].radius_m, wide.ugvs["ugv2"].radius_m = 1.5, 1.25
    made = scenes.scene(trace, wide)
    assert (made.barriers[0].radius_m, made.barriers[0].safe_m) == (1.5, wide.safe_distance.obstacle_m + 1.5)
    assert [body.radius_m for body in made.robots] == [made.mark_m, 1.25, made.mark_m]
    assert made.mark_m > 0.0
