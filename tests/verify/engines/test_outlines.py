"""Signed distances from walls, polygons and prisms: by certificates, by sampling, and beside the running code's."""

import numpy as np
import pytest
from builders.cores import drawn, places
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.base.arrays import Array
from airground_drake.model.geometry import convex, outline
from airground_drake.verify.engines import outlines
from airground_drake.verify.engines.geometry import ROWS
from airground_drake.verify.engines.outlines import (
    Cores,
    away_from,
    closest,
    least_distances,
    nearest_point,
    over_time,
    unpacked,
    within,
)

SEEDS = st.integers(0, 2**32 - 1)


def core_of(row: Array) -> Cores:
    return Cores.of(row[None]).take(0)


def corners_of(row: Array) -> Array:
    flat = row[9 : 9 + 2 * int(row[5])].reshape(-1, 2)
    return np.array([[*corner, height] for corner in flat for height in row[3:5]])


@examples(150)
@given(SEEDS, st.booleans())
def test_a_distance_is_that_of_the_nearest_point(seed: int, planar: bool) -> None:
    """The nearest point is in the core, and no corner lies beyond the plane through it: that is a proof."""
    rng = np.random.default_rng(seed)
    row = drawn(rng)
    corners, core = corners_of(row), core_of(row)
    for place in places(rng, 10, planar=planar and row[3] == 0.0):
        distance, normal = away_from(core, place, planar=planar)
        at = place - distance * normal
        assert np.linalg.norm(normal) == pytest.approx(1.0)
        assert ((corners - at) @ normal).max() <= 1e-12  # the core is behind the plane
        assert away_from(core, at, planar=planar).distance == pytest.approx(0.0, abs=1e-12)  # and reaches it
        if distance < 0.0:  # a ball of that radius about the place is in the core: no other plane is nearer
            turn = np.linspace(0.0, 2.0 * np.pi, 65)
            ring = np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
            inside = place + (1.0 - 1e-9) * abs(float(distance)) * np.concatenate([ring, np.zeros((2, 3))])
            inside[-2:, 2] += 0.0 if planar else (1.0 - 1e-9) * abs(float(distance)) * np.array([1.0, -1.0])
            assert (away_from(core, inside, planar=planar).distance < 0.0).all()


@examples(150)
@given(SEEDS, st.booleans())
def test_the_unit_vector_is_a_subgradient(seed: int, planar: bool) -> None:
    """dist(x + v) >= dist(x) + n.v, from inside, too."""
    rng = np.random.default_rng(seed)
    row = drawn(rng)
    start, end = places(rng, 20, planar=planar and row[3] == 0.0).reshape(2, 10, 3)
    here, there = (away_from(core_of(row), each, planar=planar) for each in (start, end))
    rate = ((end - start) * here.normal).sum(axis=1)
    assert (there.distance >= here.distance + rate - 1e-12).all()


@examples(100)
@given(SEEDS, st.booleans())
def test_the_running_code_measures_the_same(seed: int, planar: bool) -> None:
    rng = np.random.default_rng(seed)
    row = drawn(rng)
    some = places(rng, 10, planar=planar and row[3] == 0.0)
    found, away = away_from(core_of(row), some, planar=planar), np.empty(3)
    for place, distance, normal in zip(some, *found, strict=True):
        assert convex.nearest(row, *place, planar, away, np.inf) == pytest.approx(distance, abs=1e-12)
        np.testing.assert_allclose(away, normal, atol=1e-9)
    least = least_distances(core_of(row), some[:-1], some[1:], planar=planar)[0]
    np.testing.assert_allclose(convex.approaches(row, some[:-1], some[1:], planar)[0], least, atol=1e-8)


@examples(100)
@given(SEEDS, st.booleans())
def test_the_least_distance_along_a_motion_against_sampling(seed: int, planar: bool) -> None:
    rng = np.random.default_rng(seed)
    row, fine = drawn(rng), np.linspace(0.0, 1.0, 401)
    start, end = places(rng, 2, planar=planar and row[3] == 0.0)
    core, length = core_of(row), float(np.linalg.norm(end - start))
    (least,), (share,) = least_distances(core, start[None], end[None], planar=planar)
    sampled = away_from(core, start + fine[:, None] * (end - start), planar=planar).distance.min()
    assert sampled - length / 800.0 <= least <= sampled + 1e-12
    assert away_from(core, start + share * (end - start), planar=planar).distance == pytest.approx(least, abs=1e-12)


def test_the_way_out_through_the_top_is_for_those_who_fly() -> None:
    block = core_of(outline.prism([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]], top=3.0))
    inside, above = np.array([0.5, 0.0, 2.9]), np.array([0.0, 0.0, 4.0])
    assert away_from(block, inside, planar=False).distance == pytest.approx(-0.1)
    assert away_from(block, inside, planar=False).normal.tolist() == [0.0, 0.0, 1.0]
    assert away_from(block, inside, planar=True).distance == pytest.approx(-0.5)
    assert away_from(block, above, planar=False) == (1.0, pytest.approx([0.0, 0.0, 1.0]))
    slab = core_of(outline.prism([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]))  # flat
    assert away_from(slab, above, planar=False).distance == 4.0
    assert away_from(slab, np.array([0.5, 0.0, 0.0]), planar=True).distance == -0.5


@examples(40)
@given(SEEDS, st.sampled_from([1, 2, 5, ROWS, ROWS + 1, 2 * ROWS + 1, 150]), st.booleans())
def test_many_cores_along_a_way_are_those_of_each_core_at_each_row(seed: int, rows: int, planar: bool) -> None:
    """Boxes leave nothing out."""
    rng = np.random.default_rng(seed)
    shapes = [row for row in (drawn(rng) for _ in range(12)) if row[3] == 0.0 or not planar]
    many = outline.moved(
        outline.stacked(shapes), np.append(rng.uniform(-9.0, 9.0, (len(shapes), 2)), np.zeros((len(shapes), 1)), 1)
    )
    way = np.cumsum(rng.normal(0.0, 0.4, (rows, 3)), axis=0) * [1.0, 1.0, not planar]
    cores = Cores.of(many)
    each = np.array([away_from(cores.take(k), way, planar=planar).distance for k in range(len(many))])
    np.testing.assert_allclose(over_time(cores, way, planar=planar), each.min(axis=0), atol=1e-12)
    found = within(cores, way, 2.0, planar=planar)
    np.testing.assert_array_equal(np.column_stack([found.place, found.core]), np.argwhere(each.T <= 2.0))
    np.testing.assert_allclose(found.away.distance, each[found.core, found.place], atol=1e-12)
    nearest = closest(cores, way, planar=planar)
    if rows == 1:
        assert nearest.distance == pytest.approx(each.min())
        return
    least = np.array([
        least_distances(cores.take(k), way[:-1], way[1:], planar=planar)[0] for k in range(len(many))
    ])  # fmt: skip
    assert nearest.distance == pytest.approx(least.min(), abs=1e-12)
    assert least[:, nearest.row - 1].min() == pytest.approx(least.min(), abs=1e-12)
    at = way[nearest.row - 1] + nearest.share * (way[nearest.row] - way[nearest.row - 1])
    assert away_from(cores, at, planar=planar).distance.min() == pytest.approx(least.min(), abs=1e-9)
    place = nearest_point(cores, way[0], planar=planar)
    assert np.linalg.norm(way[0] - place) == pytest.approx(abs(each[:, 0].min()), abs=1e-12)


def test_outlines_of_a_trace_are_those_of_the_running_code() -> None:
    layout = ("GAP", "RADIUS", "SPEED", "BASE", "TOP", "COUNT", "MIDDLE", "EXTENT", "CORNERS")
    assert {name: getattr(outlines, name) for name in layout} == {name: getattr(outline, name) for name in layout}
    rows = outline.stacked([drawn(np.random.default_rng(k)) for k in range(8)])
    numbers = [number for row in rows for number in outline.as_tuple(row)]
    np.testing.assert_array_equal(unpacked(numbers), rows)
    for wrong in (numbers[:-1], [*numbers, 0.0], numbers[1:], [*numbers[:5], 0.5, *numbers[6:]]):
        with pytest.raises(ValueError, match="no outline"):
            unpacked(wrong)
