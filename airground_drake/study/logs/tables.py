"""Tables as streams: long ones with a column that names the body, wide ones, one file per robot, TUM, Parquet."""

import re
from collections.abc import Collection, Iterator, Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt
import pandas as pd

from airground_drake.base import files
from airground_drake.base.arrays import Array, Flags
from airground_drake.base.errors import LogError
from airground_drake.study.logs import text
from airground_drake.study.logs.columns import WORDS, Columns, Place, Time, clock_of, columns, counts_frames, listed
from airground_drake.study.logs.stream import PER_M, Log, Stream, Whole, body_of, renamed

TUM = ["timestamp", "tx", "ty", "tz", "qx", "qy", "qz", "qw"]  # columns of a file in TUM's format, which has no header
# First columns that `ros2 topic echo --csv` prints for a pose; for odometry, the other frame precedes x.
ECHO = ["header.stamp.sec", "header.stamp.nanosec", "header.frame_id", "x", "y", "z"]
UNIT_LENGTH = 0.05  # the length of a quaternion differs from 1 by less
MOST_BODIES = 2_000  # different values in a column that names bodies
_UNITS = re.compile(r"length\W*units?\W+(\w+)", re.IGNORECASE)
_ISO = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d.*")  # date and time of day
_ELAPSED = re.compile(r"-?\d+ days [+-]?\d\d:\d\d:\d\d(\.\d+)?")
_NOTHING = ("nan", "null", "none", "na", "n/a")
_DECIMAL = re.compile(r"([+-]?)(\d{1,19})(?:\.(\d*))?")


class Wanted(NamedTuple):
    """Names given by the scenario and the command line."""

    bodies: Collection[str]  # names of the scenario
    rename: Mapping[str, str]  # bodies by names in the log
    columns: Mapping[str, str]  # names of columns by their content

    def body(self, name: str, *, is_file: bool = False) -> str:
        """The body that a name in the log stands for, or ''."""
        return renamed([name], self.rename) or body_of(name, self.bodies, is_file=is_file)


def read(path: Path, content: bytes, wanted: Wanted) -> Log:
    table = _parquet(content) if content[:4] == b"PAR1" else text.read(content)
    labels = table.labels
    no_words = all(not line.strip() or line.lstrip().startswith("#") for line in table.above)
    if not table.has_header and len(labels) == len(TUM) and no_words and not wanted.columns and _has_turns(table):
        table = table._replace(labels=(labels := TUM))
    if not table.has_header and not wanted.columns and _is_echo(table):
        child = [] if text.is_number(table.cells[3][0]) else ["child_frame"]
        named = [*ECHO[:3], *child, *ECHO[3:]]
        table = table._replace(labels=(labels := [*named, *labels[len(named) :]]))
    has = columns(labels, wanted.columns, wanted.bodies)
    for k in (k for k, label in enumerate(labels) if not has.times and counts_frames(label)):
        if all(map(text.is_number, table.cells[k].unique()[:100])):
            has = has._replace(times=[Time(k, None, "", 1, "")])
            break
    if not has.times or not has.places:
        wants = {"a column of times": has.times, "columns x and y": has.places}
        lacks = " and ".join(name for name, there in wants.items() if not there)
        raise LogError(
            f"it lacks {lacks}: its columns are {listed(labels)}; wanted: such as t_s, body, x_m, y_m, z_m, or "
            "--map-columns t=NAME,body=NAME,x=NAME,y=NAME,z=NAME"
        )
    has = _of_bodies(has, table, wanted, path)
    clocks = [clock_of(place, has.times, labels) for place in has.places]
    used = {k for place in has.places for k in (place.x, place.y, place.z)} | {has.body}
    used |= {k for time in clocks for k in (time.whole, time.rest)}
    used |= {has.frame} if _frames(table, has) is not None else set()
    has.refuse_unused(used)
    for label in (label for k, label in enumerate(labels) if k in used and label in table.unread):
        kind = table.unread[label]
        raise LogError(f"column {label!r} is needed, and of type {kind}; wanted: numbers, texts, times or durations")
    log = Log(list(_streams(path, table, has, wanted)))
    if others := [label or f"column {k + 1}" for k, label in enumerate(labels) if k not in used]:
        log.ignored.append(f"{path.name}: columns {listed(others)}")
    if table.odd:
        where = f"first line {table.odd[0]}"
        log.ignored.append(f"{path.name}: lines with another number of fields, or cut off: {len(table.odd)}, {where}")
    return log


def _is_echo(table: text.Table) -> bool:
    """Whether a table without a header begins with seconds since 1970, nanoseconds and the name of a frame."""
    if len(table.labels) < len(ECHO) + 4:
        return False
    sec, nanosec, frame = (table.cells[k].iloc[0] for k in range(3))
    return sec.isdigit() and len(sec) == 10 and nanosec.isdigit() and not text.is_number(frame)


def _has_turns(table: text.Table) -> bool:
    """Whether the last four columns of most rows are a unit quaternion, as in TUM files."""
    numbers = table.cells.iloc[:, -4:].apply(pd.to_numeric, errors="coerce").to_numpy(dtype=np.float64)
    return bool((np.abs(np.linalg.norm(numbers, axis=1) - 1.0) <= UNIT_LENGTH).mean() > 0.5)


def _frames(table: text.Table, has: Columns) -> pd.Series | None:
    """The coordinate frames of the rows; None without such a column, or if it has frame numbers."""
    cells = table.cells[has.frame] if has.frame is not None else None
    return None if cells is None or all(text.is_number(cell) for cell in cells.unique()[:100]) else cells


def _parquet(content: bytes) -> text.Table:
    """A table of numbers, times and texts; columns of other types are empty."""
    others = dict[str, str]()
    try:
        table = files.read_table(content, others)
        texts = {k: [*map(_written, table.iloc[:, k].tolist())] for k in range(table.shape[1])}
    except (ValueError, OverflowError) as error:
        raise LogError(str(error)) from None
    cells = pd.DataFrame(texts | {table.shape[1] + k: "" for k in range(len(others))}, dtype=str, index=table.index)
    labels = [*map(str, table.columns), *others]
    if (index := "__index_level_0__") in table and table[index].dtype.kind in "mM":  # one without a name, with times
        labels[labels.index(index)] = "__time"
    return text.Table(labels, cells, range(1, len(table) + 1), [], True, [], others)


def _written(value: Any) -> str:
    if value is None or value is pd.NaT:
        return ""
    return repr(value) if isinstance(value, float) else str(value)


def _file_of(path: Path, wanted: Wanted) -> str:
    """The name of a single-body file: its stem, or its folder's name if only that names a body."""
    by_folder = wanted.body(path.parent.name) and not wanted.body(path.stem, is_file=True)
    return path.parent.name if by_folder else path.stem


def _of_bodies(has: Columns, table: text.Table, wanted: Wanted, path: Path) -> Columns:
    """Choose between a long table, with a column of bodies and one place, and a wide one."""
    wide = [place for place in has.places if place.name and wanted.body(place.name)]
    if wide:
        return has._replace(body=None, places=wide)
    text_columns: list[int] = [has.body] if has.body is not None else []
    numbers = {k for place in has.places for k in (place.x, place.y, place.z)} | {has.frame}
    numbers |= {k for time in has.times for k in (time.whole, time.rest)}
    text_columns += [k for k in range(len(table.labels)) if k not in text_columns and k not in numbers]
    for k in text_columns:
        values = table.cells[k].unique()
        if len(values) <= MOST_BODIES and any(wanted.body(value) for value in values):
            return has._replace(body=k, places=_one_place(has.places))
    if has.body is not None and has.body not in has.chosen:
        several, of_file = table.cells[has.body].nunique(), wanted.body(_file_of(path, wanted), is_file=True)
        if several > max(1, len(table.cells) // 4) or (several == 1 and of_file):
            has = has._replace(body=None)  # it counts rows, or names a frame or a kind of robot
    if has.body is not None:
        return has._replace(places=_one_place(has.places))
    return has


def _one_place(places: list[Place]) -> list[Place]:
    """The only place, or the only one whose name says that it is a position."""
    named = [place for place in places if place.is_position] if len(places) > 1 else places
    if len(named) != 1:
        several = listed([place.name or "x, y" for place in places])
        raise LogError(f"it has several places in a row: {several}; wanted: --map-columns x=NAME,y=NAME,z=NAME")
    return named


def _streams(path: Path, table: text.Table, has: Columns, wanted: Wanted) -> Iterator[Stream]:
    """The streams of a table; of a long one, those of each body and frame."""
    stated = next((match[1].lower() for line in table.above if (match := _UNITS.search(line))), "")
    length = WORDS.get(stated, stated) if WORDS.get(stated, stated) in PER_M else ""
    has = has._replace(times=[_dated(table, time) for time in has.times])
    whole = {time: _stamps(table, time) for time in has.times}
    frames = _frames(table, has)
    for place in has.places:
        time = clock_of(place, has.times, table.labels)
        numbers, why = _places(table, place)
        stamps, nano, stamped = whole[time]
        why[~stamped & (why == "")] = "no time"
        if len(has.places) > 1 and not np.isfinite(numbers[:, :2]).any():
            continue
        alone = len(has.places) == 1
        keys = pd.DataFrame({
            "body": table.cells[has.body] if has.body is not None else place.name or path.stem,
            "frame": frames if frames is not None else "",
        }, index=table.cells.index)  # fmt: skip
        for key, rows in keys.groupby(["body", "frame"], sort=False).groups.items():
            name, frame = cast("tuple[str, str]", key)
            at = np.asarray(rows)
            is_file = has.body is None and alone and not wanted.body(place.name)
            stream = Stream(
                source=str(path),
                name=_file_of(path, wanted) if is_file else str(name),
                whole=stamps[at],
                nano=nano[at],
                places=numbers[at],
                time_unit=time.unit,
                length_unit=place.units[0] or length,
                frame=str(frame).strip("/"),
                clock=" and ".join(table.labels[k] for k in (time.whole, time.rest) if k is not None),
                is_file=is_file,
                counts_frames=counts_frames(table.labels[time.whole]),
            )
            # empty rows between those of other bodies do not count
            is_sparse = has.body is None and len(has.places) > 1 and bool((why == "empty").mean() > 0.5)
            stream.skip(why[at], "line", [table.lines[k] for k in at], "empty" if is_sparse else "")
            yield stream


def _places(table: text.Table, place: Place) -> tuple[Array, npt.NDArray[np.object_]]:
    """Coordinates (n, 3), in the unit of x, and the reason for each row without them, else ''."""
    if not all(place.units) and any(place.units):
        named = listed([table.labels[k] for k in (place.x, place.y, place.z) if k is not None])
        raise LogError(f"some of the columns {named} have a unit, others not; wanted: one for each, or none")
    taken = [place.x, place.y, *([] if place.z is None else [place.z])]
    texts = [table.cells[k] for k in taken]
    numbers = np.full((len(table.cells), 3), np.nan)
    why = np.full(len(table.cells), "", dtype=object)
    for axis, cells in enumerate(texts):
        numbers[:, axis] = pd.to_numeric(cells, errors="coerce").to_numpy(dtype=np.float64)
        if place.units[axis] != place.units[0]:
            numbers[:, axis] *= PER_M[place.units[0]] / PER_M[place.units[axis]]
        low = cells.str.lower().to_numpy()
        reasons = np.select([np.isin(low, ["", "-"]), np.isin(low, [*_NOTHING, "inf", "-inf"])],
                            ["empty", "not finite"], "no number")  # fmt: skip
        bad = ~np.isfinite(numbers[:, axis]) & (why == "")
        if axis == 2:
            bad &= ~np.isin(low, ["", "-", *_NOTHING])  # UGVs need no height
        why[bad] = reasons[bad]
    return numbers, why


def _dated(table: text.Table, time: Time) -> Time:
    """The time; dates become seconds since 1970, and durations as pandas writes them become seconds."""
    cells = table.cells[time.whole]
    first = next(filter(None, cells), "")
    moments: Any
    if _ISO.fullmatch(first):
        moments = pd.to_datetime(cells.str.replace(",", "."), utc=True, errors="coerce", format="ISO8601")
        moments = moments.where(moments.dt.year.between(1678, 2261))  # 64 bits hold no others in nanoseconds
    elif _ELAPSED.fullmatch(first):
        moments = pd.to_timedelta(cells, errors="coerce")
    else:
        return time
    stamps = moments.dt.as_unit("ns").astype("int64").map(lambda ns: str(Decimal(ns).scaleb(-9)))
    table.cells[time.whole] = stamps.where(moments.notna(), "")
    return time._replace(unit="s")


def _stamps(table: text.Table, time: Time) -> tuple[Whole, Whole, Flags]:
    """Whole units, billionths, and whether a row has a stamp."""
    whole, nano, good = _exactly(table.cells[time.whole].tolist())
    if time.rest is not None:
        rest, _, has_rest = _exactly(table.cells[time.rest].tolist())
        nano, good = rest, good & has_rest
    return whole, nano, good


def _exactly(cells: list[str]) -> tuple[Whole, Whole, Flags]:
    """Numbers as whole parts and billionths: exact for decimal text, rounded for floats."""
    whole, nano = np.zeros(len(cells), dtype=np.int64), np.zeros(len(cells), dtype=np.int64)
    good = np.zeros(len(cells), dtype=bool)
    for k, cell in enumerate(cells):
        if (match := _DECIMAL.fullmatch(cell)) and int(match[2]) < 2**63:
            sign = -1 if match[1] == "-" else 1
            whole[k], nano[k], good[k] = sign * int(match[2]), sign * int(f"{match[3] or ''}000000000"[:9]), True
            continue
        try:
            value = float(cell)
        except ValueError:
            continue
        if abs(value) < 2**62:
            whole[k] = np.floor(value)
            nano[k], good[k] = round((value - np.floor(value)) * 1e9), True
    return whole, nano, good
