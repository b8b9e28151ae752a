"""What comes of accepting and of refusing, rolled out to the end."""

from dataclasses import replace

import numpy as np
import pytest
from builders.problems import LAW

from airground_drake.model.geometry.motion import Motion
from airground_drake.model.geometry.outline import balls, prism, stacked
from airground_drake.model.geometry.paths import shortest_path
from airground_drake.uav.policy import Proposal
from airground_drake.ugv.outcome import Outcome, Outlook, outcomes, robot_at, way_left
from airground_drake.ugv.rollout import View

LOOK = Outlook(longest=20.0)
Points = tuple[tuple[float, float], ...]


def situation(*discs: tuple[float, float], speed: float = 1.0, max_speed: float = 3.0) -> View:
    preset = Motion.at_speed(np.array([[0.0, 0.0, 0.0], [8.0, 0.0, 0.0]]), speed)
    still, one, nobody = balls([[x, y, 0.0] for x, y in discs]), np.ones(len(discs)), np.zeros((0, 3))
    return View(0.0, np.zeros(3), preset, still, still[:0], nobody, nobody, 2.0 * one, one, max_speed)


def along(*corners: tuple[float, float], speed: float = 2.0) -> Proposal:
    return Proposal("way", 0.0, Motion.at_speed(np.array([[x, y, 0.0] for x, y in corners]), speed))


ROUND = along((0.0, 0.0), (1.0, 3.5), (5.0, 3.5), (8.0, 0.0))
WALL = ((4.0, 1.0), (4.0, -1.0))
AWAY = Motion.at_speed(np.array([[4.0, 0.0, 0.0], [4.0, 9.0, 0.0]]), 2.0)


def beside(asked: tuple[Motion, bool] | None) -> View:
    place, point = np.array([[4.0, 0.0, 0.0]]), balls(np.zeros(3))
    moving = {"parts": point, "places": place, "velocities": 0.0 * place, "asked": (asked,)}
    return replace(situation(), **moving, distances=np.array([2.0]), shares=np.array([0.5]))


@pytest.mark.parametrize(
    ("scene", "proposal", "look", "stalls", "better"),
    [
        (situation(*WALL), ROUND, LOOK, [True, False], True),
        (situation(), ROUND, LOOK, [False, False], False),  # the own task gets there without a detour
        (situation(*WALL), along((0.0, 0.0), (0.01, 0.0)), LOOK, [True, True], False),  # to stay is no better
        (situation(*WALL, (3.0, 3.5)), ROUND, LOOK, [True, True], None),
        (situation(speed=0.02, max_speed=0.02), along((0.0, 0.0), (4.0, 1.0), (8.0, 0.0), speed=0.02), LOOK,
         [False, False], None),  # a slow robot that goes on
        (situation((2.5, 1.0), (2.5, -1.0), speed=0.04, max_speed=0.04),
         along((0.0, 0.0), (0.0, 4.0), (8.0, 4.0), speed=0.04), replace(LOOK, longest=60.0), [True, False], True),
        (beside(None), ROUND, LOOK, [True, False], True),
        (beside((AWAY, True)), ROUND, LOOK, [False, False], False),  # the other robot makes way
        (beside((AWAY, False)), ROUND, LOOK, [True, False], True),  # it has not accepted yet: no reason to refuse
    ],
)  # fmt: skip
def test_what_stalls_and_what_is_better(
    scene: View, proposal: Proposal, look: Outlook, stalls: list[bool], better: bool | None
) -> None:
    refuse, accept = outcomes(scene, LAW, proposal, look)
    assert [refuse.stalls, accept.stalls] == stalls
    assert better is None or accept.better_than(refuse) is better
    assert not refuse.better_than(accept) or not better
    assert np.isfinite([refuse.cost, accept.cost]).all()
    for outcome in (refuse, accept):
        assert len(outcome.positions) <= round((look.longest + look.past) / LAW.avoidance.period) + 1
        assert (outcome.left == 0.0) == (np.linalg.norm(outcome.end - [8.0, 0.0, 0.0]) <= look.near)


def test_the_cost_is_that_of_25_and_what_is_under_way_costs_the_way_left_as_well() -> None:
    """Squared distances to the preset trajectory, and the cost-to-go along the way left: L^3 / (3 v)."""
    scene, look = situation(speed=0.2, max_speed=1.0), Outlook(longest=4.0, past=2.0)
    for outcome in outcomes(scene, LAW, along((0.0, 0.0), (4.0, 0.0)), look):
        assert len(outcome.positions) == round(6.0 / LAW.avoidance.period) + 1  # however long the preset is
        t = LAW.avoidance.period * np.arange(1.0, len(outcome.positions))
        error = np.square(scene.preset.sample(t) - outcome.positions[1:]).sum()
        assert not outcome.stalls
        assert outcome.left == pytest.approx(8.0 - outcome.end[0])
        assert 1.0 < outcome.left < 7.5
        assert outcome.cost == pytest.approx(LAW.avoidance.period * error + outcome.left**3 / 0.6, rel=1e-9)


def test_another_robot_is_predicted_on_the_motion_that_it_is_asked_for() -> None:
    after = np.array([0.0, 1.0, 10.0])
    passing = replace(beside(None), velocities=np.array([[1.0, 0.0, 0.0]]))
    np.testing.assert_allclose(robot_at(passing, 0, after, 3.0, together=True)[:, 0], [4.0, 5.0, 7.0])
    off = replace(beside((AWAY, True)), places=np.array([[3.0, 0.0, 0.0]]))
    np.testing.assert_allclose(robot_at(off, 0, after, 3.0, together=False)[:, 0], 4.0 - np.exp(-after))


AROUND = 2.0 * np.sqrt(12.0) + 2.0 * np.pi / 3.0
FAR = tuple((x, y) for x in range(-50, 50, 5) for y in (40.0, 50.0, 60.0))


@pytest.mark.parametrize(
    ("x", "discs", "radius", "left"),
    [
        (0.0, (), 2.0, 8.0),
        (0.0, ((4.0, 2.0),), 2.0, 8.0),
        (4.0, ((4.0, 0.0),), 2.0, 4.0),  # straight from inside a disc, and without any way
        (0.0, ((8.0, 0.0),), 2.0, 8.0),
        (0.0, ((4.0, 0.0),), 2.0, AROUND),
        (0.0, ((4.0, 0.0),), 3.0, 2.0 * np.sqrt(7.0) + 6.0 * (np.pi / 2.0 - np.arccos(0.75))),
        (0.0, ((4.0, 0.0), (4.0, 9.0)), (2.0, 5.0), AROUND),
        (0.0, (*FAR, (4.0, 0.0)), 2.0, AROUND),
    ],
)
def test_the_way_left(x: float, discs: Points, radius: float | tuple[float, ...], left: float) -> None:
    rows = balls([[*disc, 0.0] for disc in discs])
    reach = np.broadcast_to(radius, len(rows))
    found = way_left(np.array([x, 0.0, 0.0]), np.array([8.0, 0.0, 0.0]), rows, reach)
    assert found == pytest.approx(left)


@pytest.mark.parametrize("place", [(0.0, 0.0), (-1.0, 1.0), (3.6, -1.5), (2.0, 2.0)])
def test_among_very_many_walls_the_one_that_matters_counts(place: tuple[float, float]) -> None:
    """Sixty far walls come first, sixty short ones lie nearer to the straight way than the last wall, across it."""
    far = [prism([[x, y], [x + 1.0, y]]) for x in range(-20, 20, 2) for y in (30.0, 32.0, -30.0)]
    beside = [prism([[x, y], [x + 0.05, y]]) for x in np.arange(0.5, 8.0, 0.25) for y in (0.8, -0.8)]
    rows = stacked([*far, *beside, prism([[4.0, -3.0], [4.0, 5.0]])])
    keep, here, goal = np.full(len(rows), 0.3), np.array([*place, 0.0]), np.array([8.0, 0.0, 0.0])
    exact = shortest_path(here[:2], goal[:2], rows, keep).length_m
    assert way_left(here, goal, rows, keep) == pytest.approx(exact, rel=0.03)
    assert way_left(here, goal, rows[:-1], keep[:-1]) < exact - 0.5


def test_a_ball_above_the_way_takes_up_the_circle_in_which_it_meets_the_plane() -> None:
    left = way_left(np.zeros(3), np.array([8.0, 0.0, 0.0]), balls([[4.0, 0.0, 1.5], [4.0, 0.0, 2.6]]), np.full(2, 2.5))
    assert left == pytest.approx(AROUND)


def test_outcomes_are_compared_by_stalling_first() -> None:
    still = np.zeros((1, 3))
    home, far, near = Outcome(still, False, 0.0, 100.0), Outcome(still, True, 2.0, 9.0), Outcome(still, True, 1.0, 1.0)
    assert home.better_than(far)
    assert not far.better_than(home)
    assert near.better_than(far)
    assert not near.better_than(replace(near, cost=near.cost * (1.0 + 1e-7)))
