"""A run as CSV files, one per table of the trace."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from airground_drake.base import files
from airground_drake.run.trace import TABLES, Trace


def write(trace: Trace, folder: Path) -> Iterator[Path]:
    """Write the tables and the events of a run, `RUN_TABLE.csv`; numbers are written so that they read back equal.

    A cell that holds several numbers is a JSON list.

    Raises:
        OSError: if a file cannot be written.
    """
    tables: dict[str, pd.DataFrame] = {name: getattr(trace, name) for name in TABLES}
    tables["events"] = pd.DataFrame(trace.events)
    for name, table in tables.items():
        path = folder / f"{trace.run}_{name}.csv"
        files.write_text(path, table.map(_cell).to_csv(index=False))
        yield path


def _cell(value: Any) -> Any:
    """A list or an array as JSON text, anything else as it is."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    return json.dumps(value) if isinstance(value, list) else value
