"""What a Meshcat shows while a run is simulated, and that the run is the same without it."""

import msgpack
import pandas as pd
from pydrake.geometry import Meshcat

from airground_drake.report.view.draw import robot_path, served, state_path
from airground_drake.report.view.live_view import LiveView
from airground_drake.report.view.stage import INTERVENED, OWN, STATES
from airground_drake.scenario.load import load
from airground_drake.sim.simulation import simulate


def place(meshcat: Meshcat, k: int) -> list[float]:
    matrix = msgpack.unpackb(meshcat._GetPackedTransform(robot_path(k)))["matrix"]
    return matrix[12:15]


def shown(meshcat: Meshcat, k: int) -> list[bool]:
    paths = [state_path(k, state) for state in range(len(STATES))]
    return [msgpack.unpackb(meshcat._GetPackedProperty(path, "visible"))["value"] for path in paths]


def test_the_run_is_the_same_and_the_robots_are_where_it_ends() -> None:
    scenario = load("case_a", ["duration_s=15.0"])
    meshcat = served()
    watched = simulate(scenario, "d", observers=[LiveView(meshcat, scenario)])
    pd.testing.assert_frame_equal(watched.states, simulate(scenario, "d").states, check_exact=True)
    for k, robot in enumerate(watched.robots):
        assert place(meshcat, k) == watched.position(robot)[-1].tolist()
    assert shown(meshcat, 0) == [state == INTERVENED for state in range(len(STATES))]
    assert shown(meshcat, 1) == [state == OWN for state in range(len(STATES))]
