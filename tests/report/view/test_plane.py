"""The ground plane: what of it is shown, and what says what is known of an obstacle."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from report.cases import make_scenario

from airground_drake.base.arrays import Array
from airground_drake.report.view.canvas import MUTED
from airground_drake.report.view.plane import MAX_NAMED_BARRIERS, draw_barriers, frame_of
from airground_drake.scenario.schema import Moves, Obstacle, Scenario


def test_a_frame_holds_ways_targets_radii_and_safe_circles() -> None:
    scenario = make_scenario()
    scenario.obstacles = {"rock": Obstacle([30.0, 0.0, 0.0], radius_m=1.0)}
    scenario.ugvs["ugv1"].radius_m, scenario.ugvs["ugv1"].target_m = 3.0, [0.0, 50.0, 0.0]
    frame = frame_of(scenario, [("ugv1", np.array([[-20.0, -9.0, 0.0], [0.0, 0.0, 0.0]]))])
    assert frame.right == pytest.approx(31.0 + scenario.safe_distance.obstacle_m, abs=0.5)
    assert (frame.left, frame.bottom, frame.top) == pytest.approx((-23.0, -12.0, 50.0), abs=1.5)
    assert frame.left < -23.0
    assert frame.bottom < -12.0


def test_obstacles_that_the_uav_does_not_know_are_hollow_and_few_obstacles_have_their_names() -> None:
    scenario = make_scenario()
    scenario.obstacles = {f"rock_{k}": Obstacle([float(k), 0.0, 0.0], known_to_uav=k != 1) for k in range(3)}
    scenario.obstacles["rock_2"].appears_s = 4.0
    scenario.uav.phantoms_m = [[9.0, 9.0, 0.0]]
    axes = Figure().subplots()
    said = [label.text for label in draw_barriers(axes, scenario)[0]]
    assert said == ["rock_0", "rock_1", "rock_2, from 4 s", "(only on the UAV's map)"]
    hollow = [float(line.get_xdata()[0]) for line in axes.lines if line.get_markerfacecolor() == "white"]
    assert hollow == [1.0]
    scenario.obstacles = {f"rock_{k}": Obstacle([float(k), 0.0, 0.0]) for k in range(MAX_NAMED_BARRIERS + 1)}
    assert [label.text for label in draw_barriers(axes, scenario)[0]] == ["(only on the UAV's map)"]


ELL = [[0.0, 0.0], [6.0, 0.0], [6.0, 1.5], [1.5, 1.5], [1.5, 5.0], [0.0, 5.0]]
BENT = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [1.0, 4.0]]


def turned(corners: Sequence[Sequence[float]], place: Sequence[float], heading: float) -> Array:
    across = np.array(corners) @ [1.0, 1.0j]
    there = complex(*place) + across * np.exp(1j * heading)
    return np.column_stack([there.real, there.imag])


def beyond(point: Array, corners: Array, *, closed: bool) -> float:
    ends = np.roll(corners, -1, axis=0) if closed else np.concatenate([corners[1:], corners[-1:]])
    crossed = 0
    least = np.inf
    for a, b in zip(corners, ends, strict=True):
        share = np.clip((point - a) @ (b - a) / max((b - a) @ (b - a), 1e-12), 0.0, 1.0)
        least = min(least, float(np.linalg.norm(a + share * (b - a) - point)))
        if (a[1] > point[1]) != (b[1] > point[1]):
            crossed += bool(point[0] < a[0] + (point[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
    return -least if closed and crossed % 2 else least


@settings(max_examples=6)
@given(
    heading=st.floats(-3.0, 3.0),
    radius=st.sampled_from([0.0, 0.4]),
    shape=st.sampled_from(["polygon_m", "segment_m", "size_m"]),
    known=st.booleans(),
    many=st.booleans(),
)
def test_each_pixel_has_the_colour_of_what_is_there(
    heading: float, radius: float, shape: str, known: bool, many: bool
) -> None:
    """Dark in the body, or white if the UAV does not know it; grey where surfaces must not be; white elsewhere."""
    corners = {"polygon_m": ELL, "segment_m": BENT, "size_m": [4.0, 2.0]}[shape]
    wall = Obstacle([1.0, -2.0, 0.0], known_to_uav=known, radius_m=radius, heading_rad=heading, distance_m=1.2)
    setattr(wall, shape, corners)
    scenario = make_scenario()
    scenario.obstacles = {"wall": wall}
    if many:
        scenario.obstacles |= {f"far_{k}": Obstacle([90.0, k, 0.0], size_m=[0.5, 0.5]) for k in range(200)}
    figure = Figure(figsize=(4.0, 4.0), dpi=100)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(-10.0, 10.0), ylim=(-10.0, 10.0))
    axes.set_axis_off()
    draw_barriers(axes, scenario)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    drawn = np.asarray(canvas.buffer_rgba())[:, :, :3] / 255.0
    grey = "#dddddd" if many else "#f3f3f3"
    box = [[-2.0, -1.0], [2.0, -1.0], [2.0, 1.0], [-2.0, 1.0]]
    around, pixel = turned(box if shape == "size_m" else corners, (1.0, -2.0), heading), 20.0 / 400
    seen = set[str]()
    for point in np.random.default_rng(1).uniform(-9.0, 9.0, (800, 2)):
        apart = beyond(point, around, closed=shape != "segment_m") - radius
        column, row = (point + 10.0) / pixel * [1.0, -1.0] + [0.0, 400.0]
        if apart < -3.0 * pixel:
            wanted = MUTED if known else "#ffffff"
        elif 5.0 * pixel < apart < (0.5 if many else 1.2 - 3.0 * pixel):  # the rim of many is coarse
            wanted = grey
        elif apart > 1.2 + 3.0 * pixel:
            wanted = "#ffffff"
        else:
            continue
        seen.add(wanted)
        found = drawn[int(row), int(column)]
        assert found == pytest.approx(to_rgb(wanted), abs=0.02), (point, apart)
    assert {"#ffffff", grey} <= seen


def walls(count: int) -> Scenario:
    scenario = make_scenario()
    scenario.obstacles = {
        f"wall_{k}": Obstacle([3.0 * k, 0.0, 0.0], polygon_m=ELL, known_to_uav=k % 2 == 0) for k in range(count)
    }
    return scenario


def test_what_moves_is_drawn_with_its_way_and_a_word_or_left_to_others() -> None:
    scenario = walls(1)
    scenario.obstacles["cart"] = Obstacle(size_m=[1.0, 1.0], moves=Moves([[1.0, 2.0, 0.0], [5.0, 2.0, 0.0]], 1.0))
    axes = Figure().subplots()
    labels, _ = draw_barriers(axes, scenario)
    assert [label.text for label in labels] == ["wall_0", "cart"]
    assert [line.get_xydata().tolist() for line in axes.lines] == [[[1.0, 2.0], [5.0, 2.0]]]
    assert [label.text for label in draw_barriers(axes, scenario, moving=False)[0]] == ["wall_0"]


def test_a_thousand_walls_are_a_few_collections_without_names() -> None:
    axes = Figure().subplots()
    labels, edges = draw_barriers(axes, walls(1000))
    assert (labels, edges, len(axes.lines), len(axes.patches)) == ([], [], 0, 0)
    assert len(axes.collections) <= 4


def test_a_frame_holds_walls_where_they_are_and_the_arena() -> None:
    scenario = make_scenario()
    scenario.obstacles = {
        "wall": Obstacle([30.0, 1.0, 0.0], segment_m=[[0.0, 0.0], [0.0, 20.0]], heading_rad=-np.pi / 2)
    }
    way = [("ugv1", np.zeros((2, 3)))]
    frame = frame_of(scenario, way)
    assert frame.right == pytest.approx(50.0 + scenario.safe_distance.obstacle_m, abs=0.5)
    assert frame.bottom > -4.0  # the wall lies along x: no circle round it counts
    scenario.arena_m = [[60.0, 40.0], [-70.0, -50.0]]
    assert frame_of(scenario, way) == pytest.approx((-70.0, 60.0, -50.0, 40.0), abs=1.5)
