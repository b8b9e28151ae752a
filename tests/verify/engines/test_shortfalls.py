"""By how much positions miss the inequalities of set-based avoidance, exactly."""

from fractions import Fraction

import numpy as np
import pytest
from builders.cores import drawn
from builders.worlds import world
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.base.arrays import Array
from airground_drake.model.geometry import outline
from airground_drake.model.law.avoidance import Avoidance
from airground_drake.verify.engines import shortfalls as module
from airground_drake.verify.engines.outlines import Cores
from airground_drake.verify.engines.shortfalls import shortage, shortfalls

ONE, HALF, GAIN = Fraction(1), Fraction(1, 2), Fraction(3, 40)
D = 2.0


def along_x(*places: float) -> Array:
    return np.array([[x, 0.0, 0.0] for x in places])


@pytest.mark.parametrize(
    ("first", "second", "share", "last", "missed"),
    [
        # beside an obstacle
        ((2.0, 1.75), (0.0, 0.0), ONE, ONE, 0.25),  # a step of 0.25 m into the safe distance
        ((2.5, 2.0), (0.0, 0.0), ONE, ONE, 0.0),  # onto it
        ((2.5, 1.9375), (0.0, 0.0), ONE, ONE, 0.0625),
        ((1.0, 1.0), (0.0, 0.0), ONE, ONE, 0.075),  # no step back where A h times the deficit is due
        ((-1.0, -1.0625), (0.0, 0.0), ONE, ONE, 0.0125),
        ((0.0, 1.0), (0.0, 0.0), ONE, ONE, 0.075 * 2.0 + 1.0),  # on the obstacle no direction leads away
        ((9.0, 8.0), (0.0, 0.0), ONE, ONE, 0.0),  # far
        ((2.0, 2.0 - 2.0**-52), (0.0, 0.0), ONE, ONE, 2.0**-52),  # nothing is below the resolution
        # two robots, which together may come 0.5 m nearer
        ((2.5, 2.5), (0.0, 0.75), HALF, ONE, 0.5),
        ((2.5, 2.5), (0.0, 0.75), HALF / 2, ONE, 0.375),
        ((2.5, 3.5), (0.0, 0.75), HALF, ONE, 0.5),  # the other's step is no help
        ((2.5, 3.5), (0.0, -1.0), HALF, ONE, 0.0),
        ((3.0, 2.25), (0.0, 0.0), HALF, ONE, 0.0),  # too far to reach each other
        ((3.0, 2.25), (0.0, 0.5), HALF, ONE, 0.25),
        # the last period cut short
        ((2.0, 1.75), (0.0, 0.0), ONE, HALF, 0.5),
        ((3.0, 2.5), (0.0, 0.0), ONE, HALF, 0.0),
        ((3.0, 2.375), (0.0, 0.0), ONE, HALF, 0.25),
    ],
)
def test_what_a_step_misses(
    first: tuple[float, ...], second: tuple[float, ...], share: Fraction, last: Fraction, missed: float
) -> None:
    other = along_x(*second) if share < 1 else np.zeros(3)
    (found,) = shortfalls(along_x(*first), other, D, share, GAIN, last)
    assert found == pytest.approx(missed, abs=1e-15, rel=1e-15)
    assert (found == 0.0) == (missed == 0.0)


def test_a_distance_too_short_is_found_exactly() -> None:
    assert shortage(np.array([2.0 - 2.0**-52, 0.0, 0.0]), np.zeros(3), D) == Fraction(2) ** -52
    assert shortage(np.array([2.0, 0.0, 0.0]), np.zeros(3), D) == 0
    assert shortfalls(along_x(2.0, 2.0) + np.array([0.0, 1e-100, 0.0]), np.zeros(3), D, ONE, GAIN, ONE).tolist() == [
        0.0
    ]


SQUARE = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]


@pytest.mark.parametrize(
    ("row", "planar", "begin", "end", "missed"),
    [
        # a wall from (0, -4) to (0, 4), d = 2
        (outline.prism([[0.0, -4.0], [0.0, 4.0]]), True, (2.0, 1.0, 0.0), (1.75, 1.5, 0.0), 0.25),
        (outline.prism([[0.0, -4.0], [0.0, 4.0]]), True, (2.0, 1.0, 0.0), (2.0, 9.0, 0.0), 0.0),  # along it
        (outline.prism([[0.0, -4.0], [0.0, 4.0]]), True, (-1.0, 3.0, 0.0), (-1.0, 3.0, 0.0), 0.075),
        (outline.prism([[0.0, -4.0], [0.0, 4.0]]), True, (0.0, 6.0, 0.0), (0.0, 5.75, 0.0), 0.25),  # beside its end
        (outline.prism([[0.0, -4.0], [0.0, 4.0]]), True, (0.0, 1.0, 0.0), (0.0625, 1.0, 0.0), 0.0875),  # off it
        # a square
        (outline.prism(SQUARE), True, (3.0, 0.5, 0.0), (2.75, 0.5, 0.0), 0.25),
        (outline.prism(SQUARE), True, (4.0, 5.0, 0.0), (1.0, 1.0, 0.0), 5.0 - (5.0 - 2.0)),  # 5 m from its corner
        (outline.prism(SQUARE), True, (0.75, 0.0, 0.0), (0.75, 0.0, 0.0), 0.075 * 2.25),  # inside, 0.25 m deep
        (outline.prism(SQUARE), True, (0.75, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0),
        (outline.prism(SQUARE), True, (0.75, 0.0, 0.0), (0.5, 0.0, 0.0), 0.075 * 2.25 + 0.25),  # farther in
        (outline.prism(SQUARE), True, (0.75, 0.75, 0.0), (0.75, 1.0, 0.0), 0.0),  # either of two edges will do
        # a block 3 m high, from above
        (outline.prism(SQUARE, top=3.0), False, (0.0, 0.0, 5.0), (0.0, 0.0, 4.75), 0.25),
        (outline.prism(SQUARE, top=3.0), False, (0.0, 0.0, 2.75), (0.0, 0.0, 2.75), 0.075 * 2.25),
        (outline.prism(SQUARE, top=3.0), False, (4.0, 0.0, 7.0), (4.0, 0.0, 7.0), 0.0),
        (outline.prism(SQUARE), False, (0.0, 0.0, 5.0), (0.0, 0.0, 2.0), 0.0),  # flat: 5 m below
    ],
)  # fmt: skip
def test_what_a_step_beside_a_core_misses(
    row: Array, planar: bool, begin: tuple[float, ...], end: tuple[float, ...], missed: float
) -> None:
    core = Cores.of(row[None]).take(0)
    (found,) = shortfalls(np.array([begin, end]), np.zeros(3), D, ONE, GAIN, ONE, core, planar=planar)
    assert found == pytest.approx(missed, abs=1e-15, rel=1e-15)
    assert (found == 0.0) == (missed == 0.0)
    place = np.array([0.5, 0.25, 0.0])  # a core about another place
    ends = place + np.array([begin, end])
    assert shortfalls(ends, place, D, ONE, GAIN, ONE, core, planar=planar).tolist() == [found]


def test_a_distance_too_short_from_a_core_is_found_exactly() -> None:
    wall = Cores.of(outline.prism([[0.0, -4.0], [0.0, 4.0]])[None]).take(0)
    assert shortage(np.array([2.0 - 2.0**-52, 1.0, 0.0]), np.zeros(3), D, wall, planar=True) == Fraction(2) ** -52
    square = Cores.of(outline.prism(SQUARE, top=3.0)[None]).take(0)
    assert shortage(np.array([0.75, 0.0, 2.5]), np.zeros(3), D, square, planar=True) == Fraction(9, 4)
    assert shortage(np.array([0.0, 0.0, 2.75]), np.zeros(3), D, square, planar=False) == Fraction(9, 4)


@given(seed=st.integers(0, 2**32 - 1), planar=st.booleans())
def test_the_screen_hides_nothing_beside_a_core(seed: int, planar: bool) -> None:
    rng = np.random.default_rng(seed)
    core = Cores.of(drawn(rng)[None]).take(0)
    way = np.cumsum(rng.normal(0.0, 1.0, (40, 3)) * 10.0 ** rng.uniform(-13.0, 0.5, (40, 1)), axis=0)
    way = (way + np.append(core.corners[0], 0.0) + rng.normal(0.0, 1.0, 3)) * [1.0, 1.0, not planar]
    screened = shortfalls(way, np.zeros(3), D, ONE, GAIN, ONE, core, planar=planar)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "_doubtful", lambda first, *_, **__: np.arange(len(first) - 1))
        assert shortfalls(way, np.zeros(3), D, ONE, GAIN, ONE, core, planar=planar).tolist() == screened.tolist()


@given(seed=st.integers(0, 2**32 - 1), share=st.sampled_from([ONE, HALF]))
def test_the_screen_hides_nothing(seed: int, share: Fraction) -> None:
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-13.0, 0.5, (40, 1))
    first = np.cumsum(rng.normal(0.0, 1.0, (40, 3)) * size, axis=0) + np.array([D, 0.0, 0.0])
    second = np.zeros((40, 3)) if share == 1 else np.cumsum(rng.normal(0.0, 1.0, (40, 3)) * size, axis=0)
    screened = shortfalls(first, second, D, share, GAIN, ONE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "_doubtful", lambda first, *_, **__: np.arange(len(first) - 1))
        assert shortfalls(first, second, D, share, GAIN, ONE).tolist() == screened.tolist()


ROUNDING_M = 2e-14
"""Some roundings of coordinates of 10 m, each by 9e-16 m."""


@given(seed=st.integers(0, 2**32 - 1), planar=st.booleans())
def test_the_running_law_beside_a_core_misses_no_more_than_rounding(seed: int, planar: bool) -> None:
    """From outside and from inside, whatever is asked of it."""
    rng, h = np.random.default_rng(seed), 0.05
    row = drawn(rng, gap=0.5)
    core, avoidance = Cores.of(row[None]).take(0), Avoidance(gain=4.0, period=h, sensing_range=50.0)
    team = world(1, max_speed=2.0)
    near = team.around(slice(0, 1) if planar else slice(1, 2))
    near = near._replace(
        still=row[None], distance=np.full((1, 2), [0.5, -1e6]), share=np.ones((1, 2)), max_speed=np.array([2.0])
    )
    start = np.append(core.corners[0] + rng.normal(0.0, 1.5, 2), 0.0 if planar else rng.uniform(0.0, 4.0))
    places, path = np.array([start, start]), [start]
    for _ in range(30):
        wish = rng.normal(0.0, 3.0, (1, 3)) * near.mobility
        path.append(path[-1] + h * avoidance.command(wish, places, near)[0])
        places = np.array([path[-1], path[-1]])
    missed = shortfalls(np.array(path), np.zeros(3), 0.5, ONE, Fraction(4.0) * Fraction(h), ONE, core, planar=planar)
    assert missed.max() <= 10.0 * ROUNDING_M
