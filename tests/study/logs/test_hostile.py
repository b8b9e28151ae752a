"""Logs that are broken, huge or made to mislead: one line says why, and nothing else happens."""

import os
import re
import shutil
import sqlite3
import sys
import tempfile
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
import zstandard
from builders import logs
from builders.logs import Ros
from hypothesis import example, given
from hypothesis import strategies as st

from airground_drake.base import files
from airground_drake.base.errors import LogError
from airground_drake.scenario.load import load, resolved
from airground_drake.study.logs import bags, text
from airground_drake.study.logs.judging import courses, judge
from airground_drake.study.logs.tracks import Track, Tracks

FULL = logs.motion(every=4)
LONG = logs.text(logs.long(FULL))


def of_mcap(folder: Path) -> Path:
    logs.mcap_json(folder / "a.mcap", logs.foxglove(FULL, {}))
    return folder / "a.mcap"


def of_protobuf(folder: Path) -> Path:
    logs.mcap_protobuf(folder / "a.mcap", FULL)
    return folder / "a.mcap"


def of_ros1(folder: Path) -> Path:
    logs.write_ros1(folder / "a.bag", Ros(1), logs.of_ros(Ros(1), FULL, {}))
    return folder / "a.bag"


def of_db3(folder: Path) -> Path:
    logs.write_db3(folder / "a.db3", Ros(2), logs.of_ros(Ros(2), FULL, {}))
    return folder / "a.db3"


def of_text(folder: Path) -> Path:
    (folder / "a.csv").write_text(LONG)
    return folder / "a.csv"


WRITERS: list[Callable[[Path], Path]] = [of_mcap, of_protobuf, of_ros1, of_db3, of_text]


def judged_or_refused(path: Path, document: dict[str, Any]) -> str:
    """'' if the log can be judged, else the refusal, which is one line; any other exception is a fault."""
    try:
        judge(logs.read(path, document), document)
    except LogError as error:
        said = str(error)
    else:
        said = ""
    assert "\n" not in said
    assert len(said) < 1500
    return said


@pytest.mark.parametrize("write", WRITERS, ids=lambda write: write.__name__)
def test_a_file_that_ends_early_is_refused_or_judged_as_far_as_it_goes(
    write: Callable[[Path], Path], tmp_path: Path, document: dict[str, Any]
) -> None:
    path = write(tmp_path)
    assert judged_or_refused(path, document) == ""
    whole = path.read_bytes()
    for length in np.linspace(0, len(whole) - 1, 12).astype(int).tolist():
        path.write_bytes(whole[:length])
        said = judged_or_refused(path, document)
        assert said or write in (of_text, of_mcap, of_protobuf) or length > 0.9 * len(whole)


def test_a_recording_that_was_cut_off_is_judged_as_far_as_it_goes(tmp_path: Path, document: dict[str, Any]) -> None:
    path = tmp_path / "a.mcap"
    logs.mcap_json(path, logs.foxglove(FULL, {}), chunk_size=4096)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 3])
    found = logs.read(path, document)
    assert "a.mcap: cut off, and read up to there" in found.ignored
    assert 1.0 < found.bodies["tb_0"].t_s[-1] < 4.0
    assert not judge(found, document).covers_all


def test_a_changed_position_and_messages_beside_a_file_are_noticed(tmp_path: Path, document: dict[str, Any]) -> None:
    """A recording has checksums; what a killed recorder had not moved into its database is in another file."""
    from mcap.writer import CompressionType

    path = tmp_path / "a.mcap"
    logs.mcap_json(path, logs.foxglove(FULL, {}), compression=CompressionType.NONE)
    path.write_bytes(path.read_bytes().replace(b'"y": 0.6', b'"y": 0.9'))
    assert "it cannot be read as MCAP to its end: CRCValidationError" in judged_or_refused(path, document)
    base = sqlite3.connect(of_db3(tmp_path))
    base.executescript("PRAGMA journal_mode=WAL; DELETE FROM messages WHERE id > 60")
    said = "a.db3-wal beside it has messages that it lacks; wanted: sqlite3 a.db3 VACUUM"
    assert said in judged_or_refused(tmp_path / "a.db3", document)
    base.execute("VACUUM")
    base.close()
    assert judged_or_refused(tmp_path / "a.db3", document) == ""


def test_a_number_that_was_cut_off_is_no_position(tmp_path: Path, document: dict[str, Any]) -> None:
    rows = [f"{t},{name},{x:.4f},{y:.4f}\n" for t, name, (x, y, _) in logs.rows(FULL) if name != "uav"]
    for cut, ignored in ((0, 0), (1, 0), (2, 1), (5, 1)):
        (tmp_path / "a.csv").write_text("t,body,x,y\n" + "".join(rows)[: -cut or None])
        found = logs.read(tmp_path / "a.csv", document)
        assert len(found.bodies["tb_1"].t_s) == len(FULL["tb_1"][0]) - ignored
        assert ("a.csv: lines with another number of fields, or cut off: 1, first line 63" in found.ignored) == ignored


@pytest.mark.parametrize("write", WRITERS, ids=lambda write: write.__name__)
def test_changed_bytes_end_in_a_line_or_in_a_verdict(
    write: Callable[[Path], Path], tmp_path: Path, document: dict[str, Any]
) -> None:
    path, draw = write(tmp_path), np.random.default_rng(1)
    whole = path.read_bytes()
    for _ in range(12):
        changed = bytearray(whole)
        for k in draw.integers(0, len(whole), 8).tolist():
            changed[k] = int(draw.integers(256))
        path.write_bytes(changed)
        judged_or_refused(path, document)


CELLS = st.sampled_from(["1", "2.5", "x", "nan", "", '"', "t", "1e999", "-1", "1,5"])
TABLES = st.lists(st.lists(CELLS, max_size=6).map(";".join), max_size=9).map("\n".join)


@example(b'0;;"')
@example(b'0;1;"a\n0;1;b"\n0;1;2')
@pytest.mark.filterwarnings("error")
@given(st.binary(max_size=400) | st.text(max_size=400).map(str.encode) | TABLES.map(str.encode))
def test_noise_is_refused(content: bytes) -> None:
    try:
        found = text.read(content)
    except LogError:
        return
    assert len(found.labels) == len(found.cells.columns) >= text.FEWEST


def test_decimal_commas_are_read_where_the_middle_of_a_column_shows_none() -> None:
    rows = [f"{t},5;a;{'0,5' if abs(t - 300) > 290 else '0'};1.2" for t in range(600)]
    table = text.read("\n".join(["t;robot;x;version", *rows]).encode())
    assert {*table.cells[2]} == {"0.5", "0"}
    assert {*table.cells[3]} == {"1.2"}


@pytest.mark.parametrize(
    "start", [b"\x89MCAP0\r\n", b"#ROSBAG V2.0\n", b"SQLite format 3\0", b"PAR1", b"\x1f\x8b", b""]
)
def test_noise_after_the_mark_of_a_kind_is_refused(start: bytes, tmp_path: Path, document: dict[str, Any]) -> None:
    noise = np.random.default_rng(2).integers(0, 256, 3000).astype(np.uint8).tobytes()
    (tmp_path / "a.log").write_bytes(start + noise)
    assert judged_or_refused(tmp_path / "a.log", document)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "it is empty"),
        ("\n\n# only a comment\n", "no lines with data"),
        ("hello\nworld\n", "it is not a table"),
        ("t_s,body,x_m,y_m,z_m\n", "it has no rows of numbers"),
        ("t_s,qw,qx,qy,qz,x,y,z,extra\n" + "0.1,1,0,0,0,1,2,0\n0.2,1,0,0,0,1,2,0\n" * 9, "it lacks a column of times"),
        (re.sub(r"(?m)^(\d)", r"at \1", LONG, count=30), "have words where most lines have numbers: line"),
        (re.sub(r"(?m)^(\d)", r"04/05/2026 \1", LONG), "tb_0 has no usable rows: 31 with no time, first in line 2"),
        (
            re.sub(r"(tb_1),(.*)\.(\d{3})\d,(.*)\.(\d{3})\d,", r"\1,\2\3,\4\5,", LONG.replace("_m", "")),
            "lengths of tb_0 fit tb_0's start in metres, others only fit in millimetres",
        ),
        (LONG.replace("x_m", "x"), "some of the columns x, y_m, z_m have a unit, others not"),
        (re.sub(r"(?m)^(\d+)\.\d+", r"\1", LONG), "rows are elsewhere at the same time as another row; wanted: stamps"),
        ("a,b,c\n1,2,3\n4,5,6\n", "it lacks a column of times and columns x and y: its columns are a, b, c"),
        ("t,body,x,x,y\n0,tb_0,0,0,0\n1,tb_0,0,0,0\n", "two columns are called 'x'"),
        ("t,x_m,y_m,p.x,p.y\n0,1,2,3,4\n1,1,2,3,4\n", ""),
        (LONG.replace("tb_0", "nobody"), "tb_0 is not in the log"),
        (LONG.replace(",0.0000,", ",1e155,"), "has a value beyond 1e+12; wanted: seconds and metres"),
        (LONG.replace("0.0000", "inf"), ""),
        (re.sub(r"(?m)^\d", "9999-12-31 23:59:5", LONG), "tb_0 has no usable rows: 31 with no time, first in line 2"),
    ],
)
def test_a_table_that_cannot_be_used_says_what_is_wanted(
    content: str, says: str, tmp_path: Path, document: dict[str, Any]
) -> None:
    (tmp_path / "a.csv").write_text(content)
    said = judged_or_refused(tmp_path / "a.csv", document)
    assert said
    assert says in said


def test_other_encodings_and_line_ends_are_read(tmp_path: Path, document: dict[str, Any]) -> None:
    for content in (LONG.encode("utf-16"), LONG.encode("utf-8-sig"), LONG.replace("\n", "\r\n").encode(),
                    LONG.replace("\n", "\r").encode(),
                    LONG.replace("body", "body", 1).encode() + b"# caf\xe9\n"):  # fmt: skip
        (tmp_path / "a.csv").write_bytes(content)
        assert judged_or_refused(tmp_path / "a.csv", document) == ""


def test_names_that_look_like_no_value_are_names(tmp_path: Path) -> None:
    given = logs.scenario()
    given["ugvs"] = {"NA": given["ugvs"]["tb_0"], "null": given["ugvs"]["tb_1"]}
    (tmp_path / "lab.yaml").write_text(yaml.safe_dump(given))
    table = logs.long({"NA": FULL["tb_0"], "null": FULL["tb_1"], "uav": FULL["uav"]})
    (tmp_path / "a.csv").write_text(logs.text(table))
    document = resolved(load(str(tmp_path / "lab.yaml")))
    assert {*logs.read(tmp_path / "a.csv", document).bodies} == {"NA", "null", "uav"}


def test_too_large_a_text_is_refused_before_it_is_read(
    tmp_path: Path, document: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = of_text(tmp_path)
    monkeypatch.setattr(text, "MOST_ROWS", 50)
    assert "it has 93 rows; allowed: 50" in judged_or_refused(path, document)
    with pytest.raises(OSError, match="allowed: 10"):
        files.read_bytes(path, 10, links=True)


def test_messages_that_lie_about_their_fields_are_left_out(tmp_path: Path, document: dict[str, Any]) -> None:
    lies: list[Any] = [
        None, [], "text", 7, {"pose": 1}, {"position": {"x": "a", "y": 1, "z": 2}}, {"transforms": 5},
        {"name": ["tb_0"], "pose": []}, {"position": {"x": 1e400, "y": 0, "z": 0}}, {"header": {"stamp": {"sec": "x"}}},
        {"position": {"x": 10**400, "y": 0, "z": 0}},
    ]  # fmt: skip
    said = logs.foxglove(FULL, {})
    more = [(logs.EPOCH_NS + k, f"/tb_0/lie_{k}", "lie", each) for k, each in enumerate(lies)]
    logs.mcap_json(tmp_path / "a.mcap", [*said, *more])
    assert judged_or_refused(tmp_path / "a.mcap", document) == ""


def bomb_mcap(how: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        from mcap.writer import CompressionType, Writer

        with (folder / "a.mcap").open("wb") as file:
            writer = Writer(file, compression=CompressionType[how])
            writer.start()
            channel = writer.register_channel("/tb_0/pose", "json", 0)
            writer.add_message(channel, 1, b" " * LARGE + b"1", 1)
            writer.finish()
        return folder / "a.mcap"

    return write


def bomb_ros1(how: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        from rosbags.rosbag1 import Writer

        ros, bag = Ros(1), Writer(folder / "a.bag")
        bag.set_compression(Writer.CompressionFormat[how])
        with bag:
            topic = bag.add_connection("/tb_0/name", "std_msgs/msg/String", typestore=ros.store)
            bag.write(topic, 1, LARGE.to_bytes(4, "little") + b" " * LARGE)
        return folder / "a.bag"

    return write


def bomb_messages(folder: Path) -> Path:
    path = of_db3(folder)
    with sqlite3.connect(path) as base:
        base.execute("UPDATE messages SET data = ? WHERE topic_id > 1", (zstandard.compress(b" " * LARGE),))
    base.close()
    return path


def bomb_file(folder: Path) -> Path:
    (folder / "bag").mkdir()
    (folder / "bag" / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    (folder / "bag" / "a.db3.zstd").write_bytes(zstandard.compress(b" " * LARGE))
    return folder / "bag"


LARGE = 5_000_000
BOMBS = {
    "MCAP, zstd": bomb_mcap("ZSTD"), "MCAP, lz4": bomb_mcap("LZ4"), "ROS 1, lz4": bomb_ros1("LZ4"),
    "ROS 1, bz2": bomb_ros1("BZ2"), "messages, zstd": bomb_messages, "file, zstd": bomb_file,
}  # fmt: skip


@pytest.mark.parametrize("kind", BOMBS)
def test_what_unpacks_to_too_much_is_refused_before_it_is_unpacked(
    kind: str, tmp_path: Path, document: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    path, left = BOMBS[kind](tmp_path), {*Path(tempfile.gettempdir()).glob("airground_drake.*")}
    monkeypatch.setattr(files, "LARGEST_FILE", LARGE // 5)
    monkeypatch.setattr(files, "MOST_UNPACKED", LARGE // 5)
    assert "it unpacks to more than 1000000 bytes, the most allowed" in judged_or_refused(path, document)
    assert {*Path(tempfile.gettempdir()).glob("airground_drake.*")} <= left


def test_all_parts_of_a_file_are_counted_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "MOST_UNPACKED", 3 * LARGE)
    unpacker, part = bags.Unpacker(1000), zstandard.compress(b" " * LARGE)
    assert [len(unpacker.unpacked(part, "zstd")) for _ in range(3)] == 3 * [LARGE]
    with pytest.raises(LogError, match="it unpacks to more than 0 bytes"):
        unpacker.unpacked(part, "zstd")


def test_only_regular_files_of_a_folder_are_read(tmp_path: Path, document: dict[str, Any]) -> None:
    """A pipe would make a bag wait for ever, and a link may lead to the file of somebody else."""
    bag = tmp_path / "bag"
    bag.mkdir()
    (bag / "metadata.yaml").write_text(
        "rosbag2_bagfile_information: {version: 5, storage_identifier: sqlite3, relative_file_paths: [a.db3]}\n"
    )
    os.mkfifo(bag / "a.db3")
    (bag / "b.db3").symlink_to(of_db3(tmp_path))
    said = "bag: the folder has no files: a.db3: no regular file, b.db3: a link; wanted: regular files"
    assert said in judged_or_refused(bag, document)
    shutil.copy(tmp_path / "a.db3", bag / "c.db3")
    found = logs.read(bag, document)
    assert {"a.db3: no regular file", "b.db3: a link"} <= {*found.ignored}
    (tmp_path / "links").mkdir()
    (tmp_path / "links" / "a.csv").symlink_to(of_text(tmp_path))
    assert "the folder has no files: a.csv: a link; wanted: regular files" in judged_or_refused(
        tmp_path / "links", document
    )


@pytest.mark.parametrize("kind", ["ROS 1", "ROS 2"])
def test_a_broken_definition_loses_its_topic_only(kind: str, tmp_path: Path, document: dict[str, Any]) -> None:
    thing, broken = "lab_msgs/msg/Thing", "float64 x\nthis is no definition\n"
    if kind == "ROS 1":
        from rosbags.rosbag1 import Writer

        ros, path = Ros(1), tmp_path / "a.bag"
        with Writer(path) as bag:
            topics = {"/tb_0/thing": bag.add_connection("/tb_0/thing", thing, msgdef=broken, md5sum="0" * 32)}
            bag.write(topics["/tb_0/thing"], 1, b"12345678")
            for received, topic, name, message in logs.of_ros(ros, FULL, {}):
                if topic not in topics:
                    topics[topic] = bag.add_connection(topic, name, typestore=ros.store)
                bag.write(topics[topic], received, ros.raw(name, message))
    else:
        path = of_db3(tmp_path)
        with sqlite3.connect(path) as base:
            base.executescript("CREATE TABLE message_definitions(topic_type, encoding, encoded_message_definition)")
            base.execute("INSERT INTO message_definitions VALUES (?, 'ros2msg', ?)", (thing, broken))
            base.execute("INSERT INTO topics VALUES (99, '/tb_0/thing', ?, 'cdr', '')", (thing,))
            base.execute("INSERT INTO messages VALUES (NULL, 99, 1, ?)", (b"123456789012",))
        base.close()
    found = logs.read(path, document)
    assert {*found.bodies} == {"tb_0", "tb_1", "uav"}
    assert any("/tb_0/thing (lab_msgs/msg/Thing: " in each for each in found.ignored)


@pytest.mark.parametrize("stamp", [{"sec": 2**62, "nanosec": 0}, 2**62, 1e300])
def test_stamps_beyond_64_bits_are_none(stamp: Any, tmp_path: Path, document: dict[str, Any]) -> None:
    said = [(2**64 - 1, topic, kind, {**message, "timestamp": stamp})
            for _, topic, kind, message in logs.foxglove(FULL, {}) if "pose" in message]  # fmt: skip
    logs.mcap_json(
        tmp_path / "a.mcap", [*logs.foxglove({**FULL, "uav": (FULL["uav"][0][:0], FULL["uav"][1][:0])}, {}), *said]
    )
    assert judged_or_refused(tmp_path / "a.mcap", document)


@pytest.mark.parametrize(
    ("package", "write", "says"),
    [
        ("mcap.exceptions", of_mcap, "an MCAP file needs the package mcap"),
        ("mcap_protobuf.decoder", of_protobuf, "messages in protobuf need the package mcap-protobuf-support"),
        ("rosbags", of_ros1, "messages of ROS need the package rosbags"),
        ("rosbags", of_db3, "messages of ROS need the package rosbags"),
    ],
)
def test_a_package_that_is_missing_is_named_in_one_line(
    package: str, write: Callable[[Path], Path], says: str, tmp_path: Path, document: dict[str, Any],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    path = write(tmp_path)
    monkeypatch.setitem(sys.modules, package, None)
    said = judged_or_refused(path, document)
    assert f"{says}: {bags.HINT}" in said


def test_distances_of_a_long_log_beside_many_corners_need_little_memory() -> None:
    """All differences of places and corners at once would take 400 MB."""
    angles = np.linspace(0.0, 2.0 * np.pi, 301)[1:]
    corners = np.round(np.column_stack([5.0 + np.cos(angles), 3.0 + np.sin(angles)]), 4).tolist()
    document = resolved(load("minimal", {"obstacles.rock": {"polygon_m": corners}}))
    t_s = np.linspace(0.0, 20.0, 20_001)
    places_m = np.column_stack([0.5 * t_s, np.zeros((len(t_s), 2))])
    tracemalloc.start()
    try:
        ((times, gaps_m),) = courses(Tracks({"ugv1": Track(t_s, places_m, 0.1)}, [], []), document)["ugv1", "rock"]
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(times) == len(gaps_m) == 20_001
    assert float(gaps_m.min()) == pytest.approx(2.0, abs=1e-3)
    assert most < 100e6
