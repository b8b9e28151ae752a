"""The built diagram against the scenario: broken variants of the running code, each refuted by a claim."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies
from pydrake.systems.primitives import LinearSystem
from verify.test_layers import imported, within

from airground_drake import components, diagram
from airground_drake.arrays import Array
from airground_drake.check.scenario import kinds_of
from airground_drake.intervention.policy import Proposal
from airground_drake.nsbc import team as team_module
from airground_drake.nsbc.avoidance import Avoidance, HalfSpaces, Surroundings
from airground_drake.nsbc.law import UgvLaw
from airground_drake.nsbc.team import Neighbourhood, Team
from airground_drake.scenarios.load import load, resolved
from airground_drake.scenarios.schema import Scenario
from airground_drake.systems import controllers
from airground_drake.verify.claim import ModelClaim
from airground_drake.verify.model.avoidance import binding_states, scenario_pairs, wiring
from airground_drake.verify.model.avoidance.constants import constants, kinds
from airground_drake.verify.model.avoidance.disturbed_runs import scenes
from airground_drake.verify.model.avoidance.safe_gate import SafeGate
from airground_drake.verify.model.avoidance.safe_inv import SafeInv
from airground_drake.verify.model.avoidance.scenario_pairs import Views, as_points

Patch = Callable[[pytest.MonkeyPatch], None]


def distance_between(first_uav: bool, factor: float) -> Patch:
    right = Team.pair_distance

    def wrong(self: Team) -> Array:
        found = right(self)
        rows = np.arange(len(found))
        with_uav = (rows == rows[-1]) | (rows == rows[-1])[:, None]
        return np.where(with_uav == first_uav, factor * found, found)

    return lambda patch: patch.setattr(Team, "pair_distance", wrong)


def neighbourhood(change: Callable[[Team, Neighbourhood], Neighbourhood]) -> Patch:
    right = Team.neighbourhood
    return lambda patch: patch.setattr(Team, "neighbourhood", lambda self, rows: change(self, right(self, rows)))


def shares(value: float) -> Patch:
    return neighbourhood(lambda team, given: replace(given, share=np.where(given.share < 1.0, value, given.share)))


def obstacle_distance(factor: float) -> Patch:
    def change(team: Team, given: Neighbourhood) -> Neighbourhood:
        obstacle = np.arange(given.distance.shape[1]) < len(team.obstacles)
        return replace(given, distance=np.where(obstacle, factor * given.distance, given.distance))

    return neighbourhood(change)


def gathered(change: Callable[[Array, int], Array]) -> Patch:
    """Another `kernels.gather`: `change(centres, number of obstacles)`."""
    right = team_module.kernels.gather

    def wrong(self: Neighbourhood, positions: Array) -> Surroundings:
        centre = change(right(positions, self.obstacles, self.others), len(self.obstacles))
        return Surroundings(centre, self.distance, self.share)

    return lambda patch: patch.setattr(Neighbourhood, "around", wrong)


def far(centre: Array, columns: slice) -> Array:
    moved = centre.copy()
    moved[:, columns] += 1e3
    return moved


def layer(**changed: Any) -> Patch:
    right = components.make_avoidance

    def wrong(*args: Any) -> Avoidance:
        return replace(right(*args), **changed)

    return lambda patch: patch.setattr(components, "make_avoidance", wrong)


def everything_accepted(patch: pytest.MonkeyPatch) -> None:
    def wrong(proposals: Sequence[Proposal | None], answers: Array) -> list[Proposal | None]:
        return list(proposals)

    patch.setattr(controllers, "accepted_proposals", wrong)


def any_issue_answered(patch: pytest.MonkeyPatch) -> None:
    def wrong(proposals: Sequence[Proposal | None], answers: Array) -> list[Proposal | None]:
        return [p if answers[2 * i] == 1.0 else None for i, p in enumerate(proposals)]

    patch.setattr(controllers, "accepted_proposals", wrong)


def mobility_lost(patch: pytest.MonkeyPatch) -> None:
    patch.setattr(Team, "mobility", property(lambda self: np.ones((len(self.robots), 3))))


def on_top(patch: pytest.MonkeyPatch) -> None:
    right = components.make_law
    patch.setattr(components, "make_law", lambda *args: replace(right(*args), intervention_on_top=True))


def unlayered(patch: pytest.MonkeyPatch) -> None:
    """The UAV without its layer."""

    class Blind(controllers.UavController):
        def __init__(self, team: Team, avoidance: Avoidance, **given: Any) -> None:
            super().__init__(team, replace(avoidance, sensing_range=0.0), **given)

    patch.setattr("airground_drake.diagram.UavController", Blind)


def speeding(patch: pytest.MonkeyPatch) -> None:
    right = components.make_team

    def wrong(scenario: Scenario) -> Team:
        found = right(scenario)
        return replace(found, max_speed=1.5 * found.max_speed)

    patch.setattr(components, "make_team", wrong)


def swapped(patch: pytest.MonkeyPatch) -> None:
    """Two UGVs' commands exchanged on their way."""
    right = UgvLaw.velocity

    def wrong(self: UgvLaw, *args: Any) -> Array:
        found: Array = right(self, *args)
        return found[::-1]

    patch.setattr(UgvLaw, "velocity", wrong)


def half_rate(patch: pytest.MonkeyPatch) -> None:
    """The UGVs sampled at half the rate."""

    class Slow(controllers.UgvController):
        def __init__(self, team: Team, law: UgvLaw) -> None:
            period = law.avoidance.period
            super().__init__(team, replace(law, avoidance=replace(law.avoidance, period=2.0 * period)))
            self.avoidance = law.avoidance
            self.law = law

    patch.setattr("airground_drake.diagram.UgvController", Slow)


def fast_plants(patch: pytest.MonkeyPatch) -> None:
    eye, zero = np.eye(3), np.zeros((3, 3))

    def plant(robot: str, start: Array) -> LinearSystem:
        found = LinearSystem(A=zero, B=1.1 * eye, C=eye, D=zero)
        found.configure_default_state(start)
        return found

    right = diagram.build_model
    patch.setattr(wiring, "build_model", lambda *args: right(*args, plants=plant))


def first_half_space_dropped(patch: pytest.MonkeyPatch) -> None:
    right = Avoidance.half_spaces

    def wrong(self: Avoidance, *args: Any) -> HalfSpaces:
        found = right(self, *args)
        bound = found.bound.copy()
        bound[0, 0] = -np.inf
        return HalfSpaces(found.normal, bound)

    patch.setattr(Avoidance, "half_spaces", wrong)


MUTANTS: dict[str, Patch] = {
    "distance UAV/UGV times 0.9": distance_between(True, 0.9),
    "distance UAV/UGV times 0.9999": distance_between(True, 0.9999),
    "distance UGV/UGV times 0.9": distance_between(False, 0.9),
    "distance UGV/UGV times 1.1": distance_between(False, 1.1),
    "distance to obstacles times 0.9": obstacle_distance(0.9),
    "share 1 for robots": shares(1.0),
    "share 0 for robots": shares(0.0),
    "share 0.51 for robots": shares(0.51),
    "gather leaves out the UAV": gathered(lambda centre, m: far(centre, slice(-1, None))),
    "gather leaves out an obstacle": gathered(lambda centre, m: far(centre, slice(0, min(m, 1)))),
    "gather leaves out the UGVs": gathered(lambda centre, m: far(centre, slice(m, -1))),
    "gather in another order": gathered(lambda centre, m: np.roll(centre, 1, axis=1)),
    "no gain": layer(gain=0.0),
    "range cut": layer(sensing_range=2.1),
    "twice the period": layer(period=0.1),
    "everything accepted": everything_accepted,
    "another proposal's answer": any_issue_answered,
    "planar mobility lost": mobility_lost,
    "intervention on top": on_top,
    "UAV without its layer": unlayered,
    "speed limits times 1.5": speeding,
    "commands swapped": swapped,
    "UGVs at half the rate": half_rate,
    "plants faster than commanded": fast_plants,
    "one inequality dropped": first_half_space_dropped,
}


@pytest.mark.parametrize("name", MUTANTS)
def test_running_code_that_differs_from_the_scenario_is_refuted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scenario = load("case_a")[0]
    given = SafeInv().inputs(scenario)
    MUTANTS[name](monkeypatch)
    assert SafeInv().inputs(scenario) == given  # nothing that is demanded comes from the code
    finding = SafeInv().judge(given)
    assert finding.status == "refuted", finding
    assert finding.counterexample is not None
    assert finding.margin is None or finding.margin < 0.0
    json.dumps(finding.counterexample, allow_nan=False)


@pytest.mark.parametrize("name", ["distance UAV/UGV times 0.9", "share 1 for robots", "gather leaves out the UAV"])
def test_safe_gate_refutes_it_too_and_says_where(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    given = SafeGate().inputs(load("case_a")[0])
    MUTANTS[name](monkeypatch)
    finding = SafeGate().judge(given)
    assert finding.status == "refuted", finding
    assert finding.counterexample is not None
    found = finding.counterexample.get("wiring", finding.counterexample)
    assert {found["robot"], found["avoided"]} <= {"ugv1", "ugv2", "ugv3", "uav"}
    assert (found["safe_distance_m"], found["share"]) in {(1.0, 0.5), (2.0, 0.5)}
    assert found["missed_by_m_s"] > 0.01
    assert finding.margin is not None
    assert finding.margin < -0.01


@pytest.mark.parametrize("claim", [SafeInv(), SafeGate()], ids=lambda claim: claim.id)
def test_a_diagram_of_another_scenario_is_refuted(claim: ModelClaim, case_a: Scenario) -> None:
    given = claim.inputs(case_a)
    case_a.safe_distance.air_ground_m *= 0.9
    assert claim.judge(given | {"scenario": claim.inputs(case_a)["scenario"]}).status == "refuted"


def test_every_pair_binds_and_every_answer_occurs(found: dict[str, Any]) -> None:
    seen = found["SAFE-INV"].evidence["wiring"]
    assert seen["agrees"]
    assert seen["differences"] == seen["never_bound_count"] == 0
    assert min(seen["least_times_bound"].values()) > 10
    assert min(seen["proposals"].values()) > 30
    assert seen["executed"] == seen["proposals"]["accepted"]


@pytest.mark.parametrize("factor", [1.0 - 1e-6, 1.0 + 1e-6])
def test_a_millionth_of_a_distance_is_noticed(
    factor: float, monkeypatch: pytest.MonkeyPatch, inputs: dict[str, Any]
) -> None:
    assert wiring.compare(inputs)["agrees"]
    distance_between(True, factor)(monkeypatch)
    assert not wiring.compare(inputs)["agrees"]


def test_a_pair_that_was_never_near_is_not_proved(monkeypatch: pytest.MonkeyPatch, inputs: dict[str, Any]) -> None:
    right = binding_states.beside

    def apart(given: Any, views: Views, pairs: Any, *more: Any) -> binding_states.State:
        return right(given, views, [(i, j) for i, j in pairs if j < 0], *more)

    monkeypatch.setattr(binding_states, "beside", apart)
    monkeypatch.setattr(wiring, "beside", apart)
    monkeypatch.setattr(binding_states, "CROWDED", 0)
    assert SafeInv().judge(inputs).status == "inconclusive"


def test_the_scenario_alone_says_what_is_demanded() -> None:
    judged = {"nsbc", "components", "diagram", "systems", "gatekeeper", "intervention", "simulation", "decision"}
    path = scenario_pairs.__file__
    assert path is not None
    assert not [name for name in imported(Path(path)) if within(name, judged)]


def test_demands_agree_with_those_of_the_running_team(inputs: dict[str, Any], case_a: Scenario) -> None:
    """Today's code; were it to differ, the claim decides, not this test."""
    views, team = Views.of(inputs["team"]), components.make_team(case_a)
    around = team.neighbourhood(slice(None))
    assert np.array_equal(views.safe, around.distance)
    assert np.array_equal(views.share, around.share)
    assert np.array_equal(views.others, around.others)
    assert np.array_equal(views.mobility, team.mobility)
    assert [kind.name for kind in kinds(inputs)] == ["obstacle", "uav_ugv", "ugv_ugv"]


def test_a_projection_onto_one_half_space() -> None:
    normal = np.array([[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
    for bound, wanted, one, velocity in (
        ([-1.0, -1.0], [-3.0, 0.0, 0.0], True, [-1.0, 0.0, 0.0]),
        ([-1.0, -1.0], [-3.0, -3.0, 0.0], False, None),
        ([-1.0, -np.inf], [2.0, -3.0, 0.0], True, [2.0, -3.0, 0.0]),
        ([0.5, -1.0], [-1.0, 0.0, 1.0], True, [0.5, 0.0, 1.0]),
    ):
        posed, found, _ = wiring.closest_velocity(np.array([wanted]), normal, np.array([bound]))
        assert posed[0] == one
        assert velocity is None or np.allclose(found[0], velocity)


def test_inequalities_are_those_of_all_that_is_sensed(bodies: Scenario) -> None:
    views, rng = Views.of(constants(bodies)["team"]), np.random.default_rng(1)
    gain, period, reach = 2.0, 0.1, 4.0
    for spread in (1.0, 4.0, 100.0):
        positions = rng.uniform(-spread, spread, (len(views.robots), 3))
        found = views.inequalities(positions, gain, period, reach)
        offset = positions[:, None] - views.centres(positions)
        distance = np.linalg.norm(offset, axis=-1)
        deficit = views.safe - distance
        bound = views.share * deficit * np.where(deficit >= 0.0, gain, 1.0 / period)
        seen = np.isfinite(found.bound)
        robot, column = np.nonzero(seen)
        view = found.view[robot, column]
        assert sorted(zip(robot, view, strict=True)) == [tuple(pair) for pair in np.argwhere(distance <= reach)]
        assert np.allclose(found.bound[seen], bound[robot, view])
        assert np.allclose(found.normal[seen], (offset / distance[..., None])[robot, view] * views.mobility[robot])
        assert np.allclose(found.distance, np.take_along_axis(distance, found.view, axis=1))


@given(strategies.integers(0, 10**9))
def test_what_has_not_bound_is_met_in_pairs_that_share_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count, m = int(rng.integers(1, 6)), int(rng.integers(0, 5))
    team = {
        "ugvs": [f"ugv{k}" for k in range(count)], "uav": "uav", "obstacles": rng.normal(size=(m, 3)).tolist(),
        "obstacle_distance": 1.0, "ugv_distance": 1.0, "air_ground_distance": 1.0, "max_speed": [1.0] * (count + 1),
        "radius": [0.0] * (count + 1), "obstacle_radius": [0.0] * m,
    }  # fmt: skip
    views = Views.of(team)
    bound_of = rng.integers(0, 2, views.safe.shape)
    missing = [(i, int(views.points[i, k])) for i, k in np.argwhere(bound_of == 0).tolist()]
    left = {(i, point - m if point >= m else -1 - point) for i, point in missing}
    pairs = wiring.unbound(views, bound_of)
    assert left.issuperset(pairs)
    met = [each for pair in pairs for each in pair]
    assert len(set(met)) == len(met)
    assert all({i, j} & set(met) for i, j in left)  # no other pair could be added


def test_robots_are_put_beside_each_other_until_they_have_bound(
    monkeypatch: pytest.MonkeyPatch, inputs: dict[str, Any]
) -> None:
    monkeypatch.setattr(wiring, "states", lambda *_: iter(()))
    monkeypatch.setattr(wiring, "AGAIN", 0)
    monkeypatch.setattr(wiring, "AGAIN_OF_ROBOTS", 50)
    seen = wiring.compare(inputs)
    assert min(seen["least_times_bound"][kind] for kind in ("uav_ugv", "ugv_ugv")) > 0
    assert seen["states"] < 50
    monkeypatch.setattr(wiring, "AGAIN_OF_ROBOTS", 0)
    assert wiring.compare(inputs)["states"] == 0


def test_in_a_large_team_every_pair_binds(case_a: Scenario) -> None:
    first = case_a.ugvs["ugv1"]
    for k in range(20):
        more = deepcopy(first)
        for point in (more.start_m, more.target_m, *more.preset.waypoints_m):
            point[1] += 100.0 + 5.0 * k
        case_a.ugvs[f"more{k}"] = more
    seen = wiring.compare(SafeInv().inputs(case_a))
    assert seen["agrees"]
    assert seen["views"] == {"obstacle": 23 * 3, "uav_ugv": 44, "ugv_ugv": 22 * 21}
    assert seen["never_bound_count"] == 0


@pytest.fixture
def bodies(case_a: Scenario) -> Scenario:
    """Case A with bodies of different sizes."""
    for body, radius in zip([*case_a.ugvs.values(), case_a.uav], (0.25, 0.1, 0.2), strict=True):
        body.radius_m = radius
    for obstacle, radius in zip(case_a.obstacles.values(), (0.5, 0.0, 0.3), strict=True):
        obstacle.radius_m = radius
    case_a.safe_distance.ugv_m = 1.5  # they start 2 m apart
    return case_a


def test_demands_on_bodies_are_met_by_the_running_team(bodies: Scenario) -> None:
    inputs = SafeInv().inputs(bodies)
    views = Views.of(inputs["team"])
    assert np.array_equal(views.safe, components.make_team(bodies).neighbourhood(slice(None)).distance)
    assert [views.apart(0, other) for other in (-1, -2, 1, 2)] == [2.75, 2.25, 1.85, 1.45]
    assert wiring.compare(inputs)["agrees"]


def test_disturbed_points_are_as_far_apart_as_the_nearest_bodies(bodies: Scenario) -> None:
    given = constants(bodies)
    points = Views.of(as_points(given["team"]))
    assert (points.obstacle_distance, points.ugv_distance, points.air_ground_distance) == (2.1, 1.85, 1.0 + (0.2 + 0.1))
    assert min(kind.safe for kind in kinds(given)) == points.air_ground_distance
    for start in scenes(given):
        apart = np.linalg.norm(start.positions[:, None] - start.team.centres(start.positions), axis=-1)
        assert (apart >= start.team.safe - 1e-9).all(), start.name


@pytest.mark.parametrize("claim", [SafeInv(), SafeGate()], ids=lambda claim: claim.id)
def test_bodies_are_proved(claim: ModelClaim, bodies: Scenario) -> None:
    assert claim.judge(claim.inputs(bodies)).status == "proved"


FORGETFUL: dict[str, Callable[[Team], Team]] = {
    "obstacles are points": lambda team: replace(team, obstacle_radius=0.0),
    "robots are points": lambda team: replace(team, radius=0.0),
    "the UAV is a point": lambda team: replace(team, radius=team.radii * [1.0, 1.0, 0.0]),
    "radii in another order": lambda team: replace(team, radius=np.roll(team.radii, 1)),
    "radii 1e-5 of themselves too small": lambda team: replace(team, radius=(1.0 - 1e-5) * team.radii),
}


@pytest.mark.parametrize("name", FORGETFUL)
def test_a_team_that_forgets_radii_is_refuted(name: str, bodies: Scenario, monkeypatch: pytest.MonkeyPatch) -> None:
    given, right = SafeInv().inputs(bodies), components.make_team
    monkeypatch.setattr(components, "make_team", lambda scenario: FORGETFUL[name](right(scenario)))
    found = wiring.compare(given)
    assert not found["agrees"]
    assert found["first_difference"]["what"] != "a proposal is executed without leave, or not with it"


def test_only_the_other_robot_is_taken_for_a_point(bodies: Scenario, monkeypatch: pytest.MonkeyPatch) -> None:
    right = Team.pair_distance
    monkeypatch.setattr(Team, "pair_distance", lambda team: right(team) - team.radii)
    assert not wiring.compare(SafeInv().inputs(bodies))["agrees"]


def test_kinds_of_bodies_are_the_farthest_fastest_and_nearest(bodies: Scenario) -> None:
    bodies.ugvs["ugv2"].max_speed_m_s = 9.0
    found = [(kind.name, round(kind.safe, 9), kind.closing) for kind in kinds(SafeInv().inputs(bodies))]
    speed = bodies.uav.max_speed_m_s
    one, two = (bodies.ugvs[name].max_speed_m_s for name in ("ugv1", "ugv2"))
    assert found == [
        ("obstacle_1", 2.75, one), ("obstacle_2", 2.7, speed), ("obstacle_3", 2.1, two),
        ("uav_ugv_1", 1.45, speed + one), ("uav_ugv_2", 1.3, speed + two), ("ugv_ugv", 1.85, one + two),
    ]  # fmt: skip
    data = resolved(bodies)
    assert [(kind.name, round(kind.safe_m, 9), kind.closing_m_s) for kind in kinds_of(data)] == found
