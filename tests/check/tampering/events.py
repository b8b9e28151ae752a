"""Tampering with events and with what is said of a run."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from check.tampering.base import (
    RUN,
    UGV,
    edited_entries,
    edited_json,
    edited_report,
    ignored,
    read_table,
    refused_by,
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


@refused_by("events", "events follow from signals and decisions")
def status_of_an_answer_changed(folder: Path) -> None:
    with edited_entries(folder) as entries:
        for entry in entries:
            first(entry, "accept")["status"] = "optimal"


@refused_by("events", "what is said of an event")
def something_added_to_an_event(folder: Path) -> None:
    with edited_entries(folder) as entries:
        for entry in entries:
            first(entry, "trigger")["why"] = "stuck"


@refused_by("events", "events follow from signals and decisions", run="b")
def another_obstacle_was_hit(folder: Path) -> None:
    with edited_entries(folder, "b") as entries:
        for entry in entries:
            first(entry, "collision")["obstacle"] = "obstacle_9"


def exchange_traces(folder: Path) -> None:
    """Exchange the folders of two runs."""
    trace(folder, "b").rename(folder / "trace" / "x")
    trace(folder).rename(trace(folder, "b"))
    (folder / "trace" / "x").rename(trace(folder))


@refused_by("trace", "name of the run")
def traces_exchanged(folder: Path) -> None:
    exchange_traces(folder)


@refused_by("trace", "events in report.json")
def traces_exchanged_and_renamed(folder: Path) -> None:
    exchange_traces(folder)
    for name in ("b", RUN):
        with edited_json(trace(folder, name) / "meta.json") as meta:
            meta.update(run=name, method=name)


@refused_by("trace", "events in report.json", run="b")
def crash_replaced_by_a_safe_run(folder: Path) -> None:
    shutil.rmtree(trace(folder, "b"))
    shutil.copytree(trace(folder), trace(folder, "b"))
    with edited_json(trace(folder, "b") / "meta.json") as meta:
        meta.update(run="b", method="b")


@refused_by("trace", "events in report.json")
def event_removed_from_the_report(folder: Path) -> None:
    with edited_report(folder) as report:
        del report["runs"][RUN]["events"][0]


@refused_by("events", "events follow from signals and decisions")
def trigger_removed(folder: Path) -> None:
    without_event(folder, "trigger")


@refused_by("GATE-FEAS", "the decision is on a proposal")
def proposal_removed(folder: Path) -> None:
    without_event(folder, "proposal")


@refused_by("events", "events follow from signals and decisions", run="b")
def collision_removed(folder: Path) -> None:
    without_event(folder, "collision", "b")


@refused_by("events", "events follow from signals and decisions")
def refusal_removed(folder: Path) -> None:
    without_event(folder, "refuse")


@refused_by("events", "events follow from signals and decisions")
def arrival_removed(folder: Path) -> None:
    without_event(folder, "arrival")


@refused_by("COMM", "a proposal only during interventions")
def proposal_added(folder: Path) -> None:
    signals = read_table(folder)
    row = signals[signals["t_s"] >= 1.0].iloc[0]
    place = [float(row[f"ugv2.{axis}_m"]) for axis in "xyz"]
    event = {"t_s": float(row["t_s"]), "robot": "ugv2", "kind": "proposal", "position_m": place, "policy": "detour"}
    with edited_entries(folder) as entries:
        for entry in entries:
            entry["events"].insert(0, event)
        entries[0]["metrics"]["event_counts"]["ugv2"]["proposal"] = 1


@refused_by("events", "events follow from signals and decisions")
def policy_of_an_answer_changed(folder: Path) -> None:
    with edited_entries(folder) as entries:
        for entry in entries:
            first(entry, "refuse")["policy"] = "detour"


@refused_by("events", "place of an event")
def place_of_a_trigger_moved(folder: Path) -> None:
    with edited_entries(folder) as entries:
        for entry in entries:
            first(entry, "trigger")["position_m"][0] += 1e-3


@refused_by("events", "events are in order")
def events_reversed(folder: Path) -> None:
    with edited_entries(folder) as entries:
        for entry in entries:
            entry["events"].reverse()


@refused_by("THR-TRIG", "triggers and releases")
def trigger_moved(folder: Path) -> None:
    with edited_entries(folder) as entries:
        for entry in entries:
            first(entry, "trigger")["t_s"] -= 1e-3


@refused_by("THR-TRIG", "only UGVs are triggered on")
def trigger_of_the_uav(folder: Path) -> None:
    with edited_entries(folder) as entries:
        for entry in entries:
            event = {**entry["events"][0], "kind": "trigger", "robot": "uav"}
            entry["events"] += [{**event, "t_s": t_s} for t_s in (24.8, 24.9)]


@refused_by("trace", "threshold in force")
def threshold_in_force_changed(folder: Path) -> None:
    with edited_entries(folder) as entries:
        for entry in entries:
            entry["zeta_m"] = 2.9


@refused_by("trace", "composition of the run")
def composition_changed(folder: Path) -> None:
    with edited_entries(folder) as entries:
        for entry in entries:
            entry["composition"] = "recursion_nearest"


@refused_by("trace", "faults in report.json")
def fault_hidden(folder: Path) -> None:
    with edited_json(trace(folder) / "meta.json") as meta:
        meta["faults"] = [{"t_s": 11.0, "robot": UGV, "policy": "detour", "message": "no way found"}]


@refused_by("metrics", "counts of events")
def count_of_events_changed(folder: Path) -> None:
    with edited_report(folder) as report:
        report["runs"][RUN]["metrics"]["event_counts"][UGV]["proposal"] = 1


@refused_by("metrics", "counts of refusals", run="c")
def refusals_in_the_metrics_changed(folder: Path) -> None:
    with edited_report(folder) as report:
        refusals = report["runs"]["c"]["metrics"]["gatekeeper"]["refusals"]
        refusals[UGV] = {"unsafe": 1 + sum(refusals.get(UGV, {}).values())}


@refused_by("metrics", "closest call", run="c")
def closest_call_changed(folder: Path) -> None:
    with edited_report(folder) as report:
        report["runs"]["c"]["metrics"]["gatekeeper"]["closest_call"]["relative_cost_margin"] *= 2.0


@refused_by("metrics", "least distance", run="b")
def distance_in_the_metrics_changed(folder: Path) -> None:
    with edited_report(folder) as report:
        report["runs"]["b"]["metrics"]["min_distance_m"][UGV]["sudden"]["value"] = 2.0


@refused_by("metrics", "robot of least margin")
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


@refused_by("metrics", "final position")
def end_in_the_metrics_moved(folder: Path) -> None:
    with edited_report(folder) as report:
        report["runs"][RUN]["metrics"]["final_position_m"][UGV][0] += 0.01


@refused_by("metrics", "counts of answers")
def answers_in_the_metrics_changed(folder: Path) -> None:
    with edited_report(folder) as report:
        report["runs"][RUN]["metrics"]["gatekeeper"]["decisions"] = {"accept": 49}


@refused_by("report", "seed", run="")
def seed_changed(folder: Path) -> None:
    with edited_report(folder) as report:
        report["provenance"]["seed"] = 7


@ignored("nothing else in a report tells when it was written, by what versions, on what machine")
def versions_changed(folder: Path) -> None:
    with edited_report(folder) as report:
        report["provenance"].update(drake="0.0.1", started="1999-01-01T00:00:00+00:00", git="0" * 40)


@ignored("the measured time of a simulation is recorded once and follows from nothing; no verdict depends on it")
def simulated_in_no_time(folder: Path) -> None:
    with edited_json(trace(folder) / "timings.json") as timings, edited_report(folder) as report:
        timings["wall_s"] = 1e-9
        metrics = report["runs"][RUN]["metrics"]
        metrics |= {"wall_s": 1e-9, "realtime_factor": metrics["duration_s"] / 1e-9}
