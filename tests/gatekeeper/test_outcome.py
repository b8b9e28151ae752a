"""What comes of accepting and of refusing, rolled out to the end."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from airground_drake.gatekeeper.outcome import Outcome, Outlook, outcomes, robot_at, way_left
from airground_drake.gatekeeper.rollout import View
from airground_drake.geometry.motion import Motion
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc.avoidance import Avoidance
from airground_drake.nsbc.law import UgvLaw

LAW = UgvLaw(Avoidance(3.0, 0.05, 4.0), 2.0, 1.5, intervention_on_top=False)
LOOK = Outlook(longest=20.0)


def situation(*discs: tuple[float, float]) -> View:
    """A UGV at the origin that is to go to (8, 0), and discs of 2 m."""
    preset = Motion.at_speed(np.array([[0.0, 0.0, 0.0], [8.0, 0.0, 0.0]]), 1.0)
    centres, one = np.array([[x, y, 0.0] for x, y in discs]).reshape(-1, 3), np.ones(len(discs))
    return View(0.0, np.zeros(3), preset, centres, 0.0 * centres, 2.0 * one, one, 3.0)


def along(*corners: tuple[float, float], speed: float = 2.0) -> Proposal:
    return Proposal("way", 0.0, Motion.at_speed(np.array([[x, y, 0.0] for x, y in corners]), speed))


ROUND = along((0.0, 0.0), (1.0, 3.5), (5.0, 3.5), (8.0, 0.0))


def test_a_way_round_a_wall_is_better_than_standing_in_front_of_it() -> None:
    scene = situation((4.0, 1.0), (4.0, -1.0))
    refuse, accept = outcomes(scene, LAW, ROUND, LOOK)
    assert refuse.stalls
    assert not accept.stalls
    assert accept.left == 0.0
    assert accept.better_than(refuse)
    assert not refuse.better_than(accept)
    assert np.linalg.norm(accept.end - [8.0, 0.0, 0.0]) < 0.1


def test_where_the_own_task_gets_there_a_detour_is_not_taken() -> None:
    scene = situation()
    refuse, accept = outcomes(scene, LAW, ROUND, LOOK)
    assert not refuse.stalls
    assert refuse.cost < 1e-9
    assert not accept.better_than(refuse)


def test_a_slow_robot_that_goes_on_does_not_stall() -> None:
    scene = situation()
    slow = replace(scene, preset=Motion.at_speed(scene.preset.positions, 0.02), max_speed=0.02)
    way = along((0.0, 0.0), (4.0, 1.0), (8.0, 0.0), speed=0.02)
    for outcome in outcomes(slow, LAW, way, LOOK):
        assert not outcome.stalls
        assert np.isfinite(outcome.cost)


def test_a_slow_robot_stalls_in_front_of_a_wall() -> None:
    scene = situation((2.5, 1.0), (2.5, -1.0))
    slow = replace(scene, preset=Motion.at_speed(scene.preset.positions, 0.04), max_speed=0.04)
    way = along((0.0, 0.0), (0.0, 4.0), (8.0, 4.0), speed=0.04)
    refuse, accept = outcomes(slow, LAW, way, replace(LOOK, longest=60.0))
    assert refuse.stalls
    assert not accept.stalls
    assert accept.better_than(refuse)


def test_a_proposal_to_stay_makes_no_difference_to_a_stall() -> None:
    scene = situation((4.0, 1.0), (4.0, -1.0))
    refuse, accept = outcomes(scene, LAW, along((0.0, 0.0), (0.01, 0.0)), LOOK)
    assert refuse.stalls
    assert accept.stalls
    assert not accept.better_than(refuse)


def test_no_roll_out_takes_longer_than_the_longest_try_and_what_comes_past_it() -> None:
    """However long the preset trajectory is."""
    scene = situation()
    endless = replace(scene, preset=Motion.at_speed(np.array([[0.0, 0.0, 0.0], [8.0, 0.0, 0.0]]), 1e-3))
    for outcome in outcomes(endless, LAW, ROUND, LOOK):
        assert len(outcome.positions) == round((LOOK.longest + LOOK.past) / LAW.avoidance.period) + 1


def test_what_is_under_way_at_the_end_costs_the_way_that_is_left_as_well() -> None:
    """Squared distances to the preset trajectory, and the cost-to-go along the way left: L^3 / (3 v)."""
    scene = situation()
    speed, look = 0.2, Outlook(longest=4.0, past=2.0)
    slow = replace(scene, preset=Motion.at_speed(scene.preset.positions, speed), max_speed=1.0)
    away = along((0.0, 0.0), (4.0, 0.0))
    for outcome in outcomes(slow, LAW, away, look):
        t = LAW.avoidance.period * np.arange(1.0, len(outcome.positions))
        error = np.square(slow.preset.sample(t) - outcome.positions[1:]).sum()
        assert not outcome.stalls
        assert outcome.left == pytest.approx(8.0 - outcome.end[0])
        assert 1.0 < outcome.left < 7.5
        expected = LAW.avoidance.period * error + outcome.left**3 / (3.0 * speed)
        assert outcome.cost == pytest.approx(expected, rel=1e-9)


def test_what_is_not_known_is_not_avoided_and_a_map_that_lies_costs_no_more_than_usefulness() -> None:
    assert not outcomes(situation(), LAW, ROUND, LOOK)[0].stalls
    assert outcomes(situation((4.0, 1.0), (4.0, -1.0), (3.0, 3.5)), LAW, ROUND, LOOK)[1].stalls


AWAY = Motion.at_speed(np.array([[4.0, 0.0, 0.0], [4.0, 9.0, 0.0]]), 2.0)


def beside(asked: tuple[Motion, bool] | None) -> View:
    """Another robot stands on the way of the UGV."""
    return replace(situation((4.0, 0.0)), asked=(asked,), shares=np.array([0.5]))


def test_another_robot_is_predicted_on_the_motion_that_it_is_asked_for() -> None:
    standing, going = beside(None), beside((AWAY, True))
    assert outcomes(standing, LAW, ROUND, LOOK)[0].stalls
    assert not outcomes(going, LAW, ROUND, LOOK)[0].stalls
    after = np.array([0.0, 1.0, 10.0])
    passing = replace(standing, velocities=np.array([[1.0, 0.0, 0.0]]))
    np.testing.assert_allclose(robot_at(passing, 0, after, 3.0, together=True)[:, 0], [4.0, 5.0, 7.0])
    off = replace(going, centres=np.array([[3.0, 0.0, 0.0]]))
    np.testing.assert_allclose(robot_at(off, 0, after, 3.0, together=False)[:, 0], 4.0 - np.exp(-after))


def test_nobody_refuses_his_part_of_a_joint_plan_because_the_others_would_free_his_way() -> None:
    """What another robot has not accepted yet is no reason to refuse."""
    refuse, accept = outcomes(beside((AWAY, False)), LAW, ROUND, LOOK)
    assert refuse.stalls
    assert not accept.stalls
    assert accept.better_than(refuse)


@pytest.mark.parametrize(
    ("place", "discs", "expected"),
    [
        ((0.0, 0.0), [], 8.0),
        ((0.0, 0.0), [(4.0, 2.0)], 8.0),
        ((4.0, 0.0), [(4.0, 0.0)], 4.0),
        ((0.0, 0.0), [(8.0, 0.0)], 8.0),
    ],
)  # fmt: skip
def test_the_way_left(place: tuple[float, float], discs: list[tuple[float, float]], expected: float) -> None:
    centres = np.array([[x, y, 0.0] for x, y in discs]).reshape(-1, 3)
    found = way_left(np.array([*place, 0.0]), np.array([8.0, 0.0, 0.0]), centres, 2.0)
    assert found == pytest.approx(expected)  # straight where it is free, from inside a disc, and without any way


def test_the_way_left_goes_round() -> None:
    left = way_left(np.zeros(3), np.array([8.0, 0.0, 0.0]), np.array([[4.0, 0.0, 0.0]]), 2.0)
    assert left == pytest.approx(2.0 * np.sqrt(12.0) + 2.0 * np.pi / 3.0)


def test_of_very_many_circles_those_beside_the_way_count() -> None:
    far = np.array([[x, y, 0.0] for x in range(-50, 50, 5) for y in (40.0, 50.0, 60.0)])
    discs = np.concatenate([far, [[4.0, 0.0, 0.0]]])
    left = way_left(np.zeros(3), np.array([8.0, 0.0, 0.0]), discs, 2.0)
    assert left == pytest.approx(2.0 * np.sqrt(12.0) + 2.0 * np.pi / 3.0)


def test_the_cost_to_go_falls_along_the_way_by_what_is_left_squared() -> None:
    """The condition of the stability theory: dV = -L^2 dt, and L is no less than the distance to the goal."""
    scene = situation((4.0, 0.0))
    goal, v, step = scene.preset.positions[-1], 1.0, 1e-4
    here = np.array([1.0, 0.5, 0.0])
    left = way_left(here, goal, scene.centres, 2.0)
    ahead = here + step * np.array([*np.array([2.9, 1.7]) / np.hypot(2.9, 1.7), 0.0])
    gains = (left**3 - (left - step) ** 3) / (3.0 * v)
    assert gains == pytest.approx(left**2 * step / v, rel=1e-3)
    assert left >= np.linalg.norm(goal - here)
    assert way_left(ahead, goal, scene.centres, 2.0) >= left - step


def test_outcomes_are_compared_by_stalling_first() -> None:
    still = np.zeros((1, 3))
    home, far, near = Outcome(still, False, 0.0, 100.0), Outcome(still, True, 2.0, 9.0), Outcome(still, True, 1.0, 1.0)
    assert home.better_than(far)
    assert not far.better_than(home)
    assert near.better_than(far)
    assert not near.better_than(replace(near, cost=near.cost * (1.0 + 1e-7)))


def test_the_way_left_goes_round_circles_of_different_sizes() -> None:
    discs = np.array([[4.0, 0.0, 0.0], [4.0, 9.0, 0.0], [4.0, -9.0, 2.5]])
    left = way_left(np.zeros(3), np.array([8.0, 0.0, 0.0]), discs, np.array([2.0, 5.0, 2.5]))
    assert left == pytest.approx(2.0 * np.sqrt(12.0) + 2.0 * np.pi / 3.0)
    wide = way_left(np.zeros(3), np.array([8.0, 0.0, 0.0]), discs[:1], np.array([3.0]))
    assert wide == pytest.approx(2.0 * np.sqrt(7.0) + 6.0 * (np.pi / 2.0 - np.arccos(0.75)))
