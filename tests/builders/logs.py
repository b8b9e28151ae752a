"""One short experiment, written in the forms of other loggers; what is true of it by formulas of its own."""

import csv
import io
import json
import sqlite3
from collections.abc import Callable, Iterable, Mapping
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from airground_drake.base.arrays import Array
from airground_drake.scenario.load import load, resolved
from airground_drake.study.logs import opening, tracks
from airground_drake.study.logs.judging import Judged, judge
from airground_drake.study.logs.tables import Wanted
from airground_drake.study.logs.tracks import Choice, Tracks

RATE_HZ, LASTS_S = 20.0, 6.0
EPOCH_NS = 1_700_000_123_456_789_000
"""Stamp of t = 0 in logs with stamps since 1970."""
UGVS = {"tb_0": (-1.0, 0.0), "tb_1": (-1.0, 0.7)}
PILLAR, RADII = (1.0, -0.62, 0.0), {"tb_0": 0.15, "tb_1": 0.15, "uav": 0.1, "pillar": 0.2}
GAPS = {"obstacle_m": 0.2, "ugv_m": 0.3, "air_ground_m": 0.6}
BROKEN = ("tb_0", "tb_1")
Motion = dict[str, tuple[Array, Array]]
"""Times (n,), s, and places (n, 3), m, by body."""


def scenario(**more: Any) -> dict[str, Any]:
    ugvs = {
        name: {
            "start_m": [*start, 0.0], "target_m": [1.6, start[1], 0.0], "max_speed_m_s": 1.0, "radius_m": RADII[name],
            "preset": {"waypoints_m": [[*start, 0.0], [1.6, start[1], 0.0]], "speed_m_s": 0.4},
        }
        for name, start in UGVS.items()
    }  # fmt: skip
    return {
        "name": "lab", "duration_s": LASTS_S, "ugvs": ugvs,
        "uav": {"name": "uav", "start_m": [-1.0, -0.2, 1.5], "max_speed_m_s": 2.0, "radius_m": RADII["uav"]},
        "obstacles": {"pillar": {"position_m": [*PILLAR], "radius_m": RADII["pillar"]}},
        "safe_distance": {**GAPS, "collision_m": 0.02},
        "control": {"period_s": 0.05, "avoidance_gain_1_s": 3.0, "sensing_range_m": 3.0},
        "intervention": {"policies": [{"name": "coordinate"}]},
        "runs": {"a": {"method": "a", "expected": {"LIVE-GOAL": "holds or refuted"}}},
        **more,
    }  # fmt: skip


def write_scenario(folder: Path, **more: Any) -> Path:
    path = folder / "lab.yaml"
    path.write_text(yaml.safe_dump(scenario(**more)))
    return path


def document(folder: Path, **more: Any) -> dict[str, Any]:
    """The scenario as nested dicts and lists, with all defaults."""
    return resolved(load(str(write_scenario(folder, **more))))


def where(t_s: Array) -> dict[str, Array]:
    """Where each body is: tb_1 swerves towards tb_0 at 3 s, and away again."""
    zero = 0.0 * t_s
    x = -1.0 + 0.4 * t_s
    swerve = 0.115 * np.exp(-(((t_s - 3.03) / 0.4) ** 2))
    return {
        "tb_0": np.stack([x, zero, zero], axis=1),
        "tb_1": np.stack([x + 0.01 * np.sin(t_s), 0.7 - swerve, zero], axis=1),
        "uav": np.stack([x, -0.2 + 0.05 * t_s, 1.5 - 0.5 * np.exp(-((t_s - 4.0) ** 2))], axis=1),
    }


def motion(bodies: Iterable[str] = ("tb_0", "tb_1", "uav"), every: int = 1) -> Motion:
    """Samples at 20 Hz, or every so many of them, rounded to 0.1 mm."""
    t_s = np.arange(0, round(RATE_HZ * LASTS_S) + 1, every) / RATE_HZ
    return {name: (t_s, np.round(where(t_s)[name], 4) + 0.0) for name in bodies}


def own_times(rates_hz: Mapping[str, float], jitter: float, seed: int) -> Motion:
    draw, whole, found = np.random.default_rng(seed), motion(), {}
    for name, rate in rates_hz.items():
        steps = (1.0 + jitter * draw.uniform(-1.0, 1.0, round(2 * LASTS_S * rate))) / rate
        t_s = np.round(draw.uniform(0.0, 0.03) + np.append(0.0, np.cumsum(steps)), 6)
        t_s = t_s[t_s <= LASTS_S]
        found[name] = (t_s, np.round(at(whole[name], t_s), 4) + 0.0)
    return found


def at(track: tuple[Array, Array], t_s: Array) -> Array:
    return np.stack([np.interp(t_s, track[0], axis) for axis in track[1].T], axis=1)


def least_gaps(bodies: Motion, gap_s: float = np.inf) -> dict[tuple[str, str], tuple[float, float]]:
    """Least distance of the surfaces of each pair, m, and when, s, where both are recorded; points and balls only."""
    found = {}
    for one, two in [*combinations(bodies, 2), *((name, "pillar") for name in bodies)]:
        other = bodies.get(two, (bodies[one][0], np.tile(PILLAR, (len(bodies[one][0]), 1))))
        own = bodies[one][0]
        knots = np.unique(np.concatenate([own, other[0]]))
        knots = knots[(knots >= max(own[0], other[0][0])) & (knots <= min(own[-1], other[0][-1]))]
        least = (np.inf, 0.0)
        for t0, t1 in pairwise(knots.tolist()):
            if any(_gap(track[0], t0, t1) > gap_s * (1.0 + 1e-6) for track in (bodies[one], other)):
                continue
            r0, r1 = ((at(bodies[one], np.array([t])) - at(other, np.array([t])))[0] for t in (t0, t1))
            w = r1 - r0
            s = min(max(-float(r0 @ w) / float(w @ w), 0.0), 1.0) if w.any() else 0.0
            least = min(least, (float(np.linalg.norm(r0 + s * w)), float(t0 + s * (t1 - t0))))
        found[one, two] = (least[0] - RADII[one] - RADII[two], least[1])
    return found


def _gap(t_s: Array, begin: float, end: float) -> float:
    k = int(np.searchsorted(t_s, 0.5 * (begin + end)))
    return float(t_s[k] - t_s[k - 1])


def required_m(one: str, two: str) -> float:
    return GAPS["obstacle_m" if two == "pillar" else "air_ground_m" if "uav" in (one, two) else "ugv_m"]


def read(path: Path | list[Path], document: Mapping[str, Any], **choice: Any) -> Tracks:
    columns = choice.pop("columns", {})
    chosen, paths = Choice(**choice), path if isinstance(path, list) else [path]
    bodies = tracks.bodies_of(dict(document), chosen.uavs)
    return tracks.joined(opening.opened(paths, Wanted(bodies, chosen.rename, columns)), dict(document), chosen)


def judged(table: pd.DataFrame, document: Mapping[str, Any], folder: Path) -> Judged:
    table.to_csv(folder / "table.csv", index=False)
    return judge(read(folder / "table.csv", document), dict(document))


# --- forms -----------------------------------------------------------------------------------------------------------


def rows(bodies: Motion) -> list[tuple[float, str, Array]]:
    found = [
        (float(t), name, place) for name, (t_s, places) in bodies.items() for t, place in zip(t_s, places, strict=True)
    ]
    return sorted(found, key=lambda row: row[0])


def text(lines: Iterable[Iterable[Any]], delimiter: str = ",") -> str:
    out = io.StringIO()
    csv.writer(out, delimiter=delimiter, lineterminator="\n").writerows(lines)
    return out.getvalue()


def fixed(place: Array, scale: float = 1.0) -> list[str]:
    return [f"{scale * c + 0.0:.4f}" for c in place]


def long(
    bodies: Motion, head: str = "t_s,body,x_m,y_m,z_m", stamp: Callable[[float], str] = "{:.6f}".format,
    scale: float = 1.0,
) -> list[list[str]]:  # fmt: skip
    return [head.split(","), *([stamp(t), name, *fixed(place, scale)] for t, name, place in rows(bodies))]


def wide(bodies: Motion, name: str = "{}_{}", scale: float = 1.0) -> list[list[str]]:
    t_s = next(iter(bodies.values()))[0]
    head = ["time", *(name.format(body, axis) for body in bodies for axis in "xyz")]
    cells = [[c for _, places in bodies.values() for c in fixed(places[k], scale)] for k in range(len(t_s))]
    return [head, *([f"{t:.3f}", *row] for t, row in zip(t_s, cells, strict=True))]


def since_1970(t_s: float) -> str:
    ns = EPOCH_NS + round(t_s * 1e9)
    return f"{ns // 10**9}.{ns % 10**9:09d}"


# --- messages --------------------------------------------------------------------------------------------------------

Said = tuple[int, str, str, Any]
"""When a message was received, ns; topic, type, and content."""


def foxglove(bodies: Motion, late_s: Mapping[str, float]) -> list[Said]:
    """At first no body is tracked."""
    found: list[Said] = [(EPOCH_NS, "/log", "foxglove.Log", {"message": "on", "level": 2})]
    found.append((EPOCH_NS, "/tf", "foxglove.FrameTransforms", {"transforms": []}))
    for t, name, place in rows(bodies):
        ns = EPOCH_NS + round(t * 1e9)
        stamp, xyz = {"sec": ns // 10**9, "nsec": ns % 10**9}, dict(zip("xyz", place.tolist(), strict=True))
        received = ns + round(1e9 * late_s.get(name, 0.0))
        if name == "uav":
            pose = {"timestamp": stamp, "frame_id": "world", "pose": {"position": xyz}}
            found.append((received, "/uav/pose", "foxglove.PoseInFrame", pose))
        else:
            one = {"timestamp": stamp, "parent_frame_id": "world", "child_frame_id": f"{name}/base", "translation": xyz}
            found.append((received, "/tf", "foxglove.FrameTransforms", {"transforms": [one]}))
    return sorted(found, key=lambda each: each[0])


def mcap_json(path: Path, said: Iterable[Said], profile: str = "", **options: Any) -> None:
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start(profile=profile, library="a logger")
        channels: dict[str, int] = {}
        for received, topic, kind, content in said:
            if topic not in channels:
                schema = writer.register_schema(kind, "jsonschema", b'{"type": "object"}')
                channels[topic] = writer.register_channel(topic, "json", schema)
            writer.add_message(channels[topic], received, json.dumps(content).encode(), received)
        writer.finish()


def mcap_protobuf(path: Path, bodies: Motion) -> None:
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
    from mcap_protobuf.writer import Writer

    field = descriptor_pb2.FieldDescriptorProto
    kinds = {
        "Time": [("seconds", field.TYPE_INT64, ""), ("nanos", field.TYPE_INT32, "")],
        "Vector": [(axis, field.TYPE_DOUBLE, "") for axis in "xyz"],
        "Pose": [("position", field.TYPE_MESSAGE, ".lab.Vector")],
        "PoseInFrame": [
            ("timestamp", field.TYPE_MESSAGE, ".lab.Time"), ("frame_id", field.TYPE_STRING, ""),
            ("pose", field.TYPE_MESSAGE, ".lab.Pose"),
        ],
    }  # fmt: skip
    about = descriptor_pb2.FileDescriptorProto(name="lab.proto", package="lab", syntax="proto3")
    for name, fields in kinds.items():
        message = about.message_type.add(name=name)
        for number, (each, kind, of) in enumerate(fields, start=1):
            more = {"type_name": of} if of else {}
            message.field.add(name=each, number=number, type=kind, label=field.LABEL_OPTIONAL, **more)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(about)
    make = {name: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"lab.{name}")) for name in kinds}
    with path.open("wb") as file, Writer(file) as writer:
        for t, name, place in rows(bodies):
            ns = EPOCH_NS + round(t * 1e9)
            xyz = dict(zip("xyz", place.tolist(), strict=True))
            pose = make["PoseInFrame"](
                timestamp=make["Time"](seconds=ns // 10**9, nanos=ns % 10**9), frame_id="world",
                pose=make["Pose"](position=make["Vector"](**xyz)),
            )  # fmt: skip
            writer.write_message(f"/{name}/pose", pose, log_time=ns + 5_000_000, publish_time=ns)


class Ros:
    def __init__(self, version: int) -> None:
        from rosbags.typesys import Stores, get_typestore

        self.version = version
        self.store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_HUMBLE)

    def make(self, kind: str, **values: Any) -> Any:
        return self.store.types[kind](**values)

    def raw(self, kind: str, message: Any) -> bytes:
        write = self.store.serialize_ros1 if self.version == 1 else self.store.serialize_cdr
        return bytes(write(message, kind))

    def header(self, ns: int, frame: str) -> Any:
        stamp = self.make("builtin_interfaces/msg/Time", sec=ns // 10**9, nanosec=ns % 10**9)
        more = {"seq": 1} if self.version == 1 else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **more)

    def vector(self, kind: str, place: Iterable[float]) -> Any:
        return self.make(f"geometry_msgs/msg/{kind}", **dict(zip("xyz", map(float, place), strict=True)))

    def pose(self, place: Array) -> Any:
        turn = self.make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
        return self.make("geometry_msgs/msg/Pose", position=self.vector("Point", place), orientation=turn)

    def stamped(self, ns: int, frame: str, place: Array) -> tuple[str, Any]:
        kind = "geometry_msgs/msg/PoseStamped"
        return kind, self.make(kind, header=self.header(ns, frame), pose=self.pose(place))

    def odometry(self, ns: int, frame: str, child: str, place: Array) -> tuple[str, Any]:
        kind, none = "nav_msgs/msg/Odometry", np.zeros(36)
        return kind, self.make(
            kind, header=self.header(ns, frame), child_frame_id=child,
            pose=self.make("geometry_msgs/msg/PoseWithCovariance", pose=self.pose(place), covariance=none),
            twist=self.make("geometry_msgs/msg/TwistWithCovariance", twist=self.twist()[1], covariance=none),
        )  # fmt: skip

    def transform(self, ns: int, frame: str, child: str, place: Array) -> tuple[str, Any]:
        kind = "geometry_msgs/msg/TransformStamped"
        turn = self.make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
        moved = self.make("geometry_msgs/msg/Transform", translation=self.vector("Vector3", place), rotation=turn)
        return kind, self.make(kind, header=self.header(ns, frame), child_frame_id=child, transform=moved)

    def twist(self) -> tuple[str, Any]:
        kind, none = "geometry_msgs/msg/Twist", self.vector("Vector3", (0, 0, 0))
        return kind, self.make(kind, linear=self.vector("Vector3", (1, 0, 0)), angular=none)


def of_ros(ros: Ros, bodies: Motion, late_s: Mapping[str, float], frame: str = "map") -> list[Said]:
    found: list[Said] = [(EPOCH_NS + 1, "/tb_0/cmd_vel", *ros.twist())]
    for t, name, place in rows(bodies):
        ns = EPOCH_NS + round(t * 1e9)
        received = ns + round(1e9 * late_s.get(name, 0.01))
        if name == "tb_0":
            found.append((received, "/tb_0/odom", *ros.odometry(ns, frame, "tb_0/base_footprint", place)))
        elif name == "uav":
            found.append((received, "/vicon/uav/uav", *ros.transform(ns, f"/{frame}", "vicon/uav/uav", place)))
        else:
            found.append((received, f"/vicon/{name}/pose", *ros.stamped(ns, frame, place)))
    return sorted(found, key=lambda each: each[0])


def write_ros1(path: Path, ros: Ros, said: Iterable[Said]) -> None:
    from rosbags.rosbag1 import Writer

    with Writer(path) as bag:
        topics: dict[str, Any] = {}
        for received, topic, kind, message in said:
            if topic not in topics:
                topics[topic] = bag.add_connection(topic, kind, typestore=ros.store)
            bag.write(topics[topic], received, ros.raw(kind, message))


def write_ros2(path: Path, ros: Ros, said: Iterable[Said], storage: str) -> None:
    """The folder of a ROS 2 bag; storage is SQLITE3 or MCAP."""
    from rosbags.rosbag2 import StoragePlugin, Writer

    with Writer(path, version=8, storage_plugin=StoragePlugin[storage]) as bag:
        topics: dict[str, Any] = {}
        for received, topic, kind, message in said:
            if topic not in topics:
                topics[topic] = bag.add_connection(topic, kind, typestore=ros.store)
            bag.write(topics[topic], received, ros.raw(kind, message))


def write_db3(path: Path, ros: Ros, said: Iterable[Said]) -> None:
    """A .db3 file as older distributions write it: without definitions of the messages, and without its folder."""
    with sqlite3.connect(path) as base:
        base.executescript(
            "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
            "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,"
            "data BLOB NOT NULL); INSERT INTO schema VALUES (3, 'humble');"
        )
        topics: dict[str, int] = {}
        for received, topic, kind, message in said:
            if topic not in topics:
                topics[topic] = len(topics) + 1
                base.execute("INSERT INTO topics VALUES (?,?,?,?,?)", (topics[topic], topic, kind, "cdr", ""))
            row = (topics[topic], received, ros.raw(kind, message))
            base.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?,?,?)", row)
    base.close()
