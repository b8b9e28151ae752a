"""Tampering with events and with what is said of a run."""

from __future__ import annotations

import shutil
from functools import partial
from pathlib import Path
from typing import Any

from check.tampering.base import (
    RUN,
    UGV,
    edited_entries,
    edited_json,
    edited_report,
    named,
    read_table,
    tampering,
    trace,
)


def first(entry: Any, kind: str) -> Any:
    """The first event of a kind."""
    return next(event for event in entry["events"] if event["kind"] == kind)


def without_event(folder: Path, kind: str, run: str = RUN) -> None:
    """Remove the first event of a kind from meta.json, and from report.json with its count."""
    with edited_entries(folder, run) as entries:
        for entry in entries:
            entry["events"].remove(first(entry, kind))
        counts = entries[0]["metrics"]["event_counts"][UGV]
        counts[kind] -= 1
        if not counts[kind]:
            del counts[kind]


def exchange_traces(folder: Path) -> None:
    """Exchange the folders of two runs."""
    trace(folder, "b").rename(folder / "trace" / "x")
    trace(folder).rename(trace(folder, "b"))
    (folder / "trace" / "x").rename(trace(folder))


@tampering()
def traces_exchanged_and_renamed(folder: Path) -> None:
    exchange_traces(folder)
    for name in ("b", RUN):
        with edited_json(trace(folder, name) / "meta.json") as meta:
            meta.update(run=name, method=name)


@tampering()
def crash_replaced_by_a_safe_run(folder: Path) -> None:
    shutil.rmtree(trace(folder, "b"))
    shutil.copytree(trace(folder), trace(folder, "b"))
    with edited_json(trace(folder, "b") / "meta.json") as meta:
        meta.update(run="b", method="b")


REMOVED = {"trigger": RUN, "proposal": RUN, "collision": "b", "refuse": RUN, "arrival": RUN}
"""Kinds of events, and a run that has one."""
for _kind, _run in REMOVED.items():
    _edit = named(f"{_kind}_removed", partial(without_event, kind=_kind, run=_run))
    tampering()(_edit)


@tampering()
def proposal_added(folder: Path) -> None:
    signals = read_table(folder)
    row = signals[signals["t_s"] >= 1.0].iloc[0]
    place = [float(row[f"ugv2.{axis}_m"]) for axis in "xyz"]
    event = {"t_s": float(row["t_s"]), "robot": "ugv2", "kind": "proposal", "position_m": place, "policy": "detour"}
    with edited_entries(folder) as entries:
        for entry in entries:
            entry["events"].insert(0, event)
        entries[0]["metrics"]["event_counts"]["ugv2"]["proposal"] = 1


@tampering()
def events_reversed(folder: Path) -> None:
    with edited_entries(folder) as entries:
        for entry in entries:
            entry["events"].reverse()


@tampering()
def trigger_of_the_uav(folder: Path) -> None:
    with edited_entries(folder) as entries:
        for entry in entries:
            event = {**entry["events"][0], "kind": "trigger", "robot": "uav"}
            entry["events"] += [{**event, "t_s": t_s} for t_s in (24.8, 24.9)]


@tampering()
def fault_hidden(folder: Path) -> None:
    with edited_json(trace(folder) / "meta.json") as meta:
        meta["faults"] = [{"t_s": 11.0, "robot": UGV, "policy": "detour", "message": "no way found"}]


@tampering()
def refusals_in_the_metrics_changed(folder: Path) -> None:
    with edited_report(folder) as report:
        refusals = report["runs"]["c"]["metrics"]["gatekeeper"]["refusals"]
        refusals[UGV] = {"unsafe": 1 + sum(refusals.get(UGV, {}).values())}


@tampering()
def nearest_robot_changed(folder: Path) -> None:
    """Another robot than the nearest, with its own distance."""
    with edited_report(folder) as report:
        metrics = report["runs"][RUN]["metrics"]["min_robot_distance_m"]
        pairs = report_pairs(report)
        pair = next(pair for pair in pairs if (pair["first"], pair["second"]) == (UGV, "uav"))
        found = {"value": pair["min_distance_m"], "t_s": pair["t_s"], "safe_distance_m": pair["safe_distance_m"]}
        metrics[UGV] = {"uav": found}


def report_pairs(report: Any) -> list[Any]:
    """Evidence of SAFE-TRACE."""
    claim = next(entry for entry in report["claims"] if (entry["id"], entry["run"]) == ("SAFE-TRACE", RUN))
    return list(claim["evidence"]["pairs"])
