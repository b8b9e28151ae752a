"""Strict reading of a report's files.

What is read depends on the content alone, so contents that were read before are not parsed again. Nothing that is
returned here may be changed.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections import Counter
from functools import lru_cache
from pathlib import Path
from typing import Any, NoReturn

import pandas as pd

from .rules import Disagreement, NotEstablished

Json = dict[str, Any]
Files = tuple[tuple[str, bytes], ...]
"""Names and contents."""


def read_bytes(path: Path) -> bytes:
    """The content of a file.

    Raises:
        NotEstablished: if it cannot be read.
    """
    try:
        return path.read_bytes()
    except OSError as error:
        raise NotEstablished("the file can be read", str(error.strerror), path.name) from error


def sha256(content: bytes) -> str:
    """SHA-256 of a content, hexadecimal."""
    return hashlib.sha256(content).hexdigest()


def read_folder(folder: Path) -> Files:
    """The content of every file in a folder, by name; nothing if there is no such folder."""
    return tuple((path.name, read_bytes(path)) for path in sorted(folder.glob("*")))


def content_of(files: Files, name: str) -> bytes:
    """The content of one file.

    Raises:
        NotEstablished: if it is not there.
    """
    for known, content in files:
        if known == name:
            return content
    raise NotEstablished("the file can be read", "it is not there", name)


def canonical(value: Any) -> str:
    """The text of a JSON value."""
    return json.dumps(value, allow_nan=False)


def read_json(path: Path) -> Any:
    """Strict JSON: no NaN, no infinity, no key twice.

    Raises:
        NotEstablished: if the file cannot be read or is not JSON.
        Disagreement: if it is JSON that is not strict.
    """
    return parse_json(read_bytes(path), path.name)


@lru_cache(maxsize=64)
def parse_json(content: bytes, name: str) -> Any:
    """The value of a strict JSON text; `name` is what it is called in a refusal.

    Raises:
        NotEstablished: if it is not JSON.
        Disagreement: if it is JSON that is not strict.
    """

    def unique(found: list[tuple[str, Any]]) -> Json:
        value = dict(found)
        if len(value) < len(found):
            key, count = Counter(key for key, _ in found).most_common(1)[0]
            raise Disagreement("a key is there once", count, 1, f"{name}: {key}")
        return value

    def refused(text: str) -> NoReturn:
        raise Disagreement("numbers are finite", text, "a number", name)

    try:
        return json.loads(content.decode("utf-8"), object_pairs_hook=unique, parse_constant=refused)
    except (ValueError, RecursionError) as error:
        raise NotEstablished("the file is JSON", str(error), name) from error


@lru_cache(maxsize=64)
def parse_table(content: bytes, name: str) -> pd.DataFrame:
    """The table in a Parquet file, rows numbered from 0.

    Raises:
        NotEstablished: if it is none.
    """
    try:
        return pd.read_parquet(io.BytesIO(content)).reset_index(drop=True)
    except Exception as error:  # pyarrow raises what it likes
        raise NotEstablished("the file is a table", f"{type(error).__name__}: {error}", name) from error
