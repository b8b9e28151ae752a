"""Tests of the scenario loader: every mistake is one line that names file, key, value and what is allowed."""

from __future__ import annotations

import copy
import dataclasses
import functools
import hashlib
import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.errors import ScenarioError
from airground_drake.nsbc.avoidance import COMPOSITIONS
from airground_drake.scenarios import schema, validate
from airground_drake.scenarios.load import MAX_BYTES, load, resolved, shipped

CASE_A = Path(schema.__file__).with_name("case_a.yaml")
DATA: dict[str, Any] = yaml.safe_load(CASE_A.read_text(encoding="utf-8"))
DELETE = object()

# A small valid scenario on which one thing at a time is broken.
SMALL = """\
name: small
seed: 3
duration_s: 5
ugvs:
  one: {start_m: [0, 0, 0], target_m: [9, 0, 0], preset: {waypoints_m: [[0, 0, 0], [9, 0, 0]]}, max_speed_m_s: 2}
  two: {start_m: [0, 5, 0], target_m: [9, 5, 0], preset: {waypoints_m: [[0, 5, 0], [9, 5, 0]]}, max_speed_m_s: 3}
uav: {start_m: [0, 2, 2], target_m: [9, 2, 2]}
obstacles:
  rock: {position_m: [5, -5, 0]}
intervention:
  policies: [{name: detour, parameters: {speed_m_s: 3}}]
runs:
  d: {method: d, stalls_m: {one: [1, 0, 0]}, expected: {SAFE-TRACE: holds}}
reproduction: [{id: A1, quantity: q, measure: m, run: d, robot: one, paper: [1.5]}]
choices: [{key: control.period_s, source: ours, reason: r}]
"""


SMALL_DATA: dict[str, Any] = yaml.safe_load(SMALL)


def edit(data: dict[str, Any], key: str, value: object) -> dict[str, Any]:
    """A copy of plain data with a dotted key set, added or deleted."""
    data = copy.deepcopy(data)
    *parents, last = key.split(".")
    node: Any = data
    for part in parents:
        node = node[int(part)] if isinstance(node, list) else node.setdefault(part, {})
    at = int(last) if isinstance(node, list) else last
    if value is DELETE:
        del node[at]
    else:
        node[at] = value
    return data


@functools.cache
def case_a() -> tuple[schema.Scenario, str]:
    """The shipped scenario, loaded once; not to be changed."""
    return load("case_a")


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str | bytes], str]:
    def _write(content: str | bytes) -> str:
        path = tmp_path / "bad.yaml"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return str(path)

    return _write


def message(name_or_path: str, overrides: list[str] | None = None) -> str:
    """The one-line message that loading fails with."""
    with pytest.raises(ScenarioError) as caught:
        load(name_or_path, overrides or [])
    text = str(caught.value)
    assert text.isprintable()
    assert len(text.splitlines()) == 1
    return text


# --- what is well-formed loads ---------------------------------------------------------------------------------


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

    assert covers(plain, DATA)


def test_resolved_round_trips(write: Callable[[str | bytes], str]) -> None:
    scenario, _ = case_a()
    again, _ = load(write(yaml.safe_dump(resolved(scenario), sort_keys=False)))
    assert again == scenario
    assert resolved(again) == resolved(scenario)


def test_numbers_are_read_by_the_rules_of_yaml_1_2(write: Callable[[str | bytes], str]) -> None:
    path = write(SMALL.replace("duration_s: 5", "duration_s: 1e+1\nstall_tolerance_m: 2E-2\ntitle: yes"))
    scenario, _ = load(path)
    assert (scenario.duration_s, scenario.stall_tolerance_m, scenario.title) == (10.0, 0.02, "yes")
    assert type(scenario.ugvs["one"].max_speed_m_s) is float


def test_anchors_merges_and_private_templates(write: Callable[[str | bytes], str]) -> None:
    text = SMALL.replace("max_speed_m_s: 2}", "<<: *fast}").replace("max_speed_m_s: 3}", "<<: [*fast, {}]}")
    path = write("_template: &fast {max_speed_m_s: 4}\n" + text)
    scenario, _ = load(path, ["ugvs.one.max_speed_m_s=5"])
    assert [ugv.max_speed_m_s for ugv in scenario.ugvs.values()] == [5.0, 4.0]


def test_a_byte_order_mark_and_crlf_are_harmless(write: Callable[[str | bytes], str]) -> None:
    assert load(write(b"\xef\xbb\xbf" + SMALL.replace("\n", "\r\n").encode()))[0].name == "small"


def test_starting_exactly_at_the_safe_distance_is_allowed(write: Callable[[str | bytes], str]) -> None:
    angle = 0.3
    start = [5 + 2 * math.cos(angle), -5 + 2 * math.sin(angle), 0.0]
    assert load(write(SMALL), [f"ugvs.one.start_m={start}"])[0].ugvs["one"].start_m == start


@pytest.mark.parametrize("period", ["0.05", "0.1", "0.01", "0.0625"])
def test_multiples_tolerate_rounding(period: str, write: Callable[[str | bytes], str]) -> None:
    overrides = ["control.period_s=0.01", "decision.noise_period_s=0.01", "intervention.period_s=0.07"]
    if period == "0.0625":
        assert "gatekeeper.period_s: 0.0625" in message(write(SMALL), [*overrides, f"gatekeeper.period_s={period}"])
    else:
        load(write(SMALL), [*overrides, f"gatekeeper.period_s={period}"])


def test_policies_of_the_registry_and_plug_ins(write: Callable[[str | bytes], str]) -> None:
    path = write(SMALL)
    load(path, ["intervention.policies.0.name=my.module:Policy"])
    with pytest.raises(ScenarioError, match="one of detour"):
        load(path, ["intervention.policies.0.name=teleport"])


# --- overrides ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("override", "value"),
    [
        ("seed=7", 7),
        ("control.sensing_range_m=5", 5.0),
        ("ugvs.ugv1.preset.speed_m_s=1e-1", 0.1),
        ("ugvs.ugv1.preset.waypoints_m.1=[3.3, 14, 0]", [3.3, 14.0, 0.0]),
        ("ugvs.ugv1.start_m.0=1.25", 1.25),
        ("intervention.policies.0.parameters.speed_m_s=3", 3.0),
        ("safe_distance.collision_m=0.1", 0.1),
        ("obstacles.obstacle_3.known_to_uav=false", False),
        ("title=a = b", "a = b"),
        ("runs.b.expected={SAFE-TRACE: refuted}", {"SAFE-TRACE": "refuted"}),
    ],
)
def test_override(override: str, value: object) -> None:
    scenario, digest = load("case_a", [override])
    base, base_digest = case_a()
    assert resolved(scenario) == edit(resolved(base), override.partition("=")[0], value)
    assert digest != base_digest


def test_overrides_apply_in_order_and_leave_aliases_alone(write: Callable[[str | bytes], str]) -> None:
    first, second = "preset: {waypoints_m: [[0, 0, 0]", "preset: {waypoints_m: [[0, 5, 0], [9, 5, 0]]}"
    path = write(SMALL.replace(first, first.replace("preset:", "preset: &shared")).replace(second, "preset: *shared"))
    scenario, _ = load(path, ["ugvs.one.preset.speed_m_s=1.5", "ugvs.one.preset.speed_m_s=2"])
    assert [ugv.preset.speed_m_s for ugv in scenario.ugvs.values()] == [2.0, 1.0]


def test_the_digest_depends_on_how_overrides_are_split(write: Callable[[str | bytes], str]) -> None:
    path, splits = write(SMALL), (["title=a", "title=b"], ["title=b"], ["title=atitle=b"])
    assert len({load(path, overrides)[1] for overrides in splits}) == 3


@pytest.mark.parametrize(
    ("override", "fragments"),
    [
        ("seed", ["--set seed", "dotted.key=value"]),
        ("=1", ["--set =1", "dotted.key=value"]),
        ("contrl.period_s=1", ["contrl: unknown key", "did you mean control?", "obstacles"]),
        ("control.period=1", ["control.period: unknown key", "did you mean period_s?", "avoidance_gain_1_s"]),
        ("ugvs.ugv9.max_speed_m_s=1", ["ugvs.ugv9: unknown key", "ugv1, ugv2"]),
        ("ugvs..start_m=1", ["ugvs.: unknown key"]),
        ("intervention.policies.3.name=x", ["intervention.policies.3: unknown key", "allowed: 0"]),
        ("intervention.policies.0.parameters.sped_m_s=1", ["parameters.sped_m_s", "did you mean speed_m_s?"]),
        ("seed.x=1", ["seed.x: unknown key", "allowed: none"]),
        ("control.period_s=5 km", ["--set", "control.period_s: '5 km'", "a number in s"]),
        ("control.period_s=", ["--set control.period_s=", "empty"]),
        ("control.period_s=[", ["--set control.period_s=[", "not YAML"]),
        (
            "control.period_s=-1",
            ["--set control.period_s=-1: control.period_s: -1.0", "a number in s, not below 1e-09"],
        ),
        ("seed=1\n2", ["--set seed=1\\n2"]),
        ("ugvs=null", ["--set ugvs=null: ugvs: no value is given", "a mapping"]),
    ],
)
def test_bad_override(override: str, fragments: list[str]) -> None:
    text = message("case_a", [override])
    assert all(fragment in text for fragment in fragments), text


# --- files that are no scenario --------------------------------------------------------------------------------


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
        (b"a: &a\n  <<: *a\n", ["a: unknown key"]),
        (b"name: " + b"x" * MAX_BYTES, ["too large", str(MAX_BYTES)]),
        (b"? [a, b]\n: 1\n", ["bad.yaml:1", "as a key"]),
        (b"!!set {a}\n", ["bad.yaml:1: the tag set is given", "a mapping"]),
        (b"<<: 5\n", ["bad.yaml:1: <<: 5", "mappings to merge"]),
    ],
)
def test_files_that_are_no_scenario(content: bytes, fragments: list[str], write: Callable[[str | bytes], str]) -> None:
    text = message(write(content))
    assert "bad.yaml" in text
    assert all(fragment in text for fragment in fragments), text


@pytest.mark.parametrize(
    ("old", "new", "fragments"),
    [
        ("seed: 3", "seed: 3\nseed: 4", ["bad.yaml:3: seed: given twice", "bad.yaml:2"]),
        ("  rock:", "  rock: {position_m: [9, 9, 9]}\n  rock:", ["bad.yaml:10: obstacles.rock: given twice", ":9"]),
        ("seed: 3", "sede: 3", ["bad.yaml:2: sede: unknown key", "did you mean seed?", "duration_s"]),
        ("  rock: {", "  rock: {radius_m: 1, ", ["bad.yaml:9: obstacles.rock.radius_m", "position_m, known_to_uav"]),
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
def test_errors_name_the_line(old: str, new: str, fragments: list[str], write: Callable[[str | bytes], str]) -> None:
    assert old in SMALL
    text = message(write(SMALL.replace(old, new)))
    assert all(fragment in text for fragment in fragments), text


# --- one bad value at a time -----------------------------------------------------------------------------------

BAD: list[tuple[str, object, list[str]]] = [
    # shape
    ("name", DELETE, ["name: missing", "text"]),
    ("ugvs", DELETE, ["ugvs: missing", "a mapping"]),
    ("uav", DELETE, ["uav: missing", "altitude_m"]),
    ("obstacles", DELETE, ["obstacles: missing"]),
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
    ("uav.target_m", [0, 0, 0, 0], ["uav.target_m: [", "3 numbers in m"]),
    ("obstacles.rock.position_m", [], ["obstacles.rock.position_m: []", "3 numbers in m"]),
    ("ugvs.one.preset.waypoints_m.1", [], ["waypoints_m.1: []", "3 numbers in m"]),
    ("runs.d.stalls_m.one", [1], ["runs.d.stalls_m.one: [1.0]", "3 numbers in m"]),
    ("ugvs.one.start_m", [0, math.nan, 0], ["ugvs.one.start_m.1: nan", "a finite number in m"]),
    ("duration_s", math.inf, ["duration_s: inf", "a finite number in s"]),
    ("duration_s", 10**400, ["duration_s: inf", "a finite number in s"]),
    ("duration_s", -(10**400), ["duration_s:", "a finite number in s"]),
    ("intervention.policies.0.parameters.speed_m_s", math.nan, ["speed_m_s: nan", "a finite number in m/s"]),
    ("intervention.policies.0.parameters.speed_m_s", "fast", ["speed_m_s: 'fast'", "a number in m/s"]),
    ("reproduction.0.paper", [math.inf], ["reproduction.0.paper.0: inf", "a finite number"]),
    # names
    ("name", "a b", ["name: 'a b'", "letters, digits and underscores"]),
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
    ("gatekeeper.stages", 7, ["gatekeeper.horizon_s: 3.0", "horizon_s / stages = 0.42857"]),
    ("decision.noise_period_s", 0.01, ["decision.noise_period_s: 0.01", "multiple of control.period_s"]),
    # decision
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
]


@pytest.mark.parametrize(("key", "value", "fragments"), BAD, ids=[f"{i}-{bad[0]}" for i, bad in enumerate(BAD)])
def test_bad_value(key: str, value: object, fragments: list[str], write: Callable[[str | bytes], str]) -> None:
    data = edit(SMALL_DATA, key, value)
    text = message(write(yaml.safe_dump(data, sort_keys=False)))
    assert re.search(r"bad\.yaml:\d+: ", text), text
    assert all(fragment in text for fragment in fragments), text


def test_the_small_scenario_is_valid_otherwise(write: Callable[[str | bytes], str]) -> None:
    assert load(write(SMALL))[0].obstacles["rock"].known_to_uav
    load(write(SMALL.replace("rock: {position_m: [5, -5, 0]}", "{}")))


def test_a_bayes_threshold_that_cannot_be_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: float) -> float:
        raise ValueError

    monkeypatch.setattr(validate, "optimal_threshold", fail)
    assert "decision.threshold: no Bayes threshold" in message("case_a", ["decision.threshold.rule=bayes"])


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


# --- nothing but ScenarioError, whatever the file --------------------------------------------------------------


def leaves(node: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths to every node below the root."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    return [found for key, child in items for found in ((*path, key), *leaves(child, (*path, key)))]


JUNK = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.integers(-3, 3).map(lambda k: k * 10**400),
    st.floats(),
    st.sampled_from([1e308, -1e308, 5e-324, 1e-9, 1e9]),
    st.text(max_size=5),
    st.text(st.characters(categories=["Cs", "Cc", "Zl", "Zp"]), max_size=3),
    st.sampled_from(["5 km", "nan", "a\nb", "<<", "*x", "yes", "2020-01-01", ""]),
    st.just([]),
    st.just({}),
    st.lists(st.floats(), max_size=4),
    st.lists(st.lists(st.floats(-20, 20), min_size=3, max_size=3), max_size=3),
    st.dictionaries(st.text(max_size=3), st.integers(), max_size=2),
)


def load_if_valid(path: str, overrides: Sequence[str] = ()) -> schema.Scenario | None:
    """The scenario, or None where it is refused in one printable line; any other exception passes."""
    refusal = ""
    try:
        return load(path, overrides)[0]
    except ScenarioError as error:
        refusal = str(error)
    assert refusal.isprintable()
    return None


def loads_or_explains(path: Path, content: bytes) -> None:
    """Load; an accepted scenario round-trips, a refused one is explained in one line."""
    path.write_bytes(content)
    scenario = load_if_valid(str(path))
    if scenario is not None:
        path.write_text(yaml.safe_dump(resolved(scenario), sort_keys=False), encoding="utf-8")
        assert load(str(path))[0] == scenario


@examples(40, fuzz=3000)
@given(data=st.data())
def test_mutated_data(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    mutated = copy.deepcopy(SMALL_DATA)
    for _ in range(data.draw(st.integers(1, 2))):
        paths = leaves(mutated)
        *parents, last = data.draw(st.sampled_from(paths)) if paths else ("name",)
        node = mutated
        for part in parents:
            node = node[part]
        action = data.draw(st.sampled_from(["replace", "replace", "drop", "add"]))
        if action == "drop" and paths:
            del node[last]
        elif action == "add" and isinstance(node, dict):
            node[data.draw(st.text(max_size=4))] = data.draw(JUNK)
        else:
            node[last] = data.draw(JUNK)
    text = yaml.safe_dump(mutated, sort_keys=False)
    loads_or_explains(tmp_path_factory.getbasetemp() / "mutated.yaml", text.encode("utf-8", "surrogatepass"))


@examples(40, fuzz=3000)
@given(data=st.data())
def test_mutated_text(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    content = SMALL.encode()
    begin = data.draw(st.integers(0, len(content)))
    end = data.draw(st.integers(begin, min(begin + 30, len(content))))
    inserted = data.draw(st.one_of(st.binary(max_size=6), st.text("{}[]:,&*!|>%@`'\"\\#-? \t\n0a<.~", max_size=6)))
    new = inserted if isinstance(inserted, bytes) else inserted.encode()
    loads_or_explains(tmp_path_factory.getbasetemp() / "mutated.yaml", content[:begin] + new + content[end:])


@examples(40)
@given(
    key=st.one_of(st.sampled_from([".".join(map(str, path)) for path in leaves(SMALL_DATA)]), st.text()),
    value=st.one_of(JUNK.map(str), st.text(max_size=8)),
)
def test_random_overrides(tmp_path_factory: pytest.TempPathFactory, key: str, value: str) -> None:
    path = tmp_path_factory.getbasetemp() / "overridden.yaml"
    path.write_text(SMALL, encoding="utf-8")
    load_if_valid(str(path), [f"{key}={value}"])
