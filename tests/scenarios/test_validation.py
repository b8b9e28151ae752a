"""One bad value at a time: every mistake is one line that names file, key, value and what is allowed."""

from __future__ import annotations

import copy
import dataclasses
import math
import re
from fractions import Fraction
from typing import Any

import pytest
import yaml
from scenarios.cases import DATA, DELETE, SMALL, SMALL_DATA, Write, case_a, edit, message

from airground_drake.errors import ScenarioError
from airground_drake.nsbc.avoidance import COMPOSITIONS
from airground_drake.scenarios import validate
from airground_drake.scenarios.load import load

BAD: list[tuple[str, object, list[str]]] = [
    # shape
    ("name", DELETE, ["name: missing", "text"]),
    ("ugvs", DELETE, ["ugvs: missing", "a mapping"]),
    ("uav", DELETE, ["uav: missing", "altitude_m"]),
    ("runs", DELETE, ["runs: missing"]),
    ("runs.d.method", DELETE, ["runs.d.method: missing"]),
    ("ugvs.one.start_m", DELETE, ["ugvs.one.start_m: missing", "a list in m"]),
    ("ugvs.one.preset.waypoints_m", DELETE, ["ugvs.one.preset.waypoints_m: missing"]),
    ("obstacles.rock.position_m", DELETE, ["obstacles.rock.position_m: missing"]),
    ("obstacles.rock.known_to_uav", "yes", ["known_to_uav: 'yes'", "true or false"]),
    ("control.period_s", True, ["control.period_s: True", "a number in s"]),
    ("control.avoidance_gain_1_s", "high", ["'high'", "a number in 1/s"]),
    ("gatekeeper.error_weight_1_m2_s", "x", ["a number in 1/(m^2 s)"]),
    ("decision.noise_m_sqrt_s", [1], ["a list is given", "a number in m/sqrt(s)"]),
    ("ugvs.one.max_speed_m_s", {}, ["a mapping is given", "a number in m/s"]),
    ("ugvs.one.start_m", [0, "0 m", 0], ["ugvs.one.start_m.1: '0 m'", "a number in m"]),
    ("ugvs.one.start_m", 3, ["ugvs.one.start_m: 3", "a list in m"]),
    ("ugvs.one.start_m", [0, 0], ["ugvs.one.start_m: [0.0, 0.0]", "3 numbers in m"]),
    ("uav.phantoms_m", [[0, 0, 0], [1, 2]], ["uav.phantoms_m.1: [1.0, 2.0]", "3 numbers in m"]),
    ("uav.target_m", [0, 0, 0, 0], ["uav.target_m: [", "3 numbers in m"]),
    ("obstacles.rock.position_m", [], ["obstacles.rock.position_m: []", "3 numbers in m"]),
    ("ugvs.one.preset.waypoints_m.1", [], ["waypoints_m.1: []", "3 numbers in m"]),
    ("runs.d.stalls_m.one", [1], ["runs.d.stalls_m.one: [1.0]", "3 numbers in m"]),
    ("ugvs.one.start_m", [0, math.nan, 0], ["ugvs.one.start_m.1: nan", "a finite number in m"]),
    ("duration_s", math.inf, ["duration_s: inf", "a finite number in s"]),
    ("duration_s", 10**400, ["duration_s: inf", "a finite number in s"]),
    ("duration_s", 1e-9, ["duration_s: 1e-09", "at least one control period, control.period_s = "]),
    ("duration_s", -(10**400), ["duration_s:", "a finite number in s"]),
    ("intervention.policies.0.parameters.speed_m_s", math.nan, ["speed_m_s: nan", "a finite number in m/s"]),
    ("intervention.policies.0.parameters.speed_m_s", "fast", ["speed_m_s: 'fast'", "a number in m/s"]),
    ("reproduction.0.paper", [math.inf], ["reproduction.0.paper.0: inf", "a finite number"]),
    # names
    ("name", "a b", ["name: 'a b'", "letters, digits and underscores"]),
    ("name", "n" * 65, ["name: 'nnn", "a name of at most 64 characters"]),
    ("runs." + "r" * 65, {"method": "a"}, ["'rrr", "a name of at most 64 characters"]),
    ("title", "a\u202eb", ["title: '\\u202e'", "the direction of writing"]),
    ("description", "\x1b[2J", ["description: '\\x1b'", "control characters"]),
    ("choices.0.reason", "r" * 10_001, ["choices.0.reason: 'rrr", "at most 10000 characters"]),
    ("name", "../x", ["name: '../x'", "letters, digits and underscores"]),
    ("ugvs.two ", DATA["ugvs"]["ugv1"], ["'two '", "letters"]),
    ("obstacles.1st", {"position_m": [50, 50, 0]}, ["obstacles.1st: '1st'", "does not begin with a digit"]),
    ("obstacles.one", {"position_m": [50, 50, 0]}, ["ugvs.one: 'one'", "no other"]),
    ("uav.name", "rock", ["uav.name: 'rock'", "no other"]),
    ("runs.a-b", {"method": "a"}, ["runs.a-b: 'a-b'", "letters"]),
    ("intervention.policies.0.parameters.not ok", 1, ["parameters.not ok: 'not ok'", "letters"]),
    # counts
    ("ugvs", {}, ["ugvs: 0 UGVs", "1 to 100"]),
    ("runs", {}, ["runs: no run"]),
    ("seed", -1, ["seed: -1", "from 0 to 2147483647"]),
    ("seed", 2**31, ["seed: 2147483648", "from 0 to 2147483647"]),
    ("gatekeeper.stages", 0, ["gatekeeper.stages: 0", "from 1 to 1000"]),
    ("gatekeeper.stages", 1001, ["gatekeeper.stages: 1001", "from 1 to 1000"]),
    # options
    ("gatekeeper.route", "enumeration", ["no longer a route", "mixed_integer", "gatekeeper.blocks: 10"]),
    ("gatekeeper.route", "branch_and_bound", ["no longer a route", "mixed_integer"]),
    ("gatekeeper.route", "rollout", ["no longer a route", "mixed_integer", "method (d)"]),
    ("gatekeeper.budget_nodes", 15000, ["gatekeeper.budget_nodes: no longer a key", "remove it"]),
    ("gatekeeper.lag_m", 0.5, ["gatekeeper.lag_m: no longer a key", "longest_s, tries and rest_s"]),
    ("gatekeeper.behind_s", 2.0, ["gatekeeper.behind_s: no longer a key", "longest_s, tries and rest_s"]),
    ("gatekeeper.blocks", 61, ["gatekeeper.blocks: 61", "1 to gatekeeper.stages"]),
    ("gatekeeper", {"route": "relaxed", "blocks": 10}, ["gatekeeper.blocks: 10", "only the route mixed_integer"]),
    ("gatekeeper.route", "exact", ["gatekeeper.route: 'exact'", "relaxed"]),
    ("decision.trigger", "x", ["decision.trigger: 'x'", "automaton, bare"]),
    ("decision.threshold.rule", "x", ["decision.threshold.rule: 'x'", "fixed, bayes"]),
    ("runs.d.method", "e", ["runs.d.method: 'e'", "a, b, c, d"]),
    ("runs.d.composition", "x", ["runs.d.composition: 'x'", *COMPOSITIONS]),
    ("intervention.policies.0.name", "detuor", ["policies.0.name: 'detuor'", "one of detour"]),
    ("choices.0.source", "paper", ["choices.0.source: 'paper'", "calibrated, ours"]),
    # runs, reproduction, choices
    ("runs.d.stalls_m.three", [1, 0, 0], ["runs.d.stalls_m.three: 'three'", "one of the UGVs one, two"]),
    ("runs.d.expected.SAFE", "holds", ["runs.d.expected.SAFE: 'SAFE'", "SAFE-TRACE, SAFE-HYP"]),
    ("runs.d.expected.COMM", "ok", ["runs.d.expected.COMM: 'ok'", "proved, holds, supported"]),
    ("runs.d.expected.COMM", "exercized", ["runs.d.expected.COMM: 'exercized'", "not_run, exercised, or several"]),
    ("runs.d.expected.COMM", "exercised, refuted", ["'exercised, refuted'", "such as: exercised or refuted"]),
    ("expected", {"SAFE-INV": "exercised or"}, ["expected.SAFE-INV: 'exercised or'", "proved, holds"]),
    ("reproduction.0.run", "b", ["reproduction.0.run: 'b'", "one of the runs d"]),
    ("reproduction.0.robot", "rock", ["reproduction.0.robot: 'rock'", "one, two, uav"]),
    ("reproduction.0.id", "", ["reproduction.0.id: ''", "an identifier"]),
    ("reproduction", DATA["reproduction"][:1] * 2, ["reproduction.0.id: 'A1'", "no other row"]),
    ("reproduction.0.paper", [], ["reproduction.0.paper: []", "at least one number"]),
    ("choices.0.key", "control.periods", ["choices.0.key: 'control.periods'", "a key of this scenario"]),
    # plane, presets
    ("ugvs.one.start_m", [0, 0, 1], ["ugvs.one.start_m: [0.0, 0.0, 1.0]", "z must be 0 m"]),
    ("ugvs.one.target_m", [9, 0, 1], ["ugvs.one.target_m", "z must be 0 m"]),
    ("ugvs.one.preset.waypoints_m.0", [0, 0, 1], ["ugvs.one.preset.waypoints_m.0", "z must be 0 m"]),
    ("runs.d.stalls_m.one", [1, 0, 1], ["runs.d.stalls_m.one", "z must be 0 m"]),
    ("ugvs.one.preset.waypoints_m", [[0, 0, 0]], ["ugvs.one.preset.waypoints_m", "at least 2 waypoints"]),
    ("ugvs.one.preset.waypoints_m.1", [0, 0, 0], ["waypoints_m.1: [0.0, 0.0, 0.0]", "other than the one before"]),
    # gains and periods
    ("control.avoidance_gain_1_s", 41, ["control.avoidance_gain_1_s: 41.0", "at most 40 1/s"]),
    ("control.motion_gain_1_s", 41, ["control.motion_gain_1_s: 41.0", "at most 40 1/s"]),
    ("control.formation_gain_1_s", 41, ["control.formation_gain_1_s: 41.0", "must not exceed 1"]),
    ("control.intervention_gain_1_s", 41, ["control.intervention_gain_1_s: 41.0", "must not exceed 1"]),
    ("gatekeeper.period_s", 0.06, ["gatekeeper.period_s: 0.06", "multiple of control.period_s = 0.025 s"]),
    ("gatekeeper.period_s", 0.0125, ["gatekeeper.period_s: 0.0125", "multiple of control.period_s"]),
    ("intervention.period_s", 0.06, ["intervention.period_s: 0.06", "multiple of control.period_s"]),
    ("gatekeeper.horizon_s", 3.1, ["gatekeeper.horizon_s: 3.1", "horizon_s / stages", "multiple of"]),
    ("gatekeeper.stages", 7, ["gatekeeper.horizon_s: 3.0", "horizon_s / stages = 0.42857", "stages: 120 would do"]),
    ("decision.noise_period_s", 0.01, ["decision.noise_period_s: 0.01", "multiple of control.period_s"]),
    ("decision.leak_1_s", 41, ["decision.leak_1_s: 41.0", "at most 40 1/s", "must not exceed 1"]),
    # decision
    ("decision.release_m", 0, ["decision.release_m: 0.0", "not below 1e-09"]),
    ("decision.release_m", 3, ["decision.release_m: 3.0", "less than the fixed threshold, 3 m"]),
    ("decision.threshold", {"rule": "bayes", "drift_m_s": 1000}, ["decision.release_m: 1.5", "the bayes threshold"]),
    # distances
    ("uav.altitude_m", 1, ["uav.altitude_m: 1.0", "more than safe_distance.air_ground_m = 1 m"]),
    ("safe_distance.collision_m", 1, ["safe_distance.collision_m: 1.0", "less than safe_distance.air_ground_m = 1 m"]),
    ("safe_distance.collision_m", 2, ["safe_distance.collision_m: 2.0", "less than safe_distance.obstacle_m"]),
    ("control.sensing_range_m", 2.2, ["sensing_range_m: 2.2", "2.25 m for uav and rock", "2 m", "10 m/s", "0.025 s"]),
    ("safe_distance.ugv_m", 3.9, ["control.sensing_range_m: 4.0", "4.025 m for two and one", "5 m/s", "ugv_m 3.9 m"]),
    (
        "ugvs.one.start_m",
        [5, -4, 0],
        ["ugvs.one.start_m: [5.0, -4.0, 0.0]", "one starts 1 m from rock", "2 m is needed"],
    ),
    ("uav.start_m", [5, -5, 1], ["uav.start_m", "uav starts 1 m from rock", "safe_distance.obstacle_m = 2 m"]),
    ("ugvs.two.start_m", [0, 1, 0], ["ugvs.two.start_m", "two starts 1 m from one", "safe_distance.ugv_m = 2 m"]),
    ("uav.start_m", [0, 0, 0.5], ["uav.start_m", "uav starts 0.5 m from one", "safe_distance.air_ground_m = 1 m"]),
    ("ugvs.one.target_m", [5, -4, 0], ["ugvs.one.target_m", "one would end 1 m from rock"]),
    ("uav.target_m", [5, -4, 0], ["uav.target_m", "uav would end 1 m from rock"]),
    ("ugvs.two.target_m", [9, 1, 0], ["ugvs.two.target_m", "two would end 1 m from one"]),
    # claims that have moved
    ("runs.d.expected", {"GATE-SUR": "holds"}, ["expected.GATE-SUR", "no longer a claim, it is part of GATE-FEAS"]),
    (
        "runs.d.expected",
        {"GATE-TIME": "exercised"},
        ["no longer a claim, decision times are measurements", "remove it"],
    ),
    # radii
    ("obstacles.rock.radius_m", -1, ["obstacles.rock.radius_m: -1.0", "a number in m, not below 0"]),
    ("ugvs.one.radius_m", "wide", ["ugvs.one.radius_m"]),
    ("obstacles.rock.radius_m", 1.9, ["sensing_range_m: 4.0", "4.15 m for uav and rock", "m + radii 1.9 m + closing"]),
    ("uav.radius_m", 1.5, ["uav.altitude_m: 2.0", "air_ground_m = 1 m + radii 1.5 m, for the UAV"]),
]


@pytest.mark.parametrize(("key", "value", "fragments"), BAD, ids=[f"{i}-{bad[0]}" for i, bad in enumerate(BAD)])
def test_bad_value(key: str, value: object, fragments: list[str], write: Write) -> None:
    data = edit(SMALL_DATA, key, value)
    text = message(write(yaml.safe_dump(data, sort_keys=False)))
    assert re.search(r"bad\.yaml:\d+: ", text), text
    assert all(fragment in text for fragment in fragments), text


def test_a_preset_ends_at_the_target_where_the_ugv_is_expected_there(write: Write) -> None:
    data = edit(edit(SMALL_DATA, "duration_s", 15), "ugvs.two.preset.waypoints_m.1", [9, -5, 0])
    text = message(write(yaml.safe_dump(data)))
    assert "ugvs.two.preset.waypoints_m.1: [9.0, -5.0, 0.0] is not allowed; at most arrival_tolerance_m = 0.1 m" in text
    for key, value in {
        "runs.d.expected.LIVE-GOAL": "holds or refuted",
        "runs.d.stalls_m.two": [4, 5, 0],
        "arrival_tolerance_m": 10,
        "duration_s": 5,  # too short for the preset: nobody is expected to arrive
    }.items():
        load(write(yaml.safe_dump(edit(data, key, value))))


def test_bodies_start_as_far_apart_as_their_radii_demand(write: Write) -> None:
    data = edit(edit(SMALL_DATA, "ugvs.one.radius_m", 0.5), "ugvs.two.radius_m", 0.25)
    load(write(yaml.safe_dump(edit(data, "ugvs.two.start_m", [0.0, 2.75, 0.0]))))
    text = message(write(yaml.safe_dump(edit(data, "ugvs.two.start_m", [0.0, 2.7, 0.0]))))
    assert "two starts 2.7 m from one, at least safe_distance.ugv_m = 2 m + radii 0.75 m is needed" in text


def test_limits_are_those_of_the_proofs_to_the_last_digit(write: Write) -> None:
    """Decimals, not what floating-point numbers make of them; and what a message asks for is allowed."""
    speeds = edit(edit(SMALL_DATA, "ugvs.one.max_speed_m_s", 1.1), "ugvs.two.max_speed_m_s", 2.2)
    slow = edit(edit(edit(speeds, "uav.max_speed_m_s", 1.0), "control.period_s", 0.1), "decision.noise_period_s", 0.1)
    slow = edit(edit(slow, "gatekeeper.period_s", 0.1), "intervention.period_s", 0.1)
    slow = edit(edit(slow, "control.formation_gain_1_s", 1.0), "control.sensing_range_m", 2.33)
    slow = edit(slow, "gatekeeper.stages", 30)
    assert load(write(yaml.safe_dump(slow)))[0].control.sensing_range_m == 2.33
    assert "at least 2.33 m for two and one" in message(
        write(yaml.safe_dump(edit(slow, "control.sensing_range_m", 2.3299999999)))
    )
    assert "at most 33.3333333 1/s" in message(
        write(yaml.safe_dump(edit(edit(SMALL_DATA, "control.period_s", 0.03), "control.motion_gain_1_s", 33.33333334)))
    )


@pytest.mark.parametrize("period", [0.3, 0.7, 0.049, 0.025, 0.1])
def test_a_gain_of_one_over_the_period_is_accepted_whatever_becomes_of_its_last_digit(period: float) -> None:
    common = dict.fromkeys(("control.period_s", "gatekeeper.period_s", "intervention.period_s"), period)
    common |= {"gatekeeper.horizon_s": 10 * period, "gatekeeper.stages": 10, "decision.noise_period_s": period}
    gains = {f"control.{name}": 1.0 / period for name in validate.GAINS}
    control = load("minimal", {**common, **gains, "control.sensing_range_m": 20.0})[0].control
    for name in validate.GAINS:
        gain = getattr(control, name)
        assert gain == pytest.approx(1.0 / period, rel=1e-15)
        assert Fraction(repr(gain)) * Fraction(repr(period)) <= 1  # as proofs and checker take them
    with pytest.raises(ScenarioError, match="must not exceed 1"):
        load("minimal", {**common, **gains, "control.motion_gain_1_s": (1.0 + 1e-14) / period})


def test_the_small_scenario_is_valid_otherwise(write: Write) -> None:
    assert load(write(SMALL))[0].obstacles["rock"].known_to_uav
    load(write(SMALL.replace("rock: {position_m: [5, -5, 0]}", "{}")))
    assert not load(write(yaml.safe_dump(edit(SMALL_DATA, "obstacles", DELETE))))[0].obstacles


def test_a_bayes_threshold_that_cannot_be_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: float) -> float:
        raise ValueError

    monkeypatch.setitem(validate.COMPUTED, "bayes", fail)
    assert "decision.threshold: no bayes threshold" in message("case_a", ["decision.threshold.rule=bayes"])


def test_every_number_of_the_schema_has_a_lower_bound() -> None:
    scenario = copy.deepcopy(case_a()[0])
    seen: set[tuple[type, str]] = set()

    def numbers(value: Any) -> None:
        if dataclasses.is_dataclass(value):
            for field in dataclasses.fields(value):
                child = getattr(value, field.name)
                if field.type is float and (type(value), field.name) not in seen:
                    seen.add((type(value), field.name))
                    setattr(value, field.name, -1.0)
                    with pytest.raises(ScenarioError) as caught:
                        validate.check(scenario, "x")
                    assert caught.value.key.endswith(field.name)
                    setattr(value, field.name, child)
                numbers(child)
        for child in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
            numbers(child)

    numbers(scenario)
    validate.check(scenario, "x")
    assert len(seen) >= 34
