"""Edits of a trace: each returns a copy. Edits by name are functions from trace to trace."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from airground_drake.run.trace import PROBLEM_ARRAYS, PROBLEM_SCALARS, Trace
from builders.layout import decision_table
from builders.scenarios import changed


def with_signals(trace: Trace, edit: Callable[[pd.DataFrame], pd.DataFrame | None]) -> Trace:
    """A copy whose signals were edited, in place or by returning new ones."""
    signals = trace.signals.copy()
    edited = edit(signals)
    return replace(trace, signals=signals if edited is None else edited)


def with_meta(trace: Trace, **changes: Any) -> Trace:
    """A copy with entries of `meta` replaced."""
    return replace(trace, meta=copy.deepcopy(trace.meta) | changes)


def with_scenario(trace: Trace, **changes: Any) -> Trace:
    """A copy that claims to be of another scenario: dotted keys, with __ for the dots."""
    dotted = {key.replace("__", "."): value for key, value in changes.items()}
    return with_meta(trace, scenario=changed(trace.meta["scenario"], dotted))


def with_events(trace: Trace, change: Callable[[list[dict[str, Any]]], list[dict[str, Any]]]) -> Trace:
    return with_meta(trace, events=sorted(change(list(trace.events)), key=lambda event: float(event["t_s"])))


def moved(trace: Trace, robot: str, row: int, offset: list[float]) -> Trace:
    """A copy in which a robot is elsewhere at one row, with commands that lead there and back."""

    def edit(signals: pd.DataFrame) -> None:
        dt = np.diff(signals["t_s"].to_numpy())
        for axis, delta in zip("xyz", offset, strict=True):
            signals.loc[row, f"{robot}.{axis}_m"] += delta
            signals.loc[row, f"{robot}.v{axis}_m_s"] += delta / dt[row - 1]
            if row + 1 < len(signals):
                signals.loc[row + 1, f"{robot}.v{axis}_m_s"] -= delta / dt[row]

    return with_signals(trace, edit)


def set_nan(column: str) -> Callable[[Trace], Trace]:
    def edit(signals: pd.DataFrame) -> None:
        signals.loc[300, column] = np.nan

    return lambda trace: with_signals(trace, edit)


def dropped(column: str) -> Callable[[Trace], Trace]:
    return lambda trace: with_signals(trace, lambda signals: signals.drop(columns=column))


def bumped(column: str, by: float, row: int = 500) -> Callable[[Trace], Trace]:
    def edit(signals: pd.DataFrame) -> None:
        signals[column] += by * (signals.index == row)

    return lambda trace: with_signals(trace, edit)


def rows(keep: Callable[[pd.DataFrame], pd.DataFrame]) -> Callable[[Trace], Trace]:
    return lambda trace: with_signals(trace, lambda signals: keep(signals).reset_index(drop=True))


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
