"""The coordinate policy: who moves, who is asked to make way, and what is proposed to whom."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import maps
import numpy as np
import pytest
from builders.observations import mate, seen
from oracles import faults_of

from airground_drake.model.geometry.motion import Motion
from airground_drake.scenario.load import from_data
from airground_drake.scenario.schema import (
    Control,
    Decision,
    Intervention,
    Obstacle,
    Policy,
    Preset,
    Run,
    Scenario,
    Threshold,
    Uav,
    Ugv,
)
from airground_drake.sim.simulation import simulate
from airground_drake.uav import coordinate
from airground_drake.uav.coordinate import NARROWER, Coordinate, predicted
from airground_drake.uav.coordination.joint import Plan, plan
from airground_drake.uav.policy import Observation, Proposal, Teammate
from airground_drake.verify import judge

BAY = [
    *((x, y) for x in np.arange(-14.0, 14.1, 1.4) for y in (-2.2, 2.2) if not (y > 0.0 and 3.0 < x < 8.0)),
    *((x, 7.0) for x in (2.0, 4.0, 6.0, 8.0)), (1.0, 5.0), (9.5, 5.0),
]  # fmt: skip
"""A corridor along y = 0 in which two robots cannot pass each other, with a bay above 3 m < x < 8 m."""
TRAP = [
    (8.115876, 1.431656), (13.292501, 0.287848), (3.983709, -4.271705), (7.562889, 4.727434), (5.863896, 4.08611),
    (0.434908, -4.559956), (4.720305, -0.689488), (8.237888, -1.205923),
]  # fmt: skip
"""Between the first and the last but one there are 3.5 mm more than a UGV needs; behind it, between the first and the
last, is no way on. A random course (`benchmarks/liveness.py --only 402`)."""
COMES = mate("comes", [-1.0, 0.0], [12.0, 0.0])
PARKED = mate("parked", [2.0, 0.0], [2.0, 0.0], triggered=False)


def propose(what: Observation) -> Mapping[str, Motion]:
    found = Coordinate().propose(what)
    assert found is not None
    return found


def least_distance(one: Motion, other: Motion) -> float:
    t = np.linspace(min(one.times[0], other.times[0]), max(one.end, other.end), 2000)
    return float(np.linalg.norm(one.sample(t) - other.sample(t), axis=1).min())


def test_two_that_block_each_other_get_motions_that_fit_together() -> None:
    one, other = mate("one", [-1.0, 0.0], [6.0, 0.0]), mate("other", [1.0, 0.0], [-6.0, 0.0])
    found = propose(seen([one, other]))
    assert list(found) == ["one", "other"]
    assert {motion.times[0] for motion in found.values()} == {10.05}
    assert least_distance(found["one"], found["other"]) >= 2.0 - 1e-9
    assert max(motion.max_speed for motion in found.values()) <= 0.8 + 1e-9


def test_a_robot_that_could_not_follow_gets_slower_motions() -> None:
    one, other = mate("one", [-1.0, 0.0], [6.0, 0.0], too_fast=2), mate("other", [1.0, 0.0], [-6.0, 0.0])
    found = propose(seen([one, other]))
    assert 0.15 < found["one"].max_speed <= 0.2 + 1e-9 < found["other"].max_speed
    (crawls,) = propose(seen([replace(one, too_fast=40)])).values()
    assert 0.05 < crawls.max_speed <= 0.1 + 1e-9


def test_a_parked_robot_is_asked_aside_and_back_only_where_it_is_in_the_way() -> None:
    found = propose(seen([COMES, PARKED], BAY))
    assert list(found) == ["comes", "parked"]
    assert found["parked"].positions[-1].tolist() == [2.0, 0.0, 0.0]
    assert np.abs(found["parked"].positions - [2.0, 0.0, 0.0]).max() > 2.0
    assert least_distance(found["comes"], found["parked"]) >= 2.0 - 1e-9
    assert list(propose(seen([COMES, PARKED]))) == ["comes"]  # there is room to go round


def test_a_robot_that_went_through_a_narrow_gap_is_led_back_through_it() -> None:
    trapped = mate("trapped", [6.67613121, 0.04344314], [20.0, 0.0])
    found = propose(seen([trapped], TRAP))["trapped"]
    assert found.positions[-1].tolist() == [20.0, 0.0, 0.0]
    ways = found.sample(np.linspace(found.times[0], found.end, 5000))[:, None, :2] - np.array(TRAP)
    assert np.linalg.norm(ways, axis=2).min() >= 2.0 - 1e-6


@pytest.fixture
def plans(monkeypatch: pytest.MonkeyPatch) -> list[Plan]:
    """All that are made from now on."""
    found: list[Plan] = []

    def counted(*given: Any, **options: Any) -> Plan:
        found.append(plan(*given, **options))
        return found[-1]

    monkeypatch.setattr(coordinate, "plan", counted)
    return found


def test_a_robot_that_is_shut_in_is_planned_for_again_only_elsewhere_or_on_another_map(plans: list[Plan]) -> None:
    policy, ring = Coordinate(), [(2.2 * math.cos(k), 2.2 * math.sin(k)) for k in range(7)]
    shut_in, other = mate("comes", [0.0, 0.0], [12.0, 0.0]), mate("other", [9.0, 0.0], [9.0, 0.0], triggered=False)
    moved = replace(shut_in, position=np.array([0.05, 0.0, 0.0]))

    def plans_for(team: list[Teammate], at: float = 10.0, obstacles: int = 7) -> int:
        before = len(plans)
        there = replace(seen(team, ring[:obstacles]), t=at, start=at + 0.05)
        assert (policy.propose(there) is None) == (obstacles == 7)
        return len(plans) - before

    assert 0 < plans_for([shut_in, other]) <= 2 * len(NARROWER)  # nobody is asked to make way for it
    assert plans_for([shut_in, other], 20.0) == 0
    assert plans_for([replace(shut_in, position=shut_in.position + 1e-9), other], 20.0) == 0
    assert plans_for([moved, other], 20.0) > 0
    assert plans_for([shut_in, other], 21.0, obstacles=4) > 0


def test_a_joint_plan_in_vain_is_made_again_only_in_another_situation(plans: list[Plan]) -> None:
    """Two UGVs face each other in a corridor without a bay: each has a way alone, but not together."""
    policy, corridor = Coordinate(), [(x, y) for x in np.arange(-30.0, 30.1, 1.4) for y in (-2.2, 2.2)]
    one, other = mate("one", [-1.1, 0.0], [12.0, 0.0]), mate("other", [1.1, 0.0], [-12.0, 0.0])

    def plans_for(team: list[Teammate], at: float, *, robot: int = 0, obstacles: int = len(corridor)) -> int:
        before = len(plans)
        assert policy.propose(replace(seen(team, corridor[:obstacles], robot=robot), t=at, start=at + 0.05)) is None
        return len(plans) - before

    assert plans_for([one, other], 10.0) >= len(NARROWER)
    assert plans_for([one, other], 20.0) == plans_for([one, other], 20.0, robot=1) == 0
    assert plans_for([one, replace(other, resting=True)], 20.0) > 0
    assert plans_for([one, other], 20.0, obstacles=len(corridor) - 1) > 0


def test_a_bay_that_is_too_narrow_for_the_full_clearance_is_waited_in() -> None:
    """Two change places in a corridor; the bay is 1 m wide, and who waits in it needs 0.8 m."""
    north = [[-4.6, 0.5], [-0.5, 0.5], [-0.5, 1.5], [0.5, 1.5], [0.5, 0.5], [4.6, 0.5], [4.6, -0.5]]
    ugvs = {
        name: maps.straight((x, 0.0), (-x, 0.0), 0.6, max_speed_m_s=1.0, radius_m=0.2)
        for name, x in (("r1", -4.0), ("r2", 4.0))
    }
    scenario = from_data(
        {
            "name": "bay", "duration_s": 18.0, "ugvs": ugvs, "runs": {"d": {"method": "d"}},
            "uav": {"start_m": [0.0, 0.0, 2.5], "altitude_m": 2.5},
            "obstacles": {"wall": {"segment_m": [*north, [-4.6, -0.5], [-4.6, 0.5]]}},
            "safe_distance": {"obstacle_m": 0.2, "ugv_m": 0.2, "air_ground_m": 1.0},
            "control": {"period_s": 0.05, "sensing_range_m": 3.0}, "gatekeeper": {"period_s": 0.2},
            "intervention": {"policies": [{"name": "coordinate"}]},
            "decision": {"threshold": {"zeta_m": 1.0}, "release_m": 0.6, "noise_period_s": 0.05},
        },
        "bay",
    )  # fmt: skip
    arrived = {event["robot"] for event in simulate(scenario, "d").events if event["kind"] == "arrival"}
    assert arrived == {"r1", "r2", "uav"}


def test_ugvs_that_have_met_are_planned_for_with_less_spacing() -> None:
    """Twelve on a tight circle, which drive through its centre: where they stop, the full spacing has no room."""
    ends = [(4.8 * math.cos(k * math.pi / 6.0), 4.8 * math.sin(k * math.pi / 6.0)) for k in range(12)]
    ugvs = {
        f"r{k}": maps.straight((x, y), (-x, -y), 1.0, max_speed_m_s=2.0, radius_m=0.2) for k, (x, y) in enumerate(ends)
    }
    scenario = from_data(
        {
            "name": "tight", "duration_s": 5.5, "ugvs": ugvs, "runs": {"d": {"method": "d"}},
            "uav": {"start_m": [0.0, 0.0, 3.0], "altitude_m": 3.0, "max_speed_m_s": 6.0},
            "safe_distance": {"obstacle_m": 0.1, "ugv_m": 0.1, "air_ground_m": 0.5, "collision_m": 0.01},
            "control": {"period_s": 0.05, "sensing_range_m": 3.0},
            "intervention": {"policies": [{"name": "coordinate"}]},
            "decision": {"threshold": {"zeta_m": 1.5}, "release_m": 1.0, "noise_period_s": 0.05},
        },
        "tight",
    )  # fmt: skip
    assert set(simulate(scenario, "d").proposals["robot"]) == set(ugvs)


@pytest.mark.parametrize(
    "unwilling",
    [
        {"resting": True, "refusals": 1},
        {"proposal": Proposal("other", 10.0, Motion(np.array([11.0]), np.array([[2.0, 0.0, 0.0]])))},
    ],
    ids=["resting", "asked this instant"],
)
def test_who_is_unwilling_is_not_asked(unwilling: dict[str, Any]) -> None:
    assert Coordinate().propose(seen([COMES, replace(PARKED, **unwilling)], BAY)) is None


def test_a_robot_that_follows_a_proposal_is_left_to_it() -> None:
    away = Proposal("coordinate", 9.0, Motion(np.array([10.0, 16.0]), np.array([[4.0, 0.0, 0.0], [4.0, 6.0, 0.0]])))
    other = mate("other", [4.0, 0.0], [4.0, 8.0], proposal=away, answered="accepted", standing=False)
    found = propose(seen([mate("one", [0.0, 0.0], [10.0, 0.0]), other]))
    assert list(found) == ["one"]
    assert least_distance(found["one"], away.motion) >= 2.0 - 1e-9


def test_what_others_are_taken_to_do() -> None:
    preset = Motion(np.array([0.0, 20.0]), np.array([[0.0, 0.0, 0.0], [20.0, 0.0, 0.0]]))
    moving = mate("one", [10.0, 0.5], [20.0, 0.0], preset=preset, triggered=False, standing=False)
    assert predicted(replace(moving, standing=True), 10.0).tolist() == [[0.0, 10.0, 0.5]]
    ahead = predicted(moving, 10.0)
    assert ahead[0].tolist() == [0.0, 10.0, 0.5]
    assert ahead[-1] == pytest.approx([10.0, 20.0, 0.0], abs=1e-3)
    onto = Proposal("detour", 9.0, Motion(np.array([9.0, 14.0]), np.array([[9.0, 3.0, 0.0], [14.0, 0.0, 0.0]])))
    along = predicted(replace(moving, proposal=onto, answered="accepted"), 10.0)
    assert along[-1].tolist() == [10.0, 20.0, 0.0]
    assert predicted(replace(moving, proposal=onto, answered="refused", triggered=True), 10.0).shape == (1, 3)


def test_nothing_without_a_team_and_no_nonsense() -> None:
    alone = seen([COMES])
    assert Coordinate().propose(replace(alone, team=())) is None
    assert list(propose(alone)) == ["comes"]
    with pytest.raises(ValueError, match="spacing_m"):
        Coordinate(spacing_m=0.0)


def aside() -> Scenario:
    def ugv(start: list[float], target: list[float], through: list[float]) -> Ugv:
        return Ugv([*start, 0.0], [*target, 0.0], Preset([[*p, 0.0] for p in (start, through, target)], 0.7), 1.5)

    return Scenario(
        name="aside",
        duration_s=28.0,
        ugvs={
            "comes": ugv([-6.0, 0.0], [12.0, 0.0], [3.0, 0.0]),
            "parked": ugv([2.0, 0.0], [2.0, 0.0], [2.001, 0.0]),
        },
        uav=Uav(start_m=[0.0, 30.0, 3.0], target_m=[7.0, 0.0, 3.0], altitude_m=3.0),
        obstacles={f"o{k}": Obstacle([float(x), float(y), 0.0]) for k, (x, y) in enumerate(BAY)},
        control=Control(period_s=0.05),
        decision=Decision(Threshold(zeta_m=2.0), release_m=1.0, noise_period_s=0.05),
        intervention=Intervention(policies=[Policy("coordinate")], ranking="listed"),
        runs={"d": Run("d")},
    )


def test_under_method_d_it_consents_because_it_gets_home_again() -> None:
    of_run = simulate(aside(), "d")
    first = of_run.decisions[of_run.decisions["reason"] == "makes_way"]
    assert first["robot"].tolist() == ["parked"]
    assert (first["accept_outcome_m2_s"] > first["refuse_outcome_m2_s"]).all()  # it has nothing to gain
    for ugv, target in (("parked", 2.0), ("comes", 12.0)):
        assert math.dist(of_run.position(ugv)[-1], (target, 0.0, 0.0)) < 0.1
    for verdict in judge(of_run):
        assert verdict.status == "holds", verdict
    own = of_run.proposals.assign(cause=of_run.proposals["robot"])
    assert {"records", "progress"} <= faults_of(replace(of_run, proposals=own)).keys()
