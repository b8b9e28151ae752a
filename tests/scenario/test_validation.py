"""Rules of a scenario that take more than one bad value to show; the others are in `bad_inputs.py`."""

import re
from fractions import Fraction

import pytest
import yaml
from scenario.cases import SMALL_DATA, Write, edit, message

from airground_drake.base.errors import ScenarioError
from airground_drake.scenario import json_schema, validate
from airground_drake.scenario.load import load, validated
from airground_drake.scenario.rounding import TOLERANCE_M
from airground_drake.scenario.schema import Scenario
from airground_drake.verify.runs.pairs import DISTANCE_TOLERANCE_M


def test_a_preset_ends_at_the_target_where_the_ugv_is_expected_there(write: Write) -> None:
    data = edit(edit(SMALL_DATA, "duration_s", 15), "ugvs.two.preset.waypoints_m.1", [9, -5, 0])
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
    assert "two starts 1.95 m from one, at least safe_distance.ugv_m = 2 m is needed" in text


@pytest.mark.parametrize("period", [0.3, 0.7, 0.049, 0.025])
def test_a_gain_of_one_over_the_period_is_accepted_whatever_becomes_of_its_last_digit(period: float) -> None:
    common = dict.fromkeys(("control.period_s", "gatekeeper.period_s", "intervention.period_s"), period)
    common |= {"gatekeeper.horizon_s": 10 * period, "gatekeeper.stages": 10, "decision.noise_period_s": period}
    gains = {f"control.{name}": 1.0 / period for name in validate.GAINS}
    control = load("minimal", {**common, **gains, "control.sensing_range_m": 20.0}).control
    for name in validate.GAINS:
        gain = getattr(control, name)
        assert gain == pytest.approx(1.0 / period, rel=1e-15)
        assert Fraction(repr(gain)) * Fraction(repr(period)) <= 1  # as proofs and checker take them
    with pytest.raises(ScenarioError, match="must not exceed 1"):
        load("minimal", {**common, **gains, "control.motion_gain_1_s": (1.0 + 1e-14) / period})


def test_every_number_of_the_schema_has_a_lower_bound() -> None:
    properties = [
        each for part in json_schema.scenario_schema()["$defs"].values() for each in part["properties"].items()
    ]
    numbers = {name: says for name, says in properties if name != "<<" and says.get("type") in ("number", "integer")}
    least = dict.fromkeys(numbers, 0.0) | {"heading_rad": -1e9}
    assert all(least[name] <= says["minimum"] < says["maximum"] <= 2**31 for name, says in numbers.items()), numbers
    assert len(numbers) >= 34


# --- scenarios in which rounding could take more from a safe distance than SAFE-TRACE tolerates


@pytest.mark.parametrize("key", ["ugvs.ugv1.start_m", "ugvs.ugv1.target_m", "uav.start_m", "uav.target_m"])
def test_robots_start_and_end_within_the_arena(key: str) -> None:
    arena = {"arena_m": [[14.0, -6.0], [-4.0, 6.0]]}
    load("minimal", arena)
    with pytest.raises(ScenarioError, match=rf"{key}: .* is not allowed; a place within arena_m = "):
        load("minimal", {**arena, key: [11.0, 6.0, 3.0 * key.startswith("uav")]})


def test_one_tolerance() -> None:
    assert TOLERANCE_M == DISTANCE_TOLERANCE_M


def moved(scenario: Scenario, by: float) -> Scenario:
    ugvs, uav, runs = scenario.ugvs.values(), scenario.uav, scenario.runs.values()
    places = [place for ugv in ugvs for place in (ugv.start_m, ugv.target_m, *ugv.preset.waypoints_m)]
    places += [uav.start_m, uav.target_m, *(each.position_m for each in scenario.obstacles.values())]
    for place in [*places, *(stall for run in runs for stall in run.stalls_m.values())]:
        place[0] += by
    return scenario


def test_coordinates_far_away_are_refused_and_the_message_says_what_is_allowed(case_a: Scenario) -> None:
    with pytest.raises(ScenarioError, match=r"coordinates of at most .*1e-09 m") as caught:
        validated(moved(case_a, 1.6e7))
    allowed = float(str(caught.value).split("coordinates of at most ")[1].split(" m")[0])
    assert 1e3 < allowed < 1e4
    validated(moved(load("case_a"), allowed - 13.0))
    with pytest.raises(ScenarioError):
        validated(moved(load("case_a"), 1.001 * allowed))
    validated(moved(load("case_a", {"control.avoidance_gain_1_s": 0.0, "duration_s": 1e4}), 1e7))


@pytest.mark.parametrize(("key", "value"), [("duration_s", 1e5), ("control.avoidance_gain_1_s", 1e-6)])
def test_the_rounding_bound_names_what_is_to_blame_and_what_is_allowed(key: str, value: float) -> None:
    with pytest.raises(ScenarioError, match=f"{key}:") as caught:
        load("case_a", {key: value})
    load("case_a", {key: float(re.findall(r"at (?:most|least) ([\d.e+-]+) ", str(caught.value))[0])})
