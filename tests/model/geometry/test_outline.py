"""Outlines as rows of numbers, and which of them are near: against distances in numpy and by counting."""

from collections.abc import Callable

import numpy as np
import pytest
from builders.cores import drawn, places
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.base.arrays import Array
from airground_drake.model.geometry import convex, outline
from airground_drake.model.geometry.outline import BASE, COUNT, EXTENT, GAP, MIDDLE, RADIUS, TOP
from airground_drake.verify.engines.outlines import Cores, away_from, closest, unpacked

SEEDS = st.integers(0, 10**6)
TRIANGLE = outline.prism([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]], base=0.5, top=2.0, radius=0.25, gap=0.75)


def distances(rows: Array, some: Array, *, planar: bool) -> Array:
    return away_from(Cores.of(rows), some[:, None], planar=planar).distance


def many(rng: np.random.Generator, count: int = 5) -> Array:
    rows = outline.stacked(drawn(rng) for _ in range(count))
    rows[:, GAP], rows[:, RADIUS] = rng.uniform(0.1, 1.0, (2, count))
    return rows


def test_the_numbers_of_an_outline() -> None:
    expected = [0.75, 0.25, 0.0, 0.5, 2.0, 3.0, 1.0, 0.5, 1.25**0.5, 0.0, 0.0, 2.0, 0.0, 0.0, 1.0]
    np.testing.assert_allclose(TRIANGLE, expected, rtol=1e-14)
    assert TRIANGLE[EXTENT] >= np.hypot(1.0, 0.5)
    (ball,) = outline.balls([1.0, 2.0, 3.0], radii=0.5, gap=0.25)
    np.testing.assert_array_equal(ball, [0.25, 0.5, 0.0, 3.0, 3.0, 1.0, 1.0, 2.0, 0.0, 1.0, 2.0])
    np.testing.assert_array_equal(outline.keep(outline.stacked([TRIANGLE, ball]), 1.0), [2.0, 1.75])


@examples(50)
@given(SEEDS)
def test_outlines_are_sent_without_padding_and_come_back(seed: int) -> None:
    rows = many(np.random.default_rng(seed))
    back = unpacked([number for row in rows for number in outline.as_tuple(row)])
    np.testing.assert_array_equal(back, rows)
    np.testing.assert_array_equal(outline.joined(rows[:2], rows[2:]), rows)
    assert outline.is_among(rows, back).all()
    assert not outline.is_among(outline.moved(rows, np.full(3, 100.0)), back).any()
    assert outline.are_outlines(rows).all()


def spoilt(column: int, value: float) -> Array:
    row = TRIANGLE.copy()
    row[column] = value
    return row


STAR = np.array([[np.cos(turn), np.sin(turn)] for turn in 0.8 * np.pi * np.arange(5)])
"""Turns left at each corner, and goes round twice."""
STRANGE: dict[str, Array] = {
    **{f"{column} is not a number": spoilt(column, np.nan) for column in range(len(TRIANGLE))},
    **{f"{name} below 0": spoilt(column, -1.0) for name, column in (("gap", GAP), ("radius", RADIUS), ("speed", 2))},
    "upside down": spoilt(BASE, TRIANGLE[TOP] + 1.0),
    "no corner": spoilt(COUNT, 0.0),
    "a share of a corner": spoilt(COUNT, 2.5),
    "more corners than numbers": spoilt(COUNT, 4.0),
    "a circle that is too small": spoilt(EXTENT, 1.0),
    "a circle elsewhere": spoilt(MIDDLE, 9.0),
    "clockwise": outline.prism([[0.0, 0.0], [0.0, 1.0], [2.0, 0.0]]),
    "twice around": outline.prism(STAR),
    "a corner twice": outline.prism([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
    "a wall without length": outline.prism([[1.0, 1.0], [1.0, 1.0]]),
    "no area": outline.prism([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]),
    "a dent": outline.prism([[0.0, 0.0], [2.0, 0.0], [0.5, 0.5], [0.0, 2.0]]),
}


@pytest.mark.parametrize("name", STRANGE)
def test_what_a_stranger_sends_is_not_taken_for_an_outline(name: str) -> None:
    rows = outline.stacked([TRIANGLE, STRANGE[name], outline.balls(np.zeros(3))[0]])
    assert outline.are_outlines(rows).tolist() == [True, False, True]


def test_rows_that_are_too_short_are_no_outlines() -> None:
    assert outline.are_outlines(np.zeros((2, 10))).tolist() == [False, False]
    assert outline.are_outlines(outline.balls(np.zeros((2, 3)))).tolist() == [True, True]


@examples(50)
@given(SEEDS)
def test_outlines_are_moved_with_all_that_belongs_to_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows, some = many(rng), places(rng, 8, planar=False)
    by = rng.normal(size=(len(rows), 3))
    moved = outline.moved(rows, by)
    for k, shift in enumerate(by):
        there, here = (
            distances(moved[k, None], some + shift, planar=False),
            distances(rows[k, None], some, planar=False),
        )
        np.testing.assert_allclose(there, here, atol=1e-12)
    np.testing.assert_array_equal(outline.moved(rows, by[0]), outline.moved(rows, np.tile(by[0], (len(rows), 1))))


@examples(50)
@given(SEEDS)
def test_a_box_holds_all_and_no_more(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = many(rng, 3)
    low, high = outline.box(rows)
    reach = rows[:, EXTENT] + rows[:, RADIUS]
    np.testing.assert_array_equal(low[:2], (rows[:, MIDDLE:EXTENT] - reach[:, None]).min(axis=0))
    np.testing.assert_array_equal(high[:2], (rows[:, MIDDLE:EXTENT] + reach[:, None]).max(axis=0))
    some = places(rng, 200, planar=False)
    inside = (distances(rows, some, planar=False) <= rows[:, RADIUS]).any(axis=1)
    assert ((low <= some[inside]) & (some[inside] <= high)).all()
    assert (low[2], high[2]) == ((rows[:, BASE] - rows[:, RADIUS]).min(), (rows[:, TOP] + rows[:, RADIUS]).max())


@examples(50)
@given(SEEDS, st.floats(-1.0, 4.0), st.floats(0.1, 2.0))
def test_a_section_is_what_a_plane_cuts_out(seed: int, height: float, reach: float) -> None:
    """A place at that height is within reach of a core if, and only if, it is in its section."""
    rng = np.random.default_rng(seed)
    rows, some = many(rng), places(rng, 40, planar=True)
    cut, keep = outline.sections(rows, reach, height)
    assert (cut[:, [BASE, TOP]] == 0.0).all()
    near = (distances(cut, some, planar=True) < keep).any(axis=1)
    margin = distances(rows, some + np.array([0.0, 0.0, height]), planar=False) - reach
    sure = (np.abs(margin) > 1e-9).all(axis=1)
    assert (near == (margin < 0.0).any(axis=1))[sure].all()


@examples(50)
@given(SEEDS, st.floats(0.1, 2.0))
def test_a_rim_is_the_boundary(seed: int, reach: float) -> None:
    row = drawn(np.random.default_rng(seed))
    row[BASE] = row[TOP] = 0.0
    around = outline.rim(row, reach)
    flat = np.column_stack([around, np.zeros(len(around))])
    np.testing.assert_allclose(distances(row[None], flat, planar=True), reach, atol=1e-9)
    x, y = (around - row[MIDDLE:EXTENT]).T
    turned = np.unwrap(np.arctan2(y, x), period=2.0 * np.pi)
    assert (np.diff(turned) >= -1e-12).all()  # counter-clockwise
    assert turned[-1] - turned[0] < 2.0 * np.pi
    assert np.diff(turned).max() < np.pi  # and all around
    steps = np.linalg.norm(np.diff(around, axis=0), axis=1)
    assert steps.max() <= max(np.linalg.norm(edge) for edge in _edges(row)) + 0.5 * np.pi * reach


def _edges(row: Array) -> Array:
    corners = outline.corners_of(row)
    return corners - np.roll(corners, 1, axis=0)


def test_what_is_not_there_is_beyond_any_range() -> None:
    rows = outline.stacked([TRIANGLE, outline.balls(np.zeros(3))[0]])
    left = outline.where(np.array([False, True]), rows)
    assert left.shape == rows.shape
    assert convex.distances(left, np.zeros(3), True).tolist() == [pytest.approx(3.0**0.5 * outline.NOWHERE_M), 0.0]


REACHES = (0.0, 0.7, 2.0)


@examples(50)
@given(SEEDS, st.booleans(), st.sampled_from(REACHES))
def test_what_is_within_reach(seed: int, planar: bool, reach: float) -> None:
    rng = np.random.default_rng(seed)
    rows, some = many(rng), places(rng, 6, planar=planar)
    apart = distances(rows, some, planar=planar)
    found = convex.within(rows, some, reach, planar)
    sure = np.abs(apart - reach) > 1e-9
    assert (found == (apart <= reach))[sure].all()
    assert not convex.news_within(rows, some, reach, planar, found)
    for i, k in np.argwhere(found).tolist():
        known = found.copy()
        known[i, k] = False
        assert convex.news_within(rows, some, reach, planar, known)
    many_bounds = [convex.may_be_within(rows, k, *place[:2], reach) for place in some for k in range(len(rows))]
    assert (found.ravel() <= np.array(many_bounds)).all()


@examples(50)
@given(SEEDS)
def test_nearest_points_are_in_the_core_and_that_far_away(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows, some = many(rng), places(rng, 6, planar=True)
    near, apart = convex.nearest_points(rows, some), distances(rows, some, planar=True)
    for k, row in enumerate(rows):
        flat = near[:, k].copy()
        flat[:, 2] = row[BASE]
        assert (np.abs(distances(row[None], flat, planar=True)) <= 1e-9).all()
        np.testing.assert_allclose(
            np.linalg.norm(near[:, k] - some, axis=1) if row[COUNT] == 1.0 else
            np.linalg.norm(near[:, k, :2] - some[:, :2], axis=1), np.abs(apart[:, k]), atol=1e-9,
        )  # fmt: skip


Clear = Callable[[Array, Array, Array, Array], Array]
FREE: dict[str, Clear] = {
    "clears": lambda begin, end, rows, keep: np.array([
        all(convex.clears(row, far, *a, *b) for row, far in zip(rows, keep.tolist(), strict=True))
        for a, b in zip(begin, end, strict=True)
    ]),
    **{
        f"no blocker, first tried {first}": lambda begin, end, rows, keep, first=first: np.array([
            convex.blocker(*a, *b, rows, keep, first) < 0 for a, b in zip(begin, end, strict=True)
        ]) for first in (-1, 0, 3)
    },
    "what is in the way": lambda begin, end, rows, keep: np.array([
        not convex.in_the_way(a[None], b[None], np.zeros(1), rows, keep).any() for a, b in zip(begin, end, strict=True)
    ]),
}  # fmt: skip


@pytest.mark.parametrize("name", FREE)
@examples(12)
@given(SEEDS)
def test_segments_that_keep_clear(name: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = outline.stacked(drawn(rng) for _ in range(4))
    rows[:, [BASE, TOP]] = 0.0
    begin, end = rng.uniform(-5.0, 5.0, (2, 12, 2))
    end[:4] = begin[:4] + 0.3 * rng.normal(size=(4, 2))
    keep, cores = rng.choice([0.0, 0.3, 1.0], len(rows)), Cores.of(rows)
    ways = np.stack([np.column_stack([each, np.zeros(len(each))]) for each in (begin, end)], axis=1)
    least = np.array([[closest(cores.take([k]), way, planar=True)[0] for k in range(len(rows))] for way in ways])
    margin = least - keep
    sure = (np.abs(margin) > 1e-7).all(axis=1)
    found = FREE[name](begin, end, rows, keep)
    assert (found == (margin > 0.0).all(axis=1))[sure].all()
