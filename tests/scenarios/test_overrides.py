"""`--set key=value`."""

from __future__ import annotations

import pytest
from scenarios.cases import SMALL, Write, case_a, edit

from airground_drake.scenarios.load import load, resolved, validated


@pytest.mark.parametrize("title", ["\U0001f697 \u00e9", "\\ud83d\\ude97", 'a "b" # c: \\', "1e5"])
def test_text_that_is_given_as_a_value_is_that_text(title: str) -> None:
    assert validated(load("minimal")[0], {"title": title}).title == title


@pytest.mark.parametrize(
    ("override", "value"),
    [
        ("seed=7", 7),
        ("control.sensing_range_m=5", 5.0),
        ("ugvs.ugv1.preset.speed_m_s=1e-1", 0.1),
        ("ugvs.ugv1.preset.waypoints_m.1=[3.3, 13.05, 0]", [3.3, 13.05, 0.0]),
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


def test_a_mapping_whose_names_are_free_takes_new_ones(write: Write) -> None:
    changes = [
        "runs.d.expected.LIVE-GOAL=refuted",
        "obstacles.box.position_m=[-9, -9, 0]",
        "obstacles.box.known_to_uav=false",
        "intervention.policies.0.parameters.clearance_m=0.2",
        "runs.again={method: b}",
    ]
    scenario, _ = load("case_a", changes)
    assert scenario.runs["d"].expected["LIVE-GOAL"] == "refuted"
    assert (scenario.obstacles["box"].position_m, scenario.obstacles["box"].known_to_uav) == ([-9.0, -9.0, 0.0], False)
    assert scenario.intervention.policies[0].parameters == {"speed_m_s": 2.85, "clearance_m": 0.2}
    assert [*scenario.obstacles][-1] == "box"
    assert [*scenario.runs][-1] == "again"
    private = load(write(SMALL), ["obstacles={_box: {position_m: [-9, -9, 0]}}"])[0]
    assert [*private.obstacles] == ["_box"]  # a name, no template
    assert load(write(SMALL), ["obstacles.box.position_m=[-9, -9, 0]"])[0].obstacles["box"].known_to_uav


def test_overrides_apply_in_order_and_leave_aliases_alone(write: Write) -> None:
    first, second = "preset: {waypoints_m: [[0, 0, 0]", "preset: {waypoints_m: [[0, 5, 0], [9, 5, 0]]}"
    path = write(SMALL.replace(first, first.replace("preset:", "preset: &shared")).replace(second, "preset: *shared"))
    scenario, _ = load(path, ["ugvs.one.preset.speed_m_s=1.5", "ugvs.one.preset.speed_m_s=2"])
    assert [ugv.preset.speed_m_s for ugv in scenario.ugvs.values()] == [2.0, 1.0]


def test_the_digest_depends_on_how_overrides_are_split(write: Write) -> None:
    path, splits = write(SMALL), (["title=a", "title=b"], ["title=b"], ["title=atitle=b"])
    assert len({load(path, overrides)[1] for overrides in splits}) == 3
