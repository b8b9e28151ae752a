"""Tests of the shortest path among discs: known lengths, a brute-force oracle, properties of the curve."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from properties import examples

from airground_drake.base.arrays import Array
from airground_drake.model.geometry import paths, tangents
from airground_drake.model.geometry.outline import balls
from airground_drake.model.geometry.paths import TOL, NoPath, Path, shortest_path

Point = tuple[float, float]
Disc = tuple[float, float, float]
RING = [(2.0 * math.cos(a), 2.0 * math.sin(a), 1.0) for a in np.arange(8) * math.pi / 4]


def find(start: Point, goal: Point, discs: list[Disc]) -> Path:
    return shortest_path(start, goal, balls([[x, y, 0.0] for x, y, _ in discs]), [r for _, _, r in discs])


def length_or_inf(start: Point, goal: Point, discs: list[Disc]) -> float:
    try:
        return find(start, goal, discs).length_m
    except NoPath:
        return math.inf


def sample(path: Path, n: int = 200) -> tuple[Array, Array, Array]:
    s = np.linspace(0.0, path.length_m, n)
    points, tangents = zip(*(path.at(float(x)) for x in s), strict=True)
    assert np.array_equal(path.points(s.tolist()), points)
    return s, np.array(points), np.array(tangents)


def clearance(points: Array, discs: list[Disc]) -> float:
    return min((float((np.hypot(*(points - d[:2]).T) - d[2]).min()) for d in discs), default=math.inf)


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


DISC = [(0.0, 0.0, 1.0)]
TWO = [(0.0, 0.0, 1.0), (4.0, 0.0, 1.0)]
LENS = [(-1.0, 0.0, math.sqrt(2.0)), (1.0, 0.0, math.sqrt(2.0))]
"""Their circles cross at (0, 1) and (0, -1)."""


def round_one(half: float, radius: float) -> float:
    return 2.0 * math.sqrt(half**2 - radius**2) + radius * (math.pi - 2.0 * math.acos(radius / half))


@pytest.mark.parametrize(
    ("start", "goal", "discs", "length"),
    [
        ((0.0, 0.0), (3.0, 4.0), [], 5.0),
        ((0.0, 0.0), (3.0, 4.0), [(9.0, 9.0, 1.0)], 5.0),
        ((1.0, 2.0), (1.0, 2.0), DISC, 0.0),
        *(((-half, 0.0), (half, 0.0), [(0.0, 0.0, r)], round_one(half, r))
          for half, r in ((3.0, 1.0), (1.0 + 1e-6, 1.0), (500.0, 2.05), (4.0, 3.999))),
        ((-3.0, 0.0), (3.0, 0.0), [*DISC, (0.3, 0.1, 0.5), *DISC, (0.5, 0.0, 0.5), (2.0, 0.0, 0.0)],
         round_one(3.0, 1.0)),  # inside another one, equal, a point
        ((-1.0, 0.0), (5.0, 0.0), TWO, min(math.pi + 4.0, 2.0 * (math.pi - math.acos(0.5)) + 2.0 * math.sqrt(3.0))),
        ((0.0, 1.0), (4.0, -1.0), TWO, math.pi - 2.0 * math.acos(0.5) + 2.0 * math.sqrt(3.0)),  # an inner tangent
        ((0.0, -1.0), (0.0, 1.0), [(-1.0, 0.0, 1.0), (1.0, 0.0, 1.0)], 2.0),  # touching discs leave a passage
        ((0.0, 1.0), (0.0, -1.0), LENS, 1.5 * math.pi * math.sqrt(2.0)),  # from crossing to crossing: 3/4 of a circle
        ((0.0, 1.0), (0.0, 3.0), LENS, 2.0),
        ((0.5, 0.0), (-3.0, 0.0), DISC, 0.5 + math.pi - math.acos(1.0 / 3.0) + math.sqrt(8.0)),  # from inside
        ((0.0, 0.1), (0.0, 5.0), [(-0.8, 0.0, 1.0), (0.8, 0.0, 1.0)], 4.9),  # from a lens, by its corner
        *(((rim * math.cos(1.0), rim * math.sin(1.0)), (rim * math.cos(3.0), rim * math.sin(3.0)), [(0.0, 0.0, 2.0)],
           4.0) for rim in (2.0 - 0.9e-9, 2.0 - 1e-12, 2.0, 2.0 + 0.9e-9)),  # on a circle within the tolerance
        ((4.0, 0.0), (2.0 - 0.9e-9, 0.0), [(0.0, 0.0, 2.0)], 2.0),  # the goal only
    ],
)  # fmt: skip
def test_known_lengths(start: Point, goal: Point, discs: list[Disc], length: float) -> None:
    path = find(start, goal, discs)
    assert path.length_m == pytest.approx(length, abs=2e-8)
    check_curve(path, start, goal)
    assert np.array_equal(path.pieces, find(start, goal, discs).pieces)  # of two equally short ways the same each time
    for s, end in ((-1.0, start), (1e9, goal)):
        assert np.allclose(path.at(s)[0], end, atol=1e-8)


@pytest.mark.parametrize("x", [0.0, 1e-310])
def test_from_a_centre_any_way_out_will_do(x: float) -> None:
    assert find((x, 0.0), (0.0, 5.0), DISC).length_m > 5.0


@pytest.mark.parametrize(
    ("start", "goal", "discs", "told"),
    [
        ((0.0, 0.0), (9.0, 0.0), RING, r"no way from start \(0, 0\) to goal \(9, 0\)"),
        ((9.0, 0.0), (0.0, 0.0), RING, r"no way from start \(9, 0\) to goal \(0, 0\)"),
        ((0.0, 0.0), (20.0, 0.0), [*RING, *((x + 20.0, y, r) for x, y, r in RING)], "enclose one of them$"),
        ((0.0, 0.0), (2.0, 0.0), [(2.0, 0.5, 1.0)], r"goal \(2, 0\) is inside the disc at \(2, 0.5\)"),
    ],
)
def test_where_there_is_no_path_the_message_says_why(start: Point, goal: Point, discs: list[Disc], told: str) -> None:
    with pytest.raises(NoPath, match=told):
        find(start, goal, discs)


def test_numbers_that_are_not_finite_are_refused() -> None:
    for place in ((0.0, 0.0, 1.0), (math.inf, 0.0, 1.0), (0.0, 0.0, math.nan)):
        with pytest.raises(ValueError, match="finite"):
            find((0.0, math.nan) if place == (0.0, 0.0, 1.0) else (3.0, 3.0), (9.0, 9.0), [place])


coordinate = st.floats(0.0, 10.0).map(lambda x: round(x, 3))
point = st.tuples(coordinate, coordinate)
scene = st.lists(st.tuples(coordinate, coordinate, st.floats(0.3, 2.5)), max_size=5)
halves = st.integers(0, 8).map(lambda n: n / 2.0)
grid_scene = st.lists(st.tuples(halves, halves, st.sampled_from([0.5, 1.0, 1.5])), max_size=7)


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


@pytest.mark.parametrize("order", [1, -1])
def test_a_small_disc_on_the_rim_of_a_large_one_is_not_run_through(order: int) -> None:
    """It is not in the middle of the arc between the neighbouring tangents."""
    rim, leave = (2.0 * np.exp(1j * math.radians(angle)) for angle in (75.0, 70.0))
    goal = leave * (1.0 - 1.0j)
    discs = [(rim.real, rim.imag, 0.1), (0.0, 0.0, 2.0)][::order]
    path = find((-4.0, 0.0), (goal.real, goal.imag), discs)
    assert clearance(sample(path, 1000)[1], discs) >= -TOL
    check_curve(path, (-4.0, 0.0), (goal.real, goal.imag))


def test_a_way_along_a_wall_of_many_parts_takes_few_searches(monkeypatch: pytest.MonkeyPatch) -> None:
    """Round one disc the next is in the way, and so on to the end of the wall."""
    discs = [(0.4 * k, 0.4 * k, 0.3) for k in range(-80, 81)]
    searches, search = list[int](), tangents.shortest
    monkeypatch.setattr(tangents, "shortest", lambda p, q, some: searches.append(len(some.reach)) or search(p, q, some))
    found = find((2.0, -2.0), (-2.0, 2.0), discs)
    assert clearance(sample(found)[1], discs) >= -TOL
    assert len(searches) < 30
    monkeypatch.setattr(paths, "FEW", 1000)
    assert found.length_m == pytest.approx(find((2.0, -2.0), (-2.0, 2.0), discs).length_m, abs=1e-7)
