"""Claims about runs beside walls, polygons and prisms: distances that can be worked out by hand."""

from typing import Any

import numpy as np
import pytest
from builders.rooms import NOTCHED, SQUARE
from builders.scenarios import STILL, lone
from builders.simulation import simulate
from verify.judging import decided

from airground_drake.scenario.schema import Obstacle, SafeDistance
from airground_drake.sim.trace import Trace
from airground_drake.verify.claims.gate_plan import INSIDE_M
from airground_drake.verify.pair_kinds import constants
from airground_drake.verify.runs.pairs import are_too_near, gap_over_time, pair_of

ROOT = 0.5**0.5


def passing(begin: tuple[float, float], end: tuple[float, float], robot_m: float = 0.0, **given: Any) -> Trace:
    """A UGV of radius `robot_m` goes from one place to another in a second, beside the obstacle `o`; d = 0.3 m."""
    scenario = lone(
        [*begin, 0.0], [*end, 0.0], STILL, 1.0, obstacles={"o": Obstacle(**given)},
        safe_distance=SafeDistance(0.3, ugv_m=0.3), arena_m=[[-60.0, -60.0], [60.0, 60.0]],
    )  # fmt: skip
    scenario["ugvs"]["ugv1"]["radius_m"] = robot_m
    velocity = [end[0] - begin[0], end[1] - begin[1], 0.0]
    return simulate(scenario, drive=lambda t: [velocity, [0.0] * 3])


PASSES: dict[str, tuple[dict[str, Any], tuple[float, float], tuple[float, float], float]] = {
    "the middle of a wall": ({"segment_m": [[0, -4], [0, 4]]}, (1, 2), (0.5, 2.5), 0.5),
    "the end of a wall": ({"segment_m": [[0, -4], [0, 4]]}, (-2, 5), (2, 5), 1.0),
    "the second part of a wall": ({"segment_m": [[9, 9], [9, 1], [0, 1]]}, (0, 0), (3, 0.5), 0.5),
    "through a wall": ({"segment_m": [[0, -4], [0, 4]]}, (-1, 0), (1, 0.5), 0.0),
    "a rounded wall": ({"segment_m": [[0, -4], [0, 4]], "radius_m": 0.2}, (1, 2), (0.5, 2.5), 0.3),
    "an edge of a polygon": ({"polygon_m": SQUARE}, (-3, 2), (0, 1.5), 0.5),
    "clockwise": ({"polygon_m": SQUARE[::-1]}, (3, 0.5), (2, 0.5), 1.0),
    "a corner of a polygon": ({"polygon_m": SQUARE}, (1, 3), (3, 1), ROOT * 2.0),
    "moved by position_m": ({"polygon_m": SQUARE, "position_m": [5.0, 0.0, 0.0]}, (2, 0), (3, 0), 1.0),
    "turned by 45 degrees": ({"polygon_m": SQUARE, "heading_rad": np.pi / 4}, (3, 0), (2, 0), 2.0 - 2.0**0.5),
    "a box, turned by a right angle": (
        {"size_m": [4.0, 1.0], "position_m": [0.0, 0.0, 0.0], "heading_rad": np.pi / 2}, (2, 1), (1, 1), 0.5,
    ),
    "as deep as it gets": ({"polygon_m": SQUARE}, (-2, 0.5), (2, 0.5), -0.5),
    "ends inside, turned": ({"polygon_m": SQUARE, "heading_rad": np.pi / 4}, (3, 0), (1, 0), -(1.0 - ROOT)),
    "in the notch of a polygon": ({"polygon_m": NOTCHED}, (0, 4), (0, 0), 0.5),
    "into the leg beside it": ({"polygon_m": NOTCHED}, (0, 0), (0.75, 0), -0.25),
    "a post": ({"position_m": [0.0, 0.0, 0.0], "height_m": 2.0, "radius_m": 0.1}, (-2, 0.5), (2, 0.5), 0.4),
}  # fmt: skip


@pytest.mark.parametrize("name", PASSES)
def test_the_gap_is_between_surfaces_of_the_nearest_part(name: str) -> None:
    given, begin, end, gap_m = PASSES[name]
    for radius_m in (0.0, 0.15):
        trace = passing(begin, end, radius_m, **given)
        finding = decided("SAFE-TRACE", trace)
        (found,) = (each for each in finding.evidence["pairs"] if each["second"] == "o" and each["first"] == "ugv1")
        assert found["min_distance_m"] == pytest.approx(gap_m - radius_m, abs=1e-9)
        assert (found["safe_distance_m"], found["margin_m"]) == (0.3, pytest.approx(gap_m - radius_m - 0.3, abs=1e-9))
        assert finding.status == ("holds" if gap_m - radius_m >= 0.3 - 1e-9 else "refuted")
        assert gap_over_time(trace, pair_of(trace, "ugv1", "o")).min() >= gap_m - radius_m - 1e-9


def test_an_obstacle_may_have_a_distance_of_its_own() -> None:
    trace = passing((1.0, 2.0), (0.5, 2.5), segment_m=[[0.0, -4.0], [0.0, 4.0]], distance_m=0.6)
    finding = decided("SAFE-TRACE", trace)
    assert (finding.status, finding.margin) == ("refuted", pytest.approx(-0.1))
    assert finding.where == {"first": "ugv1", "second": "o", "t_s": 1.0}
    assert finding.counterexample is not None
    assert finding.counterexample["positions_m"]["o"] == pytest.approx([0.0, 2.5, 0.0])  # its nearest point
    pairs = constants(trace.scenario)["pairs"]
    assert {each["distance_m"] for each in pairs if each["kind"] == "obstacle"} == {0.6, 0.3}


def test_the_arena_is_judged_by_its_walls() -> None:
    trace = passing((0.0, 59.0), (0.0, 59.8), polygon_m=SQUARE)
    finding = decided("SAFE-TRACE", trace)
    assert (finding.status, finding.margin) == ("refuted", pytest.approx(-0.1))
    assert finding.where["second"] == "arena_north"


@pytest.mark.parametrize(
    ("height_m", "z", "gap_m"), [(0.0, 1.0, 1.0), (3.0, 4.0, 1.0), (3.0, 2.5, -0.5), (8.0, 2.5, -1.0), (3.0, 3.0, 0.0)]
)
def test_a_uav_keeps_away_from_the_top_and_a_ugv_from_the_sides(height_m: float, z: float, gap_m: float) -> None:
    scenario = lone(
        [2.0, 0.0, 0.0], [2.0, 0.0, 0.0], STILL, 1.0, safe_distance=SafeDistance(0.3, ugv_m=0.3, air_ground_m=0.2),
        obstacles={"o": Obstacle(polygon_m=SQUARE, height_m=height_m)},
    )  # fmt: skip
    scenario["uav"] |= {"start_m": [0.0, 0.0, z], "target_m": [0.0, 0.0, z], "radius_m": 0.0}
    trace = simulate(scenario, drive=lambda t: [[0.0] * 3] * 2)
    found = {(each["first"], each["second"]): each["min_distance_m"] for each in
             decided("SAFE-TRACE", trace).evidence["pairs"]}  # fmt: skip
    assert found["uav", "o"] == pytest.approx(gap_m)
    assert found["ugv1", "o"] == pytest.approx(1.0)


def test_a_wall_that_appears_is_judged_from_then_on() -> None:
    wall = {"segment_m": [[0.0, -4.0], [0.0, 4.0]]}
    before = decided("SAFE-TRACE", passing((-1.0, 0.0), (1.0, 0.0), **wall, appears_s=0.8))
    (found,) = (each for each in before.evidence["pairs"] if (each["first"], each["second"]) == ("ugv1", "o"))
    assert (found["min_distance_m"], found["t_s"]) == (pytest.approx(0.6), pytest.approx(0.8))
    on_top = decided("SAFE-TRACE", passing((-1.0, 0.0), (1.0, 0.0), **wall, appears_s=0.5))
    assert "appeared at 0.5 s" in on_top.counterexample["why"]


def test_too_near_is_the_nearest_part_at_the_time() -> None:
    trace = passing((5.0, 5.0), (5.0, 5.0), 0.1, polygon_m=NOTCHED, appears_s=0.5)
    places = np.array([[0.0, 0.0, 0.0], [0.11, 0.0, 0.0], [0.4, 0.0, 0.0], [0.0, 5.0, 0.0]])
    assert are_too_near(trace, "ugv1", places, 0.6, INSIDE_M).tolist() == [False, True, True, False]
    assert not are_too_near(trace, "ugv1", places, 0.4, INSIDE_M).any()
