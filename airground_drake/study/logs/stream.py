"""A stream: unconverted positions of one body from one source."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.base.errors import LogError

Whole = npt.NDArray[np.int64]

PER_S = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}  # units of time, and how many of each are a second
YEAR_2000_S, YEAR_2100_S = 946_684_800, 4_102_444_800  # stamps between these are taken as times since 1970
PER_M = {"m": 1.0, "cm": 100.0, "mm": 1000.0}  # units of length, and how many of each are a metre
OF_MESSAGES = HEADERS, RECEIPT = "header stamps", "times of receipt"  # clocks of messages
LAST = np.iinfo(np.int64).max
# Suffix of a robot's name in this package's tables for its body, if the law steers another point.
OF_BODY = ".body"
# Suffixes that loggers append to a body's name.
AFTER = re.compile(r"_(?:pos|position|pose|odom|odometry|translation|p)$", re.IGNORECASE)
# Words in a name that exclude a body's position.
ELSEWHERE = {
    "orientation", "rotation", "quaternion", "quat", "rot", "twist", "linear", "angular", "velocity", "vel",
    "acceleration", "accel", "acc", "force", "torque", "imu", "gyro", "mag", "euler", "rpy", "cmd", "command", "goal",
    "target", "ref", "reference", "desired", "setpoint", "plan", "waypoint", "initialpose", "covariance", "error",
    "marker", "markers",
}  # fmt: skip


def unit_since_1970(least: float, largest: float) -> str:
    """The unit in which numbers are Unix times of the years 2000 to 2100; '' if no unit fits."""
    return next((unit for unit, per in PER_S.items() if YEAR_2000_S <= least / per <= largest / per <= YEAR_2100_S), "")


@dataclass(eq=False)
class Stream:
    """Positions of one body; n rows, in the order of the source."""

    # A stamp is `whole` + `nano` / 1e9 units of time: a float cannot represent nanoseconds since 1970.

    source: str  # path of the file or folder
    name: str  # its name in the source: a topic, a prefix of column names, a value in a column, a file's stem
    whole: Whole  # whole units of time, (n,)
    nano: Whole  # the rest, in billionths of the unit, (n,)
    places: Array  # x, y, z, (n, 3); z is nan where the source lacks it
    time_unit: str = ""  # key of `PER_S`; '' if the source does not say
    length_unit: str = ""  # key of `PER_M`; '' if the source does not say
    frame: str = ""  # coordinate frame, without slashes at the ends; '' if the source does not say
    child: str = ""  # frame that the body carries; '' if the source does not say
    clock: str = ""  # what the stamps are: "header stamps", "times of receipt", or the name of a column
    is_file: bool = False  # whether `name` is the stem of a file
    late_s: float = 0.0  # median of time of receipt less header stamp; 0 if stamps are not those of headers
    counts_frames: bool = False  # whether stamps are numbers of frames, by the name of their column
    skipped: Counter[str] = field(default_factory=Counter)  # rows without a position or a stamp, by the reason
    # Where the first of them is, by the reason: "line 12"; '' if the source has no lines.
    first_skipped: dict[str, str] = field(default_factory=dict)

    @property
    def label(self) -> str:
        return f"{self.name} ({self.child})" if self.child and self.child != self.name else self.name

    def ns(self, unit: str) -> Whole:
        """Stamps in nanoseconds, (n,), if they are in a unit of time; LogError if 64 bits do not hold them."""
        per = 10**9 // PER_S[unit]
        if max(map(abs, map(int, (self.whole.min(initial=0), self.whole.max(initial=0))))) > (2**63 - 1) // per - 1:
            raise LogError(f"{self.label} has times of more than 292 years; wanted: --time-unit, or seconds")
        return self.whole * per + self.nano * per // 10**9

    def elapsed_s(self, unit: str) -> Array:
        """Times since the least stamp, (n,), s, if stamps are in a unit of time."""
        since = (self.whole - self.whole.min(initial=LAST)).view(np.uint64)  # differences of 64 bits wrap around
        return (since + self.nano / 1e9) / PER_S[unit]

    def skip(self, reasons: npt.NDArray[Any], noun: str, numbers: Sequence[int], uncounted: str = "") -> None:
        """Leave out the rows with a reason, (n,), '' for none, and count them by it, except for one reason."""
        # noun, numbers: what a row is called in the source, such as "line", and its number there, (n,)
        for k in np.flatnonzero((reasons != "") & (reasons != uncounted)).tolist():
            self.skipped[reasons[k]] += 1
            self.first_skipped.setdefault(reasons[k], f"{noun} {numbers[k]}")
        good = reasons == ""
        self.whole, self.nano, self.places = self.whole[good], self.nano[good], self.places[good]


@dataclass(eq=False)
class Log:
    """The content of a log's files."""

    streams: list[Stream] = field(default_factory=list)  # that may describe bodies
    # Unused columns, topics and files with the reasons, as printed.
    ignored: list[str] = field(default_factory=list)
    # Files in folders that are not logs, with the reasons; part of `ignored`.
    unusable: list[str] = field(default_factory=list)

    def add(self, other: Log) -> None:
        self.streams += other.streams
        self.ignored += other.ignored


def segments(name: str) -> list[str]:
    """The parts of a path: a topic, a frame, or the name of a column."""
    return [segment for segment in re.split(r"[/.\s:|]+", name) if segment]


def is_elsewhere(name: str, bodies: Collection[str]) -> bool:
    """Whether a name, apart from names of bodies, denotes something else than a position, such as a goal."""
    words = (
        word for segment in segments(name) if segment not in bodies for word in re.split(r"[^A-Za-z]+", segment.lower())
    )
    return not ELSEWHERE.isdisjoint(words)


def body_of(name: str, bodies: Collection[str], *, is_file: bool = False) -> str:
    """The one body that a name names, or ''."""
    # It is a part of the path: `/tb3_0/odom`, `tb3_0_pose`. The stem of a file may contain it between other words:
    # `run2_tb3_0-odom`. Capitals count only if two bodies differ by them.
    if (robot := name.removesuffix(OF_BODY)) in bodies:
        return robot
    parts = {part for segment in segments(name) for part in (segment, AFTER.sub("", segment))}
    named = {body for body in bodies if body in parts}
    if not named:
        low = {part.lower() for part in parts}
        named = {body for body in bodies if body.lower() in low}
    if not named and is_file:
        named = {body for body in bodies if re.search(rf"(?<![A-Za-z0-9]){re.escape(body)}(?![A-Za-z0-9])", name)}
        named -= {body for body in named for other in named if body != other and body in other}
    return named.pop() if len(named) == 1 else ""


def renamed(names: Iterable[str], rename: Mapping[str, str]) -> str:
    """The body that `--rename` assigns to the first of some names, or ''; outer slashes are ignored."""
    known = {key.strip("/"): body for key, body in rename.items()}
    return next((known[name.strip("/")] for name in names if name.strip("/") in known), "")
