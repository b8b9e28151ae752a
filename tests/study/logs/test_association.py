"""Streams become tracks: gaps, repeated rows, frames, names and units; each rule has a case that needs it."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from builders import logs
from builders.logs import BROKEN, Motion, Ros

from airground_drake.base.errors import LogError
from airground_drake.study.logs.judging import BROKEN as NOT_KEPT
from airground_drake.study.logs.judging import KEPT, JudgedPair, judge
from airground_drake.study.logs.words import lines

FULL = logs.motion()


def pair_of(found: list[JudgedPair], *names: str) -> JudgedPair:
    return next(pair for pair in found if (pair.first, pair.second) == names)


def written(folder: Path, table: list[list[str]], name: str = "log.csv") -> Path:
    (folder / name).write_text(logs.text(table))
    return folder / name


def with_gap(begin_s: float, end_s: float, mark: str | None) -> tuple[list[list[str]], Motion]:
    """The log without tb_1 for a while: its rows are marked, or missing; and what is left."""
    head, *rows = logs.long(FULL)
    inside = [row[1] == "tb_1" and begin_s < float(row[0]) < end_s for row in rows]
    if mark is None:
        rows = [row for row, is_in in zip(rows, inside, strict=True) if not is_in]
    else:
        rows = [[*row[:2], mark, mark, mark] if is_in else row for row, is_in in zip(rows, inside, strict=True)]
    t_s, places = FULL["tb_1"]
    left = (t_s <= begin_s) | (t_s >= end_s)
    return [head, *rows], {**FULL, "tb_1": (t_s[left], places[left])}


@pytest.mark.parametrize("mark", ["NaN", "", "lost", "0", "9999", None])
def test_nothing_is_claimed_in_a_gap(mark: str | None, tmp_path: Path, document: dict[str, Any]) -> None:
    table, left = with_gap(2.4, 3.6, mark)
    found = logs.read(written(tmp_path, table), document)
    judged = judge(found, document)
    pair = pair_of(judged.pairs, *BROKEN)
    assert (pair.status, judged.covers_all) == (KEPT, False)
    assert pair.gaps_s == [(pytest.approx(2.4), pytest.approx(3.6))]
    assert pair.covered_s == pytest.approx(logs.LASTS_S - 1.2)
    assert pair.least_m == pytest.approx(logs.least_gaps(left, 0.1)[BROKEN][0], abs=1e-9)
    assert judged.pairs[-1].first == "tb_0" or judged.pairs[-1].gaps_s
    text = "\n".join(lines(judged, found))
    assert "Every distance was kept" not in text
    assert "tb_0, tb_1 are not covered from 2.400 to 3.600 s" in text
    assert any("tb_1: 23 rows skipped" in said for said in found.remarks) == (mark is not None)


def test_where_a_body_leaps_nothing_is_claimed(tmp_path: Path, document: dict[str, Any]) -> None:
    """The last place is written again while it is lost, as if it stood; the leap at the end shows it."""
    t_s, places = FULL["tb_1"]
    held = places.copy()
    held[(t_s > 2.4) & (t_s < 3.6)] = places[t_s <= 2.4][-1]
    found = logs.read(written(tmp_path, logs.long({**FULL, "tb_1": (t_s, held)})), document)
    judged = judge(found, document)
    assert pair_of(judged.pairs, *BROKEN).gaps_s == [(pytest.approx(2.4), pytest.approx(3.6))]
    assert (judged.covers_all, found.bodies["tb_1"].gaps) == (False, pair_of(judged.pairs, *BROKEN).gaps_s)
    assert any("tb_1: 1 step more than 5 times faster than 1 m/s, first to 3.6 s" in said for said in found.remarks)
    far = written(tmp_path, logs.long({**FULL, "tb_1": (t_s, 1000.0 * places)}))
    with pytest.raises(LogError, match="tb_1: 120 of 120 steps are more than 5 times faster than 1 m/s; wanted: --len"):
        logs.read(far, document, length_unit="m")


def test_two_recordings_of_one_time_are_refused(tmp_path: Path, document: dict[str, Any]) -> None:
    aside = {name: (t_s + 0.007, places + np.array([0.0, 0.9, 0.0])) for name, (t_s, places) in FULL.items()}
    (tmp_path / "runs").mkdir()
    written(tmp_path / "runs", logs.long(FULL), "run1.csv")
    written(tmp_path / "runs", logs.long(aside), "run2.csv")
    with pytest.raises(LogError, match=r"rows of two recordings of the same time, 0\.9 m apart; wanted: one recording"):
        logs.read(tmp_path / "runs", document)


def test_a_robot_that_stands_at_the_origin_at_first_is_there(tmp_path: Path) -> None:
    ugvs = logs.scenario()["ugvs"]
    ugvs["tb_1"] |= {"start_m": [0.0, 0.0, 0.0], "preset": {"waypoints_m": [[0.0, 0.0, 0.0], [1.6, 0.7, 0.0]]}}
    document = logs.document(tmp_path, ugvs=ugvs)
    t_s, places = FULL["tb_1"]
    there = places.copy()
    there[t_s <= 2.0] = 0.0  # and then it leaps
    found = logs.read(written(tmp_path, logs.long({**FULL, "tb_1": (t_s, there)})), document)
    assert len(found.bodies["tb_1"].t_s) == len(t_s)
    assert not any("lost" in said for said in found.remarks)


@pytest.mark.parametrize(
    ("head", "row", "choice", "says"),
    [
        ("t,body,odom_x,odom_y,gps_x,gps_y", "{t},{name},{x},{y},{x},{y}", {}, "it has several places in a row: odom"),
        ("t;body;x;y", "{t};{name};{mm};0", {}, "numbers such as -2,000 stand beside 700; wanted: no commas of"),
        ("t,body,x,y,frame_id", "{t},{name},{x},{y},map", {"frames": ["mpa"]}, "no position is in it, and transforms"),
        ("tb_0.t,tb_0.x,tb_0.y,tb_1.x,tb_1.y", "{t},{x},{y},{x},{y}", {}, "tb_1 has no times of its own: there are"),
    ],
)
def test_what_could_be_read_in_two_ways_is_refused(
    head: str, row: str, choice: dict[str, Any], says: str, tmp_path: Path, document: dict[str, Any]
) -> None:
    lines = [row.format(t=t, name=name, x=place[0], y=place[1], mm=("700", "-2,000")[k % 2])
             for k, (t, name, place) in enumerate(logs.rows(FULL))]  # fmt: skip
    (tmp_path / "log.csv").write_text("\n".join([head, *lines]))
    with pytest.raises(LogError, match=re.escape(says)):
        logs.read(tmp_path / "log.csv", document, **choice)


def test_nothing_to_judge_is_no_verdict(tmp_path: Path) -> None:
    alone = logs.document(tmp_path, obstacles={})
    found = logs.read(written(tmp_path, logs.long({"tb_0": FULL["tb_0"]})), alone, without=["tb_1", "uav"])
    with pytest.raises(LogError, match="no distance is left to judge: of tb_0 nothing else is in the log or scenario"):
        judge(found, alone)


@pytest.mark.parametrize("form", ["float", "date", "one zero", "other clock"])
def test_stamps_of_headers_count_in_every_form(form: str, tmp_path: Path, document: dict[str, Any]) -> None:
    """Messages come 0.3 s late; a message without a stamp is left out; another clock is named."""
    said, late_s = [], 2.0 if form == "other clock" else 0.3
    for k, t in enumerate(FULL["uav"][0]):
        ns = logs.EPOCH_NS + round(t * 1e9)
        whole, rest = divmod(ns, 10**9)
        for name, (_, places) in FULL.items():
            stamp: Any = {"sec": whole, "nanosec": rest}
            if form == "one zero" and (k, name) == (7, "tb_0"):
                stamp = {"sec": 0, "nanosec": 0}
            stamp = ns / 1e9 if form == "float" else stamp
            if form == "date":
                stamp = f"{pd.Timestamp(ns, tz='UTC').isoformat()}"
            position = dict(zip("xyz", places[k].tolist(), strict=True))
            message = {"header": {"stamp": stamp, "frame_id": "map"}, "pose": {"position": position}}
            said.append((ns + round(1e9 * late_s) * (name == "tb_0"), f"/{name}/pose", "PoseStamped", message))
    logs.mcap_json(tmp_path / "run.mcap", said)
    found = logs.read(tmp_path / "run.mcap", document)
    least_m, _ = logs.least_gaps(FULL)[BROKEN]
    assert pair_of(judge(found, document).pairs, *BROKEN).least_m == pytest.approx(least_m, abs=1e-6)
    assert {each.origin["clock"] for each in found.bodies.values()} == {"header stamps"}
    of_clocks = ["header stamps of tb_1 are 2 s later than those of tb_0" in remark for remark in found.remarks]
    assert sum(of_clocks) == (form == "other clock"), found.remarks


def test_odometry_of_one_robot_beside_positions_without_a_frame_is_refused(
    tmp_path: Path, document: dict[str, Any]
) -> None:
    head, *rows = logs.long(FULL)
    framed = [[*row, "tb_0/odom" if row[1] == "tb_0" else ""] for row in rows]
    with pytest.raises(LogError, match="odometry is in a frame of each robot's own"):
        logs.read(written(tmp_path, [[*head, "frame_id"], *framed]), document)


def test_a_line_across_the_gap_would_say_something_else(tmp_path: Path, document: dict[str, Any]) -> None:
    """With `--gap` the user takes the motion in the gap as straight; then the pair is covered."""
    table, left = with_gap(2.4, 3.6, None)
    pair = pair_of(judge(logs.read(written(tmp_path, table), document, gap_s=2.0), document).pairs, *BROKEN)
    assert (pair.gaps_s, pair.covered_s) == ([], pytest.approx(logs.LASTS_S))
    assert pair.least_m == pytest.approx(logs.least_gaps(left)[BROKEN][0], abs=1e-9)


def test_one_lost_row_is_no_gap_two_are_and_so_is_half_of_the_log(tmp_path: Path, document: dict[str, Any]) -> None:
    for end_s, gaps in ((1.10, 0), (1.15, 1)):
        table, _ = with_gap(1.0, end_s, None)
        pair = pair_of(judge(logs.read(written(tmp_path, table), document), document).pairs, *BROKEN)
        assert len(pair.gaps_s) == gaps
    few = {**FULL, "tb_1": (FULL["tb_1"][0][:61:60], FULL["tb_1"][1][:61:60])}
    judged = judge(logs.read(written(tmp_path, logs.long(few)), document), document)
    assert pair_of(judged.pairs, *BROKEN).gaps_s == [(pytest.approx(3.0), pytest.approx(6.0))]
    late = {**FULL, "tb_1": (FULL["tb_1"][0][60:61], FULL["tb_1"][1][60:61])}
    judged = judge(found := logs.read(written(tmp_path, logs.long(late)), document), document)
    text = "\n".join(lines(judged, found))
    assert "tb_0, tb_1: NOT KEPT, 0.2856 m at 3.000 s" in text
    assert "; covered 0 s; no interval was recorded: the safety theorem promises no distance" in text
    assert "robots do not start as in the scenario" not in text


def test_a_log_that_is_shorter_than_the_scenario_says_so(tmp_path: Path, document: dict[str, Any]) -> None:
    short = {name: (t_s[:21], places[:21]) for name, (t_s, places) in FULL.items()}
    found = logs.read(written(tmp_path, logs.long(short)), document)
    judged = judge(found, document)
    assert (judged.status, judged.covers_all) == (KEPT, False)
    first, second, *_ = lines(judged, found)
    assert first == "No distance was broken where the log covers it."
    assert "The log has 1 of the scenario's 6 s" in second


def test_a_folder_may_have_other_files_and_a_log_that_cannot_be_read_is_told(
    tmp_path: Path, document: dict[str, Any]
) -> None:
    written(tmp_path, logs.long({"tb_0": FULL["tb_0"]}), "tb_0.csv")
    written(tmp_path, logs.long({"tb_1": FULL["tb_1"]}), "tb_1.csv")
    (tmp_path / "README.md").write_text("The second lap.\n")
    (tmp_path / "hall.jpg").write_bytes(b"\xff\xd8\xff\xe0 no picture")
    found = logs.read(tmp_path, document)
    assert sorted(found.bodies) == ["tb_0", "tb_1"]
    assert sum(name in "\n".join(found.ignored) for name in ("README.md", "hall.jpg")) == 2
    (tmp_path / "tb_1.csv").write_bytes(b"")
    with pytest.raises(
        LogError, match=r"tb_1 is not in the log; names there: tb_0; not usable: .*tb_1.csv: it is empty; wanted: "
    ):
        logs.read(tmp_path, document)
    with pytest.raises(LogError, match=r"README\.md: "):
        logs.read(tmp_path / "README.md", document)
    (tmp_path / "tb_0.csv").write_bytes(b"")
    with pytest.raises(LogError, match=r"no file of the folder is a log: .*README\.md: .*tb_0\.csv: .* and 1 more$"):
        logs.read(tmp_path, document)


def test_a_log_of_one_instant_is_refused(tmp_path: Path, document: dict[str, Any]) -> None:
    one = {name: (t_s[:1], places[:1]) for name, (t_s, places) in FULL.items()}
    with pytest.raises(LogError, match="positions at 0 s only; wanted: at two times at least"):
        judge(logs.read(written(tmp_path, logs.long(one)), document), document)


def test_bodies_that_are_never_recorded_together_are_refused(tmp_path: Path, document: dict[str, Any]) -> None:
    apart = {**FULL, "tb_1": (FULL["tb_1"][0] + 1.7e9, FULL["tb_1"][1])}
    with pytest.raises(LogError, match="tb_0 0 to 6 s and tb_1 1700000000 to 1700000006 s are never recorded at"):
        judge(logs.read(written(tmp_path, logs.long(apart)), document), document)


def test_of_two_rows_of_one_time_the_first_counts_and_the_contradiction_is_named(
    tmp_path: Path, document: dict[str, Any]
) -> None:
    head, *rows = logs.long(FULL)
    k = next(k for k, row in enumerate(rows) if row[:2] == ["3.000000", "tb_1"])
    other = [*rows[k][:3], f"{float(rows[k][3]) - 0.5:.4f}", rows[k][4]]
    found = logs.read(written(tmp_path, [head, *rows[: k + 1], other, *rows[k + 1 :]]), document)
    assert pair_of(judge(found, document).pairs, *BROKEN).least_m == pytest.approx(logs.least_gaps(FULL)[BROKEN][0])
    told = "tb_1: 1 row not where an earlier one of the same time is, at 3 s by 0.5 m; the earlier one counts"
    assert told in found.remarks


# --- names and frames ------------------------------------------------------------------------------------------------


def posed(folder: Path, frames: dict[str, str], topics: dict[str, str] | None = None) -> Path:
    """A ROS 2 bag of odometry, each body in a frame."""
    ros, said = Ros(2), []
    for t, name, place in logs.rows(FULL):
        ns = logs.EPOCH_NS + round(t * 1e9)
        said.append(
            (ns, (topics or {}).get(name, f"/{name}/odom"), *ros.odometry(ns, frames[name], f"{name}/base", place))
        )
    logs.write_ros2(folder / "bag", ros, said, "SQLITE3")
    return folder / "bag"


@pytest.mark.parametrize(
    ("frames", "says"),
    [
        ({name: f"{name}/odom" for name in FULL}, "tb_0 in tb_0/odom, tb_1 in tb_1/odom, uav in uav/odom"),
        (dict.fromkeys(FULL, "odom"), "--frame odom if this is one for all"),
        ({"tb_0": "map", "tb_1": "world", "uav": "map"}, "positions are in different frames"),
    ],
)
def test_frames_that_may_differ_are_refused_unless_they_are_said_to_be_one(
    frames: dict[str, str], says: str, tmp_path: Path, document: dict[str, Any]
) -> None:
    path = posed(tmp_path, frames)
    with pytest.raises(LogError, match=says):
        logs.read(path, document)
    assert judge(logs.read(path, document, frames=[*frames.values()]), document).status == NOT_KEPT


def test_robots_that_all_start_at_zero_are_refused_where_no_frame_is_stated(
    tmp_path: Path, document: dict[str, Any]
) -> None:
    own = {name: (t_s, places - places[0]) for name, (t_s, places) in FULL.items()}
    with pytest.raises(LogError, match=r"tb_0, tb_1 all start at \(0, 0\)"):
        logs.read(written(tmp_path, logs.long(own)), document)


def test_a_body_in_two_topics_needs_a_word_from_the_user(tmp_path: Path, document: dict[str, Any]) -> None:
    ros, said = Ros(2), []
    for t, name, place in logs.rows(FULL):
        ns = logs.EPOCH_NS + round(t * 1e9)
        said.append((ns, f"/{name}/amcl_pose", *ros.stamped(ns, "map", place)))
        said.append((ns, f"/{name}/odom", *ros.odometry(ns, f"{name}/odom", f"{name}/base", place - FULL[name][1][0])))
        said.append((ns, f"/{name}/goal_pose", *ros.stamped(ns, "map", 0.0 * place)))
    logs.write_ros2(tmp_path / "bag", ros, said, "MCAP")
    with pytest.raises(LogError, match=r"tb_0 is in the log more than once: .*in frame map.*--frame FRAME"):
        logs.read(tmp_path / "bag", document)
    assert judge(logs.read(tmp_path / "bag", document, frames=["map"]), document).status == NOT_KEPT
    rename = {f"/{name}/amcl_pose": name for name in FULL}
    assert judge(logs.read(tmp_path / "bag", document, rename=rename), document).status == NOT_KEPT


def test_transforms_of_a_robots_own_parts_are_not_its_position(tmp_path: Path, document: dict[str, Any]) -> None:
    said = logs.foxglove(FULL, {})
    arm = {"parent_frame_id": "tb_0/base", "child_frame_id": "tb_0/arm", "translation": {"x": 0.1, "y": 0.0, "z": 0.2}}
    arms = []
    for ns, *_ in said:
        stamped = {**arm, "timestamp": {"sec": ns // 10**9, "nsec": ns % 10**9}}
        arms.append((ns + 1, "/tf", "foxglove.FrameTransforms", {"transforms": [stamped]}))
    logs.mcap_json(tmp_path / "run.mcap", [*said, *arms])
    assert judge(logs.read(tmp_path / "run.mcap", document), document).status == NOT_KEPT


def test_names_that_do_not_fit_are_listed_with_what_helps(tmp_path: Path, document: dict[str, Any]) -> None:
    path = posed(tmp_path, dict.fromkeys(FULL, "map"), {"tb_1": "/robot_b/odom"})
    assert judge(logs.read(path, document), document).status == NOT_KEPT  # by the frame that the robot carries
    other = {"tb_0": FULL["tb_0"], "b": FULL["tb_1"], "uav": FULL["uav"]}
    path = written(tmp_path, logs.long(other))
    with pytest.raises(LogError, match="tb_1 is not in the log; names there: tb_0, b, uav; wanted: --rename NAME=tb_1"):
        logs.read(path, document)
    assert judge(logs.read(path, document, rename={"b": "tb_1"}), document).status == NOT_KEPT
    with pytest.raises(LogError, match="the log has no c"):
        logs.read(path, document, rename={"c": "tb_1"})
    with pytest.raises(LogError, match="the scenario has no tb_9"):
        logs.read(path, document, rename={"b": "tb_9"})
    found = judge(logs.read(path, document, without=["tb_1"]), document)
    assert {pair.first for pair in found.pairs} == {"tb_0", "uav"}


# --- heights, further UAVs, errors -----------------------------------------------------------------------------------


def test_heights_of_ugvs_do_not_count_between_them(tmp_path: Path, document: dict[str, Any]) -> None:
    """Markers on two robots may be at different heights; in the plane the robots are as near as before."""
    up = np.array([0.0, 0.0, 0.4])
    high = {name: (t_s, places + up * (name == "tb_1")) for name, (t_s, places) in FULL.items()}
    found = judge(logs.read(written(tmp_path, logs.long(high)), document), document)
    expected = logs.least_gaps(FULL)
    for one, two in (BROKEN, ("tb_1", "pillar")):
        assert pair_of(found.pairs, one, two).least_m == pytest.approx(expected[one, two][0], abs=1e-9)
    assert pair_of(found.pairs, "tb_1", "uav").least_m == pytest.approx(
        logs.least_gaps(high)["tb_1", "uav"][0], abs=1e-9
    )


def test_a_further_uav_is_judged_like_the_first(tmp_path: Path, document: dict[str, Any]) -> None:
    t_s, places = FULL["uav"]
    both = {**FULL, "uav2": (t_s, places - np.array([0.0, 0.0, 0.9]))}
    path = written(tmp_path, logs.long(both))
    assert "uav2: names no body of the scenario" in logs.read(path, document).ignored
    found = judge(logs.read(path, document, uavs=["uav2"]), document)
    new = {(pair.first, pair.second): pair for pair in found.pairs if "uav2" in (pair.first, pair.second)}
    assert {*new} == {("tb_0", "uav2"), ("tb_1", "uav2"), ("uav2", "pillar")}
    assert new["tb_0", "uav2"].safe_m == logs.GAPS["air_ground_m"]
    apart = document | {"safe_distance": document["safe_distance"] | {"uav_m": 0.6}}
    judged = {(pair.first, pair.second): pair for pair in judge(logs.read(path, apart, uavs=["uav2"]), apart).pairs}
    assert judged["uav", "uav2"].safe_m == 0.6
    assert judged["uav", "uav2"].least_m == pytest.approx(0.9 - 2.0 * logs.RADII["uav"])


@pytest.mark.parametrize(
    ("errors_m", "status"),
    [
        ({}, NOT_KEPT), ({"tb_0": 0.001, "tb_1": 0.001}, NOT_KEPT), ({"tb_0": 0.02, "tb_1": 0.02}, "open"),
        ({"uav": 0.5}, NOT_KEPT),
    ],
)  # fmt: skip
def test_position_errors_make_a_distance_open(
    errors_m: dict[str, float], status: str, tmp_path: Path, document: dict[str, Any]
) -> None:
    found = judge(logs.read(written(tmp_path, logs.long(FULL)), document), document, errors_m)
    pair = pair_of(found.pairs, *BROKEN)
    assert pair.status == status
    assert pair.error_m == pytest.approx(sum(errors_m.get(name, 0.0) for name in BROKEN))
    far = pair_of(found.pairs, "tb_0", "uav")
    assert far.promised_m == pytest.approx(0.6 - errors_m.get("uav", 0.0) - errors_m.get("tb_0", 0.0), abs=1e-9)
    assert pair_of(found.pairs, "tb_0", "pillar").error_m == errors_m.get("tb_0", 0.0)
    eps, centres = pair.error_m, 0.3 + 2 * 0.15
    assert pair.law_m == pytest.approx(eps + (centres**2 + eps**2) ** 0.5 - 2 * 0.15)


def test_a_shortfall_is_told_with_its_interval_and_its_robot(tmp_path: Path, document: dict[str, Any]) -> None:
    """A step of 0.1 m towards a robot at rest, from the required distance, lacks 0.1 m; then A h asks for a retreat."""
    t_s = np.array([0.0, 0.1, 0.4, 0.6])
    still = np.zeros((4, 3))
    moving = still + np.array([0.0, 0.6, 0.0])
    moving[1:, 1] -= 0.1
    log = {"tb_0": (t_s, still), "tb_1": (t_s, moving), "uav": (t_s, still + np.array([0.0, 0.0, 2.0]))}
    pair = pair_of(judge(logs.read(written(tmp_path, logs.long(log)), document, gap_s=1.0), document).pairs, *BROKEN)
    assert (pair.missed_at_s, pair.missed_for_s) == (0.0, pytest.approx(0.1))
    assert pair.missed_by_m == {"tb_0": pytest.approx(0.0), "tb_1": pytest.approx(0.1)}
    assert pair.missed_m == pytest.approx(0.1)
    # at rest 0.1 m inside d: 3/s times 0.3 s asks for 0.09 m, of which each robot lacks its half
    deficit = max(0.1, 0.1 * (1.0 - 0.9) + 0.09, (0.1 * (1.0 - 0.9) + 0.09) * (1.0 - 0.6) + 0.06)
    assert pair.promised_m == pytest.approx(0.3 - deficit)
    assert pair.came_m == {"tb_0": pytest.approx(0.0), "tb_1": pytest.approx(0.1)}
    assert pair.below_s == [(pytest.approx(0.0, abs=1e-6), pytest.approx(0.6))]


def test_each_interval_asks_for_a_retreat_of_its_own_length(tmp_path: Path, document: dict[str, Any]) -> None:
    """Two robots that rest 0.1 m inside d lack 3/s times 0.1 s of it in the first interval, 3/s times 0.3 s then."""
    t_s, still = np.array([0.0, 0.1, 0.4]), np.zeros((3, 3))
    log = {"tb_0": (t_s, still), "tb_1": (t_s, still + np.array([0.0, 0.5, 0.0]))}
    pair = pair_of(judge(logs.read(written(tmp_path, logs.long(log)), document, gap_s=1.0), document).pairs, *BROKEN)
    assert (pair.missed_m, pair.missed_at_s, pair.missed_for_s) == pytest.approx((0.09, 0.1, 0.3))
    assert pair.hypotheses["starts at the distance or farther"] is False


def test_rows_nanoseconds_apart_make_no_speed(tmp_path: Path) -> None:
    """A run's rows stand 1.6 ns apart at an event; rounded to whole nanoseconds that is 2 ns, or 1 ns."""
    walks = {"radius_m": 0.2, "moves": {"waypoints_m": [[1.0, -2.0], [1.0, 2.0]], "speed_m_s": 0.6}}
    person = {**walks, "max_speed_m_s": 0.6}
    document = logs.document(tmp_path, obstacles={"person": person})
    whole = np.arange(0.0, 2.0, 0.05)
    t_s = np.sort(np.concatenate([whole, whole + 0.0123456784, whole + 0.0123456800]))
    way = np.stack([0.0 * t_s + 1.0, -2.0 + 0.6 * t_s, 0.0 * t_s], axis=1)
    drive = np.stack([-1.0 + 1.0 * t_s / 3.0, 0.0 * t_s, 0.0 * t_s], axis=1)
    rows = [["t_s", "body", "x_m", "y_m", "z_m"]]
    for name, places in (("person", way), ("tb_0", 3.0 * drive), ("tb_1", drive + np.array([0.0, 0.7, 0.0]))):
        rows += [
            [f"{t!r}", name, *(f"{c!r}" for c in place)] for t, place in zip(t_s.tolist(), places.tolist(), strict=True)
        ]
    judged = judge(logs.read(written(tmp_path, rows), document, without=["uav"]), document)
    assert {pair.too_fast_m_s for pair in judged.pairs if pair.passive} == {0.0}
    assert judged.speeds_m_s["tb_0"][0] == pytest.approx(1.0, rel=1e-6)
    faster = [[*row[:3], f"{1.001 * float(row[3])!r}", row[4]] if row[1] == "person" else row for row in rows]
    judged = judge(logs.read(written(tmp_path, faster), document, without=["uav"]), document)
    assert [pair.too_fast_m_s for pair in judged.pairs if pair.passive] == pytest.approx(2 * [0.6006], rel=1e-6)
