"""A stream: positions that one source has of one body, as they are written there."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array
from airground_drake.base.errors import LogError, one_line

Whole = npt.NDArray[np.int64]

PER_S = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}  # units of time, and how many of each are a second
YEAR_2000_S, YEAR_2100_S = 946_684_800, 4_102_444_800  # stamps since 1970 that are between these are taken as such
PER_M = {"m": 1.0, "cm": 100.0, "mm": 1000.0}  # units of length, and how many of each are a metre
OF_MESSAGES = HEADERS, RECEIPT = "header stamps", "times of receipt"  # clocks of messages
LAST = np.iinfo(np.int64).max


def unit_since_1970(least: float, largest: float) -> str:
    """The unit in which numbers, as times since 1970, are in the years 2000 to 2100; '' if no unit fits."""
    return next((unit for unit, per in PER_S.items() if YEAR_2000_S <= least / per <= largest / per <= YEAR_2100_S), "")


@dataclass(eq=False)
class Stream:
    """Positions of one body; n rows, in the order of the source."""

    # A stamp is `whole` + `nano` / 1e9 units of time: nanoseconds since 1970 are no floating-point numbers.

    source: str  # path of the file or folder
    name: str  # what the source calls it: a topic, the beginning of columns' names, a value in a column, a file's stem
    whole: Whole  # whole units of time, (n,)
    nano: Whole  # the rest, in billionths of the unit, (n,)
    places: Array  # x, y, z, (n, 3); z is nan where the source lacks it
    time_unit: str = ""  # key of `PER_S`; '' if the source does not say
    length_unit: str = ""  # key of `PER_M`; '' if the source does not say
    frame: str = ""  # coordinate frame, without slashes at the ends; '' if the source does not say
    child: str = ""  # frame that the body carries; '' if the source does not say
    clock: str = ""  # what the stamps are: "header stamps", "times of receipt", or the name of a column
    is_file: bool = False  # whether `name` is the stem of a file
    counts_frames: bool = False  # whether stamps are numbers of frames, by the name of their column
    skipped: Counter[str] = field(default_factory=Counter)  # rows without a position or a stamp, by the reason
    # Where the first of them is, by the reason: "line 12"; '' if the source has no lines.
    first_skipped: dict[str, str] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """How messages name it."""
        return f"{self.name} ({self.child})" if self.child and self.child != self.name else self.name

    def ns(self, unit: str) -> Whole:
        """Stamps in nanoseconds, (n,), if they are in a unit of time; LogError if 64 bits do not hold them."""
        per = 10**9 // PER_S[unit]
        if max(map(abs, map(int, (self.whole.min(initial=0), self.whole.max(initial=0))))) > (2**63 - 1) // per - 1:
            raise LogError(one_line(f"{self.label} has times of more than 292 years; wanted: --time-unit, or seconds"))
        return self.whole * per + self.nano * per // 10**9

    def elapsed_s(self, unit: str) -> Array:
        """Times since the least stamp, (n,), s, if stamps are in a unit of time."""
        since = (self.whole - self.whole.min(initial=LAST)).view(np.uint64)  # differences of 64 bits wrap around
        return (since + self.nano / 1e9) / PER_S[unit]


@dataclass(eq=False)
class Log:
    """What the files of a log have."""

    streams: list[Stream] = field(default_factory=list)  # that may be about bodies
    # What was not used, and why: columns, topics, files; each as it is said.
    ignored: list[str] = field(default_factory=list)
    # Files of folders that are no logs, and why; they are among those ignored.
    unusable: list[str] = field(default_factory=list)

    def add(self, other: Log) -> None:
        self.streams += other.streams
        self.ignored += other.ignored
