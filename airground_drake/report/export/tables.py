"""A run as CSV files, one per table of the trace."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from airground_drake.base import files
from airground_drake.sim.tables import TABLES
from airground_drake.sim.trace import Trace
from airground_drake.verify.runs.pairs import least_gap, pairs_of

# Columns under the names that say what they are, by their names in a trace.
TOLD = {"distances_m": "distances_of_centres_m"}


def write(trace: Trace, folder: Path) -> Iterator[Path]:
    """Write the tables, the events and the smallest distances of a run, `RUN_TABLE.csv`."""
    # Distances are between surfaces, below 0 as an overlap. Numbers are written so that they read back equal.
    tables: dict[str, pd.DataFrame] = {name: getattr(trace, name) for name in TABLES}
    tables["events"] = pd.DataFrame(trace.events)
    tables["distances"] = pd.DataFrame(_distances(trace))
    for name, table in tables.items():
        path = folder / f"{trace.run}_{name}.csv"
        files.write_text(path, table.rename(columns=TOLD).map(_cell).to_csv(index=False))
        yield path


def _distances(trace: Trace) -> Iterator[dict[str, Any]]:
    """A row per pair, with the names of report.json."""
    for least in (least_gap(trace, pair) for pair in pairs_of(trace)):
        yield {
            "first": least.pair.first, "second": least.pair.second, "min_distance_m": least.gap_m,
            "safe_distance_m": least.pair.required_m, "t_s": least.t_s,
        }  # fmt: skip


def _cell(value: Any) -> Any:
    """A list or an array as JSON text, anything else as it is."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    return json.dumps(value) if isinstance(value, list) else value
