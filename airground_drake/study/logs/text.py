"""Text tables of loggers: delimiter, header and decimal sign are detected from the data lines.

Detection from the first lines would fail with headers of several lines, or with comments above the data.
"""

import csv
import io
import re
import warnings
from collections import Counter
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import pandas as pd

from airground_drake.base.errors import LogError, short

# In this order: a table with decimal commas has as many commas in each line, too. Blanks come last.
DELIMITERS = (";", "\t", ",", "|")
SAMPLE = 200  # lines in the middle of a file from which its form is found
ALIKE = 0.6  # least share of these lines that have the usual number of fields
FEWEST, MOST = 3, 20_000  # columns of a table
MOST_HEADERS = 20  # lines of a header
MOST_ROWS = 10_000_000
_UNKNOWN = "it is neither text nor a file of a known kind; wanted: CSV, TSV, TUM, Parquet, MCAP or a ROS bag"
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)|", re.IGNORECASE)
_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_POINT = re.compile(r"[+-]?\d*\.\d+([eE][+-]?\d+)?")


class Table(NamedTuple):
    """A table of texts."""

    # Names of the columns; of several header lines, the parts joined by "/"; numbers from 1 without header.
    labels: list[str]
    cells: pd.DataFrame  # the columns by number, with a text per row; decimals have a point
    lines: Sequence[int]  # number of each row's line in the file
    above: list[str]  # lines above the header, and comments
    has_header: bool  # whether there was one
    odd: list[int]  # numbers of the lines that are left out: with another number of fields, or cut off
    unread: Mapping[str, str] = MappingProxyType({})  # types of columns that are left out, by label


def read(content: bytes) -> Table:
    lines = re.sub(r"\r+\n", "\n", _decoded(content)).replace("\r", "\n").split("\n")
    full = [k for k, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")]
    if not full:
        raise LogError("it has no lines with data")
    middle = full[max(0, len(full) // 2 - SAMPLE // 2) :][:SAMPLE]
    delimiter, count = _form([lines[k] for k in middle])
    rows = [_fields(lines[k], delimiter) for k in middle]
    rows = [row for row in rows if len(row) == count]
    columns = [[row[c] for row in rows] for c in range(count)]
    commas = [delimiter != "," and _decimal_comma(column) for column in columns]
    numeric = [_is_numeric(column) for column in columns]
    first = next((k for k in full if _is_data(_fields(lines[k], delimiter), numeric)), None)
    if first is None:
        raise LogError("it has no rows of numbers; wanted: a table with times and positions")
    unnamed = next((k for k in range(count) if any(row[count - 1 - k] for row in rows)), 0)
    labels, header = _header(lines[:first], delimiter, count, unnamed)
    if len(header) > MOST_HEADERS:
        line = short(lines[max(header)])
        raise LogError(
            f"lines {min(header) + 1} to {first} have words where most lines have numbers: line {first} is {line}"
        )
    data = [k for k in full if k >= first]
    if len(data) > MOST_ROWS:
        raise LogError(f"it has {len(data)} rows; allowed: {MOST_ROWS}")
    # A logger that crashes may cut off its last number: that has fewer digits than the one above it, and no line's end.
    digits = [len(re.split(r"[.,;|\s]", line)[-1]) for line in lines[-2:]]
    whole = len(lines) - (digits[-1] < digits[0])
    good = [k for k in data if k < whole and _count(lines[k], delimiter) == count]
    chosen = set(good)
    try:
        with warnings.catch_warnings(action="ignore", category=pd.errors.ParserWarning):  # quotes joined lines
            cells = pd.read_csv(
                io.StringIO("\n".join(lines[k] for k in good)), sep=delimiter if delimiter != " " else r"\s+",
                header=None, names=list(range(count)), index_col=False, dtype=str, keep_default_na=False,
                na_filter=False, skip_blank_lines=False,
            )  # fmt: skip
    except pd.errors.ParserError as error:
        raise LogError(f"it is not a table: {error}") from None
    if len(cells) != len(good):
        raise LogError("it is not a table: quotes are open at the end of a line")
    cells = cells.apply(lambda column: column.str.strip())
    if any(commas):
        for c in (c for c in range(count) if numeric[c] and not any(map(_POINT.fullmatch, columns[c]))):
            cells[c] = cells[c].str.replace(",", ".", regex=False)
    above = [line for k, line in enumerate(lines[:first]) if k not in header]
    odd = [k + 1 for k in data if k not in chosen]
    named = labels or [str(c + 1) for c in range(count)]
    return Table(named, cells, [k + 1 for k in good], above, bool(labels), odd)


def _decoded(content: bytes) -> str:
    """The text; without a mark of its encoding it is UTF-8, or else Windows-1252."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", errors="replace")
    if b"\0" in content:
        raise LogError(_UNKNOWN)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", errors="replace")
    if sum(not (c.isprintable() or c in "\r\n\t") for c in text[:4096]) > 40:
        raise LogError(_UNKNOWN)
    return text


def _form(lines: Sequence[str]) -> tuple[str, int]:
    for delimiter in (*DELIMITERS, " "):
        count, times = Counter(_count(line, delimiter) for line in lines).most_common(1)[0]
        if count >= FEWEST and times >= ALIKE * len(lines):
            if count > MOST:
                raise LogError(f"it has {count} columns; allowed: {MOST}")
            return delimiter, count
    raise LogError(
        "it is not a table: its lines have no common number of fields, by semicolons, tabs, commas, bars or blanks"
    )


def _fields(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    if '"' not in line:
        return [field.strip() for field in line.split(delimiter)]
    try:
        return [field.strip() for field in next(csv.reader([line], delimiter=delimiter), [])]
    except csv.Error:
        return []


def _count(line: str, delimiter: str) -> int:
    return line.count(delimiter) + 1 if delimiter != " " and '"' not in line else len(_fields(line, delimiter))


def is_number(cell: str) -> bool:
    """Whether a cell is a number, empty or nan."""
    return _NUMBER.fullmatch(cell) is not None


def _is_numeric(column: Sequence[str]) -> bool:
    """Whether most cells of a column that are not empty are numbers."""
    full = [cell for cell in column if cell]
    return 2 * sum(map(is_number, full)) > len(full)


def _decimal_comma(column: Sequence[str]) -> bool:
    with_comma = [cell for cell in column if _COMMA.fullmatch(cell)]
    if not with_comma or any(map(_POINT.fullmatch, column)):
        return False
    whole = [cell for cell in column if re.fullmatch(r"[+-]?[1-9]\d{1,2}", cell)]
    if whole and all(re.fullmatch(r"[+-]?[1-9]\d{0,2},\d{3}", cell) for cell in with_comma):
        raise LogError(f"numbers such as {with_comma[0]} stand beside {whole[0]}; wanted: no commas of thousands")
    return True


def _is_data(row: Sequence[str], numeric: Sequence[bool]) -> bool:
    """Whether a line has numbers or empty cells where most lines have numbers."""
    cells = [cell for cell, is_numeric in zip(row, numeric, strict=False) if is_numeric]
    return len(row) == len(numeric) and all(map(is_number, cells)) and any(cells)


def _header(lines: Sequence[str], delimiter: str, count: int, unnamed: int) -> tuple[list[str], set[int]]:
    """Names of the columns, and the numbers of the lines that they are from; a comment may be the header."""
    # A delimiter at the end of each row, or of the header, makes no column: the last `unnamed` columns are empty.
    header: list[int] = []
    rows: list[list[str]] = []
    for k in range(len(lines) - 1, -1, -1):
        is_comment = lines[k].lstrip().startswith("#")
        row = _fields(lines[k].lstrip().lstrip("#"), delimiter)
        if not lines[k].strip() and not rows:
            continue
        if not lines[k].strip() or (is_comment and rows):
            break
        row += [""] * (count - len(row) if count - len(row) <= unnamed else 0)
        while len(row) > count and not row[-1]:
            row.pop()
        if len(row) != count or not any(row):
            break
        rows.insert(0, row)
        header.append(k)
        if is_comment:
            break
    for row in rows[:-1]:  # a header above several columns is written once
        for c in range(1, count):
            row[c] = row[c] or row[c - 1]
    parts = [[row[c] for row in rows if row[c]] for c in range(count)]
    return ["/".join(dict.fromkeys(words)) for words in parts] if rows else [], {*header}
