"""The first value in which two traces, or two JSON values, differ."""

from typing import Any

import numpy as np
import pandas as pd

from airground_drake.report.compare import differences
from airground_drake.sim.tables import TABLES
from airground_drake.sim.trace import Trace

Difference = tuple[str, Any, Any]  # where two things differ, what is recorded, and what was made here


def first_difference(recorded: Trace, made: Trace) -> Difference | None:
    """The first value in which two traces differ, of the earliest row of a table; None if they are equal."""
    # Numbers are compared exactly; times by the clock are not compared.
    for name in TABLES:
        difference = _first_cell(name, getattr(recorded, name), getattr(made, name))
        if difference is not None:
            return difference
    return first_of(recorded.meta, made.meta, "meta.json")


def _first_cell(name: str, recorded: pd.DataFrame, made: pd.DataFrame) -> Difference | None:
    if [*recorded] != [*made]:
        return first_of([*recorded], [*made], f"{name}: column")
    rows = min(len(recorded), len(made))
    first, column = rows, ""
    for k, heading in enumerate(recorded):
        theirs, ours = recorded.iloc[:first, k].tolist(), made.iloc[:first, k].tolist()
        row = next((row for row, both in enumerate(zip(theirs, ours, strict=True)) if not _equal(*both)), first)
        if row < first:
            first, column = row, str(heading)
    if column:
        at = f", t = {recorded['t_s'].iloc[first]:.9g} s" if "t_s" in recorded else ""
        both = recorded[column].iloc[first], made[column].iloc[first]
        return f"{name}, row {first}{at}: {column}", *map(_plain, both)
    return None if len(recorded) == len(made) else (f"{name}: number of rows", len(recorded), len(made))


def _equal(theirs: Any, ours: Any) -> bool:
    """Whether two cells are equal, as numbers, texts or arrays; one that is not a number equals another."""
    if isinstance(theirs, (np.ndarray, list)) and isinstance(ours, (np.ndarray, list)):
        return [*theirs] == [*ours]
    return bool(theirs == ours or (theirs != theirs and ours != ours))


def _plain(value: Any) -> Any:
    """A cell as strict JSON has it: an array as a list, a number that is not finite as a text."""
    value = value.tolist() if isinstance(value, (np.ndarray, np.generic)) else value
    return value if isinstance(value, (str, int, list)) or np.isfinite(value) else str(value)


def first_of(recorded: Any, made: Any, path: str = "") -> Difference | None:
    """The first part in which two JSON values differ, with its dotted path."""
    return next(differences(recorded, made, path, within=0.0), None)
