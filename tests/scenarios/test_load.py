"""What is well-formed loads, with the values of the file."""

from __future__ import annotations

import hashlib
import math
from dataclasses import replace
from typing import Any

import pytest
from scenarios.cases import CASE_A, DATA, SMALL, Write, case_a, message

from airground_drake.scenarios.document import text_of
from airground_drake.scenarios.load import load, resolved, shipped, validated
from airground_drake.scenarios.schema import Uav


@pytest.mark.parametrize("name", shipped())
def test_shipped_scenarios_load(name: str) -> None:
    scenario, digest = load(name)
    file = CASE_A.with_name(f"{name}.yaml")
    assert scenario.name == name
    assert digest == hashlib.sha256(file.read_bytes()).hexdigest() == load(str(file))[1]


def test_values_are_those_of_the_file() -> None:
    plain = resolved(case_a()[0])
    assert list(plain["ugvs"]) == list(DATA["ugvs"])
    assert list(plain["obstacles"]) == list(DATA["obstacles"])

    def covers(whole: Any, part: Any) -> bool:
        if isinstance(part, dict):
            return all(key in whole and covers(whole[key], value) for key, value in part.items())
        if isinstance(part, list):
            return len(whole) == len(part) and all(map(covers, whole, part))
        return bool(whole == part)

    assert covers(plain, {name: part for name, part in DATA.items() if not name.startswith("_")})


@pytest.mark.parametrize("title", ["Case A", "1e5", "1:30", "yes", "0x1f", ".5", "~", "+1", "", "Ä: #"])
def test_resolved_round_trips(title: str, write: Write) -> None:
    """Whatever text looks like by the rules of YAML 1.1 or 1.2."""
    scenario = replace(case_a()[0], title=title)
    again, _ = load(write(text_of(resolved(scenario))))
    assert again == scenario
    assert resolved(again) == resolved(scenario)


def test_numbers_are_read_by_the_rules_of_yaml_1_2(write: Write) -> None:
    path = write(SMALL.replace("duration_s: 5", "duration_s: 1e+1\nstall_tolerance_m: 2E-2\ntitle: yes"))
    scenario, _ = load(path)
    assert (scenario.duration_s, scenario.stall_tolerance_m, scenario.title) == (10.0, 0.02, "yes")
    assert type(scenario.ugvs["one"].max_speed_m_s) is float


def test_anchors_merges_and_private_templates(write: Write) -> None:
    text = SMALL.replace("max_speed_m_s: 2}", "<<: *fast}").replace("max_speed_m_s: 3}", "<<: [*fast, {}]}")
    path = write("_template: &fast {max_speed_m_s: 4}\n" + text)
    scenario, _ = load(path, ["ugvs.one.max_speed_m_s=5"])
    assert [ugv.max_speed_m_s for ugv in scenario.ugvs.values()] == [5.0, 4.0]


def test_a_byte_order_mark_and_crlf_are_harmless(write: Write) -> None:
    assert load(write(b"\xef\xbb\xbf" + SMALL.replace("\n", "\r\n").encode()))[0].name == "small"


def test_starting_exactly_at_the_safe_distance_is_allowed(write: Write) -> None:
    angle = 0.3
    start = [5 + 2 * math.cos(angle), -5 + 2 * math.sin(angle), 0.0]
    assert load(write(SMALL), [f"ugvs.one.start_m={start}"])[0].ugvs["one"].start_m == start


@pytest.mark.parametrize("period", ["0.05", "0.1", "0.01", "0.0625"])
def test_multiples_tolerate_rounding(period: str, write: Write) -> None:
    overrides = ["control.period_s=0.01", "decision.noise_period_s=0.01", "intervention.period_s=0.07"]
    if period == "0.0625":
        assert "gatekeeper.period_s: 0.0625" in message(write(SMALL), [*overrides, f"gatekeeper.period_s={period}"])
    else:
        load(write(SMALL), [*overrides, f"gatekeeper.period_s={period}"])


def test_a_plug_in_may_stand_for_a_policy(write: Write) -> None:
    assert load(write(SMALL), ["intervention.policies.0.name=my.module:Policy"])


def test_the_uav_ends_over_the_centroid_of_the_targets_unless_the_scenario_says_where(write: Write) -> None:
    assert load(write(SMALL))[0].uav.target_m == [9.0, 2.0, 2.0]
    silent = write(SMALL.replace("uav: {start_m: [0, 2, 2], target_m: [9, 2, 2]}", "uav: {start_m: [0, 2, 2]}"))
    assert load(silent)[0].uav.target_m == [9.0, 2.5, 2.0]
    moved = ["ugvs.one.target_m=[5, 1, 0]", "ugvs.one.preset.waypoints_m.1=[5, 1, 0]", "uav.altitude_m=3"]
    scenario = load(silent, moved)[0]
    assert scenario.uav.target_m == [7.0, 3.0, 3.0]
    assert validated(replace(scenario, uav=Uav(start_m=[0.0, 2.0, 2.0]))).uav.target_m == [7.0, 3.0, 2.0]
    assert "ugvs.one.target_m: [5]" in message(silent, ["ugvs.one.target_m=[5]"])


def test_an_attribute_that_is_no_key_cannot_be_set() -> None:
    scenario = load("minimal")[0]
    ugv = scenario.ugvs["ugv1"]
    for part in (scenario, scenario.uav, ugv, ugv.preset, scenario.control):
        with pytest.raises(AttributeError, match="has no attribute 'max_sped'"):
            part.max_sped = 3.0
