"""Positions in messages, found by their fields: those of ROS 1, ROS 2, Foxglove, and of this package's own recordings.

A message may be an object with attributes (ROS, protobuf) or a dict (JSON).
"""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from airground_drake.study.logs.stream import HEADERS, PER_S, RECEIPT, Stream, is_elsewhere, segments, unit_since_1970

# Beginnings of names of types without a robot's position, or ambiguous ones.
NO_PLACES = ("sensor_msgs/", "visualization_msgs/", "rcl_interfaces/", "rosgraph_msgs/", "foxglove.SceneUpdate")
# Fields with several positions, such as those of motion capture, and with the name of each one's body.
LISTS, NAMES = ("transforms", "poses", "rigidbodies"), ("name", "rigid_body_name")
FIXED = "tf_static"  # topic of transforms that do not change
# Numbers below are seconds, if they are the stamp of a header; the last nanosecond that is counted.
SECONDS, LAST_NS = 1e8, 2**63 - 1
# A topic is unused after so many messages without a position. The first ones may be empty: a body is not tracked yet.
MOST_EMPTY = 100
ROOTS = ("odom", "map", "world")  # frames that are not a robot, although a robot's name may precede them


class Place(NamedTuple):
    """A position: whose it is (`body` of a list of names, or the frame `child`), frame, stamp in ns, and x, y, z."""

    body: str
    frame: str
    child: str
    stamp_ns: int | None
    xyz: tuple[float, float, float]


def places(message: Any) -> Iterator[Place]:
    names, poses = _of(message, "name"), _of(message, "pose")
    if isinstance(names, list) and isinstance(poses, (list, np.ndarray)):  # Gazebo's model states
        for name, pose in zip(names, poses, strict=False):
            if (xyz := _xyz(_of(pose, "position"))) is not None:
                yield Place(str(name), "", "", None, xyz)
        return
    several = _first(*(_of(message, name) for name in LISTS))
    for entry in [message] if several is None else several if isinstance(several, Sequence) else []:
        if (place := _place(entry)) is None:
            continue
        if several is not None and not place.child:  # the header is that of the list
            head = _first(_of(message, "header"), {})
            body = _first(*(_of(entry, name) for name in NAMES), "")
            place = place._replace(body=str(body), frame=_frame(head), stamp_ns=_ns(_of(head, "stamp")))
        if several is None or place.child or place.body:
            yield place


def _place(entry: Any) -> Place | None:
    head = _first(_of(entry, "header"), entry)
    pose = _first(_of(entry, "pose"), _of(entry, "transform"), entry)
    pose = _first(_of(pose, "pose"), pose)
    points = [_of(pose, name) for name in ("position", "translation", "point", "position_m")]
    if _of(entry, "theta") is not None:  # Pose2D
        points.append({"x": _of(entry, "x"), "y": _of(entry, "y"), "z": math.nan})
    xyz = next((position for point in points if (position := _xyz(point)) is not None), None)
    if xyz is None:
        return None
    frame = _frame(head) or str(_first(_of(entry, "parent_frame_id"), "")).strip("/")
    child = _first(_of(entry, "child_frame_id"), "")
    stamp = _ns(_first(_of(head, "stamp"), _of(head, "timestamp")))
    return Place("", frame, str(child).strip("/"), stamp, xyz)


def _frame(head: Any) -> str:
    return str(_first(_of(head, "frame_id"), "")).strip("/")


def _of(value: Any, name: str) -> Any:
    return value.get(name) if isinstance(value, dict) else getattr(value, name, None)


def _first(*values: Any) -> Any:
    return next((value for value in values if value is not None), None)


def _xyz(point: Any) -> tuple[float, float, float] | None:
    try:
        x, y, z = (float(_of(point, axis)) for axis in "xyz")
    except (TypeError, ValueError, OverflowError):
        return None
    return x, y, z


def _ns(stamp: Any) -> int | None:
    """A header's stamp in nanoseconds, also from a number or a date; 0 counts as unset."""
    if isinstance(stamp, str):
        try:
            return int(pd.Timestamp(stamp).as_unit("ns").value) or None
        except ValueError:
            return None
    if isinstance(stamp, (int, float)) and math.isfinite(stamp):
        unit = unit_since_1970(stamp, stamp) or ("s" if abs(stamp) < SECONDS else "")
        return _in_64_bits(round(stamp * (10**9 // PER_S[unit]))) if unit else None
    whole = _first(*(_of(stamp, name) for name in ("sec", "secs", "seconds")))
    rest = _first(*(_of(stamp, name) for name in ("nanosec", "nsec", "nsecs", "nanos")), 0)
    try:
        return _in_64_bits(int(whole) * 10**9 + int(rest))
    except (TypeError, ValueError, OverflowError):
        return None


def _in_64_bits(ns: int) -> int | None:
    """A stamp other than 0 that 64 bits hold, or None."""
    return ns if 0 < abs(ns) < 2**63 else None


class Gathered:
    """Collects positions in messages: a stream for each topic, body, frame and child frame."""

    def __init__(self, source: str, bodies: tuple[str, ...]) -> None:
        self.source, self.bodies = source, bodies
        self._rows: dict[tuple[str, str, str, str], list[tuple[int, int | None, tuple[float, float, float]]]] = {}
        self.unused: dict[str, str] = {}  # topics without places, with their types
        self.used: set[str] = set()
        self._empty = Counter[str]()  # messages without a position, by topic

    def may_have(self, topic: str, kind: str) -> bool:
        if topic in self.used:
            return True
        if topic in self.unused:
            return 0 < self._empty[topic] < MOST_EMPTY
        has_places = not kind.replace("/msg/", "/").startswith(NO_PLACES) and FIXED not in segments(topic)
        if not has_places or is_elsewhere(topic, self.bodies):
            self.unused[topic] = kind
        return topic not in self.unused

    def add(self, topic: str, kind: str, received_ns: int, message: Any) -> None:
        """Collect the positions of a message; a topic is unused if its first `MOST_EMPTY` messages have none."""
        several = list(places(message))
        if several:
            self.used.add(topic)
            self.unused.pop(topic, None)
        elif topic not in self.used:
            self.unused[topic] = kind
            self._empty[topic] += 1
        for place in several:
            if (segments(place.child) or [""])[-1] in ROOTS:
                continue
            key = topic, place.body, place.frame, place.child
            self._rows.setdefault(key, []).append((min(received_ns, LAST_NS), place.stamp_ns, place.xyz))

    def streams(self) -> Iterator[Stream]:
        for (topic, body, frame, child), rows in self._rows.items():
            rows.sort(key=lambda row: row[0])  # by receipt: a file may have them in the order of its parts
            without = sum(stamp is None for _, stamp, _ in rows)
            stamped = without < 0.5 * len(rows)
            if stamped:
                rows = [row for row in rows if row[1] is not None]
            times = [stamp if stamped and stamp is not None else received for received, stamp, _ in rows]
            xyz = np.array([place for _, _, place in rows], dtype=np.float64).reshape(-1, 3)
            whole, received = np.array(times, dtype=np.int64), np.array([row[0] for row in rows], dtype=np.int64)
            stream = Stream(
                source=self.source,
                name=body or topic,
                whole=whole,
                nano=np.zeros_like(whole),
                places=xyz,
                time_unit="ns",
                frame=frame,
                child=child,
                clock=HEADERS if stamped else RECEIPT,
                late_s=float(np.median(received / 1e9 - whole / 1e9)),
            )
            if stamped and without:
                stream.skipped["no stamp"] = without
            is_finite = np.isfinite(xyz[:, :2]).all(axis=1)
            stream.skip(np.where(is_finite, "", "not finite"), "message", range(1, len(rows) + 1))
            yield stream

    def ignored(self) -> list[str]:
        return [f"{topic} ({kind})" for topic, kind in sorted(self.unused.items())]
