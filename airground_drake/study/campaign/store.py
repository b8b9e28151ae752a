"""The folder of a campaign: finished draws survive a kill and count once.

    campaign.json     identifies the campaign; `--resume` needs the same
    parts/*.parquet   finished draws, written whole or not at all: a dataset for any reader of Parquet
    journal.jsonl     draws finished since the last part, a line of strict JSON each

A draw is finished when its line is in the journal. From time to time the journal becomes a part; if the command is
killed between the two, the same draws are in both, and the part counts. A torn last line is dropped. The rows of a draw
carry a digest of the campaign and of all rows of the draw: changed, repeated or removed rows are refused.
"""

import fcntl
import io
import json
import math
import os
from collections.abc import Sequence
from itertools import chain, groupby
from pathlib import Path
from typing import Any

import pandas as pd

from airground_drake.base import files
from airground_drake.base.errors import FolderError
from airground_drake.study.campaign.rows import COLUMNS, Row

SCHEMA = "airground_drake.campaign/3"
MANIFEST, JOURNAL, PARTS = "campaign.json", "journal.jsonl", "parts"
DRAWS_IN_A_PART = 500
_KINDS: dict[str, type] = {"int64": int, "float64": float, "str": str, "bool": bool}


class Store:
    """The open folder of a campaign. One command at a time can open it."""

    def __init__(self, folder: Path, manifest: dict[str, Any], *, resume: bool) -> None:
        # folder: new or empty; with `resume`, a folder of the same campaign.
        files.make_folder(folder, "the campaign")
        self.folder = folder
        self._manifest = manifest = {"schema": SCHEMA, **manifest}
        there = sorted(path.name for path in folder.iterdir() if not _is_nothing(path))
        if there and not resume:
            raise FolderError(f"{folder} holds {there[0]!r}; allowed: a new or empty folder, or --resume")
        if there:
            _be_the_same(folder, manifest)
        with files.wanted(folder / JOURNAL, "a regular file"):
            self._journal = files.open_regular(folder / JOURNAL, os.O_RDWR | os.O_CREAT | os.O_APPEND)
        try:
            fcntl.flock(self._journal, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if (folder / MANIFEST).exists():  # another command created it if the folder was empty a moment ago
                _be_the_same(folder, manifest)
        except (BlockingIOError, FolderError) as error:
            os.close(self._journal)
            if isinstance(error, FolderError):
                raise
            raise FolderError(f"{folder} is in use by another campaign command") from None
        files.sweep(folder)
        if not there:
            files.write_json(folder / MANIFEST, manifest)
        there_already = _read_parts(folder, manifest)
        self._in_parts = [there_already]
        self._lately, whole = _read_journal(folder / JOURNAL, manifest, set(there_already["index"]))
        os.ftruncate(self._journal, whole)
        self.finished = {*there_already["index"].tolist(), *self._lately}

    def add(self, rows: Sequence[Row]) -> None:
        """Store the rows of a draw, which is then finished."""
        (index,) = {row["index"] for row in rows}
        if index in self.finished:
            return
        sealed = _sealed(self._manifest, rows)
        left = (json.dumps(sealed, allow_nan=False) + "\n").encode()
        try:
            while left:  # a nearly full disk takes only a part of it, without an error
                left = left[os.write(self._journal, left) :]
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(self.folder / JOURNAL)) from None
        self._lately[index] = sealed
        self.finished.add(index)
        if len(self._lately) >= DRAWS_IN_A_PART:
            self.flush()

    def flush(self) -> None:
        """Turn the journal into a part."""
        if not self._lately:
            return
        part = table_of(list(chain.from_iterable(self._lately.values())))
        buffer = io.BytesIO()
        part.to_parquet(buffer, index=False)
        taken = [int(path.stem.removeprefix("part-")) for path in (self.folder / PARTS).glob("part-[0-9]*.parquet")]
        number = 1 + max(taken, default=-1)
        files.write_bytes(self.folder / PARTS / f"part-{number:06d}.parquet", buffer.getvalue())
        os.ftruncate(self._journal, 0)
        self._in_parts.append(part)
        self._lately = {}

    def table(self) -> pd.DataFrame:
        self._in_parts = [_together(self._in_parts, {})]  # a million draws fill gigabytes: none of them twice
        return _together(self._in_parts, self._lately)

    def close(self) -> None:
        """Turn the rest of the journal into a part, and release the folder."""
        try:
            self.flush()
        finally:
            os.close(self._journal)


def read(folder: Path) -> tuple[dict[str, Any], pd.DataFrame]:
    """The manifest of a campaign and all rows of its finished draws, also while it runs."""
    manifest = _manifest(folder)
    if manifest is None:
        raise FolderError(f"{folder} has no campaign: no {MANIFEST} of ours")
    parts = _read_parts(folder, manifest)
    lately, _ = _read_journal(folder / JOURNAL, manifest, set(parts["index"]))
    return manifest, _together([parts], lately)


def _together(parts: Sequence[pd.DataFrame], lately: dict[int, list[Row]]) -> pd.DataFrame:
    both = [*parts, table_of(list(chain.from_iterable(lately.values())))] if lately else [*parts]
    table = pd.concat(both, ignore_index=True) if len(both) > 1 else both[0]
    in_order = table["index"].is_monotonic_increasing
    return table if in_order else table.sort_values("index", kind="stable", ignore_index=True)


def _is_nothing(path: Path) -> bool:
    """Whether this file may be left from a command killed before it wrote the manifest."""
    return files.is_partial(path) or (path.name == JOURNAL and path.lstat().st_size == 0)


def _be_the_same(folder: Path, manifest: dict[str, Any]) -> None:
    recorded = _manifest(folder)
    if recorded is None:
        raise FolderError(f"{folder} has no campaign to resume: no {MANIFEST} of ours")
    other = sorted(key for key in {*recorded, *manifest} if recorded.get(key) != manifest.get(key))
    if other:
        raise FolderError(f"{folder} has another campaign ({', '.join(other)}); allowed: the same")


def _manifest(folder: Path) -> dict[str, Any] | None:
    try:
        manifest = json.loads(files.read_text(folder / MANIFEST))
    except (OSError, ValueError, RecursionError):
        return None
    return manifest if isinstance(manifest, dict) and manifest.get("schema") == SCHEMA else None


def _read_parts(folder: Path, manifest: dict[str, Any]) -> pd.DataFrame:
    if (folder / PARTS).is_symlink() or (folder / PARTS).is_file():
        raise FolderError(f"{folder / PARTS} is a link or a file; wanted: a folder")
    parts, seen = [table_of([])], set[int]()
    for path in sorted((folder / PARTS).glob("*.parquet")):
        parts.append(_read_part(path))
        for index, rows in groupby(parts[-1].to_dict("records"), key=lambda row: int(row["index"])):
            if index in seen:
                raise _changed(path, index)
            _as_written(path, manifest, list(rows))
            seen.add(index)
    return pd.concat(parts, ignore_index=True)


def _read_part(path: Path) -> pd.DataFrame:
    try:
        part = files.read_table(_content(path))
    except ValueError as error:
        raise FolderError(f"{path}: {error}") from None
    for name, kind in table_of([]).dtypes.items():
        if name not in part or part[name].dtype != kind:
            raise FolderError(f"{path} has no column {name!r} of type {kind}; allowed: parts as campaigns write them")
    return part[list(COLUMNS)]


def _content(path: Path) -> bytes:
    """The content of a regular file of the folder; FolderError if it is something else."""
    try:
        return files.read_bytes(path)
    except OSError as error:
        raise FolderError(f"{path} cannot be read: {error.strerror}; wanted: a regular file") from None


def _read_journal(path: Path, manifest: dict[str, Any], known: set[int]) -> tuple[dict[int, list[Row]], int]:
    """Rows by index, except known draws, and the number of bytes up to the last whole line."""
    draws: dict[int, list[Row]] = {}
    whole = 0
    for line in _content(path).splitlines(keepends=True) if os.path.lexists(path) else ():
        if not line.endswith(b"\n"):
            break
        whole += len(line)
        try:
            rows = _as_written(path, manifest, json.loads(line))
            index = rows[0]["index"]
        except (ValueError, TypeError, LookupError, ArithmeticError, RecursionError):
            cut = line.decode(errors="replace")[:80]
            raise FolderError(f"{path} has a line that is no draw: {cut}") from None
        if index not in known:
            draws[index] = rows
    return draws, whole


def _sealed(manifest: dict[str, Any], rows: Sequence[Row]) -> list[Row]:
    """The rows of a draw as strict JSON (None for NaN), each with a digest of the campaign and all of the rows."""
    plain = [[_plain(_KINDS[kind], row[name]) for name, kind in COLUMNS.items() if name != "digest"] for row in rows]
    digest = files.sha256(json.dumps([manifest, plain], sort_keys=True, allow_nan=False).encode())
    return [dict(zip(COLUMNS, [*row, digest], strict=True)) for row in plain]


def _plain(kind: type, value: Any) -> Any:
    return None if kind is float and (value is None or math.isnan(value)) else kind(value)


def _as_written(path: Path, manifest: dict[str, Any], rows: Sequence[Any]) -> list[Row]:
    """The rows of a draw; FolderError if they were changed."""
    sealed = _sealed(manifest, rows)
    if [row["digest"] for row in sealed] != [row["digest"] for row in rows]:
        raise _changed(path, rows[0]["index"])
    return sealed


def _changed(path: Path, index: object) -> FolderError:
    why = "its rows were changed, repeated or removed, or are of another campaign"
    return FolderError(f"{path}: draw {index}: {why}; allowed: what the campaign wrote")


def table_of(rows: Sequence[Row]) -> pd.DataFrame:
    return pd.DataFrame(list(rows), columns=list(COLUMNS)).astype(COLUMNS)
