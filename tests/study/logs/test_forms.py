"""One experiment in the forms of many loggers: each gets the verdict that its numbers have."""

import sqlite3
from collections.abc import Callable, Iterable, Mapping
from datetime import UTC, datetime
from decimal import Decimal
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import zstandard
from builders import logs
from builders.logs import BROKEN, EPOCH_NS, Motion, Ros

from airground_drake.base.errors import LogError
from airground_drake.study.logs.judging import BROKEN as NOT_KEPT
from airground_drake.study.logs.judging import KEPT, judge


class Form(NamedTuple):
    """A form that a log can have: what writes it to a folder; what it says; remarks that are wanted."""

    write: Callable[[Path], Path | list[Path]]
    motion: Motion
    says: tuple[str, ...] = ()
    choice: Mapping[str, Any] = {}
    within_m: float = 1e-9


def table(
    name: str, lines: Callable[[], list[list[str]]], delimiter: str = ",", above: str = ""
) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / name).write_text(above + logs.text(lines(), delimiter))
        return folder / name

    return write


FULL, SLOW = logs.motion(), logs.motion(every=2)
PART = {name: (t_s[50:81], places[50:81]) for name, (t_s, places) in FULL.items()}
FLAT = logs.motion(("tb_0", "tb_1"))
JITTER = logs.own_times({"tb_0": 20.0, "tb_1": 15.0, "uav": 12.0}, 0.35, seed=5)
LATE = {"tb_0": 0.3, "tb_1": 0.01, "uav": 0.02}
"""Delays of receipt, s: by times of receipt the distances are wrong."""


def planar() -> list[list[str]]:
    lines = logs.wide(FULL)
    gone = {lines[0].index("tb_0_z"), lines[0].index("tb_1_z")}
    return [[cell for k, cell in enumerate(line) if k not in gone] for line in lines]


def sparse() -> list[list[str]]:
    names = list(JITTER)
    head = ["__time", *(f"/{name}/odom/pose/pose/position/{axis}" for name in names for axis in "xyz")]
    lines = [head]
    for t, name, place in logs.rows(JITTER):
        k = 3 * names.index(name)
        lines.append([logs.since_1970(t), *[""] * k, *logs.fixed(place), *[""] * (3 * len(names) - k - 3)])
    return lines


def comma() -> list[list[str]]:
    return [[cell if k == 0 else cell.replace(".", ",") for cell in line] for k, line in enumerate(logs.long(FULL))]


def echo(folder: Path) -> Path:
    """A file per robot, with times of receipt before the stamps of headers."""
    for name, (t_s, places) in FULL.items():
        late = round(1e9 * LATE[name])
        lines = [["%time", "field.header.seq", "field.header.stamp", "field.header.frame_id",
                  *(f"field.pose.position.{axis}" for axis in "xyz"), "field.pose.orientation.x"]]  # fmt: skip
        for k, (t, place) in enumerate(zip(t_s, places, strict=True)):
            ns = EPOCH_NS + round(t * 1e9)
            lines.append([str(ns + late), str(k), str(ns), "world", *logs.fixed(place), "0.0"])
        (folder / f"{name}.csv").write_text(logs.text(lines))
    return folder


def plotted(folder: Path) -> Path:
    """Stamps of headers per topic, in seconds and nanoseconds, beside times of receipt."""
    names, lines = list(SLOW), []
    head = ["__time"]
    for name in names:
        head += [f"/{name}/pose/header/stamp/sec", f"/{name}/pose/header/stamp/nanosec"]
        head += [f"/{name}/pose/pose/position/{axis}" for axis in "xyz"]
    for t, name, place in logs.rows(SLOW):
        ns, k = EPOCH_NS + round(t * 1e9), 5 * names.index(name)
        own = [str(ns // 10**9), str(ns % 10**9), *logs.fixed(place)]
        lines.append([logs.since_1970(t + LATE[name]), *[""] * k, *own, *[""] * (5 * len(names) - k - 5)])
    return table("plot.csv", lambda: [head, *lines])(folder)


def tum(folder: Path) -> Path:
    for name, (t_s, places) in FULL.items():
        lines = ["# timestamp tx ty tz qx qy qz qw"] * (name == "tb_0")
        lines += [" ".join([logs.since_1970(t), *logs.fixed(p), "0 0 0 1"]) for t, p in zip(t_s, places, strict=True)]
        (folder / f"run3_{name}.tum").write_text("\n".join(lines) + "\n")
    return folder


def euroc(folder: Path) -> Path:
    """A comment is the header, and units are in brackets."""
    for name, (t_s, places) in FULL.items():
        head = "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_x [],v_RS_R_x [m s^-1],v_RS_R_y [m s^-1]\n"
        lines = [[str(EPOCH_NS + round(t * 1e9)), *logs.fixed(p), "0.0", "9", "9"]
                 for t, p in zip(t_s, places, strict=True)]  # fmt: skip
        (folder / f"{name}.csv").write_text(head + logs.text(lines))
    return folder


def mocap_mm() -> list[list[str]]:
    """Five lines of headers; rotations and positions have the same axes."""
    columns = [
        (name, kind, axis)
        for name in FULL
        for kind, axes in (("Rotation", "XYZW"), ("Position", "XYZ"))
        for axis in axes
    ]
    ids = [str(sorted(FULL).index(name)) for name, _, _ in columns]
    lines = [
        ["", "Type", *["Rigid Body"] * len(columns)], ["", "Name", *(name for name, _, _ in columns)],
        ["", "ID", *ids], ["", "", *(kind for _, kind, _ in columns)],
        ["Frame", "Time (Seconds)", *(axis for _, _, axis in columns)],
    ]  # fmt: skip
    for k, t in enumerate(FULL["uav"][0]):
        cells = [c for _, places in FULL.values() for c in ("0.0", "0.0", "0.0", "1.0", *logs.fixed(places[k], 1000.0))]
        lines.append([str(6 * k), f"{t:.6f}", *cells])
    return lines


def words() -> list[list[str]]:
    lines = logs.long(FULL)
    said = ("tracking", "tracking, slow", 'said "go"', "")
    more = [
        ["frame", "comment", "battery"],
        *(["map", said[k % 4], f"{80 - 0.1 * k:.1f} %"] for k in range(len(lines) - 1)),
    ]
    return [[*line[:2], *each[:1], *line[2:], *each[1:]] for line, each in zip(lines, more, strict=True)]


def twice() -> list[list[str]]:
    """Equal rows twice, one that contradicts, and disorder."""
    head, *lines = logs.long(FULL)
    contradiction = next([*line] for line in lines if line[1] == "uav" and line[0] == "4.000000")
    contradiction[2] = f"{float(contradiction[2]) + 0.01:.4f}"
    moved = lines[30:60][::-1]
    return [head, *lines[:30], *moved, *lines[60:], *lines[100:140], contradiction]


def own_clocks() -> list[list[str]]:
    lines = [[f"{name}.{each}" for name in JITTER for each in ("t", "x", "y", "z")]]
    for k in range(max(len(t_s) for t_s, _ in JITTER.values())):
        own = (
            [f"{float(t_s[k])!r}", *logs.fixed(places[k])] if k < len(t_s) else [""] * 4
            for t_s, places in JITTER.values()
        )
        lines.append([cell for cells in own for cell in cells])
    return lines


def velocities() -> list[list[str]]:
    head, *lines = logs.long(FULL)
    return [[*head[:2], "pos_x", "pos_y", "pos_z", "v_x", "v_y"], *([*line, "0.4", "0"] for line in lines)]


def by_folder(folder: Path) -> list[Path]:
    """A file per robot; the frame that it carries is the same in all, and folders have the robots' names."""
    for name, (t_s, places) in FULL.items():
        rows = [[repr(t), "base_footprint", *logs.fixed(p)] for t, p in zip(t_s.tolist(), places, strict=True)]
        (folder / name).mkdir()
        (folder / name / "pose.csv").write_text(logs.text([["t", "child_frame_id", "x", "y", "z"], *rows]))
    return [folder / name / "pose.csv" for name in FULL]


def two_line_ends(folder: Path) -> Path:
    (folder / "log.csv").write_bytes(logs.text(logs.long(FULL)).replace("\n", "\r\r\n").encode())
    return folder / "log.csv"


def parquet(folder: Path, change: Callable[[pd.DataFrame], pd.DataFrame] = pd.DataFrame.copy) -> Path:
    head, *lines = logs.long(FULL)
    frame = pd.DataFrame(lines, columns=head).astype({name: float for name in head if name != "body"})
    change(frame).to_parquet(folder / "log.parquet")
    return folder / "log.parquet"


def arrow(folder: Path, stamps: Callable[[pa.Array], pa.Array]) -> Path:
    """Parts of structures, categories, decimals, and columns of types that nobody needs; stamps are made from ns."""
    rows = logs.rows(FULL)
    axes = [
        [Decimal(cell) for cell in column] for column in zip(*(logs.fixed(place) for *_, place in rows), strict=True)
    ]
    place = pa.StructArray.from_arrays([pa.array(axis) for axis in axes], names=[*"xyz"])
    codes, names = pd.factorize(np.array([name for _, name, _ in rows], dtype=object))
    columns = {
        "t": stamps(pa.array([round(t * 1e9) for t, *_ in rows])),
        "robot": pa.DictionaryArray.from_arrays(pa.array(codes, pa.uint8()), pa.array(names)),
        "pose": pa.StructArray.from_arrays([place], names=["position"]), "tags": [[["a"]]] * len(rows),
        "twist": [{"linear": [1.0], "of": [["a"]]}] * len(rows), "image": [b"\xff"] * len(rows),
        "noon": pa.array([1] * len(rows), pa.time64("us")), "rest": pa.array([1] * len(rows), pa.duration("us")),
    }  # fmt: skip
    pq.write_table(pa.table(columns), folder / "log.parquet")
    return folder / "log.parquet"


def dated(frame: pd.DataFrame) -> pd.DataFrame:
    return frame.assign(t_s=pd.Timestamp("2026-05-04T10:00:00Z") + pd.to_timedelta(frame["t_s"], unit="s"))


def two_files(folder: Path) -> list[Path]:
    """A log in two parts: the second half is in the first file that is named."""
    head, *lines = logs.long(FULL)
    (folder / "b.csv").write_text(logs.text([head, *lines[200:]]))
    (folder / "a.csv").write_text(logs.text([head, *lines[:200]]))
    return [folder / "b.csv", folder / "a.csv"]


def of_json(folder: Path, profile: str = "", scale: float = 1.0) -> Path:
    scaled = {name: (t_s, scale * places) for name, (t_s, places) in JITTER.items()}
    logs.mcap_json(folder / "run.mcap", logs.foxglove(scaled, LATE), profile)
    return folder / "run.mcap"


def of_protobuf(folder: Path) -> Path:
    logs.mcap_protobuf(folder / "run.mcap", JITTER)
    return folder / "run.mcap"


def gazebo(folder: Path) -> Path:
    """Model states have no stamps and no frame; the model of the room is no robot."""
    said = []
    for k, t in enumerate(FULL["uav"][0]):
        poses = [{"position": dict(zip("xyz", FULL[name][1][k].tolist(), strict=True))} for name in FULL]
        states = {"name": ["room", *FULL], "pose": [{"position": {"x": 0.0, "y": 0.0, "z": 0.0}}, *poses]}
        said.append((EPOCH_NS + round(t * 1e9), "/gazebo/model_states", "gazebo_msgs/ModelStates", states))
    logs.mcap_json(folder / "run.mcap", said)
    return folder / "run.mcap"


def captured(folder: Path) -> Path:
    said = []
    for k, t in enumerate(FULL["uav"][0]):
        ns = EPOCH_NS + round(t * 1e9)
        poses = [{"name": name, "pose": {"position": dict(zip("xyz", FULL[name][1][k].tolist(), strict=True))}}
                 for name in FULL]  # fmt: skip
        poses.append({"pose": {"position": {"x": 0.0, "y": 0.0, "z": 0.0}}})
        header = {"stamp": {"sec": ns // 10**9, "nanosec": ns % 10**9}, "frame_id": "world"}
        said.append((ns + 20_000_000 * (k % 3), "/poses", "NamedPoseArray", {"header": header, "poses": poses}))
    logs.mcap_json(folder / "run.mcap", said)
    return folder / "run.mcap"


def ros2_echo(folder: Path) -> Path:
    """What `ros2 topic echo --csv` prints has no header."""
    for name, (t_s, places) in FULL.items():
        lines = []
        for t, place in zip(t_s, places, strict=True):
            ns = EPOCH_NS + round(t * 1e9)
            child = [f"{name}/base"] if name == "tb_0" else []
            lines.append([str(ns // 10**9), str(ns % 10**9), "map", *child, *logs.fixed(place), "0", "0", "0", "1"])
        (folder / f"{name}.csv").write_text(logs.text(lines))
    return folder


def vicon() -> list[list[str]]:
    """The name of a body stands once above its columns, and units below the axes."""
    lines: list[list[str]] = [["", ""], ["Frame", "Time"], ["", "s"]]
    for name in FULL:
        lines[0] += [f"arena:{name}", "", "", "", "", ""]
        lines[1] += ["RX", "RY", "RZ", "TX", "TY", "TZ"]
        lines[2] += ["rad", "rad", "rad", "mm", "mm", "mm"]
    for k, t in enumerate(FULL["uav"][0]):
        cells = [c for _, places in FULL.values() for c in ("0", "0", "0", *logs.fixed(places[k], 1000.0))]
        lines.append([str(k), f"{t:.3f}", *cells])
    return lines


def ros1(folder: Path) -> Path:
    ros = Ros(1)
    logs.write_ros1(folder / "run.bag", ros, logs.of_ros(ros, JITTER, LATE, "world"))
    return folder / "run.bag"


def ros2(storage: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        ros = Ros(2)
        logs.write_ros2(folder / "bag", ros, logs.of_ros(ros, JITTER, LATE), storage)
        return folder / "bag"

    return write


def humble(folder: Path) -> Path:
    ros = Ros(2)
    logs.write_db3(folder / "run.db3", ros, logs.of_ros(ros, JITTER, LATE))
    return folder / "run.db3"


def packed(of: Callable[[Path], Path]) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        path = of(folder)
        (folder / "packed").mkdir()
        (folder / "packed" / f"{path.name}.zstd").write_bytes(zstandard.compress(path.read_bytes()))
        (folder / "packed" / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
        return folder / "packed"

    return write


def packed_messages(folder: Path) -> Path:
    path = humble(folder)
    with sqlite3.connect(path) as base:
        rows = base.execute("SELECT id, data FROM messages").fetchall()
        base.executemany(
            "UPDATE messages SET data = ? WHERE id = ?", [(zstandard.compress(data), k) for k, data in rows]
        )
    base.close()
    return path


def turned(bodies: Motion, axes: str, names: Iterable[str] = ("tb_0", "tb_1", "uav")) -> Motion:
    """Positions along other axes: `y,x,-z` has the scenario's y first."""
    found = dict(bodies)
    for name in names:
        t_s, places = bodies[name]
        columns = [places[:, "xyz".index(part[-1])] * (-1.0 if part[0] == "-" else 1.0) for part in axes.split(",")]
        found[name] = t_s, np.stack(columns, axis=1) + 0.0
    return found


def per_file(bodies: Motion, name: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        for body in bodies:
            table(name.format(body), lambda body=body: logs.long({body: bodies[body]}))(folder)
        return folder

    return write


def logged(t_s: float) -> str:
    """As Python's `logging` writes it."""
    return f"{datetime.fromtimestamp(EPOCH_NS // 10**9 + t_s, UTC):%Y-%m-%d %H:%M:%S,%f}"


def lab(bodies: Motion, head: str, stamp: Callable[[float], str] = "{:.6f}".format) -> Callable[[], list[list[str]]]:
    return lambda: logs.long(bodies, head, stamp)


UNDER_1970 = "times are in nanoseconds"
FORMS = {
    "long": Form(table("log.csv", lambda: logs.long(FULL)), FULL),
    "wide": Form(table("log.csv", lambda: logs.wide(FULL)), FULL),
    "wide, with points": Form(table("log.csv", lambda: logs.wide(FULL, "{}.pos_{}")), FULL),
    "wide, tabs": Form(table("log.tsv", lambda: logs.wide(FULL), "\t"), FULL),
    "wide, sparse": Form(table("log.csv", sparse), JITTER),
    "wide, planar": Form(table("log.csv", planar), FULL, ("no height in the log: tb_0, tb_1",)),
    "wide, mm in brackets": Form(
        table("log.csv", lambda: [[c + " [mm]" * (k == 0 and j > 0) for j, c in enumerate(line)]
                                  for k, line in enumerate(logs.wide(FULL, scale=1000.0))]),
        FULL, ("millimetres, as the file says",),
    ),
    "mm by size": Form(
        table("log.csv", lambda: logs.wide(FULL, scale=1000.0)), FULL, ("lengths are taken as millimetres",)
    ),
    "units of each column": Form(
        table("log.csv", lambda: [["t_s", "body", "x_mm", "y_m", "z [cm]"], *(
            [row[0], row[1], f"{float(row[2]) * 1e3:.3f}", row[3], f"{float(row[4]) * 1e2:.3f}"]
            for row in logs.long(FULL)[1:])]),
        FULL, ("millimetres, as the file says",),
    ),
    "rows of units": Form(
        table("log.csv", lambda: [["time", "body", "x", "y", "z"], ["[s]", "[-]", "[mm]", "[mm]", "[mm]"],
                                  *logs.long(FULL, scale=1000.0)[1:]]),
        FULL, ("millimetres, as the file says",),
    ),
    "a delimiter at the end of rows": Form(
        table("log.csv", lambda: [row + [""] * (k > 0) for k, row in enumerate(logs.long(FULL))]), FULL
    ),
    "a delimiter at the end of the header": Form(
        table("log.csv", lambda: [row + [""] * (k == 0) for k, row in enumerate(logs.long(FULL))]), FULL
    ),
    "us since the start of a computer": Form(
        table("log.csv", lab(FULL, "t,body,x,y,z", lambda t: str(5_123_456_789 + round(1e6 * t)))),
        {name: (t_s + 5123.456789, places) for name, (t_s, places) in FULL.items()}, ("taken as microseconds",),
    ),
    "epoch": Form(table("log.csv", lab(FULL, "timestamp,name,x,y,z", logs.since_1970)), FULL),
    "epoch, ns": Form(
        table("log.csv", lab(JITTER, "stamp,robot,x,y,z", lambda t: str(EPOCH_NS + round(t * 1e9)))), JITTER,
        (UNDER_1970,),
    ),
    "dates, comma": Form(table("log.csv", lab(FULL, "time,name,x,y,z", logged), ";"), FULL, within_m=1e-5),
    "echo": Form(echo, FULL, (UNDER_1970,)),
    "plotted": Form(plotted, SLOW),
    "ms": Form(
        table("log.csv", lab(FULL, "t,body,x,y,z", lambda t: str(round(1000 * t)))), FULL, ("taken as milliseconds",)
    ),
    "ms, stated": Form(table("log.csv", lab(FULL, "t_ms,body,x,y,z", lambda t: str(round(1000 * t)))), FULL,
                       ("milliseconds, as the file says",)),
    "decimal comma": Form(table("log.csv", comma, ";"), FULL),
    "jitter": Form(table("log.csv", lambda: logs.long(JITTER)), JITTER),
    "tum": Form(tum, FULL),
    "euroc": Form(euroc, FULL, ("nanoseconds, as the file says",)),
    "mocap": Form(
        table("log.csv", lambda: logs.wide(FULL, "{}.{}"), above="# a, b\n# rate: 120 Hz\n# bodies\n"), FULL
    ),
    "mocap, mm": Form(
        table("log.csv", mocap_mm, above="Format Version,1.23,Length Units,Millimeters,Space,Global\n\n"), FULL,
        ("millimetres, as the file says",),
    ),
    "words": Form(table("log.csv", words), FULL),
    "twice": Form(table("log.csv", twice), FULL, ("uav: 1 row not where", "repeated", "not in the order of time")),
    "no uav": Form(table("log.csv", lambda: logs.long(logs.motion(("tb_0", "tb_1")))), logs.motion(("tb_0", "tb_1")),
                   ("uav is not in the log",)),
    "parquet": Form(parquet, FULL),
    "parquet with dates": Form(partial(parquet, change=dated), FULL),
    "parquet with dates as an index": Form(
        partial(parquet, change=lambda frame: dated(frame).set_index("t_s").rename_axis(None)), FULL
    ),
    "parquet of a frame with an index and categories": Form(
        partial(parquet, change=lambda frame: frame.astype({"body": "category"}).set_index("t_s")), FULL
    ),
    "Arrow, durations": Form(partial(arrow, stamps=lambda ns: ns.cast(pa.duration("ns"))), FULL),
    "Arrow, a zone and unneeded columns": Form(
        partial(arrow, stamps=lambda ns: ns.cast(pa.timestamp("ns")).cast(pa.timestamp("us", "Europe/Berlin"))), FULL
    ),
    "durations": Form(table("log.csv", lab(FULL, "t,body,x,y,z", lambda t: str(pd.Timedelta(seconds=t)))), FULL),
    "times of each body": Form(table("log.csv", own_clocks), JITTER),
    "velocities beside positions": Form(table("log.csv", velocities), FULL),
    "a folder per robot": Form(by_folder, FULL),
    "cm by where robots start": Form(
        table("log.csv", lambda: [["t", "body", "x", "y", "z"], *logs.long(FULL, scale=100.0)[1:]]), FULL,
        ("lengths are taken as centimetres",),
    ),
    "two line ends": Form(two_line_ends, FULL),
    "two files": Form(two_files, FULL),
    "other names": Form(
        table("log.csv", lab({"A": FULL["tb_0"], "B": FULL["tb_1"], "uav": FULL["uav"]}, "clock,who,px_,py_,up")),
        FULL, (), {"columns": {"t": "clock", "body": "who", "x": "px_", "y": "py_", "z": "up"},
                   "rename": {"A": "tb_0", "B": "tb_1"}},
    ),
    "other names with units": Form(
        table("log.csv", lambda: [["clock", "id", "eastCm", "north_cm", "up (cm)"], *logs.long(FULL, scale=100.0)[1:]]),
        FULL, ("lengths are in centimetres, as the file says",),
        {"columns": {"t": "clock", "body": "id", "x": "eastCm", "y": "north_cm", "z": "up (cm)"}},
    ),
    "other names, wide": Form(
        table("log.csv", lambda: logs.wide(FULL, "{}<{}>")), FULL, (),
        {"columns": {"x": "{body}<x>", "y": "{body}<y>", "z": "{body}<z>"}},
    ),
    "foxglove, JSON": Form(of_json, JITTER),
    "foxglove, JSON in a profile of ROS 2": Form(lambda folder: of_json(folder, "ros2"), JITTER),
    "foxglove, protobuf": Form(of_protobuf, JITTER),
    "gazebo": Form(gazebo, FULL),
    "axis before the name": Form(
        table("log.csv", lambda: [["t", *(f"{axis}_{name}" for name in FULL for axis in "xyz")], *logs.wide(FULL)[1:]]),
        FULL,
    ),
    "dates": Form(table("log.csv", lab(FULL, "date,robot,x,y,z", lambda t: f"2026-05-04T12:00:{t:09.6f}Z")), FULL),
    "Vicon": Form(table("log.csv", vicon), FULL, ("millimetres, as the file says",)),
    "ROS 2, echo": Form(ros2_echo, FULL),
    "messages in millimetres": Form(partial(of_json, scale=1000.0), JITTER, ("lengths are taken as millimetres",)),
    "named poses": Form(captured, FULL),
    "ROS 1": Form(ros1, JITTER),
    "ROS 2, sqlite3": Form(ros2("SQLITE3"), JITTER),
    "ROS 2, MCAP": Form(ros2("MCAP"), JITTER),
    "ROS 2, MCAP without folder": Form(lambda folder: next(ros2("MCAP")(folder).glob("*.mcap")), JITTER),
    "ROS 2, no definitions": Form(humble, JITTER),
    "ROS 2, packed file": Form(packed(humble), JITTER),
    "ROS 2, packed messages": Form(packed_messages, JITTER),
    "ms with mm": Form(
        table("log.csv", lambda: logs.long(FULL, "t,body,x,y,z", lambda t: str(round(1000 * t)), 1000.0)), FULL,
        ("taken as milliseconds: as seconds, the log would last 6000 s", "taken as millimetres: as metres, tb_"),
    ),
    "us with m, a part of the experiment": Form(
        table("log.csv", lab(PART, "t,body,x,y,z", lambda t: str(5_000_000 + round(1e6 * t)))),
        {name: (t_s + 5.0, places) for name, (t_s, places) in PART.items()},
        ("taken as microseconds: as seconds, the log would last 1.5e+06 s",),
    ),
    "ns of a simulation from 1 s on": Form(
        table("log.csv", lab(FULL, "stamp,robot,x,y,z", lambda t: str(10**9 + round(1e9 * t)))),
        {name: (t_s + 1.0, places) for name, (t_s, places) in FULL.items()}, ("taken as nanoseconds",),
    ),
    "frames": Form(
        table("log.csv", lab(FULL, "frame,id,x,y,z", lambda t: str(round(20 * t)))), FULL,
        ("times are numbers of frames, 20 per second: as chosen",), {"rate_hz": 20.0},
    ),
    "NED": Form(
        per_file(turned(FULL, "y,x,-z"), "{}_vehicle_local_position_0.csv"), FULL,
        ("positions of tb_0, tb_1, uav are taken as NED",),
    ),
    "a drone in NED above robots in a hall's frame": Form(
        table("log.csv", lambda: [
            [*line, "frame_id" if k == 0 else "local_ned" if line[1] == "uav" else ""]
            for k, line in enumerate(logs.long(turned(FULL, "y,x,-z", ["uav"])))]),
        FULL, ("positions of uav are taken as NED",),
    ),
    "y up": Form(
        table("log.csv", lambda: logs.long(turned(FULL, "x,z,-y"))), FULL,
        ("axes: x,-z,y are x, y, z, as chosen",), {"axes": {"": "x,-z,y"}},
    ),
    "one coordinate that is constant": Form(
        table("log.csv", lambda: logs.long({name: FLAT[name] for name in ("tb_0", "tb_1")})), FLAT
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FORMS)
def test_every_form_gets_the_verdict_of_its_numbers(name: str, tmp_path: Path, document: dict[str, Any]) -> None:
    form = FORMS[name]
    found = logs.read(form.write(tmp_path), document, **form.choice)
    judged = judge(found, document)
    expected = logs.least_gaps(form.motion)
    assert {(pair.first, pair.second) for pair in judged.pairs} == {*expected}
    for pair in judged.pairs:
        least_m, at_s = expected[pair.first, pair.second]
        assert pair.least_m == pytest.approx(least_m, abs=form.within_m)
        assert pair.safe_m == logs.required_m(pair.first, pair.second)
        if pair.status == NOT_KEPT:
            shift_s = min(t_s[0] for t_s, _ in form.motion.values()) if found.origin else 0.0
            assert pair.at_s == pytest.approx(at_s - shift_s, abs=1e-5)
    assert [(pair.first, pair.second) for pair in judged.pairs if pair.status != KEPT] == [BROKEN]
    assert [wanted for wanted in form.says if not any(wanted in each for each in found.remarks)] == []


def test_these_numbers_would_be_kept_if_receipt_counted_or_a_unit_were_missed() -> None:
    """The forms can fail: by another clock, or in millimetres, the verdict is another one."""
    late = {name: (t_s + LATE[name], places) for name, (t_s, places) in JITTER.items()}
    assert abs(logs.least_gaps(late)[BROKEN][0] - logs.least_gaps(JITTER)[BROKEN][0]) > 1e-3
    assert logs.least_gaps(FULL)[BROKEN][0] < 0.3
    assert [pair for pair, (least_m, _) in logs.least_gaps(FULL).items() if least_m < logs.required_m(*pair)] == [
        BROKEN
    ]


def test_what_was_not_used_is_named(tmp_path: Path, document: dict[str, Any]) -> None:
    assert logs.read(FORMS["words"].write(tmp_path), document).ignored == ["log.csv: columns comment, battery"]
    assert "run.bag: /tb_0/cmd_vel (geometry_msgs/msg/Twist)" in logs.read(ros1(tmp_path), document).ignored
    path = arrow(tmp_path, lambda ns: ns.cast(pa.duration("ns")))
    assert logs.read(path, document).ignored == ["log.parquet: columns rest, tags, twist.linear, twist.of, image, noon"]
    with pytest.raises(LogError, match=r"column 't' is needed, and of type list<.*>; wanted: numbers, texts, times or"):
        logs.read(arrow(tmp_path, lambda ns: pa.array([[each] for each in ns.to_pylist()])), document)
    assert "room: names no body of the scenario" in logs.read(gazebo(tmp_path), document).ignored


def test_nanoseconds_are_not_rounded(tmp_path: Path, document: dict[str, Any]) -> None:
    """As a floating-point number a stamp would be off by up to 128 ns."""
    path = FORMS["epoch, ns"].write(tmp_path)
    track = logs.read(path, document).bodies["tb_1"]
    first = min(t_s[0] for t_s, _ in JITTER.values())
    assert np.abs(track.t_s - (JITTER["tb_1"][0] - first)).max() < 1e-12
