"""Kinds of edits of a run, and honest runs by name."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from builders.decisions import STAGES
from builders.edits import first_of, with_decision, with_meta, with_scenario, with_table
from builders.runs import beside_a_rock, chattering, dead_end, leaking, refractory, run_of

from airground_drake.sim.trace import Trace

Edit = Callable[[Trace], Trace]
EIGHT = [f"gatekeeper.stages={STAGES}", "gatekeeper.horizon_s=0.4"]
"""Few stages, so that all plans can be evaluated."""
SIXTH = 5
"""The decision that is edited: the best plan there changes its mode."""

A, D, JOINT = "synthetic a", "synthetic d", "dead end"
A_D, B_C, B_D, SWAP = "case_a d", "case_b c", "case_b d", "swap c"
RELAXED, BINARY, LOCAL, BLOCKS = "relaxed", "mixed_integer", "nonlinear", "blocks"
SYNTHETIC: dict[str, Callable[[], Trace]] = {
    A: lambda: run_of("a"), D: lambda: run_of("d"), "refractory": refractory, "leaking": leaking,
    "chattering": chattering, "at a rock": beside_a_rock, JOINT: dead_end,
}  # fmt: skip


def scenario(**changes: Any) -> Edit:
    return lambda trace: with_scenario(trace, **changes)


def meta(**changes: Any) -> Edit:
    return lambda trace: with_meta(trace, **changes)


def sampled(**columns: Any) -> Edit:
    return lambda trace: with_table(trace, "samples", lambda table: table.assign(**columns))


def events(edit: Callable[[list[dict[str, Any]]], object]) -> Edit:
    def change(trace: Trace) -> Trace:
        copies = [dict(event) for event in trace.events]
        edit(copies)
        return with_meta(trace, events=copies)

    return change


def decisions(edit: Callable[[pd.DataFrame], pd.DataFrame]) -> Edit:
    return lambda trace: replace(trace, decisions=edit(trace.decisions))


def proposals(edit: Callable[[pd.DataFrame], pd.DataFrame]) -> Edit:
    return lambda trace: replace(trace, proposals=edit(trace.proposals))


def one_more(**columns: Any) -> Edit:
    return decisions(lambda table: pd.concat([table, table.iloc[[-1]].assign(**columns)], ignore_index=True))


def proposed(*times: float, robot: str = "ugv1") -> Edit:
    return events(lambda all_: all_.extend([{**first_of(all_, "proposal"), "t_s": t, "robot": robot} for t in times]))


def accepted(table: pd.DataFrame) -> Any:
    return table["reason"] == "cheaper"


def refused(table: pd.DataFrame) -> Any:
    return table["reason"] == "stalls"


def executing(table: pd.DataFrame) -> Any:
    return (table["reason"] == "kept") & (table["decision"] == "accept")


def first(where: Callable[[pd.DataFrame], Any], **values: Any) -> Edit:
    """Values of the first decision for which something is true, set or called with what is there."""

    def edit(table: pd.DataFrame) -> pd.DataFrame:
        k, table = int(np.flatnonzero(where(table))[0]), table.copy()
        for name, value in values.items():
            table.loc[k, name] = value(table.loc[k, name]) if callable(value) else value
        return table

    return decisions(edit)


def decision(edit: Callable[[dict[str, Any], dict[str, Any]], object], row: int = SIXTH) -> Edit:
    return lambda trace: with_decision(trace, edit, row)


def problem(row: int = SIXTH, **arrays: Callable[[Any], Any]) -> Edit:
    return decision(lambda _, given: given.update({k: change(given[k]) for k, change in arrays.items()}), row)


def column(**values: Any) -> Edit:
    """Values of a decision, set or called with what is there."""
    return decision(lambda row, _: row.update({k: v(row[k]) if callable(v) else v for k, v in values.items()}))


def at(index: Any, value: Any) -> Callable[[Any], Any]:
    def change(values: Any) -> Any:
        values = np.array(values, dtype=float)
        values[index] = value(values[index]) if callable(value) else value
        return values

    return change


def both(*edits: Edit) -> Edit:
    def edit(trace: Trace) -> Trace:
        for each in edits:
            trace = each(trace)
        return trace

    return edit


def swapped(value: str) -> str:
    return {"accept": "refuse", "refuse": "accept"}[value]
