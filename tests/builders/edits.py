"""Edits of a trace: each returns a copy. Edits by name are functions from trace to trace."""

import copy
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from airground_drake.sim.tables import PROBLEM_ARRAYS, PROBLEM_SCALARS
from airground_drake.sim.trace import Trace
from builders.layout import decision_table
from builders.scenarios import changed

TableEdit = Callable[[pd.DataFrame], pd.DataFrame | None]


def with_table(trace: Trace, name: str, edit: TableEdit) -> Trace:
    table = getattr(trace, name).copy()
    edited = edit(table)
    return replace(trace, **{name: table if edited is None else edited})


def with_cells(trace: Trace, name: str, rows: Any, columns: Any, value: Any) -> Trace:
    """A copy with other values in rows and columns of a table; a function is called with what is there."""

    def edit(table: pd.DataFrame) -> None:
        table.loc[rows, columns] = value(table.loc[rows, columns]) if callable(value) else value

    return with_table(trace, name, edit)


def with_meta(trace: Trace, **changes: Any) -> Trace:
    return replace(trace, meta=copy.deepcopy(trace.meta) | changes)


def with_scenario(trace: Trace, **changes: Any) -> Trace:
    """A copy that claims to be of another scenario: dotted keys, with __ for the dots."""
    dotted = {key.replace("__", "."): value for key, value in changes.items()}
    return with_meta(trace, scenario=changed(trace.meta["scenario"], dotted))


def with_events(trace: Trace, change: Callable[[list[dict[str, Any]]], list[dict[str, Any]]]) -> Trace:
    return with_meta(trace, events=sorted(change(list(trace.events)), key=lambda event: float(event["t_s"])))


def moved(trace: Trace, robot: str, row: int, offset: list[float]) -> Trace:
    """A copy in which a robot is elsewhere at one row, with commands that lead there and back.

    Where an event divides a control period, the commands lead to the nearest row that a control sample follows.
    """
    t, offsets = trace.t, dict(zip("xyz", offset, strict=True))
    ends = np.append(trace.sample_rows, len(t) - 1)
    k = int(np.searchsorted(ends, row))  # the period before ends[k] leads there, the next one back
    before, after = ends[k - 1], ends[min(k + 1, len(ends) - 1)]
    nodes = [before, ends[k], after] if after > ends[k] else [before, ends[k]]
    reached = np.interp(t, t[nodes], [0.0, 1.0, 0.0][: len(nodes)], left=0.0)

    def elsewhere(states: pd.DataFrame) -> None:
        for axis, delta in offsets.items():
            states[f"{robot}.{axis}_m"] += delta * reached

    def commanded(samples: pd.DataFrame) -> None:
        for axis, delta in offsets.items():
            samples.loc[k - 1, f"{robot}.v{axis}_m_s"] += delta / (t[ends[k]] - t[before])
            if after > ends[k]:
                samples.loc[k, f"{robot}.v{axis}_m_s"] -= delta / (t[after] - t[ends[k]])

    return with_table(with_table(trace, "states", elsewhere), "samples", commanded)


def set_nan(column: str) -> Callable[[Trace], Trace]:
    return lambda trace: with_cells(trace, _table_of(trace, column), 300, column, np.nan)


def dropped(column: str) -> Callable[[Trace], Trace]:
    return lambda trace: with_table(trace, _table_of(trace, column), lambda table: table.drop(columns=column))


def bumped(column: str, by: float, row: int = 500) -> Callable[[Trace], Trace]:
    return lambda trace: with_cells(trace, _table_of(trace, column), row, column, lambda value: value + by)


def _table_of(trace: Trace, column: str) -> str:
    return "samples" if column in trace.samples else "states"


def rows(keep: Callable[[pd.DataFrame], pd.DataFrame]) -> Callable[[Trace], Trace]:
    def edit(trace: Trace) -> Trace:
        states = keep(trace.states).reset_index(drop=True)
        samples = trace.samples[trace.samples["t_s"].isin(states["t_s"][:-1])].reset_index(drop=True)
        return replace(trace, states=states, samples=samples)

    return edit


def first_of(events: list[dict[str, Any]], kind: str) -> dict[str, Any]:
    return next(event for event in events if event["kind"] == kind)


DecisionEdit = Callable[[dict[str, Any], dict[str, Any]], None]


def with_decision(trace: Trace, edit: DecisionEdit, row: int = 2) -> Trace:
    """A copy in which one decision, given as its columns and its problem (arrays flat), was edited."""
    decisions, problems = trace.decisions.to_dict("records"), trace.problems.to_dict("records")
    problems[row] = {k: np.array(v, dtype=float) if k in PROBLEM_ARRAYS else v for k, v in problems[row].items()}
    edit(decisions[row], problems[row])
    return replace(
        trace,
        decisions=decision_table(decisions),
        problems=pd.DataFrame(problems, columns=[*PROBLEM_SCALARS, *PROBLEM_ARRAYS]),
    )
