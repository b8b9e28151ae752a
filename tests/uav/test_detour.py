"""The detour: round obstacles, and round robots that stand."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.observations import mate, seen
from builders.shapes import from_core, rectangle

from airground_drake.model.geometry.motion import Motion
from airground_drake.model.geometry.outline import balls, corners_of, prism, stacked
from airground_drake.model.geometry.paths import Path, PathsFrom
from airground_drake.uav import detour
from airground_drake.uav.coordinate import Coordinate
from airground_drake.uav.database import predicted_cost
from airground_drake.uav.detour import Detour
from airground_drake.uav.halts import NOT_WATCHED, STANDS_S, room, standing, watched
from airground_drake.uav.policy import MovingObstacle, Observation, Policy, Proposal
from airground_drake.uav.wrong import StaleMap

DETOUR = Detour(speed_m_s=1.0)
CENTRES = [[2.5, 0.0, 0.0], [0.0, 9.0, 0.0]]


def least_distance(what: Observation, other: int) -> float:
    motion = DETOUR.propose(what)
    assert motion is not None
    return float(np.linalg.norm(motion.positions - what.team[other].position, axis=1).min())


def test_a_robot_that_stands_is_gone_round() -> None:
    stuck, parked = mate("ugv1", [0.0, 0.0], [10.0, 0.0]), mate("ugv2", [5.0, 0.1], [5.0, 0.1], triggered=False)
    assert least_distance(seen([stuck, parked]), 1) >= 2.05 - 1e-3  # chords of arcs


def test_a_robot_that_moves_or_will_is_not() -> None:
    stuck, parked = mate("ugv1", [0.0, 0.0], [10.0, 0.0]), mate("ugv2", [5.0, 0.1], [5.0, 0.1])
    away = Proposal("detour", 9.0, Motion(np.array([9.0]), np.array([[5.0, 4.0, 0.0]])))
    for leaves in (replace(parked, standing=False), replace(parked, proposal=away, answered="accepted")):
        assert least_distance(seen([stuck, leaves]), 1) < 0.2
    refused = replace(parked, proposal=away, answered="refused")
    assert least_distance(seen([stuck, refused]), 1) > 2.0


@pytest.mark.parametrize("parked", [True, False])
def test_a_target_may_be_as_near_to_others_as_the_safe_distance_allows(parked: bool) -> None:
    team = [mate("ugv1", [0.0, 0.0], [10.0, 0.0]), mate("ugv2", [12.0, 0.0], [12.0, 0.0], triggered=False)]
    motion = DETOUR.propose(seen(team) if parked else seen(team[:1], [(10.0, 2.0)]))
    assert motion is not None
    assert motion.positions[-1].tolist() == [10.0, 0.0, 0.0]


def test_who_keeps_to_one_place_stands() -> None:
    one_place, places = room(np.full(2, 5.0)), np.zeros((3, 3))
    halts = watched(np.tile([0.0, 0.0, 0.0, NOT_WATCHED], 2), 0.0, places.ravel(), one_place)
    assert (watched(halts, 0.5, places.ravel() + 0.05, one_place) == halts).all()
    later = watched(halts, STANDS_S, (places + np.array([[0.0], [1.0], [0.0]])).ravel(), one_place)
    assert later.reshape(2, 4).tolist() == [[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, STANDS_S]]
    assert standing(later, STANDS_S).tolist() == [True, False]
    slow = watched(halts, STANDS_S, places.ravel() + 0.02, room(np.array([0.02, 0.5])))
    assert slow[3::4].tolist() == [STANDS_S, 0.0]  # one that moves slowly does not stand


def test_bodies_are_gone_round_by_both_radii() -> None:
    stuck = mate("ugv1", [0.0, 0.0], [12.0, 0.0])
    parked = mate("ugv2", [6.0, 0.1], [6.0, 0.1], triggered=False, radius=0.5)
    what = replace(seen([stuck, parked]), radius=0.25)
    assert least_distance(what, 1) >= 2.05 + 0.75 - 1e-3
    shelf = replace(seen([stuck]), radius=0.25, obstacles=balls([6.0, 0.5, 0.0], 1.5, gap=2.0))
    motion = DETOUR.propose(shelf)
    assert motion is not None
    least = np.linalg.norm(motion.positions - [6.0, 0.5, 0.0], axis=1).min()
    assert least == pytest.approx(2.05 + 1.75, abs=1e-3)


@pytest.mark.parametrize("policy", [DETOUR, Coordinate()])
def test_the_way_out_of_a_room_keeps_its_distance_from_the_walls(policy: Policy) -> None:
    """A room open to the left: walls of different distances, one of them thick, a box in front of the door."""
    rows = stacked([
        prism([[3.0, -2.0], [3.0, 2.0]], gap=0.3), prism([[0.0, 2.0], [3.0, 2.0]], gap=0.3, radius=0.05),
        prism([[0.0, -2.0], [3.0, -2.0]], gap=0.2), rectangle(-1.5, 0.5, 0.6, 1.0),
    ])  # fmt: skip
    what = replace(seen([mate("ugv1", [2.4, 0.0], [6.0, 0.0], radius=0.2)]), radius=0.2, obstacles=rows)
    found = policy.propose(what)
    motion = found if isinstance(found, Motion) else (found or {})["ugv1"]
    assert motion.positions[-1].tolist() == [6.0, 0.0, 0.0]
    places = motion.positions[:, :2]
    for row, least in zip(rows, (0.5, 0.55, 0.4, 0.2), strict=True):
        assert from_core(places[:-1], places[1:], corners_of(row)).min() >= least - 1e-9


def test_a_map_of_the_beginning_has_the_radii_of_the_beginning() -> None:
    stuck = mate("ugv1", [0.0, 0.0], [12.0, 0.0])
    learnt = balls([[6.0, 0.5, 0.0], [6.0, 3.0, 0.0]], [1.5, 0.0], gap=2.0)
    motion = StaleMap(speed_m_s=1.0).propose(replace(seen([stuck]), obstacles=learnt, mapped=learnt[:1]))
    found = DETOUR.propose(replace(seen([stuck]), obstacles=learnt[:1]))
    assert motion is not None
    assert found is not None
    assert np.array_equal(motion.positions, found.positions)


def test_the_predicted_cost_counts_intrusion_into_obstacles_and_every_teammate() -> None:
    stuck = mate("ugv1", [0.0, 0.0], [12.0, 0.0])
    motions = {"ugv1": Motion(np.array([0.0]), np.array([[0.0, 0.0, 0.0]]))}
    costs = [
        predicted_cost(motions, replace(seen([stuck]), radius=own, obstacles=balls(CENTRES, each, gap=2.0)))
        for own, each in ((0.0, 0.0), (0.0, (0.5, 5.0)), (0.25, (0.25, 0.0)), (0.5, 0.5))
    ]
    assert costs[0] == costs[1] == costs[2]
    assert costs[3] > costs[0]
    alone, parked = seen([stuck]), mate("ugv2", [1.0, 0.0], [1.0, 0.0], triggered=False)
    for team in ((parked, stuck), (stuck, parked)):
        assert predicted_cost(motions, replace(alone, team=team)) > predicted_cost(motions, alone) + 100.0
    way = Proposal("detour", 9.0, Motion(np.array([9.0]), np.array([[1.0, 0.0, 0.0]])))
    for answered in ("silent", "accepted"):
        asked = replace(alone, team=(stuck, replace(parked, standing=False, proposal=way, answered=answered)))
        assert (predicted_cost(motions, asked) > predicted_cost(motions, alone)) == (answered == "accepted")
    person = MovingObstacle("person", balls(np.zeros(3), 0.25, 0.5), np.zeros(3), np.zeros(3), way.motion)
    for own, near in ((0.2, False), (0.3, True)):  # 1 m away
        beside = replace(alone, moving=(person,), radius=own)
        assert (predicted_cost(motions, beside) > predicted_cost(motions, alone)) == near


@pytest.mark.parametrize("ratio", [1.0, 0.9999])
def test_a_preset_that_runs_away_is_met_with_few_paths(ratio: float, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[float] = []

    class Counting(PathsFrom):
        def to(self, goal: Any) -> Path:
            path = super().to(goal)
            asked.append(path.length_m)
            return path

    monkeypatch.setattr(detour, "PathsFrom", Counting)
    runs = Motion(np.array([0.0, 100.0 / ratio]), np.array([[5.0, 0.0, 0.0], [105.0, 0.0, 0.0]]))
    what = seen([mate("ugv1", [0.0, 0.0], [105.0, 0.0])])
    motion = DETOUR.propose(replace(what, preset=runs, t=0.0, start=0.0))
    assert motion is not None
    assert len(asked) < 40
    met = min(105.0, 5.0 / (1.0 - ratio) if ratio < 1.0 else np.inf)  # s, at 1 m/s
    after = motion.times[motion.positions[:, 0] >= runs.sample(motion.times)[:, 0] - 1e-9]
    assert after[0] == pytest.approx(met, abs=0.1)
