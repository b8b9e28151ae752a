"""Strict reading of the files of a report, which may be hostile: regular files in the folder, of bounded size."""

import hashlib
import io
import json
import math
import os
import stat
from collections import Counter
from pathlib import Path
from typing import Any, NoReturn

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from .rules import Disagreement, NotEstablished

Json = dict[str, Any]

LARGEST_FILE = 256_000_000  # bytes of a file: a run of an hour with ten robots has fewer
LARGEST_JSON = 64_000_000  # bytes of a JSON file
DEEPEST = 60  # levels of nesting in JSON
LONGEST_NUMBER = 300  # characters of a number in JSON: a longer integer is beyond all floating-point numbers
MOST_CELLS = 50_000_000  # rows times columns of a table, and numbers in its lists
MOST_FILES = 100_000  # in the folder of a report
THRIFT = 10_000_000  # bytes of a text, and entries of a list, in the metadata of a table


def is_plain(name: Any) -> bool:
    """Whether a value is a plain file or folder name, without a path."""
    return isinstance(name, str) and name not in ("", ".", "..") and not {*"/\\\0"} & {*name} and name.isprintable()


def names_in(folder: Path) -> list[str]:
    """The relative paths of all files in a folder, sorted."""
    paths: list[str] = []
    for place, folders, files in os.walk(folder):
        for name in (*folders, *files):
            path = os.path.join(place, name)
            mode = os.lstat(path).st_mode
            if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
                raise NotEstablished("a report has regular files and folders only", "it is neither", path)
        inside = "" if place == os.fspath(folder) else f"{os.path.relpath(place, folder)}/"
        paths += [inside + name for name in files]
        if len(paths) > MOST_FILES:
            raise NotEstablished("a report has few files", f"more than {MOST_FILES}", str(folder))
    return sorted(paths)


def read_bytes(path: Path) -> bytes:
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOFOLLOW", 0))
        with os.fdopen(handle, "rb") as file:
            about = os.fstat(file.fileno())
            if not stat.S_ISREG(about.st_mode):
                raise NotEstablished("the file can be read", "it is not a regular file", path.name)
            if about.st_size > LARGEST_FILE:
                raise NotEstablished("the file can be read", f"it has {about.st_size} bytes", path.name)
            return file.read()
    except (OSError, ValueError) as error:
        why = str(getattr(error, "strerror", None) or error)
        raise NotEstablished("the file can be read", why, path.name) from error


def sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def read_json(path: Path) -> Any:
    """Strict JSON: no NaN, no infinity, no key twice."""
    content, name = read_bytes(path), path.name

    def unique(entries: list[tuple[str, Any]]) -> Json:
        value = dict(entries)
        if len(value) < len(entries):
            key, count = Counter(key for key, _ in entries).most_common(1)[0]
            raise Disagreement("a key is there once", count, 1, f"{name}: {key}")
        return value

    def refused(text: str) -> NoReturn:
        raise Disagreement("numbers are finite", f"{text[:20]}...", "a number", name)

    def real(text: str) -> float:
        value = float(text)
        return value if math.isfinite(value) else refused(text)

    def whole(text: str) -> int:
        return int(text) if len(text) <= LONGEST_NUMBER else refused(text)

    if len(content) > LARGEST_JSON:
        raise NotEstablished("the file is JSON", f"it has {len(content)} bytes", name)
    try:
        value = json.loads(
            content.decode("utf-8"), object_pairs_hook=unique, parse_constant=refused, parse_float=real, parse_int=whole
        )
    except (ValueError, RecursionError) as error:
        raise NotEstablished("the file is JSON", str(error), name) from error
    if _is_deep(value):
        raise NotEstablished("the file is JSON", f"it is nested more than {DEEPEST} deep", name)
    return value


def _is_deep(value: Any) -> bool:
    """Whether a value is nested deeper than `DEEPEST`, level by level."""
    level = [value]
    for _ in range(DEEPEST + 1):
        nested = [part for part in level if isinstance(part, (dict, list))]
        if not nested:
            return False
        level = [part for above in nested for part in (above.values() if isinstance(above, dict) else above)]
    return True


def parse_table(content: bytes, name: str) -> pd.DataFrame:
    """The table in a Parquet file, rows numbered from 0: numbers, texts and lists of numbers."""
    # Sizes and types in the header of the file are checked before the data are unpacked. Texts are read as
    # dictionaries: a text that is repeated a million times is stored once.
    try:
        limits = {"thrift_string_size_limit": THRIFT, "thrift_container_size_limit": THRIFT}
        file = pq.ParquetFile(io.BytesIO(content), **limits)
        schema, about = file.schema_arrow, file.metadata
        texts = [field.name for field in schema if _is_text_type(field.type)]
        chunks = (about.row_group(i).column(j) for i in range(about.num_row_groups) for j in range(about.num_columns))
        cells = max(about.num_rows * about.num_columns, sum(chunk.num_values for chunk in chunks))
        wrong = next((field for field in schema if not _is_plain_type(field.type)), None)
        if cells > MOST_CELLS:
            raise NotEstablished("the file is a table", f"it has {cells} cells, {MOST_CELLS} at most", name)
        if wrong is not None:
            raise NotEstablished("the file is a table", f"column {wrong.name!r} is of type {wrong.type}", name)
        if len({*schema.names}) < len(schema.names):
            raise NotEstablished("the file is a table", "a column is there twice", name)
        file = pq.ParquetFile(io.BytesIO(content), read_dictionary=texts, **limits)
        table = file.read().to_pandas(ignore_metadata=True)
        return table.astype(dict.fromkeys(texts, object))
    except NotEstablished:
        raise
    except Exception as error:  # pyarrow raises many types
        raise NotEstablished("the file is a table", f"{type(error).__name__}: {error}", name) from error


def _is_plain_type(kind: pa.DataType) -> bool:
    """A number, a text, a list of numbers, or nothing."""
    numbers = (pa.types.is_floating, pa.types.is_integer, pa.types.is_boolean, pa.types.is_null)
    listed = pa.types.is_list(kind) or pa.types.is_large_list(kind)
    return any(is_type(kind.value_type if listed else kind) for is_type in numbers) or _is_text_type(kind)


def _is_text_type(kind: pa.DataType) -> bool:
    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind))
