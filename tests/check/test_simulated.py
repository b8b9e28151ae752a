"""Two traces agree only if every table does, exactly; otherwise the first row that differs is told."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground_drake.report.difference import first_difference
from airground_drake.sim.tables import TABLES
from airground_drake.sim.trace import Trace

TIMES = 0.1 * np.arange(6)
BOUNDS, PLANS = [1.0, math.nan, *TIMES[2:]], [np.array([k, 0.5]) for k in TIMES]
TABLE = pd.DataFrame({"t_s": TIMES, "name": [*"abcdef"], "bound": BOUNDS, "plan": PLANS})
TRACE = Trace({"faults": [{"t_s": 1.0}]}, **dict.fromkeys(TABLES, TABLE))


def changed(value: Any) -> Any:
    """The nearest other value."""
    if isinstance(value, np.ndarray):
        return np.append(value[:-1], np.nextafter(value[-1], np.inf))
    return f"{value}x" if isinstance(value, str) else 1.0 if math.isnan(value) else math.nextafter(value, math.inf)


@given(table=st.sampled_from(TABLES), column=st.sampled_from([*TABLE]), rows=st.sets(st.integers(0, 5), min_size=1))
def test_the_first_row_with_another_value_is_told(table: str, column: str, rows: set[int]) -> None:
    other = TABLE.copy(deep=True)
    other[column] = [changed(value) if k in rows else value for k, value in enumerate(TABLE[column])]
    found = first_difference(replace(TRACE, **{table: other}), TRACE)
    assert found is not None
    assert found[0].startswith(f"{table}, row {min(rows)}, t = ")
    assert found[0].endswith(f" s: {column}")


@pytest.mark.parametrize(
    ("other", "about"),
    [
        (TABLE.iloc[:-1], "problems: number of rows"),
        (TABLE.rename(columns={"plan": "relaxed"}), "problems: column.3"),
        (TABLE.assign(more=1.0), "problems: column: number of entries"),
    ],
)
def test_other_rows_and_columns_are_told(other: pd.DataFrame, about: str) -> None:
    found = first_difference(replace(TRACE, problems=other), TRACE)
    assert found is not None
    assert found[0] == about


def test_metadata_are_compared_and_times_by_the_clock_are_not() -> None:
    assert first_difference(replace(TRACE, timings={"wall_s": 9.0}), TRACE) is None
    assert first_difference(replace(TRACE, meta={"faults": [{"t_s": 2.0}]}), TRACE) == (
        "meta.json.faults.0.t_s", 2.0, 1.0,
    )  # fmt: skip
