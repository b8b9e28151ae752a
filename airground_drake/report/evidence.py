"""Evidence of a claim as tables: lists of records, records of records, and single values; names of keys in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from airground_drake.report.figures.panels import Table

MAX_ROWS, MAX_COLUMNS, MAX_CELL_CHARS = 40, 10, 200  # maximum size of a table; report.json has all of it
# Units with which the names of quantities end, and how they are written; the longest first.
UNITS = {
    "1_m2_s": "1/(m²s)", "1_m_s": "1/(m s)", "m_sqrt_s": "m/√s", "m2_s": "m²s", "m_s": "m/s", "1_s": "1/s",
    "1_m": "1/m", "m": "m", "s": "s",
}  # fmt: skip


def split(key: str) -> tuple[str, str]:
    """The name and the unit in a key: `min_distance_m` is "min distance" and "m"."""
    for unit in UNITS:
        if key.endswith(f"_{unit}"):
            return key.removesuffix(f"_{unit}").replace("_", " "), UNITS[unit]
    return key.replace("_", " "), ""


def in_words(key: str) -> str:
    """The name and the unit in a key, in one text: "min distance, m"."""
    return ", ".join(filter(None, split(key)))


def tables(evidence: Mapping[str, Any], caption: str, number: Callable[[Any], str]) -> list[Table]:
    """The evidence: first one table of single values, then one for each key that holds several records."""
    single = {key: value for key, value in evidence.items() if not _records(value)}
    rows = tuple((in_words(key), _cell(value, number)) for key, value in single.items())
    made = [Table(caption, ("quantity", "value"), rows[:MAX_ROWS])] if rows else []
    for key, value in evidence.items():
        if records := _records(value):
            made.append(_table(f"{caption}: {in_words(key)}", records, number))
    return made


def _records(value: Any) -> list[tuple[str, Mapping[str, Any]]]:
    """The records in a list, by number, or in a record, by key; empty if the value is neither."""
    items = value.items() if isinstance(value, Mapping) else enumerate(value, 1) if isinstance(value, list) else ()
    records = [(str(key), record) for key, record in items]
    return records if all(isinstance(record, Mapping) and record for _, record in records) else []


def _table(caption: str, records: Sequence[tuple[str, Mapping[str, Any]]], number: Callable[[Any], str]) -> Table:
    keys = list(dict.fromkeys(key for _, record in records for key in record))
    shown, left_out = keys[:MAX_COLUMNS], len(keys) - MAX_COLUMNS
    rows = tuple(
        (head, *(_cell(record[key], number) if key in record else "" for key in shown)) for head, record in records
    )
    more = [f"{len(rows) - MAX_ROWS} more rows"] if len(rows) > MAX_ROWS else []
    if left_out > 0:
        more.append(f"{left_out} more columns")
    note = f" ({', '.join(more)} in report.json)" if more else ""
    return Table(f"{caption}{note}", ("", *map(in_words, shown)), rows[:MAX_ROWS])


def _cell(value: Any, number: Callable[[Any], str]) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, Mapping):
        text = "; ".join(f"{in_words(str(key))}: {_cell(item, number)}" for key, item in value.items()) or "none"
    elif isinstance(value, list):
        text = ", ".join(_cell(item, number) for item in value) or "none"
        text = f"({text})" if value and all(isinstance(item, float | int) for item in value) else text
    else:
        text = number(value) if not isinstance(value, str) else value
    return text if len(text) <= MAX_CELL_CHARS else f"{text[:MAX_CELL_CHARS]}…"
