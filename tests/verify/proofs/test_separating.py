"""Vectors that separate: they are exact, they exist wherever a distance is kept, and few are enough for what is far."""

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.model.geometry import convex, outline
from airground_drake.verify.proofs.separating import Prism, Vector, apart, separating

M = 2**20
"""Parts of a metre."""
BOX = Prism(((0, 0), (2 * M, 0), (2 * M, M), (0, M)))


def parts(*places: tuple[float, ...]) -> list[Vector]:
    return [(round(x * M), round(y * M), round(z[0] * M) if z else 0) for x, y, *z in places]


@st.composite
def prisms(draw: st.DrawFn) -> Prism:
    x, y, a, b = (draw(st.integers(-3 * M, 3 * M)) for _ in range(4))
    a, b = a or M, b or M
    turns = (0, 1, 2, 3)[: draw(st.integers(1, 4))]
    corners = [(x, y), (x + a, y + b), (x + a - b, y + b + a), (x - b, y + a)]  # a square, counter-clockwise
    return Prism(tuple(corners[k] for k in turns), 0, draw(st.sampled_from((0, M, 3 * M))))


PLACES = st.tuples(*[st.integers(-6 * M, 6 * M)] * 2, st.sampled_from((0, 0, M, 2 * M, 4 * M)))
WAYS = st.lists(PLACES, min_size=2, max_size=8)


@given(prisms(), PLACES, PLACES)
def test_the_exact_distance_of_a_straight_way_is_that_of_the_law_and_its_vector_shows_it(
    prism: Prism, begin: Vector, end: Vector
) -> None:
    square, vector = apart(prism, begin, end)
    row = outline.prism(np.array(prism.outline) / M, top=prism.top / M)
    places = np.linspace(np.array(begin, dtype=float), np.array(end, dtype=float), 400) / M
    sampled = min(convex.nearest(row, *place, False, np.empty(3), np.inf) for place in places)
    known = convex.approach(row, places[0], places[-1], False)[0]
    assert math.sqrt(square) / M == pytest.approx(max(known, 0.0), abs=1e-6)
    assert math.sqrt(square) / M <= max(sampled, 0.0) + 1e-9
    if square:
        reach = min(dot(vector, begin), dot(vector, end)) - max(dot(vector, corner) for corner in prism.corners)
        assert reach > 0
        assert Fraction(reach**2, dot(vector, vector)) == square


def dot(a: Vector, b: Vector) -> int:
    return sum(x * y for x, y in zip(a, b, strict=True))


@given(prisms(), WAYS, st.floats(0.1, 3.0), st.booleans())
def test_vectors_separate_all_of_the_way_wherever_the_distance_is_kept(
    prism: Prism, way: list[Vector], safe_m: float, touching: bool
) -> None:
    squares = [apart(prism, begin, end)[0] for begin, end in pairwise(way)]
    safe = math.isqrt(math.floor(min(squares))) if touching else round(safe_m * M)  # the largest that is kept
    [stretches] = separating([prism], way, safe)
    assert sum(periods for periods, _ in stretches) == len(way) - 1
    assert all(periods > 0 for periods, _ in stretches)
    row, wrong = 0, False
    for periods, vector in stretches:
        along = max(dot(vector, corner) for corner in prism.corners)
        reaches = [dot(vector, place) - along for place in way[row : row + periods + 1]]
        wrong |= not any(vector) or min(reaches) < 0 or min(reaches) ** 2 < safe**2 * dot(vector, vector)
        row += periods
    assert wrong is (min(squares) < safe**2 or safe == 0 == min(squares))


def test_a_way_along_an_edge_and_round_a_corner_keeps_its_distance_to_the_last_part() -> None:
    quarter = [math.pi / 2 * k / 50 for k in range(51)]
    way = [
        *parts(*((-1 + 3 * k / 50, 1.5) for k in range(50))),
        *parts(*((2 + 0.5 * math.sin(turn), 1 + 0.5 * math.cos(turn)) for turn in quarter)),
        *parts(*((2.5, 1 - k / 50) for k in range(1, 100))),
    ]
    safe = math.isqrt(math.floor(min(apart(BOX, one, other)[0] for one, other in pairwise(way))))
    [kept] = separating([BOX], way, safe)
    assert [kept[0][1], kept[-1][1]] == [(0, 1, 0), (1, 0, 0)]  # the normals of both edges
    assert len(kept) <= 52


def test_one_short_vector_is_enough_for_a_run_far_away() -> None:
    way = parts(*((5 + math.sin(k / 30), 4 + k / 200, 1.0) for k in range(600)))
    [[(periods, vector)]] = separating([BOX], way, M)
    assert periods == 599
    assert max(map(abs, vector)) <= 16
