"""What the columns of a table mean: time, body, frame, and the places of one or more bodies."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

from airground_drake.base.errors import LogError
from airground_drake.logs.names import is_elsewhere, segments
from airground_drake.logs.stream import PER_M, PER_S

WORDS = {
    "meter": "m", "meters": "m", "metre": "m", "metres": "m", "millimeter": "mm", "millimeters": "mm",
    "millimetre": "mm", "millimetres": "mm", "centimeter": "cm", "centimeters": "cm", "centimetre": "cm",
    "centimetres": "cm", "sec": "s", "secs": "s", "second": "s", "seconds": "s", "msec": "ms", "milliseconds": "ms",
    "usec": "us", "microseconds": "us", "nsec": "ns", "nanosec": "ns", "nanoseconds": "ns",
}  # fmt: skip
"""Other words for units."""
BODIES = (
    "body", "robot", "robot_name", "robot_id", "name", "agent", "agent_id", "vehicle", "model", "model_name", "object",
    "entity", "id", "label", "child_frame_id", "namespace", "who",
)  # fmt: skip
"""Names of a column that says whose row it is."""
FRAMES = ("frame", "frame_id", "reference_frame")
STAMPS = (
    "t", "time", "stamp", "timestamp", "timestamps", "times", "sim_time", "simtime", "elapsed", "clock", "seconds",
    "secs", "sec", "date", "datetime", "__time",
)  # fmt: skip
RECEIPT = ("%time", "receive_time", "received", "recv_time", "log_time", "receipt", "rosbagtimestamp")
"""Names of a column with the times at which messages were received."""
TARGETS = ("t", "body", "frame", "x", "y", "z")
"""What `--map-columns` can give a name to."""
_BRACKETS = re.compile(r"(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]")
_SUFFIX = re.compile(r"(.+)[_/](mm|cm|m|s|ms|us|ns)", re.IGNORECASE)
_AXIS = re.compile(r"(?:(.*?)[/._\s:|-])?(?:(?:t|p|pos|position|pose|translation)_?)?([xyz])", re.IGNORECASE)
_AXIS_FIRST = re.compile(r"(?:pos_?)?([xyz])[/._\s-](.+)", re.IGNORECASE)
_WHOLE = re.compile(r"(.*?)[/._]?(?:secs?|seconds)", re.IGNORECASE)
_REST = ["nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds"]


class Time(NamedTuple):
    """A column of stamps; `rest` is that of nanoseconds, if `whole` has seconds. `owner` begins what it belongs to."""

    whole: int
    rest: int | None
    unit: str
    rank: int
    owner: str


class Place(NamedTuple):
    """The columns of a body's coordinates, and their units; z is None without such a column."""

    name: str
    x: int
    y: int
    z: int | None
    units: Sequence[str]


class Columns(NamedTuple):
    """Columns by number: stamps in the order of preference, the body of a row, frames, and places."""

    times: list[Time]
    body: int | None
    frame: int | None
    places: list[Place]


def columns(labels: Sequence[str], chosen: Mapping[str, str], bodies: Collection[str]) -> Columns:
    """The meaning of each column.

    Args:
        labels: of the columns.
        chosen: names of columns by what they are, see `TARGETS`, with `{body}` for the name of a body; a unit may
            follow what they are: `x_mm`.
        bodies: of the scenario.

    Raises:
        LogError: if a chosen column is missing, or two columns have one meaning.
    """
    labels = _mapped(labels, chosen)
    axes: dict[str, dict[str, tuple[int, str]]] = {}
    for k, label in enumerate(labels):
        base, unit = split_unit(label)
        name, axis = _axis(base, bodies)
        if not axis or (unit and unit not in PER_M) or is_elsewhere(name, bodies):
            continue
        if axis in axes.setdefault(name, {}):
            raise LogError(f"two columns are called {label!r}; wanted: one, or --map-columns {axis}=NAME")
        axes[name][axis] = k, unit
    places = [
        Place(
            name,
            each["x"][0],
            each["y"][0],
            each["z"][0] if "z" in each else None,
            [each[axis][1] for axis in "xyz" if axis in each],
        )
        for name, each in axes.items()
        if {"x", "y"} <= each.keys()
    ]
    return Columns(_times(labels), _named(labels, BODIES), _named(labels, FRAMES), places)


def _axis(base: str, bodies: Collection[str]) -> tuple[str, str]:
    """Name and axis of a column without its unit: `tb1.x`, `tb1_pos_x`, also `x_tb1` of a body; else ''."""
    if (found := _AXIS_FIRST.fullmatch(base)) and found[2] in bodies:
        return found[2], found[1].lower()
    found = _AXIS.fullmatch(base)
    return ((found[1] or "").strip(), found[2].lower()) if found else ("", "")


def split_unit(label: str) -> tuple[str, str]:
    """A label without its unit, and the unit: `x_mm`, `x [mm]`, `Time (Seconds)`; '' if it names none."""
    if found := _BRACKETS.fullmatch(label):
        return found[1].rstrip("/"), WORDS.get(found[2].lower(), found[2].lower()) or "none"
    if (found := _SUFFIX.fullmatch(label)) and not _AXIS.fullmatch(label):
        return found[1], found[2].lower()
    return label, ""


def _mapped(labels: Sequence[str], chosen: Mapping[str, str]) -> list[str]:
    """The labels, with those that `--map-columns` names replaced by the usual ones."""
    found = list(labels)
    for target, pattern in chosen.items():
        names = [re.escape(each) for each in pattern.split("{body}")]
        matching = re.compile(r"(?P<body>.+)".join(names[:2]) if len(names) > 1 else names[0])
        hits = [(k, hit) for k, label in enumerate(labels) if (hit := matching.fullmatch(label))]
        if not hits:
            raise LogError(f"--map-columns {target}={pattern}: there is no such column; there are {listed(labels)}")
        for k, hit in hits:
            found[k] = f"{hit['body']}.{target}" if len(names) > 1 else target
    return found


def listed(names: Sequence[str], most: int = 12) -> str:
    """Some names in a line."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def _last(label: str) -> str:
    return (segments(split_unit(label)[0]) or [""])[-1].lower()


def _named(labels: Sequence[str], names: Sequence[str]) -> int | None:
    """The first column with the first of some names."""
    last = [_last(label) for label in labels]
    return next((last.index(name) for name in names if name in last), None)


def _times(labels: Sequence[str]) -> list[Time]:
    """Stamps of headers, then others, then times of receipt."""
    found = []
    low = [label.lower() for label in labels]
    for k, label in enumerate(low):
        base, unit = split_unit(label)
        whole = _WHOLE.fullmatch(label)
        if whole and (rest := [low.index(f"{whole[1]}{mark}{each}") for each in _REST for mark in ("", ".", "/", "_")
                               if f"{whole[1]}{mark}{each}" in low]):  # fmt: skip
            of_header = "header" in segments(whole[1]) or whole[1].endswith("stamp")
            found.append(Time(k, rest[0], "s", 0 if of_header else 1, _owner(labels[k])))
        elif _last(label) in STAMPS and (not unit or unit in PER_S):
            parts = segments(base)
            rank = 0 if parts[-2:] == ["header", "stamp"] else 2 if base == "__time" else 1
            found.append(Time(k, None, unit, rank, _owner(labels[k])))
        elif base in RECEIPT or _last(label) in RECEIPT:
            found.append(Time(k, None, unit, 3, ""))
    return sorted(found, key=lambda each: (each.rank, -len(each.owner)))


def _owner(label: str) -> str:
    """The beginning of the columns that a column of stamps belongs to: what stands before `header`, or all."""
    return re.split(r"[/._]?header[/._]", label, maxsplit=1)[0] if re.search(r"header[/._]", label) else ""
