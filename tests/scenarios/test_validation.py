"""Rules of a scenario that take more than one bad value to show; the others are in `bad_inputs.py`."""

from __future__ import annotations

from fractions import Fraction

import pytest
import yaml
from scenarios.cases import DELETE, SMALL, SMALL_DATA, Write, edit, message

from airground_drake.base.errors import ScenarioError
from airground_drake.scenarios import json_schema, validate
from airground_drake.scenarios.load import load


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
    properties = [
        each for part in json_schema.scenario_schema()["$defs"].values() for each in part["properties"].items()
    ]
    numbers = {name: says for name, says in properties if name != "<<" and says.get("type") in ("number", "integer")}
    assert all(0 <= says["minimum"] < says["maximum"] <= 2**31 for says in numbers.values()), numbers
    assert len(numbers) >= 34
