"""What is well-formed loads; what is no scenario is refused in one line that names file, key and what is allowed."""

from __future__ import annotations

import hashlib
import math
import re
from dataclasses import replace
from typing import Any

import pytest
from scenarios.cases import CASE_A, DATA, SMALL, Write, case_a, message

from airground_drake.errors import ScenarioError
from airground_drake.scenarios.document import MAX_BYTES, text_of
from airground_drake.scenarios.load import load, resolved, shipped, validated
from airground_drake.scenarios.schema import Control, Preset, Scenario, Uav, Ugv


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


def test_policies_of_the_registry_and_plug_ins(write: Write) -> None:
    path = write(SMALL)
    load(path, ["intervention.policies.0.name=my.module:Policy"])
    with pytest.raises(ScenarioError, match="one of detour"):
        load(path, ["intervention.policies.0.name=teleport"])


def test_unknown_name_lists_the_shipped_scenarios() -> None:
    text = message("case-a")
    assert "case-a: no such scenario or file; did you mean case_a?" in text
    assert all(name in text for name in shipped())


@pytest.mark.parametrize("path", ["", ".", "/", "a\0b", "no/such/file.yaml", "x" * 5000, "line\nbreak"])
def test_unreadable_paths(path: str) -> None:
    assert re.search("no such|cannot be read", message(path))


@pytest.mark.parametrize(
    ("content", "fragments"),
    [
        (b"", [": empty"]),
        (b"# only a comment\n", [": empty"]),
        (b"name: \xff\xfe\n", ["bad.yaml:1", "not UTF-8"]),
        (b"just words\n", ["bad.yaml:1", "'just words' is not allowed", "a mapping with the keys name, title"]),
        (b"- a\n- b\n", ["bad.yaml:1", "a list is given", "a mapping"]),
        (b"name: x\nugvs: [1, 2\nuav: 3\n", ["bad.yaml:3", "not YAML"]),
        (b"a: 1\n\tb: 2\n", ["bad.yaml:2", "not YAML"]),
        (b"a: 1\nb: \x07\n", ["bad.yaml:2", "not YAML", "special characters"]),
        (b'a: "\\U99999999"\n', ["bad.yaml", "not YAML"]),
        (b"a: 1\n--- \nb: 2\n", ["not YAML"]),
        (b"[" * 1000, ["nested too deeply"]),
        (b"a: &a\n  <<: *a\n", ["bad.yaml:2: nested too deeply"]),
        (b"name: " + b"x" * MAX_BYTES, ["too large", str(MAX_BYTES)]),
        (b"? [a, b]\n: 1\n", ["bad.yaml:1", "as a key"]),
        (b"!!set {a}\n", ["bad.yaml:1: the tag set is given", "a mapping"]),
        (b"<<: 5\n", ["bad.yaml:1: <<: 5", "mappings to merge"]),
    ],
)
def test_files_that_are_no_scenario(content: bytes, fragments: list[str], write: Write) -> None:
    text = message(write(content))
    assert "bad.yaml" in text
    assert all(fragment in text for fragment in fragments), text


@pytest.mark.parametrize(
    ("old", "new", "fragments"),
    [
        ("seed: 3", "seed: 3\nseed: 4", ["bad.yaml:3: seed: given twice", "bad.yaml:2"]),
        ("  rock:", "  rock: {position_m: [9, 9, 9]}\n  rock:", ["bad.yaml:10: obstacles.rock: given twice", ":9"]),
        ("seed: 3", "sede: 3", ["bad.yaml:2: sede: unknown key", "did you mean seed?", "duration_s"]),
        ("  rock: {", "  rock: {width_m: 1, ", ["bad.yaml:9: obstacles.rock.width_m", "position_m, known_to_uav"]),
        ("duration_s: 5", "duration_s: 5 km", ["bad.yaml:3: duration_s: '5 km'", "a number in s"]),
        ("ugvs:", "ugvs: &a\n  <<: *a", ["nested too deeply"]),
        ("name: small", "name: !custom x", ["bad.yaml:1: name: the tag !custom is given", "text"]),
        ("ugvs:", "ugvs: !custom", ["bad.yaml:4: ugvs: the tag !custom is given", "a mapping"]),
        ("name: small", 'name: "\\ud800"', ["bad.yaml:1: name: a value is given that cannot be read"]),
        ("seed: 3", "seed: !!int x", ["bad.yaml:2: seed: a value is given that cannot be read"]),
        ("seed: 3", f"seed: {'1' * 5000}", ["bad.yaml:2: seed: a value is given that cannot be read"]),
        ("seed: 3", "seed: 3.5", ["bad.yaml:2: seed: 3.5", "a whole number"]),
        ("name: small", "name: 17", ["bad.yaml:1: name: 17", "text"]),
        ("obstacles:\n  rock: {position_m: [5, -5, 0]}", "obstacles:", ["obstacles: no value is given", "a mapping"]),
    ],
)
def test_errors_name_the_line(old: str, new: str, fragments: list[str], write: Write) -> None:
    assert old in SMALL
    text = message(write(SMALL.replace(old, new)))
    assert all(fragment in text for fragment in fragments), text


def test_the_uav_ends_over_the_centroid_of_the_targets_unless_the_scenario_says_where(write: Write) -> None:
    assert load(write(SMALL))[0].uav.target_m == [9.0, 2.0, 2.0]
    silent = write(SMALL.replace("uav: {start_m: [0, 2, 2], target_m: [9, 2, 2]}", "uav: {start_m: [0, 2, 2]}"))
    assert load(silent)[0].uav.target_m == [9.0, 2.5, 2.0]
    moved = ["ugvs.one.target_m=[5, 1, 0]", "ugvs.one.preset.waypoints_m.1=[5, 1, 0]", "uav.altitude_m=3"]
    scenario = load(silent, moved)[0]
    assert scenario.uav.target_m == [7.0, 3.0, 3.0]
    assert validated(replace(scenario, uav=Uav(start_m=[0.0, 2.0, 2.0]))).uav.target_m == [7.0, 3.0, 2.0]
    assert "ugvs.one.target_m: [5.0]" in message(silent, ["ugvs.one.target_m=[5]"])


@pytest.mark.parametrize("part", [Scenario, Uav, Ugv, Preset, Control])
def test_an_attribute_that_is_no_key_cannot_be_set(part: type) -> None:
    with pytest.raises(AttributeError, match="has no attribute 'max_sped'"):
        part().max_sped = 3.0
