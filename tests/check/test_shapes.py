"""Shapes of the checker against dense sampling, whole polygons without parts, and the package's own geometry."""

import cmath
import math
from fractions import Fraction
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from properties import examples

from airground_drake.check.rules import NotEstablished
from airground_drake.check.run import Run
from airground_drake.check.scenario import Pair, pairs_of
from airground_drake.check.shapes import POINT, ROWS, Shape, boxes_of, shape_of, split
from airground_drake.model.geometry import outline
from airground_drake.scenario.load import from_data, load, resolved
from airground_drake.scenario.outlines import outlines_of
from airground_drake.scenario.schema import Obstacle

Corners = list[list[float]]
Array = NDArray[np.float64]
AT_ORIGIN = {"position_m": [], "heading_rad": 0.0, "height_m": 0.0, "polygon_m": [], "segment_m": [], "size_m": []}
KINDS: dict[str, Any] = {
    "ball": {"position_m": [9.0, 9.0, 1.0], "radius_m": 0.3},
    "post": {"position_m": [-9.0, 9.0], "height_m": 2.0, "radius_m": 0.1, "distance_m": 0.5},
    "hall": {
        "polygon_m": [[9, -9], [9, -12], [10, -12], [10, -10], [13, -10], [13, -9]],
        "height_m": 3.0,
        "radius_m": 0.1,
    },
    "room": {"segment_m": [[12, 3], [12, 5], [16, 5], [16, 3]], "position_m": [1.0, 2.0], "heading_rad": 0.3},
    "box": {"size_m": [3.0, 1.0], "position_m": [-9.0, -9.0], "heading_rad": -1.0, "height_m": 0.5, "distance_m": 0.25},
}
"""One obstacle of each kind, far from the robots."""


@st.composite
def polygons(draw: st.DrawFn) -> Corners:
    """Corners round the origin at distances of their own, some between two others, in either order."""
    reach = draw(st.lists(st.integers(3, 30), min_size=3, max_size=9))
    turns = 2.0 * math.pi * np.arange(len(reach)) / len(reach)
    corners = (0.1 * np.array(reach)[:, None] * np.column_stack([np.cos(turns), np.sin(turns)])).tolist()
    for k in sorted(draw(st.sets(st.integers(1, len(reach) - 1), max_size=2)), reverse=True):
        corners.insert(k, [0.5 * (a + b) for a, b in zip(corners[k - 1], corners[k], strict=True)])
    return corners[:: draw(st.sampled_from([1, -1]))]


def prism(corners: Corners, height_m: float, *, endless: bool) -> Shape:
    return shape_of(AT_ORIGIN | {"polygon_m": corners, "height_m": height_m}, endless=endless)


def signed_m(shape: Shape, places: Array) -> Array:
    """The least signed distances over all parts, (K,), m."""
    return np.asarray(np.min([part.signed_m(places) for part in shape.parts], axis=0))


PLACES = st.lists(st.tuples(*[st.floats(-4.0, 4.0)] * 2, st.floats(0.0, 4.0)), min_size=2, max_size=6)
HEIGHTS = st.sampled_from([0.0, 0.5, 2.0])


def boundary_m(corners: Corners, place: Any) -> tuple[float, bool]:
    """Distance from the edges of a whole polygon in the plane, and whether a place is inside, by complex numbers."""
    around, p = [complex(*corner) for corner in corners], complex(*place[:2])
    least, winding = math.inf, 0.0
    for a, b in zip(around, [*around[1:], around[0]], strict=True):
        share = min(max(((p - a) / (b - a)).real, 0.0), 1.0)
        least = min(least, abs(p - a - share * (b - a)))
        winding += cmath.phase((b - p) / (a - p)) if p not in (a, b) else 0.0
    return least, abs(winding) > math.pi


@given(corners=polygons(), places=PLACES, height_m=HEIGHTS)
def test_outside_the_distance_is_that_of_the_whole_polygon(corners: Corners, places: Any, height_m: float) -> None:
    for endless in (True, False):
        shape = prism(corners, height_m, endless=endless)
        for place, found in zip(places, signed_m(shape, np.array(places)), strict=True):
            flat, inside = boundary_m(corners, place)
            over = 0.0 if endless else max(place[2] - height_m, 0.0)
            if min(flat, abs(place[2] - height_m)) < 1e-9:
                continue  # on the boundary
            if not inside:
                assert found == pytest.approx(math.hypot(flat, over), abs=1e-12)
            elif over:
                assert found == pytest.approx(over, abs=1e-12)
            else:  # the depth in one of the parts
                assert -flat - 1e-12 <= found <= 0.0


@given(corners=polygons(), places=PLACES, height_m=HEIGHTS, endless=st.booleans())
def test_the_least_distance_of_a_way_is_that_of_dense_samples(
    corners: Corners, places: Any, height_m: float, endless: bool
) -> None:
    shape, way = prism(corners, height_m, endless=endless), np.array(places)
    least = shape.least_m(way)
    share = np.linspace(0.0, 1.0, 401)[:, None]
    dense = [signed_m(shape, a + share * (b - a)).min() for a, b in pairwise(way)]
    longest = float(np.linalg.norm(np.diff(way, axis=0), axis=1).max())
    assert min(dense) - longest / 800.0 <= least <= min(dense) + 1e-12
    there, passes = shape.within(way, 0.7)
    assert there.tolist() == (signed_m(shape, way) < 0.7).tolist()
    for near, of_step in zip(passes.tolist(), dense, strict=True):
        assert near or of_step >= 0.7
        assert not near or of_step < 0.7 + longest / 800.0
    assert shape.least_m(way, least - 0.1) == least - 0.1  # nothing is nearer than what is asked for


@given(corners=polygons(), places=PLACES, height_m=HEIGHTS, endless=st.booleans(), seed=st.integers(0, 99))
def test_the_normal_bounds_the_distance_after_any_step(
    corners: Corners, places: Any, height_m: float, endless: bool, seed: int
) -> None:
    """dist(x + v) >= dist(x) + n.v, with |n| = 1: all that the theorem of set-based avoidance needs."""
    steps = np.random.default_rng(seed).normal(size=(50, 3))
    for part in prism(corners, height_m, endless=endless).parts:
        for place in places:
            for away in part.away([Fraction(c) for c in place]):
                n = np.array([float(c) for c in away.vector])
                here = float(part.signed_m(np.array([place]))[0])
                assert here * np.linalg.norm(n) == pytest.approx(float(away.beyond), abs=1e-9)
                if np.linalg.norm(n) > 1e-6:
                    after = part.signed_m(np.array(place) + steps)
                    assert (after >= here + steps @ n / np.linalg.norm(n) - 1e-9).all()


@given(corners=polygons(), at=st.sampled_from([[], [0.0, 0.0, 0.0], [1.5, -0.7, 0.0]]), turn=st.floats(-4.0, 4.0))
def test_parts_are_those_of_the_controllers(corners: Corners, at: list[float], turn: float) -> None:
    body = AT_ORIGIN | {"polygon_m": corners, "position_m": at, "heading_rad": turn}
    rows = outlines_of(load("minimal"), Obstacle(**body))
    assert as_sets(shape_of(body, endless=False)) == as_sets_of(rows)


def as_sets(shape: Shape) -> list[Any]:
    """Corners and heights of all parts, in an order of their own."""
    return sorted((sorted(part.corners), part.base_m, part.top_m) for part in shape.parts)


def as_sets_of(rows: Array) -> list[Any]:
    """The same of outlines."""
    corners = [sorted(map(tuple, outline.corners_of(row).tolist())) for row in rows]
    return sorted(zip(corners, rows[:, outline.BASE].tolist(), rows[:, outline.TOP].tolist(), strict=True))


def test_every_kind_of_obstacle_has_the_shape_and_the_distance_of_the_package() -> None:
    scenario = load(
        "minimal", {"arena_m": [[30.0, -20.0], [-20.0, 20.0]], "obstacles": KINDS, "ugvs.ugv1.radius_m": 0.2}
    )
    data = resolved(scenario)
    pairs = {(pair.robot, pair.other): pair for pair in pairs_of(data)}
    assert {name for both in pairs for name in both} == {*scenario.bodies}
    for name, barrier in scenario.barriers.items():
        rows = outlines_of(scenario, barrier)
        assert as_sets(pairs[scenario.uav.name, name].shape) == as_sets_of(rows), name
        for robot, body in scenario.robots.items():
            assert {pairs[robot, name].safe_m} == {*outline.keep(rows, body.radius_m).tolist()}
            assert math.isinf(pairs[robot, name].shape.parts[0].top_m) == (robot in scenario.ugvs and name != "ball")


@pytest.mark.parametrize("origin", [[7.0, -30.0, 0.0], [7.0, -30.0, 0.4]])
def test_a_map_is_one_obstacle_of_all_its_rectangles(origin: list[float]) -> None:
    data = resolved(load("minimal"))
    cells = {
        "file": "lab.yaml", "unknown": "occupied", "sha256": {}, "cell_m": 0.05, "origin": origin, "rows": 40,
        "columns": 30, "occupied": 9, "unsure": 0, "unreached": 0, "rectangles": [[0, 3, 1, 4], [2, 40, 5, 30]],
        "starts_m": [body["start_m"][:2] for body in (*data["ugvs"].values(), data["uav"])],
    }  # fmt: skip
    data["map"] = {"file": "lab.yaml", "height_m": 1.5, "distance_m": 0.4, "cells": cells}
    scenario = from_data(data, "a report")
    rows = outlines_of(scenario, scenario.barriers["map"])
    for pair in (pair for pair in pairs_of(resolved(scenario)) if pair.other == "map"):
        assert pair.safe_m == 0.4
        for part, row in zip(pair.shape.parts, rows, strict=True):
            assert np.allclose(part.begin, outline.corners_of(row), rtol=0.0, atol=2e-12)
            assert part.top_m == (math.inf if pair.robot in scenario.ugvs else 1.5)


def test_a_polygon_that_crosses_itself_has_no_parts() -> None:
    with pytest.raises(NotEstablished, match="polygon"):
        split([(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)])


@examples(30)
@given(st.integers(0, 2**32 - 1), st.integers(2, 3 * ROWS), st.floats(0.01, 3.0), polygons(), HEIGHTS)
def test_bounds_are_below_all_distances(seed: int, rows: int, step: float, corners: Corners, height_m: float) -> None:
    rng = np.random.default_rng(seed)
    way = 5.0 * rng.normal(size=3) + np.cumsum(step * rng.normal(size=(rows, 3)), axis=0)
    for shape in (POINT, *(prism(corners, height_m, endless=endless) for endless in (True, False))):
        bounds = shape.bounds_m(*boxes_of(way))
        assert bounds.shape == (-(-(rows - 1) // ROWS), len(shape.parts))
        for k, of_slice in enumerate(bounds):
            places = way[ROWS * k : ROWS * (k + 1) + 1]
            for bound, part in zip(of_slice, shape.parts, strict=True):
                assert bound <= Shape([part]).least_m(places)


@examples(30)
@given(seed=st.integers(0, 2**32 - 1), rows=st.integers(2, 3 * ROWS), step=st.floats(0.01, 10.0))
def test_no_pair_of_robots_comes_nearer_than_its_bound(seed: int, rows: int, step: float) -> None:
    rng = np.random.default_rng(seed)
    ways = {name: 5.0 * rng.normal(size=3) + np.cumsum(step * rng.normal(size=(rows, 3)), axis=0) for name in "abc"}
    pairs = [Pair(one, other, 1.0, 0.0, 1.0, 0.5) for one, other in ("ab", "ac", "bc")]
    bounds = Run.apart_m.func(cast("Any", SimpleNamespace(body_m=ways, pairs=pairs)))
    for pair in pairs:
        assert bounds[pair.robot, pair.other] <= POINT.least_m(ways[pair.robot] - ways[pair.other])


def test_the_step_between_two_slices_belongs_to_one() -> None:
    """A place is passed at 1 m between the last row of a slice and the first one of the next."""
    way = np.column_stack([2.0 * np.arange(2 * ROWS) - (2 * ROWS - 1), np.ones((2 * ROWS, 1)), np.zeros((2 * ROWS, 1))])
    assert POINT.least_m(way) == pytest.approx(1.0, abs=1e-10)
    assert POINT.within(way, 1.1)[1].nonzero()[0].tolist() == [ROWS - 1]
    assert POINT.bounds_m(*boxes_of(way)).min() <= 1.0
