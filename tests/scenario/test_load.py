"""What is well-formed loads, with the values of the file, of `--set` and of each run's `set`."""

import math
from dataclasses import asdict, replace

import pytest
import yaml
from scenario.cases import SMALL, SMALL_DATA, Write, case_a, edit, message

from airground_drake.base.errors import ScenarioError
from airground_drake.scenario import plugins
from airground_drake.scenario.document import text_of
from airground_drake.scenario.load import load, own, resolved, validated
from airground_drake.scenario.schema import Obstacle, Uav


@pytest.mark.parametrize(
    "title", ["Case A", "1e5", "1:30", "yes", "0x1f", ".5", "~", "+1", "", "\u00c4: # \U0001f697 \\"]
)
def test_resolved_round_trips(title: str, write: Write) -> None:
    scenario = replace(case_a(), title=title)
    assert load(write(text_of(resolved(scenario)))) == scenario
    assert validated(case_a(), {"title": title}).title == title


def test_yaml_is_read_by_version_1_2_with_anchors_merges_and_templates(write: Write) -> None:
    text = "_template: &fast {max_speed_m_s: 4}\n" + SMALL
    for old, new in {
        "duration_s: 5": "duration_s: 1e+1\nstall_tolerance_m: 2E-2\ntitle: yes",
        "max_speed_m_s: 2}": "<<: *fast}",
        "max_speed_m_s: 3}": "<<: [*fast, {}]}",
        "\n": "\r\n",
    }.items():
        text = text.replace(old, new)
    scenario = load(write(b"\xef\xbb\xbf" + text.encode()), ["ugvs.one.max_speed_m_s=5"])
    assert (scenario.duration_s, scenario.stall_tolerance_m, scenario.title) == (10.0, 0.02, "yes")
    assert [ugv.max_speed_m_s for ugv in scenario.ugvs.values()] == [5.0, 4.0]
    assert type(scenario.ugvs["one"].start_m[0]) is float


@pytest.mark.parametrize(
    ("override", "value"),
    [
        ("seed=7", 7),
        ("control.sensing_range_m=5", 5.0),
        ("ugvs.ugv1.preset.waypoints_m.1=[3.3, 13.05, 0]", [3.3, 13.05, 0.0]),
        ("ugvs.ugv1.start_m.0=1.25", 1.25),
        ("intervention.policies.0.parameters.clearance_m=2e-1", 0.2),
        ("intervention.policies.0.name=my.module:Policy", "my.module:Policy"),
        ("obstacles.obstacle_3.known_to_uav=false", False),
        ("obstacles._box={position_m: [-9, -9, 0], known_to_uav: true, radius_m: 0}",
         asdict(Obstacle([-9.0, -9.0, 0.0]))),
        ("title=a = b", "a = b"),
        ("runs.b.expected={SAFE-TRACE: refuted}", {"SAFE-TRACE": "refuted"}),
        ("runs.d.expected.LIVE-GOAL=refuted", "refuted"),
    ],
)  # fmt: skip
def test_override(override: str, value: object) -> None:
    scenario = load("case_a", [override, "choices=[]"])  # what becomes of these: test_choices
    assert resolved(scenario) == edit({**resolved(case_a()), "choices": []}, override.partition("=")[0], value)
    assert scenario.digest != case_a().digest


def test_overrides_apply_in_order_and_leave_aliases_alone(write: Write) -> None:
    first, second = "preset: {waypoints_m: [[0, 0, 0]", "preset: {waypoints_m: [[0, 5, 0], [9, 5, 0]]}"
    path = write(SMALL.replace(first, first.replace("preset:", "preset: &shared")).replace(second, "preset: *shared"))
    scenario = load(path, ["ugvs.one.preset.speed_m_s=1.5", "ugvs.one.preset.speed_m_s=2"])
    assert [ugv.preset.speed_m_s for ugv in scenario.ugvs.values()] == [2.0, 1.0]
    assert load(path, ["title=a", "title=b"]).digest == load(path, ["title=b"]).digest


@pytest.mark.parametrize(
    "overrides",
    [
        [f"ugvs.one.start_m={[5 + 2 * math.cos(0.3), -5 + 2 * math.sin(0.3), 0.0]}"],  # at the safe distance
        ["control.period_s=0.01", "decision.noise_period_s=0.01", "intervention.period_s=0.07"],  # not 7 * 0.01
        ["obstacles={}"],
    ],
)
def test_limits_themselves_are_allowed(overrides: list[str], write: Write) -> None:
    load(write(SMALL), overrides)


def test_the_uav_ends_over_the_centroid_of_the_targets_unless_the_scenario_says_where(write: Write) -> None:
    assert load(write(SMALL)).uav.target_m == [9.0, 2.0, 2.0]
    silent = write(SMALL.replace("uav: {start_m: [0, 2, 2], target_m: [9, 2, 2]}", "uav: {start_m: [0, 2, 2]}"))
    moved = ["ugvs.one.target_m=[5, 1, 0]", "ugvs.one.preset.waypoints_m.1=[5, 1, 0]", "uav.altitude_m=3"]
    scenario = load(silent, moved)
    assert scenario.uav.target_m == [7.0, 3.0, 3.0]
    assert validated(replace(scenario, uav=Uav(start_m=[0.0, 2.0, 2.0]))).uav.target_m == [7.0, 3.0, 2.0]


def test_an_attribute_that_is_no_key_cannot_be_set() -> None:
    ugv = load("minimal").ugvs["ugv1"]
    for part in (ugv, ugv.preset):
        with pytest.raises(AttributeError, match="has no attribute 'max_sped'"):
            part.max_sped = 3.0  # type: ignore[union-attr]


def test_a_run_has_the_values_that_it_sets(write: Write) -> None:
    settings = {"gatekeeper.tries": 2, "intervention.policies.0.name": "mine:Mine", "gatekeeper.route": "mine:Route"}
    file = write(yaml.safe_dump(edit(SMALL_DATA, "runs.other", {"method": "c", "set": settings})))
    scenario = load(file, ["runs.other.set.gatekeeper.tries=3", "runs.d.set.decision.threshold.zeta_m=2"])
    assert own(scenario, "other").gatekeeper.tries == 3
    assert own(scenario, "d").decision.threshold.zeta_m == 2.0
    assert (scenario.gatekeeper.tries, scenario.decision.threshold.zeta_m) == (5, 3.0)
    assert {key.partition(".set.")[2] for key in plugins.plugins(scenario)} == {*settings} - {"gatekeeper.tries"}
    assert plugins.plugins(plugins.without(scenario)) == {}
    with pytest.raises(ScenarioError, match=r"--set runs.d.set.decision.threshold.zeta_m=1: .*decision.release_m"):
        load(file, ["runs.d.set.decision.threshold.zeta_m=1"])


def test_what_a_message_allows_is_allowed_and_no_more(write: Write) -> None:
    """Limits are those of the proofs to the last digit: decimals, not what floating-point numbers make of them."""
    changes = {
        "ugvs.one.max_speed_m_s": 1.1, "ugvs.two.max_speed_m_s": 2.2, "uav.max_speed_m_s": 1.0,
        "control.period_s": 0.1, "decision.noise_period_s": 0.1, "gatekeeper.period_s": 0.1,
        "intervention.period_s": 0.1, "gatekeeper.stages": 30, "control.formation_gain_1_s": 1.0,
        "control.sensing_range_m": 2.33,
    }  # fmt: skip
    slow = SMALL_DATA
    for key, value in changes.items():
        slow = edit(slow, key, value)
    assert load(write(yaml.safe_dump(slow))).control.sensing_range_m == 2.33
    short = write(yaml.safe_dump(edit(slow, "control.sensing_range_m", 2.3299999999)))
    assert "at least 2.33 m for two and one" in message(short)
    fast = edit(edit(SMALL_DATA, "control.period_s", 0.03), "control.motion_gain_1_s", 33.33333334)
    assert "at most 33.3333333 1/s" in message(write(yaml.safe_dump(fast)))


def test_a_scenario_says_what_each_body_and_each_pair_is() -> None:
    scenario = validated(case_a(), {"uav.name": "kite", "reproduction": [], "arena_m": [[-20, -20], [20, 20]]})
    keys = {
        "ugv1": "ugvs.ugv1",
        "kite": "uav",
        "obstacle_1": "obstacles.obstacle_1",
        "arena_east": "obstacles.arena_east",
    }
    assert {name: scenario.key_of(name) for name in keys} == keys
    assert [scenario.kind_of(name) for name in keys] == ["ugv", "uav", "obstacle", "obstacle"]
    assert (scenario.pair_of("ugv1", "ugv2"), scenario.pair_of("kite", "ugv1")) == ("ugv", "air_ground")
    with pytest.raises(KeyError, match="nobody"):
        scenario.kind_of("nobody")
