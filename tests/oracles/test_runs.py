"""No oracle finds a fault in unusual runs of the code as it is."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import maps
import numpy as np
import persons
import pytest
import yaml
from builders.edits import with_scenario
from builders.rooms import room

from airground_drake.base.arrays import Array
from airground_drake.model.geometry import outline
from airground_drake.scenario import world
from airground_drake.scenario.load import from_data, load
from airground_drake.scenario.schema import Moves, Obstacle, Policy, Preset, Scenario, Ugv
from airground_drake.sim.simulation import simulate
from airground_drake.ugv import outcome, outcome_gatekeeper
from airground_drake.verify.engines.outlines import Cores
from oracles import ORACLES, beginnings, control_law, faults_of, inputs, predictions, way_left
from oracles.mutants import PATIENCE, one_direction
from oracles.protocol import executed_at
from oracles.turning import OUTSIDE_M_S, edges, numbers_of
from oracles.way_left import bounds_of_way_left

AHEAD = (
    "{kind: ackermann, hand_point_m: 0.2, wheelbase_m: 0.3, max_steering_rad: 0.5}",
    "{kind: unicycle, hand_point_m: 0.2, backwards: false}",
)


@pytest.mark.parametrize("composition", ["augmented", "recursion_nearest"])
@pytest.mark.parametrize("plant", AHEAD)
def test_a_run_of_a_robot_that_only_drives_ahead_has_no_fault(plant: str, composition: str) -> None:
    """Its heading at the start is across its way, so that the inequalities of its plant bind; it does not stand."""
    given = [f"ugvs.ugv1.plant={plant[:-1]}, heading_rad: 1.2}}", "duration_s=8"]
    trace = simulate(load("minimal", [*given, f"runs.d.composition={composition}"]), "d")
    assert not faults_of(trace)
    assert np.linalg.norm(trace.chosen("ugv1")[:20], axis=1).all()
    heading = trace.column("ugv1.heading_rad")[trace.sample_rows]
    normal, _ = edges(heading, numbers_of(trace, "ugv1"))
    beyond = np.einsum("bkd,bd->bk", normal, trace.chosen("ugv1")).min(axis=1)
    assert (beyond < 1e-9).any()
    assert (beyond >= -OUTSIDE_M_S).all()


NOISY = (
    'sensing={"position_error_m": 0.03, "errors": "away", "uav_error_m": 0.5}',
    'channel={"delay_s": 0.3, "jitter_s": 0.2, "loss": 0.3, "duplicate": 0.3}',
)


@pytest.mark.parametrize(("scenario", "given"), [
    ("swap", ["duration_s=14"]), ("pocket", ["duration_s=14"]),
    ("crowd", ["duration_s=6", "control.avoidance_gain_1_s=20"]),
    ("minimal", [  # a remembered rock that may move
        'sensing={"position_error_m": 0.1, "errors": "sideways"}', "duration_s=10", "control.avoidance_gain_1_s=19",
        "obstacles.rock.max_speed_m_s=1", "channel=null",
    ]),
])  # fmt: skip
def test_a_run_with_errors_of_positions_over_a_channel_has_no_fault(scenario: str, given: list[str]) -> None:
    trace = simulate(load(scenario, [*NOISY, *given]), "d")
    assert len(trace.decisions)
    assert not faults_of(trace)


DOOR = """
name: door
duration_s: 20
ugvs:
  r1:
    start_m: [-4, 0, 0]
    target_m: [4, 0, 0]
    preset: {waypoints_m: [[-4, 0, 0], [4, 0, 0]], speed_m_s: 0.6}
    max_speed_m_s: 1
    radius_m: 0.2
uav: {start_m: [-4, 0, 2.5], altitude_m: 2.5}
obstacles:
  wall: {segment_m: [[0, -2], [0, 3.8]]}
  door: {segment_m: [[0, -3.8], [0, -2]], disappears_s: 5}
arena_m: [[-6, -3.8], [6, 3.8]]
safe_distance: {obstacle_m: 0.2, ugv_m: 0.2, air_ground_m: 1}
control: {period_s: 0.05, sensing_range_m: 3}
decision: {threshold: {rule: fixed, zeta_m: 1}, release_m: 0.6, noise_period_s: 0.05}
intervention: {policies: [{name: coordinate}]}
gatekeeper: {period_s: 0.2}
runs: {d: {method: d}}
"""


@pytest.mark.parametrize(("scenario", "name"), [
    ("standing", "a"), ("squeezed", "a"), ("round a wall", "b"), ("round a wall", "c"), ("round a wall", "d"),
    ("round a wall, known", "d"),
])  # fmt: skip
def test_a_run_beside_a_person_has_no_fault(scenario: str, name: str) -> None:
    trace = persons.run(scenario, name)
    assert len(trace.proposals) or name == "a"
    assert not faults_of(trace)


def test_oracles_that_forget_the_retreat_or_the_person_find_faults(monkeypatch: pytest.MonkeyPatch) -> None:
    """So the runs above put both to the test."""
    monkeypatch.setattr(control_law, "retreating", lambda below, *_, **__: below)
    assert "commands" in faults_of(replace(persons.run("squeezed")))
    monkeypatch.undo()
    monkeypatch.setattr(beginnings, "movers", lambda *_: [])
    assert "predictions" in faults_of(replace(persons.run("round a wall", "c")))


def test_what_moves_is_listed_after_the_robots() -> None:
    """Recursion (5) depends on what comes first: here another robot and a person, both in the way."""
    scenario, still, target = load("minimal"), [2.6, 0.4, 0.0], [2.6, 0.5, 0.0]
    scenario.ugvs["ugv2"] = Ugv(still, target, Preset([still, target], 0.01))
    moves = Moves([[3.0, -3.0, 0.0], [3.0, 3.0, 0.0]], 0.5)
    scenario.obstacles = {"person": Obstacle(moves=moves, max_speed_m_s=0.5, distance_m=1.0)}
    scenario.safe_distance.ugv_m, scenario.duration_s = 1.0, 4.0
    scenario.runs["a"].composition = "recursion_listed"
    assert not faults_of(simulate(scenario, "a"))


def test_a_known_obstacle_that_disappears_leaves_the_map() -> None:
    """The UGV has sensed it, too: the UAV learns nothing from that."""
    scenario = load("minimal", ["duration_s=10"])
    scenario.obstacles["rock"].disappears_s, scenario.intervention.retry_s = 9.0, 0.2
    scenario.intervention.policies = [Policy("hostile", {"speed_m_s": 2.0})]
    trace = simulate(scenario, "d")
    sent = [len(mapped) > 0 for mapped in trace.proposals["mapped"]]
    assert {*sent} == {True, False}
    assert not faults_of(trace)


def test_a_ugv_forgets_what_it_sees_to_be_gone() -> None:
    """It has sensed the door before that opens, and then takes the way through it."""
    data = yaml.safe_load(DOOR)
    trace = simulate(from_data(data, "door"), "d")
    assert [event["robot"] for event in trace.events if event["kind"] == "arrival"] == ["uav", "r1"]
    assert not faults_of(trace)


@pytest.mark.slow
@pytest.mark.parametrize("name", "bcd")
def test_proposals_that_concern_one_direction(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    one_direction(monkeypatch)
    trace = simulate(load("case_a"), name)
    assert sum(sent is not None for sent in executed_at(trace, "ugv1")) > 5
    assert not faults_of(trace)


def test_the_uavs_avoidance_and_contradicting_inequalities(case_a: Scenario) -> None:
    """A pole in the UAV's way; a proposal that leads UGV1 between two obstacles, inside both safe distances."""
    case_a.obstacles["pole"] = Obstacle([0.8, 3.6, 2.3])
    case_a.intervention.policies = [Policy("towards", {"x_m": 2.85, "y_m": 5.5, "speed_m_s": 2.0})]
    case_a.decision.threshold.zeta_m, case_a.decision.release_m = 1.0, 0.9
    trace = simulate(case_a, "b")
    inside = [np.linalg.norm(trace.position("ugv1") - o, axis=1) < 1.95 for o in ([1.7, 4, 0], [4.0, 7.0, 0.0])]
    assert (inside[0] & inside[1]).any()
    assert np.linalg.norm(trace.position("uav") - [0.8, 3.6, 2.3], axis=1).min() < 2.0 + 1e-9
    assert not faults_of(trace)


def test_a_uav_with_another_task_is_not_judged(case_a: Scenario) -> None:
    case_a.duration_s = 1.0
    trace = simulate(case_a, "a")
    altered = with_scenario(trace, uav__altitude_m=3.0)
    assert [fault.robot for fault in ORACLES["commands"](altered)] == ["uav"]
    assert not ORACLES["commands"](with_scenario(altered, uav__task="airground_drake.model.law.tasks:FormationTask"))


def test_stages_of_several_control_periods() -> None:
    trace = simulate(load("case_a", ["gatekeeper.stages=20", "duration_s=16.0", "reproduction=[]"]), "c")
    assert len(trace.decisions) > 5
    assert not faults_of(trace)


def test_a_ugv_goes_along_as_often_and_as_long_as_it_may() -> None:
    trace = simulate(load("case_b", PATIENCE), "d")
    assert {"over", "exhausted"} <= set(trace.decisions["reason"])
    assert not faults_of(trace)


def test_the_nearest_obstacles_of_an_endless_map_count() -> None:
    assert outcome_gatekeeper.MOST_CLAIMED == inputs.MOST_CLAIMED == 64
    assert outcome.MOST_CORNERS == way_left.MOST_CORNERS == 64
    scenario = load("case_a", ["duration_s=15.5", "reproduction=[]", "choices=[]"])
    scenario.intervention.policies = [Policy("towards", {"x_m": 6.0, "y_m": 5.0, "speed_m_s": 2.0})]
    scenario.uav.phantoms_m = [[float(x), float(y), 0.0] for x in range(10, 20) for y in range(0, 20, 2)]
    trace = simulate(scenario, "d")
    known = max(
        len(known) + len(told) for known, told in zip(*(trace.decisions[c] for c in ("known", "told")), strict=True)
    )
    assert 64 <= known <= 64 + len(scenario.obstacles)
    assert not faults_of(trace)


@pytest.mark.slow
def test_a_prediction_that_depends_on_rounding_is_not_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four UGVs head for one point: where they get round each other depends on the last digits."""
    corners = {"e": (1.0, 0.0), "n": (0.0, 1.0), "w": (-1.0, 0.0), "s": (0.0, -1.0)}
    data: dict[str, Any] = {
        "name": "meeting", "duration_s": 1.6, "decision": {"threshold": {"zeta_m": 0.2}, "release_m": 0.1},
        "ugvs": {
            ugv: maps.straight(corner, -corner, 1.0, max_speed_m_s=6.0)
            for ugv, corner in ((ugv, 0.7071068518972258 * np.array(corner)) for ugv, corner in corners.items())
        },
        "uav": {"start_m": [0.0, 0.0, 2.0], "target_m": [0.0, 0.0, 2.0], "altitude_m": 2.0, "max_speed_m_s": 10.0},
        "safe_distance": dict.fromkeys(("obstacle_m", "ugv_m", "air_ground_m"), 1e-3) | {"collision_m": 2e-5},
        "control": {"sensing_range_m": 2.0}, "runs": {"c": {"method": "c"}},
        "intervention": {"policies": [{"name": "towards", "parameters": {"x_m": 0.0, "y_m": 0.0, "speed_m_s": 1e5}}]},
    }  # fmt: skip
    trace = simulate(from_data(data, "meeting"), "c")
    assert not ORACLES["predictions"](trace)
    monkeypatch.setattr(predictions, "_is_unstable", lambda *_: False)
    assert ORACLES["predictions"](trace)


ROUND_A_DISC = 2.0 * 12.0**0.5 + 2.0 * np.pi / 3.0
"""From 4 m before a disc of 2 m to 4 m behind it."""
ROUND_A_WALL = 2.0 * (15.0**0.5 + np.arcsin(0.25))
"""Likewise round the end of a wall across the way, 1 m away from it."""
ROUND_A_BLOCK = 2.0 * (17.99**0.5 + 0.1 * (np.pi / 4.0 + np.arcsin(0.1 / 18.0**0.5))) + 2.0
"""Likewise over a block 2 m long, 0.1 m away from its corners."""


@pytest.mark.parametrize(
    ("row", "distance", "true"),
    [
        (outline.balls([4.0, 0.0, 0.0])[0], 2.0, ROUND_A_DISC),
        (outline.prism([[4.0, -9.0], [4.0, 0.0]]), 1.0, ROUND_A_WALL),
        (outline.prism([[3.0, -9.0], [5.0, -9.0], [5.0, 3.0], [3.0, 3.0]]), 0.1, ROUND_A_BLOCK),
    ],
)
def test_the_way_left_is_bounded_from_both_sides(row: Array, distance: float, true: float) -> None:
    goal = np.array([8.0, 0.0, 0.0])
    least, most = bounds_of_way_left(np.zeros(3), goal, Cores.of(row[None]), np.array([distance]))
    assert least == 8.0
    assert true - 1e-6 <= most <= 1.01 * true


@pytest.mark.parametrize("name", "abcd")
def test_a_run_among_walls_has_no_fault(name: str) -> None:
    assert not faults_of(simulate(room(), name))


def test_a_plan_among_walls_that_is_accepted_has_no_fault() -> None:
    scenario = room(20.0)
    scenario.intervention.policies = [Policy("coordinate")]
    trace = simulate(scenario, "d")
    assert (trace.decisions["decision"] == "accept").any()
    assert not faults_of(trace)


WRONG_LAW: dict[str, Callable[[Array], Array]] = {
    "one part is not seen": lambda rows: rows[: max(1, len(rows) - 2)],
    "middles in place of nearest points": lambda rows: np.array([
        [gap, 0.0, 0.0, 0.0, 0.0, 1.0, x, y, 0.0, x, y] for gap, x, y in rows[:, [0, 6, 7]]
    ]),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG_LAW)
def test_a_law_that_measures_other_distances_is_noticed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    honest = world.outlines_of
    change = WRONG_LAW[name]
    monkeypatch.setattr(
        world, "outlines_of", lambda of, each: change(honest(of, each)) if each.segment_m else honest(of, each)
    )
    assert faults_of(simulate(room(), "a"))["commands"]
