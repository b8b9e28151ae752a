"""Distances and shortfalls of the checker against closed forms."""

from fractions import Fraction
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pandas as pd
import pytest

from airground_drake.check import events, safety
from airground_drake.check.plants import Way
from airground_drake.check.rules import Disagreement
from airground_drake.check.run import Run
from airground_drake.check.scenario import Pair
from airground_drake.check.shapes import Shape, shape_of

PERIOD_S, GAIN_1_S, SAFE_M = 0.25, 2.0, 2.0
"""Binary fractions, so that A h = 1/2 and the positions below are exact."""
BODY = {"position_m": [0.0, 0.0, 0.0], "heading_rad": 0.0, "height_m": 0.0, "segment_m": [], "polygon_m": []}


def run(way_m: list[float], speed_m_s: float = 0.0, *, ahead_m: float = 0.0, cover_m: float = 0.0) -> Run:
    """A robot that moves along x towards a rock at the origin, one place per control sample; the rock may move."""
    # ahead_m: how much farther from the rock the point is that the law steers
    t = PERIOD_S * np.arange(len(way_m))
    own = np.column_stack([way_m, np.zeros(len(t)), np.zeros(len(t))])
    pair = Pair("ugv1", "rock", SAFE_M, 0.0, 1.0 + speed_m_s, 1.0, moves_m_s=speed_m_s, more_m=cover_m, cover_m=cover_m)
    places = {"ugv1": own, "rock": np.zeros((len(t), 3))}
    found = SimpleNamespace(
        t_s=t, sample_row=np.arange(len(t) - 1), pairs=[pair], apart_m={("ugv1", "rock"): 0.0},
        position_m=places | {"ugv1": own + np.array([ahead_m, 0.0, 0.0])}, body_m=places, bent_m=lambda _: 0.0,
        apart=lambda _: own - places["rock"],
        ways={name: Way(t, place) for name, place in places.items()},
        period_rows=lambda _: np.arange(len(t)), there=lambda _: slice(0, len(t)), robots={"ugv1": {}},
        links={"delay_s": 0.0, "loss": 0.0},
        scenario={
            "control": {"period_s": PERIOD_S, "avoidance_gain_1_s": GAIN_1_S},
            "obstacles": {"rock": {"moves": None, "max_speed_m_s": speed_m_s}},
        },
    )  # fmt: skip
    return cast("Run", cast("Any", found))


@pytest.mark.parametrize(
    ("short_m", "status"), [(0.0, "holds"), (5e-10, "holds"), (2e-9, "refuted"), (0.01, "refuted")]
)
def test_a_distance_that_is_short_refutes(short_m: float, status: str) -> None:
    found = safety.safe_trace(run([3.0, 2.0 - short_m, 2.5]))
    assert found.status == status
    assert found.margin == pytest.approx(-short_m, abs=1e-15)


def test_a_pair_that_stays_far_has_its_margin() -> None:
    far = run([10.0, 9.0])
    far.apart_m["ugv1", "rock"] = 8.9
    assert safety.safe_trace(far).margin == 9.0 - SAFE_M


@pytest.mark.parametrize(
    ("way_m", "missed_m"),
    [
        ([3.0, 2.0], 0.0),  # exactly the bound: the safe distance is reached
        ([3.0, 1.75], 0.25),  # beyond it
        ([1.0, 1.5], 0.0),  # inside, A h (d - D) = 1/2 back is demanded
        ([1.0, 1.25], 0.25),
        ([1.0, 0.75], 0.75),
        ([10.0, 9.0], 0.0),  # far
    ],
)
def test_the_shortfall_is_what_the_inequality_lacks(way_m: list[float], missed_m: float) -> None:
    approach = run(way_m)
    found = safety.shortfall_m(*approach.position_m.values(), approach.pairs[0], Fraction(1, 2))
    assert abs(found - Fraction(missed_m)) < Fraction(1, 2**100)


PASSIVE = [
    ([3.0, 2.25], 0.0),  # d + V h is reached
    ([3.0, 2.0], 0.25),
    ([2.0, 2.0], 0.0),  # nearer, it need not retreat
    ([2.0, 1.75], 0.25),
    ([1.0, 1.5], 0.0),
    ([1.0, -3.0], 4.0),  # through it
    ([0.0, 0.5], 0.5),  # from its place no direction is away
    ([4.0, 3.0], 0.0),
]
"""Beside a rock that may move at 1 m/s: d + V h is 2.25 m."""


@pytest.mark.parametrize(("way_m", "missed_m"), PASSIVE)
def test_beside_what_may_move_a_robot_lacks_what_it_comes_nearer(way_m: list[float], missed_m: float) -> None:
    """Wherever that went meanwhile."""
    beside = run(way_m, 1.0)
    own, gone = beside.position_m["ugv1"], np.array([[0.0, 0.0, 0.0], [0.0, 5.0, 0.0]])
    found = safety.shortfall_m(own, gone, beside.pairs[0].passive(PERIOD_S), Fraction())
    assert abs(found - Fraction(missed_m)) < Fraction(1, 2**100)


@pytest.mark.parametrize(
    ("way_m", "margin_m", "tests"),
    [
        ([3.0, 2.5], None, 0),  # too far for a period to matter: 1 m/s and V are 0.5 m
        ([3.0, 2.25], 0.0, 0),  # but its step does
        ([2.625, 2.25], 0.0, 1),
        ([2.625, 2.0], -0.25, 1),
        ([2.0, 2.0], 0.0, 1),
        ([2.0, 1.75, 1.5], -0.25, 2),
        ([1.0, -3.0], -1.0, 1),
        ([1.0, 1.5, 2.5, 2.625, 3.0], 0.0, 4),
        ([2.5, 2.625, 3.0], 0.375, 2),  # the second step is long enough
    ],
)
def test_own_doing_is_what_is_lost_of_the_distance_at_the_sample(
    way_m: list[float], margin_m: float | None, tests: int
) -> None:
    found = safety.safe_own(run(way_m, 1.0))
    assert found is not None
    assert found.exercised == (tests, tests)
    assert found.status == ("holds" if margin_m is None or margin_m >= 0.0 else "refuted")
    assert found.margin == (margin_m if margin_m is None else pytest.approx(margin_m, abs=1e-12))


@pytest.mark.parametrize(
    ("way_m", "ahead_m", "margin_m"),
    [
        ([1.0, 1.0], 0.75, 0.0),  # it is nearer than the point less the cover, and may stay so
        ([1.0, 0.75], 0.0, 0.25),  # within the cover
        ([2.125, 1.9375], -0.25, -0.0625),  # having been apart, it may not come nearer than d
    ],
)
def test_own_doing_of_a_body_off_the_steered_point(way_m: list[float], ahead_m: float, margin_m: float) -> None:
    found = safety.safe_own(run(way_m, 1.0, ahead_m=ahead_m, cover_m=0.5))
    assert found is not None
    assert found.margin == pytest.approx(margin_m, abs=1e-12)


@pytest.mark.parametrize(("robots", "margin_m"), [(["ugv1"], 3.0 - 2.25), (["ugv1", "rock"], 1.5 - 2.25)])
def test_of_two_robots_each_is_asked(robots: list[str], margin_m: float) -> None:
    """The other one comes nearer while the first one stands."""
    beside = run([3.0, 3.0], 1.0)
    beside.robots.update({name: {} for name in robots})
    beside.position_m["rock"][1, 0] = 1.5
    found = safety.safe_own(beside)
    assert found is not None
    assert found.margin == pytest.approx(margin_m, abs=1e-12)


def test_own_doing_is_not_asked_where_nothing_may_move() -> None:
    assert safety.safe_own(run([3.0, 1.0])) is None


WALL = shape_of(BODY | {"segment_m": [[-9.0, 0.0], [1.0, 0.0], [1.0, 9.0]]}, endless=True)
BALL = shape_of(BODY | {"position_m": [0.0, 0.0, 3.0], "size_m": []}, endless=True)
BLOCK = shape_of(BODY | {"size_m": [2.0, 2.0], "height_m": 8.0}, endless=False)


@pytest.mark.parametrize(
    ("shape", "here", "there", "missed_m"),
    [
        (WALL, [-8.0, -2.0, 0.0], [-7.0, -2.0, 0.0], 0.0),  # along it, at the safe distance
        (WALL, [-8.0, -2.0, 0.0], [-7.0, -1.75, 0.0], 0.25),
        (WALL, [-12.0, -4.0, 0.0], [-9.6, -0.8, 0.0], 1.0),  # 4 m towards an end that is 5 m away
        (WALL, [-1.5, 3.0, 7.0], [-0.5, 2.25, 7.0], 0.5),  # of its two parts the second one misses more
        (BLOCK, [0.5, 0.25, 4.0], [0.75, 0.0, 4.0], 1.0),  # inside, 0.5 m from the face on the right
        (BLOCK, [0.0, 0.0, 4.0], [0.5, 0.0, 4.0], 1.0),  # 1 m from each of the four faces: 1.5 m in its direction
        (BLOCK, [0.0, 0.0, 7.875], [0.0, 0.0, 8.0], 0.9375),  # inside, below the top
        (BLOCK, [0.5, 0.0, 10.5], [0.0, 0.0, 9.5], 0.5),  # above it
        (BLOCK, [3.25, 0.0, 11.0], [1.75, 0.0, 9.0], 0.75),  # 2.5 m straight towards the edge at the top, 3.75 m away
        (BALL, [4.0, 0.0, 0.0], [0.0, 0.0, 0.0], 0.2),  # 3.2 m towards a centre that is 5 m away, higher up
    ],
)
def test_the_shortfall_beside_a_wall(shape: Shape, here: list[float], there: list[float], missed_m: float) -> None:
    own = np.array([here, there])
    pair = Pair("uav", "wall", SAFE_M, 0.0, 1.0, 1.0, shape)
    assert float(safety.shortfall_m(own, 0.0 * own, pair, Fraction(1, 2))) == pytest.approx(missed_m, abs=1e-12)


@pytest.mark.parametrize(("step_m", "status"), [(2.0**-32, "holds"), (0.53e-9, "refuted")])
def test_all_of_a_shortfall_counts(step_m: float, status: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A step into the safe distance costs e / (A h); 1e-9 m are allowed."""
    for rule in ("_constants", "_motion"):
        monkeypatch.setattr(safety, rule, lambda run: None)
    found = safety.safe_hyp(run([2.0, 2.0 - step_m]))
    assert (found.status, found.margin) == (status, -2.0 * step_m if status == "holds" else None)


def without_message(apart_m: float, error_m: float) -> None:
    """Two UGVs of 1 and 2 m/s that keep 1 m drive; at the second sample, one has missed the other's message."""
    run = SimpleNamespace(
        links={"loss": 0.5}, scenario={"control": {"period_s": 0.1}}, pairs=[Pair("a", "b", 1.0, 0.0, 3.0, 0.5)],
        ugvs=["a", "b"], robots={"a": {"max_speed_m_s": 1.0}, "b": {"max_speed_m_s": 2.0}}, error_m=error_m,
        sample_s=np.array([0.0, 0.1]), sampled=lambda *_: np.ones((2, 3)),
        samples=pd.DataFrame({"a.heard_b_s": [0.0, 0.0], "b.heard_a_s": [0.0, 0.1]}),
        seen_m=lambda robot: np.tile([apart_m if robot == "b" else 0.0, 0.0, 0.0], (2, 1)),
    )  # fmt: skip
    safety._without_message(cast("Any", run))


@pytest.mark.parametrize("error_m", [0.0, 0.1])
def test_a_ugv_may_drive_without_a_message_of_one_that_cannot_be_near(error_m: float) -> None:
    least_m = 1.0 + 2.0 * error_m + 0.2 + 0.3  # it may have moved for a period, and both move for another
    without_message(least_m + 1e-6, error_m)
    with pytest.raises(Disagreement):
        without_message(least_m - 1e-6, error_m)


def test_a_robot_that_arrives_as_it_collides_has_not_arrived() -> None:
    place = np.array([[9.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    spec = {"r": {"target_m": [0.0, 0.0, 0.0]}}
    run = SimpleNamespace(
        t_s=np.arange(3.0), position_m={"r": place}, robots=spec, scenario={"arrival_tolerance_m": 1.0}
    )
    for hit_s, arrivals in ((2.0, 0), (2.5, 1)):
        assert len([*events._arrivals(cast("Any", run), [events.Event(hit_s, "r", "collision", "wall")])]) == arrivals
