"""Reports on maps say which place of the map is meant: the one nearest to the robot."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from airground_drake.report import document
from airground_drake.report.attention import bodies_of
from airground_drake.report.facts import RunFacts
from airground_drake.report.model import Report, of
from airground_drake.report.screen import Row, first_screen
from airground_drake.scenario.load import from_data
from airground_drake.scenario.shapes import corners_of_map
from airground_drake.sim.events import extract
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge

MAPS = Path(__file__).parents[1] / "scenario" / "maps" / "data"


@pytest.fixture(scope="module")
def trace() -> Trace:
    """A UGV that drives at a pillar and stops before it."""
    start, target = [-1.65, -1.1, 0.0], [-0.55, -1.1, 0.0]
    data: dict[str, Any] = {
        "name": "room",
        "duration_s": 6.0,
        "ugvs": {"ugv1": {"start_m": start, "target_m": target, "preset": {"waypoints_m": [start, target]}}},
        "uav": {"start_m": [-2.0, -0.5, 3.0]},
        "map": {"file": "turtlebot3_world.yaml"},
        "safe_distance": {"obstacle_m": 0.1, "collision_m": 0.02},
        "runs": {"a": {"method": "a"}},
    }
    return simulate(from_data(data, str(MAPS / "scenario.yaml")), "a")


def screen_of(trace: Trace) -> tuple[Report, Row]:
    made = document.build(trace.scenario, {"a": trace}, judge(trace), {"package": "0.1.0", "seed": 1, "started": "now"})
    report = of(made)
    return report, first_screen(report).rows[0]


def in_the_map(trace: Trace, place: list[float]) -> float:
    corners = corners_of_map(trace.scenario.barriers["map"].cells)
    return float(
        np.linalg.norm(np.maximum(np.maximum(corners[:, 0] - place, place - corners[:, 2]), 0.0), axis=1).min()
    )


def test_a_report_names_the_place_of_the_map_that_was_nearest(trace: Trace) -> None:
    made, row = screen_of(trace)
    (near,) = (each for each in RunFacts(made, "a").near if {each.first, each.second} == {"ugv1", "map"})
    assert near.at_m
    robot = [np.interp(near.t_s, trace.t, trace.column(f"ugv1.{axis}_m")) for axis in "xy"]
    assert math.dist(robot, near.at_m) == pytest.approx(near.value, abs=1e-9)
    assert in_the_map(trace, near.at_m) <= 1e-9
    place = f"the map at ({near.at_m[0]:.2f}, {near.at_m[1]:.2f})"
    assert row.safe.lines[1].startswith(f"ugv1\N{EN DASH}{place} 0.100 ≥ 0.1 m at")
    assert place in bodies_of(made.about("SAFE-TRACE")[0])


def test_a_report_says_where_on_the_map_a_robot_stands(trace: Trace) -> None:
    made, row = screen_of(trace)
    x, y = made.runs["a"].metrics.on_the_way["ugv1"].at_m or ()
    assert math.dist((x, y), trace.position("ugv1")[-1][:2]) < 0.11
    assert row.arrived.lines[1] == f"ugv1 stopped, held by the map at ({x:.2f}, {y:.2f})"


def test_a_report_names_the_place_of_the_map_of_a_collision(trace: Trace) -> None:
    through = replace(trace, states=trace.states.copy())
    x = np.linspace(-1.65, -0.55, len(trace.t))
    through.states["ugv1.x_m"], through.states["ugv1.y_m"] = x, -1.1
    through.meta["events"] = extract(through)
    (hit,) = (event for event in extract(through) if event["kind"] == "collision")
    assert math.dist(hit["at_m"], hit["position_m"][:2]) <= 0.02
    assert in_the_map(trace, hit["at_m"]) <= 1e-9
    at = ", ".join(f"{each:.2f}" for each in hit["at_m"])
    row = screen_of(through)[1]
    assert row.safe.lines[1] == f"ugv1\N{EN DASH}the map at ({at}) at {hit['t_s']:.2f} s"
    assert row.arrived.lines[1] == f"ugv1 collided with the map at ({at})"
