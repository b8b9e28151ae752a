"""Specs: what is drawn, and what is refused with a line that says where and what is allowed."""

from pathlib import Path

import numpy as np
import pytest

from airground_drake.base.errors import ScenarioError
from airground_drake.scenario.shipped import shipped_files
from airground_drake.study.campaign.spec import Spec, load_spec

TEXT = """
scenario: minimal
seed: 3
draw:
  seed: {integer: [0, 1000]}
  control.motion_gain_1_s: {uniform: [1.0, 3.0]}
"""


def spec_of(tmp_path: Path, text: str) -> Spec:
    path = tmp_path / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    return load_spec(path)


def test_a_draw_is_a_validated_scenario_named_by_its_index(tmp_path: Path) -> None:
    spec = spec_of(tmp_path, TEXT)
    scenario, values = spec.draw(4711), spec.values(4711)
    assert scenario.name == "mine_4711"
    assert scenario.seed == values["seed"]
    assert scenario.control.motion_gain_1_s == values["control.motion_gain_1_s"]
    assert scenario == spec_of(tmp_path, TEXT).draw(4711)
    assert scenario != spec.draw(4712)


def test_a_scenario_beside_the_spec_with_fixed_keys_and_chosen_runs(tmp_path: Path) -> None:
    (tmp_path / "own.yaml").write_bytes(shipped_files()["minimal"].read_bytes())
    drawn = spec_of(tmp_path, "scenario: own.yaml\nruns: [d]\nset: {duration_s: 3.5}\n").draw(1)
    assert (drawn.duration_s, list(drawn.runs)) == (3.5, ["d"])


def test_random_courses_are_valid_and_have_the_counts_that_are_asked_for(tmp_path: Path) -> None:
    spec = spec_of(tmp_path, "scenario: minimal\ncourse: {ugvs: [2, 3], obstacles: [1, 4], hidden: 0.5}\n")
    scenarios = [spec.draw(i) for i in range(12)]
    assert {len(each.ugvs) for each in scenarios} == {2, 3}
    assert {len(each.obstacles) for each in scenarios} == {1, 2, 3, 4}
    assert {o.known_to_uav for each in scenarios for o in each.obstacles.values()} == {True, False}
    for each in scenarios:  # the UAV's own goal is where its formation takes it
        for end in ("start_m", "target_m"):
            centroid = np.mean([getattr(ugv, end) for ugv in each.ugvs.values()], axis=0)
            assert getattr(each.uav, end) == pytest.approx([*centroid[:2], each.uav.altitude_m], abs=1e-6)


def test_a_course_has_walls_and_boxes_if_they_are_asked_for_and_all_else_stays_as_it_was(tmp_path: Path) -> None:
    plain = "scenario: minimal\nseed: 5\ncourse: {ugvs: 2, obstacles: 3, hidden: 0.5"
    many = spec_of(tmp_path, plain + ", walls: [2, 4], boxes: 3, size_m: [1, 2]}\n")
    before = spec_of(tmp_path, plain + "}\n")
    counts, known = set[int](), set[bool]()
    for k in range(8):
        drawn, plainly = many.draw(k), before.draw(k)
        walls, boxes = (
            [each for each in drawn.obstacles.values() if getattr(each, key)] for key in ("segment_m", "size_m")
        )
        assert {name: drawn.obstacles[name] for name in plainly.obstacles} == plainly.obstacles
        assert (drawn.ugvs, drawn.uav) == (plainly.ugvs, plainly.uav)
        sizes = [size for each in boxes for size in each.size_m] + [2.0 * each.segment_m[1][0] for each in walls]
        assert 1.0 <= min(sizes) <= max(sizes) <= 2.0
        assert len(boxes) == 3
        counts.add(len(walls))
        known |= {each.known_to_uav for each in walls + boxes}
    assert (counts, known) == ({2, 3, 4}, {True, False})


def test_obstacles_of_a_course_are_clear_of_a_low_uav_and_one_without_room_cannot_be_drawn(tmp_path: Path) -> None:
    low = "set: {uav.altitude_m: 1.2}\ncourse: {ugvs: 2, obstacles: 9, walls: 3, boxes: 3, length_m: 12, width_m: 9}\n"
    spec = spec_of(tmp_path, f"scenario: minimal\n{low}")
    assert len([spec.draw(i) for i in range(12)]) == 12  # all are valid
    for full in ("ugvs: 9, width_m: 3", "boxes: 2, size_m: [90, 90], width_m: 20"):
        spec = spec_of(tmp_path, f"scenario: minimal\ncourse: {{{full}}}\n")
        with pytest.raises(ScenarioError, match="have no room"):
            spec.draw(0)


def test_a_course_has_one_uav(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="course: the scenario has uavs; wanted: one UAV, in uav"):
        spec_of(tmp_path, "scenario: two_uavs\ncourse: {ugvs: 2}\n").draw(0)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[]", ":1: a list is given; wanted: a mapping with the keys name, title"),
        ("draw: {}", ":1: scenario: missing; wanted: a shipped scenario"),
        ("scenario: nowhere.yaml", "nowhere.yaml: no such scenario or file"),
        ("scenario: minimal\ndraws: {}", ":2: draws: unknown key; did you mean draw?"),
        ("scenario: minimal\nruns: [z]", ":2: runs: 'z' is not allowed; allowed: a, d"),
        ("scenario: minimal\nruns: d", ":2: runs: 'd' is not allowed; wanted: a list of names"),
        ("scenario: minimal\nseed: -1", ":2: seed: -1 is not allowed; wanted: a whole number from 0 on"),
        ("scenario: minimal\nname: ../x", ":2: name: '../x' is not allowed; wanted: a name"),
        (
            "scenario: minimal\nclaims:\n  - LIVE-HYP\n  - SAFE-T",
            ":4: claims: 'SAFE-T' is not allowed; did you mean",
        ),
        ("scenario: minimal\ndraw: {seed: 3}", ":2: draw.seed: 3 is not allowed; wanted: one of uniform"),
        ("scenario: minimal\ndraw: {seed: {unifrom: [0, 1]}}", ":2: draw.seed: 'unifrom' is not allowed; did you mean"),
        ("scenario: minimal\ndraw: {seed: {uniform: [1, 0]}}", "draw.seed.uniform: [1, 0] is not allowed; wanted"),
        ("scenario: minimal\ncourse: {ugvs: 0}", ":2: course.ugvs: 0 is not allowed; wanted: a whole number from 1"),
        (
            "scenario: minimal\ncourse: {size_m: [2, 1]}",
            "course.size_m: [2, 1] is not allowed; wanted: [least, most] in m",
        ),
        ("scenario: minimal\ncourse: {size_m: 2}", "course.size_m: 2 is not allowed; wanted: [least, most] in m"),
        ("scenario: minimal\ncourse: {walls: [2, 1]}", "course.walls: [2, 1] is not allowed; wanted: a whole number"),
        ("scenario: minimal\ncourse: []", ":2: course: a list is given; wanted: a mapping with the keys ugvs"),
        (f"scenario: minimal\ncourse: {{length_m: 1{'0' * 400}}}", "wanted: a number in m from 1e-09 to 1e+09"),
        ("scenario: minimal\ncourse: {hidden: 2}", "course.hidden: 2.0 is not allowed; wanted: a number from 0 to 1"),
        ("scenario: minimal\ncourse: {width: 2}", ":2: course.width: unknown key; did you mean width_m?"),
        ("scenario: minimal\ncourse: {}\nset: {ugvs.u.radius_m: 0.5}", ":3: set.ugvs.u.radius_m: the course would"),
        (
            "scenario: minimal\nmarks: {arrival: 2}",
            ":2: marks.arrival: 'arrival' is not allowed; did you mean arrival_",
        ),
        (
            "scenario: minimal\nset: {seed: 1}\ndraw: {seed: {choice: [2]}}",
            ":3: draw.seed: it would replace seed, which",
        ),
        (
            "scenario: minimal\ndraw: {obstacles.rock.position_m.0: {choice: [5]}, obstacles.rock: {choice: [{}]}}",
            ":2: draw.obstacles.rock: it would replace obstacles.rock.position_m.0, which is given before; wanted: one",
        ),
        (
            "scenario: minimal\nset:\n  control.motion_gain_1_s: 1\n  control: {}",
            ":4: set.control: it would replace control.motion_gain_1_s, which is given before; wanted: one value",
        ),
        ("scenario: minimal\nset: [1]", ":2: set: a list is given; wanted: a mapping with dotted keys"),
        ("scenario: minimal\nset: {contrl.period_s: 1}", ":2: set.contrl: unknown key; did you mean control?"),
        ("scenario: minimal\nset: {control.period_s: no}", ":2: set.control.period_s: 'no' is not allowed; wanted: a"),
        ("scenario: minimal\ndraw: {contrl.period_s: {uniform: [1, 2]}}", ":2: draw.contrl: unknown key; did you mean"),
    ],
)
def test_mistakes_are_one_line(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        spec_of(tmp_path, text)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
