"""The meaning of a table's columns: time, body, frame, and positions of one or more bodies."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from airground_drake.base.errors import LogError
from airground_drake.report.sentences import some
from airground_drake.study.logs.stream import PER_M, PER_S, is_elsewhere, segments

# Other words for units.
WORDS = {
    "meter": "m", "meters": "m", "metre": "m", "metres": "m", "millimeter": "mm", "millimeters": "mm",
    "millimetre": "mm", "millimetres": "mm", "centimeter": "cm", "centimeters": "cm", "centimetre": "cm",
    "centimetres": "cm", "sec": "s", "secs": "s", "second": "s", "seconds": "s", "msec": "ms", "milliseconds": "ms",
    "usec": "us", "microseconds": "us", "\u00b5s": "us", "\u03bcs": "us", "nsec": "ns", "nanosec": "ns",
    "nanoseconds": "ns",
}  # fmt: skip
# Units that are not read.
OTHER_UNITS = (
    "ft", "foot", "feet", "in", "inch", "inches", "yd", "yard", "yards", "km", "dm", "um", "\u00b5m", "\u03bcm", "nm",
    "deg", "degrees", "rad", "px", "pixel", "pixels", "min", "mins", "minutes", "h", "hr", "hrs", "hours", "days",
)  # fmt: skip
# Names of a column with the name of each row's body.
BODIES = (
    "body", "robot", "robot_name", "robot_id", "name", "agent", "agent_id", "vehicle", "model", "model_name", "object",
    "entity", "id", "label", "child_frame_id", "namespace", "who",
)  # fmt: skip
FRAMES = ("frame", "frame_id", "reference_frame")
STAMPS = (
    "t", "time", "stamp", "timestamp", "timestamps", "times", "sim_time", "simtime", "elapsed", "elapsed_time", "clock",
    "ros_time", "unix_time", "epoch_time", "epoch", "header_stamp", "seconds", "secs", "sec", "date", "datetime",
    "__time",
)  # fmt: skip
# Names of a column with the times at which messages were received.
RECEIPT = ("%time", "receive_time", "received", "recv_time", "log_time", "receipt", "rosbagtimestamp")
# Names of a column with frame numbers, which are not times.
COUNTERS = (
    "frame", "frames", "frame_id", "frameid", "frame_number", "framenumber", "frame_no", "frame_nr", "frame_num",
    "frame_index", "frame_idx", "step", "tick", "sample",
)  # fmt: skip
TARGETS = ("t", "body", "frame", "x", "y", "z")  # targets of `--map-columns`
listed = partial(some, most=12)  # columns in a message
_WORDS = re.compile(r"[A-Z]?[^\W_A-Z]+|[A-Z]+(?![a-z])")  # in a name: east_mm, eastMm, EAST [mm]
_BRACKETS = re.compile(r"(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]")
_SUFFIX = re.compile(r"(.+?)\s*[_/]\s*(mm|cm|m|s|ms|us|ns|secs?|seconds|msec|usec|nsec)", re.IGNORECASE)
_AXIS = re.compile(r"(?:(.*?)[/._\s:|-])?(?:(?:t|p|pos|position|pose|translation)_?)?([xyz])", re.IGNORECASE)
_AXIS_FIRST = re.compile(r"(?:pos_?)?([xyz])[/._\s-](.+)", re.IGNORECASE)
# Last words of the names of position columns, without names of bodies; '' is for plain x and y.
_POSITIONS = ("", "p", "pos", "position", "pose", "place", "point", "location", "translation", "xyz")
_WHOLE = re.compile(r"(.*?)[/._]?(?:secs?|seconds)", re.IGNORECASE)
_REST = ["nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds"]


class Time(NamedTuple):
    """A column of stamps; `rest` is the column of nanoseconds if `whole` has seconds."""

    whole: int
    rest: int | None
    unit: str
    rank: int
    owner: str

    def is_of(self, place: Place) -> bool:
        after = place.name[len(self.owner) :]
        return not self.owner or (place.name.startswith(self.owner) and not after[:1].isalnum())


class Place(NamedTuple):
    """The columns of a body's coordinates, and their units; z is None without such a column."""

    name: str
    x: int
    y: int
    z: int | None
    units: Sequence[str]

    @property
    def is_position(self) -> bool:
        """Whether its name says that it is a position, or says nothing."""
        return re.split(r"[^a-z]+", self.name.lower())[-1] in _POSITIONS


class Columns(NamedTuple):
    """Columns by number: stamps in the order of preference, the body of a row, frames, and places."""

    times: list[Time]
    body: int | None
    frame: int | None
    places: list[Place]
    chosen: dict[int, str]

    def refuse_unused(self, used: Collection[int | None]) -> None:
        """Raise LogError for a column named by `--map-columns` that is not among the `used` ones."""
        effective = {option for k, option in self.chosen.items() if k in used}
        for option in self.chosen.values():
            if option not in effective:
                wanted = "wanted: only columns that are needed"
                raise LogError(f"--map-columns {option} has no effect on this table; {wanted}")


def columns(labels: Sequence[str], chosen: Mapping[str, str], bodies: Collection[str]) -> Columns:
    # chosen: names of columns by their content, see `TARGETS`, with `{body}` for the name of a body; a unit may follow
    # the content: `x_mm`.
    labels, mapped = _mapped(labels, chosen)
    given = {split_unit(target)[0] for target, name in chosen.items() if "{body}" not in name}
    axes: dict[str, dict[str, tuple[int, str]]] = {}
    for k, label in enumerate(labels):
        base, unit = split_unit(label)
        name, axis = _axis(base, bodies)
        if not axis or (unit and unit not in PER_M) or is_elsewhere(name, bodies):
            continue
        if axis in given and not name and k not in mapped:
            continue
        if axis in axes.setdefault(name, {}):
            raise LogError(f"two columns are called {label!r}; wanted: one, or --map-columns {axis}=NAME")
        axes[name][axis] = k, unit
    places = [
        Place(name, of["x"][0], of["y"][0], of["z"][0] if "z" in of else None, [of[a][1] for a in "xyz" if a in of])
        for name, of in axes.items()
        if {"x", "y"} <= of.keys()
    ]
    times = [time for time in _times(labels, {*axes, *bodies}) if "t" not in given or time.whole in mapped]
    body, frame = (
        _named([label if target not in given or k in mapped else "" for k, label in enumerate(labels)], names)
        for target, names in (("body", BODIES), ("frame", FRAMES))
    )
    return Columns(times, body, frame, places, mapped)


def clock_of(place: Place, times: Sequence[Time], labels: Sequence[str]) -> Time:
    """The stamps of a position: its own, or of several columns with one name, the last before it."""
    own = next((time for time in times if time.is_of(place) or not place.name), None)
    if own is None:
        named = listed([labels[time.whole] for time in times])
        raise LogError(f"{place.name} has no times of its own: there are {named}; wanted: --map-columns t=NAME")
    alike = [time for time in times if labels[time.whole] == labels[own.whole] and time.whole < place.x]
    return max(alike, key=lambda time: time.whole, default=own)


def _axis(base: str, bodies: Collection[str]) -> tuple[str, str]:
    """Name and axis of a column without its unit: `tb1.x`, `tb1_pos_x`, also `x_tb1` of a body; else ''."""
    last, first = _AXIS.fullmatch(base), _AXIS_FIRST.fullmatch(base)
    if first and not (last and last[1] in bodies) and (first[2] in bodies or first[2].lower() in _POSITIONS):
        return first[2], first[1].lower()
    return ((last[1] or "").strip(), last[2].lower()) if last else ("", "")


def split_unit(label: str) -> tuple[str, str]:
    """A label without its unit, and the unit: `x_mm`, `x [mm]`, `Time (Seconds)`; '' if it names none."""
    if match := _BRACKETS.fullmatch(label):
        return match[1].rstrip("/"), WORDS.get(match[2].lower(), match[2].lower()) or "none"
    if (match := _SUFFIX.fullmatch(label)) and not _AXIS.fullmatch(label):
        return match[1], WORDS.get(match[2].lower(), match[2].lower())
    return label, ""


def counts_frames(label: str) -> bool:
    return re.sub(r"[\s_-]+", "_", label.split("/")[-1].strip().lower()) in COUNTERS


def _mapped(labels: Sequence[str], chosen: Mapping[str, str]) -> tuple[list[str], dict[int, str]]:
    """The labels, with standard ones for columns named by `--map-columns`, and these by number."""
    renamed, mapped = list(labels), dict[int, str]()
    for option, pattern in chosen.items():
        target = _with_unit(option, pattern)
        names = [re.escape(part) for part in pattern.split("{body}")]
        matching = re.compile(r"(?P<body>.+)".join(names[:2]) if len(names) > 1 else names[0])
        hits = [(k, hit) for k, label in enumerate(labels) if (hit := matching.fullmatch(label))]
        if not hits:
            raise LogError(f"--map-columns {option}={pattern}: there is no such column; there are {listed(labels)}")
        for k, hit in hits:
            renamed[k] = f"{hit['body']}.{target}" if len(names) > 1 else target
            mapped[k] = f"{option}={pattern}"
    return renamed, mapped


def _with_unit(target: str, pattern: str) -> str:
    """The target of a mapped column, with the unit that the column's name states; LogError for another unit there."""
    (content, chosen), words = split_unit(target), _WORDS.findall(pattern)
    unit = WORDS.get(words[-1].lower(), words[-1].lower()) if len(words) > 1 else ""
    if content in ("body", "frame") or unit not in (*PER_M, *PER_S, *OTHER_UNITS):
        return target
    units = PER_S if content == "t" else PER_M
    if unit not in units or chosen not in ("", unit):
        wanted = f"{content}_{unit}={pattern}" if unit in units else f"a column in {', '.join(units)}"
        says = f"the name of that column says {unit!r}; wanted: {wanted}; if its name is wrong, rename it"
        raise LogError(f"--map-columns {target}={pattern}: {says}")
    return f"{content}_{unit}"


def _last(label: str) -> str:
    return (segments(split_unit(label)[0]) or [""])[-1].lower()


def _named(labels: Sequence[str], names: Sequence[str]) -> int | None:
    last = [_last(label) for label in labels]
    return next((last.index(name) for name in names if name in last), None)


def _times(labels: Sequence[str], names: Collection[str]) -> list[Time]:
    """Time columns in order: header stamps, others, dates, times of receipt; `names` of positions and bodies."""
    times, rests = [], set[int]()
    low = [label.lower() for label in labels]
    for k, label in enumerate(low):
        base, unit = split_unit(label)
        owner, last = _owner(labels[k], names)
        whole = _WHOLE.fullmatch(label)
        rests_of = [f"{whole[1]}{mark}{rest}" for rest in _REST for mark in ("", ".", "/", "_")] if whole else []
        rest = next((low.index(name) for name in rests_of if name in low), None)
        if whole and rest is not None:
            of_header = "header" in segments(whole[1]) or whole[1].endswith("stamp")
            times.append(Time(k, rest, "s", 0 if of_header else 1, owner))
            rests.add(rest)
        elif last in STAMPS and (not unit or unit in PER_S):
            of_header = segments(base)[-2:] == ["header", "stamp"] or last in ("stamp", "header_stamp")
            rank = 0 if of_header else 2 if last in ("__time", "date") else 1
            times.append(Time(k, None, unit, rank, owner))
        elif base in RECEIPT or last in RECEIPT:
            times.append(Time(k, None, unit, 3, ""))
    used = (time for time in times if time.whole not in rests)
    return sorted(used, key=lambda time: (time.rank, -len(time.owner)))


def _owner(label: str, names: Collection[str]) -> tuple[str, str]:
    """The prefix of the columns that stamps belong to, '' for all, and their name in lower case."""
    # That is what stands before `header`, or before the last part if places or bodies have that name: `a.t`, `a_t`.
    base = split_unit(label)[0]
    if re.search(r"header[/._]", label):
        return re.split(r"[/._]?header[/._]", label, maxsplit=1)[0], _last(label)
    match = re.fullmatch(r"(.*)([/._\s:|-])(.*)", base)
    if match and match[3].lower() in STAMPS:
        before = match[1]
        if any(name == before or name.startswith(f"{before}{match[2]}") for name in names):
            return before, match[3].lower()
    return "", _last(label)
