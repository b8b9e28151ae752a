"""Ways among walls, polygons and balls: shortest paths, distance fields, separated places, looked-up outlines."""

import math

import numpy as np
import pytest
from builders.shapes import OUTLINES, Array, fields, from_core, rectangle, shortest_around, wall
from hypothesis import assume, given
from hypothesis import strategies as st
from properties import examples

from airground_drake.model.geometry import convex, outline, paths
from airground_drake.model.geometry.distance_field import DistanceField, length_among
from airground_drake.model.geometry.paths import TOL, NoPath, shortest_path
from airground_drake.model.geometry.separation import are_separated

Point = tuple[float, float]
ROOM = outline.stacked([wall((3.0, -2.0), (3.0, 2.0)), rectangle(1.5, 2.1, 3.0, 0.2), wall((0.0, -2.0), (3.0, -2.0))])
SQUARE = outline.stacked([rectangle(0.0, 0.0, 2.0, 2.0)])
coordinate = st.integers(-4, 44).map(lambda n: n / 4.0 + 0.1)
point = st.tuples(coordinate, coordinate)


def lacking(places: Point | Array, rows: Array, keep: Array) -> Array:
    """By how much places are too near to each core, (K, m), m; inside a polygon all of the distance."""
    here = np.array(places, dtype=np.float64).reshape(-1, 2)
    apart = [from_core(here, here, outline.corners_of(row)) for row in rows]
    return keep - np.array(apart).reshape(len(rows), len(here)).T


def length_or_inf(start: Point, goal: Point, rows: Array, keep: Array) -> float:
    try:
        return shortest_path(start, goal, rows, keep).length_m
    except NoPath:
        return math.inf


def discs_along(rows: Array, keep: Array, gap: float) -> tuple[Array, Array]:
    """Balls along the edges of all cores instead: they take up less, and hardly."""
    places, radii = [], []
    for row, far in zip(rows, keep.tolist(), strict=True):
        corners = outline.corners_of(row)
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            count = max(1, math.ceil(float(np.hypot(*(b - a))) / gap))
            places.append(a + (b - a) * np.arange(count)[:, None] / count)
            radii.append(np.full(count, far))
    flat = np.concatenate(places)
    return outline.balls(np.column_stack([flat, np.zeros(len(flat))])), np.concatenate(radii)


def over_a_square(half: float, keep: float) -> float:
    """From (-half, 0) to (half, 0) round a square of 2 m about the origin: a tangent, a corner, and the same again."""
    apart = math.hypot(half - 1.0, 1.0)
    turn = math.atan2(1.0, half - 1.0) + math.asin(keep / apart)
    return 2.0 * (math.sqrt(apart**2 - keep**2) + keep * turn + 1.0)


def over_an_end(half: float, keep: float, above: float = 0.0) -> float:
    """From (-half, above) to (half, above) over the end of a wall, or a disc, at the origin; below 0: under it."""
    apart = math.hypot(half, above)
    turn = math.pi - 2.0 * math.acos(keep / apart) - 2.0 * math.atan2(above, half)
    return 2.0 * math.sqrt(apart**2 - keep**2) + keep * turn


@pytest.mark.parametrize(
    ("start", "goal", "rows", "keep", "length"),
    [
        ((-3.0, 0.0), (3.0, 0.0), SQUARE, 0.5, over_a_square(3.0, 0.5)),
        ((-3.0, 0.0), (3.0, 0.0), SQUARE, 0.0, 2.0 * math.sqrt(5.0) + 2.0),
        ((-2.0, -2.0), (2.0, 2.0), SQUARE, 0.0, 2.0 * math.sqrt(10.0)),
        ((-3.0, 1.5), (3.0, 1.5), SQUARE, 0.5, 6.0),  # along an edge
        ((0.0, 0.8), (0.0, 4.0), SQUARE, 0.5, 3.2),  # from inside, straight out
        ((0.9, 0.0), (4.0, 0.0), outline.stacked([*SQUARE, rectangle(1.8, 0.0, 1.0, 0.8)]), 0.5,
         math.hypot(0.6, 0.9) + 0.8 + math.sqrt(1.7**2 + 0.4**2 - 0.5**2)
         + 0.5 * (math.atan2(0.4, 1.7) + math.asin(0.5 / math.hypot(1.7, 0.4)))),
        # out of two by the place where their edges cross
        ((-2.0, 0.0), (2.0, 0.0), outline.stacked([wall((0.0, -9.0), (0.0, 0.0))]), 0.5, over_an_end(2.0, 0.5)),
        ((-2.0, 0.48), (2.0, 0.48), outline.stacked([wall((0.0, -9.0), (0.0, 0.0))]), 0.5, over_an_end(2.0, 0.5, 0.48)),
        ((-2.0, 0.2), (2.0, 0.2), outline.stacked([wall((0.05, 0.5), (0.25, 4.0)), outline.balls([0.0, 0.0, 0.0])[0]]),
         [0.05, 1.0], over_an_end(2.0, 1.0, -0.2)),  # a wall that stands on a disc: under it
        ((-2.0, 0.0), (2.0, 0.0), outline.stacked([wall((0.0, -9.0), (0.0, -4.0)), wall((0.0, -4.0), (0.0, 0.0))]), 0.5,
         over_an_end(2.0, 0.5)),  # walls that share a corner
        ((-2.0, 0.0), (2.0, 0.0), outline.stacked([wall((0.0, -9.0), (0.0, -0.5)), wall((0.0, 0.5), (0.0, 9.0))]), 0.5,
         4.0),  # two ends whose circles touch leave a passage
    ],
)  # fmt: skip
@pytest.mark.parametrize("few", [0, 64])
def test_known_lengths(
    start: Point, goal: Point, rows: Array, keep: float | list[float], length: float, few: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr(paths, "FEW", few)
    assert length_or_inf(start, goal, rows, np.broadcast_to(keep, len(rows))) == pytest.approx(length, abs=1e-7)


def test_the_way_out_of_a_room_is_as_long_as_among_discs_along_its_walls() -> None:
    keep = np.full(3, 0.5)
    found = length_or_inf((1.5, 0.2), (6.0, 0.0), ROOM, keep)
    assert found == pytest.approx(10.728674383933, abs=1e-9)
    assert found == pytest.approx(length_or_inf((1.5, 0.2), (6.0, 0.0), *discs_along(ROOM, keep, 0.1)), abs=1e-9)


@pytest.mark.parametrize("start", [(0.2, 0.3), (0.2, -0.9), (1.4, 0.0)])
def test_the_start_leaves_by_the_nearest_place_of_the_boundary(start: Point) -> None:
    """Out of a square that a wall crosses: the nearest place of its own boundary is beside the wall."""
    rows, keep = outline.stacked([*SQUARE, wall((0.5, 0.0), (4.0, 0.0))]), np.array([0.25, 0.5])
    path = shortest_path(start, (-3.0, 3.0), rows, keep)
    out, turn = float(path.pieces[0, 5]), np.linspace(0.0, 2.0 * math.pi, 2000)
    left = path.at(out)[0]
    assert lacking(left, rows, keep).max() == pytest.approx(0.0, abs=TOL)
    ring = start + 0.9999 * out * np.column_stack([np.cos(turn), np.sin(turn)])
    assert lacking(ring, rows, keep).max(axis=1).min() > 0.0


def test_a_start_deep_inside_a_row_of_walls_leaves_all_of_them() -> None:
    """Where the nearest way out is farther than the distance kept, farther walls count, too."""
    rows, keep = outline.stacked([wall((0.5 * k, -2.0), (0.5 * k, 2.0)) for k in range(-6, 7)]), np.full(13, 0.5)
    path = shortest_path((0.1, 0.1), (9.0, 0.0), rows, keep)
    left = path.at(float(path.pieces[0, 5]))[0]
    assert lacking(left, rows, keep).max() == pytest.approx(0.0, abs=TOL)
    assert path.pieces[0, 5] == pytest.approx(math.hypot(0.15, 1.9 + math.sqrt(0.5**2 - 0.25**2)), abs=1e-9)


@examples(30, fuzz=2000)
@given(point, point, fields(6))
def test_a_path_is_shortest_and_keeps_its_distances(start: Point, goal: Point, field: tuple[Array, Array]) -> None:
    rows, keep = field
    assume(start != goal and max(lacking(start, rows, keep).max(), lacking(goal, rows, keep).max()) < 0.0)
    best = length_or_inf(start, goal, rows, keep)
    assert length_or_inf(goal, start, rows, keep) == pytest.approx(best, abs=1e-7)
    assert length_or_inf(start, goal, *discs_along(rows, keep, 0.4)) <= best + 1e-7
    rough = shortest_around(np.array(start), np.array(goal), rows, keep)
    assert best <= rough + 1e-7
    assert shortest_around(np.array(start), np.array(goal), rows, 0.98 * keep) <= 1.01 * best + 0.01
    assert math.isinf(best) == are_separated(np.array(start), np.array(goal), rows, keep - 1e-10)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(paths, "FEW", 0)
        assert length_or_inf(start, goal, rows, keep) == pytest.approx(best, abs=1e-7)
        patch.setattr(paths, "SEARCHES", 0)  # others beside these enter the graph, too
        assert length_or_inf(start, goal, rows, keep) == pytest.approx(best, abs=1e-7)
    if math.isfinite(best):
        path = shortest_path(start, goal, rows, keep)
        places = np.array([path.at(s)[0] for s in np.linspace(0.0, best, 60)])
        assert lacking(places, rows, keep).max() < TOL


@pytest.mark.parametrize(
    ("rows", "apart"),
    [
        ([wall((-1.0, -1.0), (9.0, -1.0)), wall((9.0, -1.0), (9.0, 9.0)), wall((9.0, 9.0), (-1.0, 9.0)),
          wall((-1.0, 9.0), (-1.0, -1.0))], True),
        ([wall((-1.0, -1.0), (9.0, -1.0)), wall((9.0, -1.0), (9.0, 9.0)), wall((9.0, 9.0), (-1.0, 9.0)),
          wall((-1.0, 9.0), (-1.0, 0.2))], False),  # a door
        ([wall((-3.0, 2.0), (2.0, -3.0)), wall((-3.0, -1.0), (3.0, 3.0)), wall((0.0, 4.0), (1.6, -4.0))], True),
        ([rectangle(5.0, 5.0, 1.0, 1.0), rectangle(-5.0, 5.0, 1.0, 1.0)], False),
    ],
)  # fmt: skip
def test_what_separates_two_places(rows: list[Array], apart: bool) -> None:
    start, goal, keep = np.array([-0.2, 0.0]), np.array([20.0, 1.0]), np.full(len(rows), 0.2)
    assert are_separated(start, goal, outline.stacked(rows), keep) is apart
    assert are_separated(goal, start, outline.stacked(rows), keep) is apart


@examples(60)
@given(st.lists(OUTLINES, max_size=12), st.integers(1, 30), st.integers(0, 99))
def test_looking_up_outlines_changes_nothing(drawn: list[Array], count: int, seed: int) -> None:
    rows = outline.stacked(drawn)
    rng, keep = np.random.default_rng(seed), np.resize([0.25, 0.5, 1.0], len(rows))
    begin = np.round(4.0 * rng.uniform(-2.0, 12.0, (count, 2))) / 4.0
    end = begin + rng.normal(size=(count, 2)) * rng.choice([0.0, 0.3, 4.0], (count, 1))
    one_by_one = [convex.points_are_free(place[None], rows, keep)[0] for place in begin]
    assert convex.points_are_free(begin, rows, keep).tolist() == one_by_one
    first, last = lacking(begin, rows, keep), lacking(end, rows, keep)
    assert one_by_one == (first.max(axis=1, initial=-1.0) <= 0.0).tolist()
    alone = np.array([
        [convex.passes(row, far, *one, *other, 1e-9) for row, far in zip(rows, keep.tolist(), strict=True)]
        for one, other in zip(begin, end, strict=True)
    ]).reshape(count, len(rows))  # fmt: skip
    assert convex.segments_are_free(begin, end, rows, keep, 1e-9).tolist() == alone.all(axis=1).tolist()
    for row, far, free, ends in zip(rows, keep, alone.T, np.maximum(first, last).T, strict=True):
        nearest = from_core(begin, end, outline.corners_of(row))
        assert (free | (nearest < far)).all()
        assert (~free | (nearest >= np.minimum(far, far - ends) - 1e-8)).all()


def test_a_distance_field_is_exact_in_sight_and_little_longer_round_walls() -> None:
    keep = np.full(3, 0.5)
    for start in ((5.0, 3.0), (3.9, 0.0), (-1.0, 1.0), (1.5, 0.2), (2.4, 1.3)):
        exact = length_or_inf(start, (6.0, 0.0), ROOM, keep)
        found = length_among(np.array(start), np.array([6.0, 0.0]), ROOM, keep)
        assert exact - 1e-9 <= found <= 1.02 * exact
        assert found == pytest.approx(exact, abs=1e-9) or exact > math.dist(start, (6.0, 0.0))


@examples(15, fuzz=500)
@given(point, point, fields(8))
def test_lengths_of_a_distance_field(start: Point, goal: Point, field: tuple[Array, Array]) -> None:
    rows, keep = field
    assume(max(lacking(start, rows, keep).max(), lacking(goal, rows, keep).max()) < 0.0)
    exact, wide = (length_or_inf(start, goal, rows, far) for far in (keep, keep + 0.12))
    found = length_among(np.array(start), np.array(goal), rows, keep)
    assert found >= exact - 1e-6
    assert found <= 1.03 * wide + 0.1


@pytest.mark.parametrize(("start", "goal"), [((-1.2, 0.0), (3.0, 0.0)), ((-3.0, 0.0), (1.2, 0.0))])
def test_a_distance_field_between_places_too_near(start: Point, goal: Point) -> None:
    """0.2 m from the square, where 0.5 m are to be kept: no nearer than that, and hardly longer than out and round."""
    found = length_among(np.array(start), np.array(goal), SQUARE, np.full(1, 0.5))
    inner, outer = (start, goal) if start[0] == -1.2 else (goal, start)
    assert found >= shortest_path(inner, outer, SQUARE, np.full(1, 0.2)).length_m
    assert found <= shortest_path(inner, outer, SQUARE, np.full(1, 0.5)).length_m + 0.1


def test_a_distance_field_knows_no_way_through_closed_walls_and_bears_walls_far_away() -> None:
    corners = [(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)]
    closed = outline.stacked([wall(a, b) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)])
    there, goal = np.zeros(2), np.array([5.0, 0.0])
    assert math.isinf(length_among(there, goal, closed, np.full(4, 0.003)))
    far = outline.joined(SQUARE, outline.stacked([wall((1e9, 0.0), (1e9, 1.0)), wall((-1e9, 9.0), (1e9, 9.0))]))
    found = length_among(np.array([-3.0, 0.0]), np.array([3.0, 0.0]), far, np.full(3, 0.5))
    assert found == pytest.approx(over_a_square(3.0, 0.5), rel=0.01)
    assert len(DistanceField.to(goal, closed, np.full(4, 0.01), 9.0).nodes) <= 65_000


@examples(60)
@given(st.lists(OUTLINES, max_size=8), st.lists(OUTLINES, max_size=8), st.sampled_from([0.0, 0.4, -0.4, 3.0]))
def test_what_is_among_others(one: list[Array], other: list[Array], shift: float) -> None:
    rows, others = outline.stacked(one), outline.stacked(other) + shift * outline.SAME_M
    both = outline.joined(rows, others)[:, outline.BASE :]
    same = np.abs(both[: len(rows), None] - both[len(rows) :]).max(axis=2) <= outline.SAME_M
    assert outline.is_among(rows, others).tolist() == same.any(axis=1).tolist()


@examples(30, fuzz=2000)
@given(point, point, fields(12))
def test_circles_that_others_cover_change_no_path(start: Point, goal: Point, field: tuple[Array, Array]) -> None:
    found = []
    for looked_at in (True, False):
        with pytest.MonkeyPatch.context() as patch:
            if not looked_at:
                patch.setattr(paths._Obstacles, "touchable", property(lambda self: np.ones(len(self.circles[1]), bool)))
            try:
                found.append(shortest_path(start, goal, *field).pieces.tolist())
            except NoPath:
                found.append([])
    assert found[0] == found[1]


@examples(60, fuzz=2000)
@given(fields(8), st.floats(-4.0, 4.0), st.floats(0.0, 2.0 * math.pi), st.integers(0, 99))
def test_which_arcs_are_covered(field: tuple[Array, Array], begin: float, sweep: float, seed: int) -> None:
    """Of covered arcs no point is outside; an arc near to one core alone, with some room, is covered."""
    rows, keep = field
    rng = np.random.default_rng(seed)
    centres, radii = rng.uniform(0.0, 10.0, (20, 2)), rng.uniform(0.05, 0.6, 20)
    found = convex.arcs_are_covered(centres, radii, np.full(20, begin), np.full(20, sweep), rows, keep)
    angles = begin + sweep * np.linspace(0.0, 1.0, 200)
    unit = np.column_stack([np.cos(angles), np.sin(angles)])
    arcs = centres[:, None] + radii[:, None, None] * unit
    lacks = lacking(arcs, rows, keep).reshape(*arcs.shape[:2], len(rows))
    assert (~found | (lacks.max(axis=2).min(axis=1) > -1e-9)).all()
    assert (found | (lacks.min(axis=1).max(axis=1) < 0.15 * radii)).all()
