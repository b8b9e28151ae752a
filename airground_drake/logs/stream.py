"""A stream: positions that one source has of one body, as they are written there."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from airground_drake.base.arrays import Array

Whole = npt.NDArray[np.int64]

PER_S = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}
"""Units of time, and how many of each are a second."""
SINCE_1970 = (("ns", 1e17), ("us", 1e14), ("ms", 1e11), ("s", 1e8))
"""Units of stamps since 1970, and the least such stamp that is taken as one."""
PER_M = {"m": 1.0, "cm": 100.0, "mm": 1000.0}
"""Units of length, and how many of each are a metre."""
OF_MESSAGES = HEADERS, RECEIPT = "header stamps", "times of receipt"
"""Clocks of messages."""


@dataclass(eq=False)
class Stream:
    """Positions of one body; n rows, in the order of the source.

    A stamp is `whole` + `nano` / 1e9 units of time: nanoseconds since 1970 are no floating-point numbers.

    Attributes:
        source: path of the file or folder.
        name: what the source calls it: a topic, the beginning of columns' names, a value in a column, a file's stem.
        whole: whole units of time, (n,).
        nano: the rest, in billionths of the unit, (n,).
        places: x, y, z, (n, 3); z is nan where the source lacks it.
        time_unit: key of `PER_S`; '' if the source does not say.
        length_unit: key of `PER_M`; '' if the source does not say.
        frame: coordinate frame, without slashes at the ends; '' if the source does not say.
        child: frame that the body carries; '' if the source does not say.
        clock: what the stamps are: "header stamps", "times of receipt", or the name of a column.
        is_file: whether `name` is the stem of a file.
        skipped: rows without a position or a stamp, by the reason.
        first_skipped: where the first of them is, by the reason: "line 12"; '' if the source has no lines.
    """

    source: str
    name: str
    whole: Whole
    nano: Whole
    places: Array
    time_unit: str = ""
    length_unit: str = ""
    frame: str = ""
    child: str = ""
    clock: str = ""
    is_file: bool = False
    skipped: Counter[str] = field(default_factory=Counter)
    first_skipped: dict[str, str] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """How messages name it."""
        return f"{self.name} ({self.child})" if self.child and self.child != self.name else self.name

    def ns(self, unit: str) -> Whole:
        """Stamps in nanoseconds, (n,), if they are in a unit of time."""
        per = 10**9 // PER_S[unit]
        return self.whole * per + self.nano * per // 10**9


@dataclass(eq=False)
class Log:
    """What the files of a log have.

    Attributes:
        streams: that may be about bodies.
        ignored: what was not used, and why: columns, topics, files; each as it is said.
        unusable: files of folders that are no logs, and why; they are among those ignored.
    """

    streams: list[Stream] = field(default_factory=list)
    ignored: list[str] = field(default_factory=list)
    unusable: list[str] = field(default_factory=list)

    def add(self, other: Log) -> None:
        """Take over what another log has."""
        self.streams += other.streams
        self.ignored += other.ignored
