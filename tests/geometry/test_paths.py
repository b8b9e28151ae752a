"""Tests of the shortest path among discs: known lengths, a brute-force oracle, properties of the curve."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from properties import examples
from scipy.sparse.csgraph import dijkstra

from airground_drake.geometry import paths
from airground_drake.geometry.paths import TOL, NoPath, Path, shortest_path

Array = NDArray[np.float64]
Point = tuple[float, float]
Disc = tuple[float, float, float]
RING = [(2.0 * math.cos(a), 2.0 * math.sin(a)) for a in np.arange(8) * math.pi / 4]


def find(start: Point, goal: Point, discs: list[Disc]) -> Path:
    return shortest_path(start, goal, [d[:2] for d in discs], [d[2] for d in discs])


def length_or_inf(start: Point, goal: Point, discs: list[Disc]) -> float:
    try:
        return find(start, goal, discs).length_m
    except NoPath:
        return math.inf


def sample(path: Path, n: int = 200) -> tuple[Array, Array, Array]:
    s = np.linspace(0.0, path.length_m, n)
    points, tangents = zip(*(path.at(float(x)) for x in s), strict=True)
    return s, np.array(points), np.array(tangents)


def clearance(points: Array, discs: list[Disc]) -> float:
    """Least distance of the points to the discs, negative inside; inf without discs."""
    return min((float((np.hypot(*(points - d[:2]).T) - d[2]).min()) for d in discs), default=math.inf)


def oracle(start: Point, goal: Point, discs: list[Disc], sides: int = 72) -> float:
    """Length of a path along polygons around the discs, never shorter than the shortest path.

    The corners are on circles inflated by 1e-3, so that 72 sides clear the disc: 1.001 cos(pi / 72) > 1.
    """
    turn = 2.0 * math.pi * np.arange(sides) / sides
    rings = [(x + 1.001 * r * np.cos(turn), y + 1.001 * r * np.sin(turn)) for x, y, r in discs]
    nodes = np.vstack([[start, goal], *(np.stack(ring, axis=1) for ring in rings)])
    for x, y, r in discs:
        nodes = nodes[np.hypot(nodes[:, 0] - x, nodes[:, 1] - y) >= r]
    a, b = nodes[:, None, :], nodes[None, :, :]
    lengths = np.hypot(*(b - a).transpose(2, 0, 1))
    graph = lengths.copy()
    for x, y, r in discs:
        # Squared distance of a centre to a segment, from the dot products at its ends.
        to_a, to_b = np.array((x, y)) - a, np.array((x, y)) - b
        along = (to_a * (b - a)).sum(axis=2)
        cross = to_a[..., 0] * (b - a)[..., 1] - to_a[..., 1] * (b - a)[..., 0]
        beside = np.abs(cross) < r * lengths
        blocked = beside & (along > 0.0) & ((-to_b * (b - a)).sum(axis=2) > 0.0)
        graph[blocked] = 0.0  # no edge in a dense graph
    return float(dijkstra(graph, indices=0)[1])


def check_curve(path: Path, start: Point, goal: Point) -> None:
    """Check that the curve joins the ends at unit speed at most and that its tangent is its derivative."""
    s, points, tangents = sample(path)
    assert np.allclose(points[0], start, rtol=0.0, atol=TOL)
    assert np.allclose(points[-1], goal, rtol=0.0, atol=10.0 * TOL)
    assert (np.hypot(*np.diff(points, axis=0).T) <= np.diff(s) + 10.0 * TOL).all()
    assert np.allclose(np.hypot(*tangents.T), 1.0 if path.length_m > 0.0 else 0.0, atol=1e-9)
    step = 1e-5
    joints = np.cumsum(path.pieces[:, 5])
    for x in np.linspace(0.0, path.length_m, 17)[1:-1].tolist():
        if np.abs(joints - x).min() > 2.0 * step and min(x, path.length_m - x) > 2.0 * step:
            slope = (path.at(x + step)[0] - path.at(x - step)[0]) / (2.0 * step)
            assert np.allclose(slope, path.at(x)[1], atol=1e-6)


# --- known answers -----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("centres", "radii"),
    [([], []), (np.empty((0, 2)), np.empty(0)), ([(9.0, 9.0)], [1.0])],
)
def test_nothing_in_the_way_gives_the_straight_line(centres: Any, radii: Any) -> None:
    path = shortest_path((0.0, 0.0), (3.0, 4.0), centres, radii)
    assert path.length_m == pytest.approx(5.0, abs=1e-12)
    position, tangent = path.at(2.5)
    assert np.allclose((position, tangent), ((1.5, 2.0), (0.6, 0.8)))


@pytest.mark.parametrize(("half", "radius"), [(3.0, 1.0), (1.0 + 1e-6, 1.0), (500.0, 2.05), (4.0, 3.999)])
def test_one_disc_between(half: float, radius: float) -> None:
    path = shortest_path((-half, 0.0), (half, 0.0), [(0.0, 0.0)], [radius])
    arc = radius * (math.pi - 2.0 * math.acos(radius / half))
    assert path.length_m == pytest.approx(2.0 * math.sqrt(half**2 - radius**2) + arc, abs=1e-8)
    check_curve(path, (-half, 0.0), (half, 0.0))


def test_inner_tangent_between_two_discs() -> None:
    discs = [(0.0, 0.0, 1.0), (4.0, 0.0, 1.0)]
    # Both ends on circles: over both discs, or over one and under the other.
    path = find((-1.0, 0.0), (5.0, 0.0), discs)
    over = 2.0 * (math.pi / 2.0) + 4.0
    s_shape = 2.0 * (math.pi - math.acos(0.5)) + 2.0 * math.sqrt(3.0)
    assert path.length_m == pytest.approx(min(over, s_shape), abs=1e-9)
    path = find((0.0, 1.0), (4.0, -1.0), discs)
    s_shape = 2.0 * (math.pi / 2.0 - math.acos(0.5)) + 2.0 * math.sqrt(3.0)
    assert path.length_m == pytest.approx(s_shape, abs=1e-9)


def test_overlapping_discs_force_the_outer_way_round() -> None:
    path = find((-2.0, 0.0), (2.0, 0.0), [(0.0, 0.8, 1.0), (0.0, -0.8, 1.0)])
    # By symmetry over the upper disc: tangent, arc, tangent, from (-2, 0) to the circle about (0, 0.8).
    far = math.hypot(2.0, 0.8)
    arc = math.pi + 2.0 * math.atan2(0.8, 2.0) - 2.0 * math.acos(1.0 / far)
    assert path.length_m == pytest.approx(2.0 * math.sqrt(far**2 - 1.0) + arc, abs=1e-9)
    assert np.abs(sample(path)[1][:, 1]).max() == pytest.approx(1.8, abs=1e-3)


def test_touching_discs_leave_a_passage_and_overlapping_ones_none() -> None:
    ends: tuple[Point, Point] = ((0.0, -1.0), (0.0, 1.0))
    through = find(*ends, [(-1.0, 0.0, 1.0), (1.0, 0.0, 1.0)])
    assert through.length_m == pytest.approx(2.0, abs=1e-6)
    around = find(*ends, [(-1.0, 0.0, 1.001), (1.0, 0.0, 1.001)])
    assert around.length_m > 3.0


def test_start_on_the_crossing_of_two_safety_circles() -> None:
    centres, radii = [(1.7, 4.0), (4.0, 7.0), (-0.5, 5.0)], [2.05] * 3
    path = shortest_path((3.369, 5.102), (3.3, 9.3), centres, radii)
    assert path.length_m == pytest.approx(7.84, abs=0.02)
    _, points, _ = sample(path)
    assert points[:, 0].max() > 5.9
    beyond = points[np.linspace(0.0, path.length_m, len(points)) > path.pieces[0, 5]]
    assert clearance(beyond, [(*c, 2.05) for c in centres]) >= -TOL


def test_start_exactly_on_the_crossing_of_two_circles() -> None:
    discs = [(-1.0, 0.0, math.sqrt(2.0)), (1.0, 0.0, math.sqrt(2.0))]
    path = find((0.0, 1.0), (0.0, -1.0), discs)  # from one crossing point to the other: 3/4 of a circle
    assert path.length_m == pytest.approx(1.5 * math.pi * math.sqrt(2.0), abs=1e-8)
    assert find((0.0, 1.0), (0.0, 3.0), discs).length_m == pytest.approx(2.0, abs=1e-9)


@pytest.mark.parametrize("offset", [-0.9e-9, -1e-12, 0.0, 1e-12, 0.9e-9])
def test_ends_on_a_circle_within_the_tolerance(offset: float) -> None:
    rim = 2.0 + offset
    start, goal = (rim * math.cos(1.0), rim * math.sin(1.0)), (rim * math.cos(3.0), rim * math.sin(3.0))
    path = find(start, goal, [(0.0, 0.0, 2.0)])
    assert path.length_m == pytest.approx(4.0, abs=1e-8)
    check_curve(path, start, goal)
    assert clearance(sample(path)[1], [(0.0, 0.0, 2.0)]) >= -2.0 * TOL


def test_start_inside_leaves_by_the_nearest_boundary_point() -> None:
    path = find((0.5, 0.0), (-3.0, 0.0), [(0.0, 0.0, 1.0)])
    assert np.allclose(path.pieces[0], (0.5, 0.0, 1.0, 0.0, 0.0, 0.5))
    arc = math.pi - math.acos(1.0 / 3.0)
    assert path.length_m == pytest.approx(0.5 + arc + math.sqrt(8.0), abs=1e-9)
    # In the lens of two discs the nearest boundary point is a crossing point, here (0, 0.6).
    path = find((0.0, 0.1), (0.0, 5.0), [(-0.8, 0.0, 1.0), (0.8, 0.0, 1.0)])
    assert path.length_m == pytest.approx(4.9, abs=1e-9)
    for x in (0.0, 1e-310):  # from a centre: any way out
        assert find((x, 0.0), (0.0, 5.0), [(0.0, 0.0, 1.0)]).length_m > 5.0


def test_contained_equal_and_point_discs_change_nothing() -> None:
    alone = find((-3.0, 0.2), (3.0, 0.0), [(0.0, 0.0, 1.0)])
    inner = [(0.0, 0.0, 1.0), (0.3, 0.1, 0.5), (0.0, 0.0, 1.0), (0.5, 0.0, 0.5), (2.0, 0.0, 0.0)]
    for discs in (inner, inner[::-1]):
        assert find((-3.0, 0.2), (3.0, 0.0), discs).length_m == pytest.approx(alone.length_m, abs=1e-12)


def test_two_equally_short_ways_give_the_same_path_each_time() -> None:
    paths = [find((-3.0, 0.0), (3.0, 0.0), [(0.0, 0.0, 1.0)]) for _ in range(3)]
    assert all(np.array_equal(path.pieces, paths[0].pieces) for path in paths)


# --- no path, bad arguments --------------------------------------------------------------


def test_no_path_out_of_or_into_a_ring() -> None:
    with pytest.raises(NoPath, match=r"start \(0, 0\).*enclose start$"):
        shortest_path((0.0, 0.0), (9.0, 0.0), RING, np.ones(8))
    with pytest.raises(NoPath, match=r"goal \(0, 0\).*enclose goal$"):
        shortest_path((9.0, 0.0), (0.0, 0.0), RING, np.ones(8))
    both = np.vstack((RING, np.add(RING, (20.0, 0.0))))
    with pytest.raises(NoPath, match=r"enclose start and goal$"):
        shortest_path((0.0, 0.0), (20.0, 0.0), both, np.ones(16))
    assert shortest_path((0.0, 0.0), (0.5, 0.5), RING, np.ones(8)).length_m == pytest.approx(math.sqrt(0.5))


def test_no_path_to_a_goal_inside_a_disc() -> None:
    with pytest.raises(NoPath, match=r"goal \(2, 0\) is inside the disc at \(2, 0.5\)"):
        shortest_path((0.0, 0.0), (2.0, 0.0), [(2.0, 0.5)], [1.0])
    assert issubclass(NoPath, ValueError)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("start", (0.0, math.nan)),
        ("start", (0.0, 0.0, 0.0)),
        ("start", ()),
        ("start", "here"),
        ("goal", (math.inf, 0.0)),
        ("goal", 1.0),
        ("centres", [(1.0, math.nan)]),
        ("centres", [1.0, 2.0]),
        ("centres", [(1.0, 2.0, 3.0)]),
        ("centres", [(1.0, 2.0), (3.0,)]),
        ("radii", [1.0, 2.0]),
        ("radii", [math.nan]),
        ("radii", [[1.0]]),
        ("radii", [-1.0]),
        ("radii", 1.0),
    ],
)
def test_bad_arguments_are_named(name: str, value: Any) -> None:
    arguments: dict[str, Any] = {"start": (0, 0), "goal": (9, 9), "centres": [(5, 5)], "radii": [1]}
    with pytest.raises(ValueError, match=f"^{name}: ") as caught:
        shortest_path(**{**arguments, name: value})
    assert not isinstance(caught.value, NoPath)


# --- the curve ---------------------------------------------------------------------------


def test_zero_length_path() -> None:
    path = find((1.0, 2.0), (1.0, 2.0), [(0.0, 0.0, 1.0)])
    position, tangent = path.at(3.0)
    assert path.length_m == 0.0
    assert np.array_equal((position, tangent), ((1.0, 2.0), (0.0, 0.0)))


def test_arc_length_is_clipped_and_nan_refused() -> None:
    path = find((0.0, 0.0), (3.0, 4.0), [])
    assert np.array_equal(path.at(-1.0)[0], (0.0, 0.0))
    assert np.allclose(path.at(99.0)[0], (3.0, 4.0))
    with pytest.raises(ValueError, match=r"^s: "):
        path.at(math.nan)


def test_path_is_immutable() -> None:
    path = find((-3.0, 0.0), (3.0, 0.0), [(0.0, 0.0, 1.0)])
    assert copy.deepcopy(path) is path
    with pytest.raises(ValueError, match="read-only"):
        path.pieces[0, 0] = 1.0
    with pytest.raises(AttributeError):
        path.length_m = 1.0  # type: ignore[misc]
    path.at(1.0)[0][:] = 0.0  # the caller's copy
    assert path.at(1.0)[0].any()


# --- random scenes -----------------------------------------------------------------------

coordinate = st.floats(0.0, 10.0).map(lambda x: round(x, 3))
point = st.tuples(coordinate, coordinate)
scene = st.lists(st.tuples(coordinate, coordinate, st.floats(0.3, 2.5)), max_size=5)
halves = st.integers(0, 8).map(lambda n: n / 2.0)
grid_scene = st.lists(st.tuples(halves, halves, st.sampled_from([0.5, 1.0, 1.5])), max_size=7)


@examples(30, fuzz=2000)
@given(point, point, scene)
def test_random_scene_against_the_oracle(start: Point, goal: Point, discs: list[Disc]) -> None:
    assume(start != goal and clearance(np.array((start, goal)), discs) > 0.05)
    for i, (x, y, r) in enumerate(discs):  # no passage so narrow that the polygons of the oracle close it
        assume(not any(0.0 < math.hypot(x - u, y - v) - r - w < 0.05 for u, v, w in discs[:i]))
    best, rough = length_or_inf(start, goal, discs), oracle(start, goal, discs)
    assert length_or_inf(goal, start, discs) == pytest.approx(best, abs=1e-8)
    if math.isinf(best):
        assert math.isinf(rough)
        return
    assert math.dist(start, goal) - 1e-9 <= best <= rough + 1e-9
    assert rough <= 1.02 * best + 1e-9
    path = find(start, goal, discs)
    check_curve(path, start, goal)
    assert clearance(sample(path)[1], discs) >= -TOL


@examples(50)
@given(st.tuples(halves, halves), st.tuples(halves, halves), grid_scene)
def test_degenerate_scene_on_a_grid(start: Point, goal: Point, discs: list[Disc]) -> None:
    """Touching, equal, concentric and aligned circles; ends on circles and on their crossings."""
    assume(clearance(np.array((start, goal)), discs) >= 0.0)
    best = length_or_inf(start, goal, discs)
    assert length_or_inf(goal, start, discs) == pytest.approx(best, abs=1e-7)
    # Slightly smaller discs can only shorten the path, and open no passage that was not a touching point.
    assert length_or_inf(start, goal, [(x, y, r - 1e-6) for x, y, r in discs]) <= best + 1e-7
    if math.isfinite(best):
        path = find(start, goal, discs)
        check_curve(path, start, goal)
        assert clearance(sample(path)[1], discs) >= -TOL


@examples(50)
@given(st.floats(0.0, 6.3), st.floats(0.0, 0.999), point, scene.filter(len))
def test_start_inside_discs(angle: float, depth: float, goal: Point, discs: list[Disc]) -> None:
    x, y, r = discs[0]
    start = (x + depth * r * math.cos(angle), y + depth * r * math.sin(angle))
    assume(clearance(np.array((goal,)), discs) > 0.0)
    try:
        path = find(start, goal, discs)
    except NoPath:
        return
    check_curve(path, start, goal)
    leg = float(path.pieces[0, 5])
    leave = path.at(leg)[0]
    assert clearance(leave[None], discs) == pytest.approx(0.0, abs=TOL)
    turn = np.linspace(0.0, 2.0 * math.pi, 200)
    for part in (0.3, 0.6, 0.99):  # no free point is nearer
        ring = start + part * leg * np.stack((np.cos(turn), np.sin(turn)), axis=1)
        assert np.min([np.hypot(*(ring - d[:2]).T) - d[2] for d in discs], axis=0).max() < 0.0
    s, points, _ = sample(path)
    assert clearance(points[s >= leg], discs) >= -TOL
    assert path.length_m >= leg + math.dist(leave.tolist(), goal) - 1e-9


@given(point, point, scene)
def test_a_path_among_many_discs_is_found_from_those_in_its_way(start: Point, goal: Point, discs: list[Disc]) -> None:
    at_once = length_or_inf(start, goal, discs)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(paths, "FEW", 0)
        assert length_or_inf(start, goal, discs) == pytest.approx(at_once, abs=1e-7)
