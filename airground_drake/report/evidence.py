"""Evidence of a claim as tables: lists of records, records of records, and single values."""

from collections.abc import Mapping, Sequence
from typing import Any

from airground_drake.report.figures.panels import Table
from airground_drake.report.quantities import split, told

MAX_ROWS, MAX_COLUMNS, MAX_CELL_CHARS = 40, 10, 200  # maximum size of a table; report.json has all of it


def tables(evidence: Mapping[str, Any], caption: str) -> list[Table]:
    """The evidence: first one table of single values, then one for each key that holds several records."""
    single = {key: value for key, value in evidence.items() if not _records(value)}
    rows = tuple((in_words(key), _cell(value)) for key, value in single.items())
    made = [Table(caption, ("quantity", "value"), rows[:MAX_ROWS])] if rows else []
    for key, value in evidence.items():
        if records := _records(value):
            made.append(_table(f"{caption}: {in_words(key)}", records))
    return made


def _records(value: Any) -> list[tuple[str, Mapping[str, Any]]]:
    """The records in a list, by number, or in a record, by key; empty if the value is neither."""
    items = value.items() if isinstance(value, Mapping) else enumerate(value, 1) if isinstance(value, list) else ()
    records = [(str(key), record) for key, record in items]
    return records if all(isinstance(record, Mapping) and record for _, record in records) else []


def _table(caption: str, records: Sequence[tuple[str, Mapping[str, Any]]]) -> Table:
    keys = list(dict.fromkeys(key for _, record in records for key in record))
    shown, left_out = keys[:MAX_COLUMNS], len(keys) - MAX_COLUMNS
    rows = tuple((head, *(_cell(record[key]) if key in record else "" for key in shown)) for head, record in records)
    more = [f"{len(rows) - MAX_ROWS} more rows"] if len(rows) > MAX_ROWS else []
    if left_out > 0:
        more.append(f"{left_out} more columns")
    note = f" ({', '.join(more)} in report.json)" if more else ""
    return Table(f"{caption}{note}", ("", *map(in_words, shown)), rows[:MAX_ROWS])


def in_words(key: str) -> str:
    """The name and the unit in a key, in one text: "min distance, m"."""
    return ", ".join(filter(None, split(key)))


def _cell(value: Any) -> str:
    text = told(value)
    return text if len(text) <= MAX_CELL_CHARS else f"{text[:MAX_CELL_CHARS]}…"
