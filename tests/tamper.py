"""Ways to tamper with a report, for `airground_drake.check` to notice: `python tests/tamper.py DIR` tries them all.

Each function edits a copy of a report's folder in place. `seal` and the `digest` of the editors mend the SHA-256 that
the report has of a file, as somebody would who wants the change to pass. The report must be of case B.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import math
import shutil
import sys
import tempfile
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from airground_drake import check

Tamper = Callable[[Path], None]
TAMPERINGS: dict[str, Tamper] = {}
RUN, UGV = "d", "ugv1"


def tampering(function: Tamper) -> Tamper:
    """Register a tampering under its name."""
    TAMPERINGS[function.__name__] = function
    return function


def edit_json(path: Path, edit: Callable[[Any], Any]) -> None:
    """Change a JSON file in place, or to what `edit` returns."""
    value = json.loads(path.read_text(encoding="utf-8"))
    changed = edit(value)
    path.write_text(json.dumps(value if changed is None else changed, indent=1, ensure_ascii=False) + "\n")


def edit_report(folder: Path, edit: Callable[[Any], Any]) -> None:
    """Change report.json."""
    edit_json(folder / "report.json", edit)


def edit_both(folder: Path, edit: Callable[[Any], Any], run: str = RUN) -> None:
    """Change the entry of a run in report.json and its meta.json in the same way."""
    edit_report(folder, lambda report: edit(report["runs"][run]))
    edit_json(folder / "trace" / run / "meta.json", edit)


def edit_scenario(folder: Path, edit: Callable[[Any], Any]) -> None:
    """Change the resolved scenario everywhere."""
    edit_report(folder, lambda report: edit(report["scenario"]["resolved"]))
    for meta in folder.glob("trace/*/meta.json"):
        edit_json(meta, lambda value: edit(value["scenario"]))


def seal(folder: Path, run: str = RUN) -> None:
    """Make the digests in a meta.json right."""
    place = folder / "trace" / run

    def edit(meta: Any) -> None:
        meta["files"] = {name: hashlib.sha256((place / name).read_bytes()).hexdigest() for name in meta["files"]}

    edit_json(place / "meta.json", edit)


def edit_table(
    folder: Path, edit: Callable[[pd.DataFrame], Any], table: str = "signals", run: str = RUN, *, digest: bool = True
) -> None:
    """Change a table in place, or to what `edit` returns."""
    path = folder / "trace" / run / f"{table}.parquet"
    frame = pd.read_parquet(path)
    changed = edit(frame)
    (frame if changed is None else changed).to_parquet(path, index=False)
    if digest:
        seal(folder, run)


def edit_certificate(
    folder: Path, claim: str, edit: Callable[[Any], Any], name: str = "obligations.json", *, digest: bool = True
) -> None:
    """Change a certificate."""
    path = folder / "certificates" / claim / name
    edit_json(path, edit)
    if digest:
        right = hashlib.sha256(path.read_bytes()).hexdigest()
        edit_report(folder, lambda report: verdict(report, claim, "")["certificates"].update({name: right}))


def verdict(report: Any, claim: str, run: str = RUN) -> Any:
    """A claim's entry in report.json."""
    return next(entry for entry in report["claims"] if (entry["id"], entry["run"]) == (claim, run))


def obligation(obligations: Any, name: str) -> Any:
    """An obligation by name."""
    return next(entry for entry in obligations if entry["name"] == name)


def middle(frame: pd.DataFrame) -> int:
    """A row while the UGV intervened on is under way."""
    return int(np.flatnonzero(frame[f"{UGV}.accepted"] == 1.0)[10])


def shift(frame: pd.DataFrame, row: int, offset_m: float) -> None:
    """Move the UGV at one row, with commands that lead there and back."""
    dt = np.diff(frame["t_s"])
    frame.loc[row, f"{UGV}.x_m"] += offset_m
    frame.loc[row, f"{UGV}.vx_m_s"] += offset_m / dt[row - 1]
    frame.loc[row + 1, f"{UGV}.vx_m_s"] -= offset_m / dt[row]


# ------------------------------------------------------------------------------------- files


@tampering
def position_changed_digest_left(folder: Path) -> None:
    edit_table(folder, lambda frame: shift(frame, middle(frame), 1e-3), digest=False)


@tampering
def parquet_truncated(folder: Path) -> None:
    path = folder / "trace" / RUN / "signals.parquet"
    path.write_bytes(path.read_bytes()[:-100])
    seal(folder)


@tampering
def parquet_is_garbage(folder: Path) -> None:
    (folder / "trace" / RUN / "decisions.parquet").write_bytes(b"PAR1 and nothing else")
    seal(folder)


@tampering
def signals_missing(folder: Path) -> None:
    (folder / "trace" / RUN / "signals.parquet").unlink()


@tampering
def problems_missing(folder: Path) -> None:
    (folder / "trace" / RUN / "problems.parquet").unlink()


@tampering
def timings_missing(folder: Path) -> None:
    (folder / "trace" / RUN / "timings.json").unlink()


@tampering
def meta_missing(folder: Path) -> None:
    (folder / "trace" / RUN / "meta.json").unlink()


@tampering
def trace_folder_missing(folder: Path) -> None:
    shutil.rmtree(folder / "trace" / RUN)


@tampering
def trace_folder_added(folder: Path) -> None:
    shutil.copytree(folder / "trace" / RUN, folder / "trace" / "e")


@tampering
def trace_of_another_schema(folder: Path) -> None:
    edit_json(folder / "trace" / RUN / "meta.json", lambda meta: meta.update(schema="airground_drake.trace/1"))


@tampering
def report_truncated(folder: Path) -> None:
    path = folder / "report.json"
    path.write_text(path.read_text()[:-200])


@tampering
def report_of_another_schema(folder: Path) -> None:
    edit_report(folder, lambda report: report.update(schema="airground_drake.report/9"))


@tampering
def report_missing(folder: Path) -> None:
    (folder / "report.json").unlink()


@tampering
def report_with_nan(folder: Path) -> None:
    edit_report(folder, lambda report: verdict(report, "SAFE-TRACE").update(margin=math.nan))


@tampering
def report_is_a_list(folder: Path) -> None:
    edit_report(folder, lambda report: [report])


@tampering
def report_with_a_key_twice(folder: Path) -> None:
    path = folder / "report.json"
    path.write_text(path.read_text().replace('"schema":', '"schema": "airground_drake.report/1", "schema":', 1))


# ------------------------------------------------------------------------------------- signals, digest mended


@tampering
def position_changed(folder: Path) -> None:
    def edit(frame: pd.DataFrame) -> None:
        frame.loc[middle(frame), f"{UGV}.x_m"] += 1e-6

    edit_table(folder, edit)


@tampering
def position_and_commands_changed(folder: Path) -> None:
    edit_table(folder, lambda frame: shift(frame, middle(frame), 1e-4))


@tampering
def position_commands_and_decision_variable_changed(folder: Path) -> None:
    def edit(frame: pd.DataFrame) -> None:
        row = middle(frame)
        shift(frame, row, 1e-3)
        error = [frame[f"{UGV}.ref_{axis}_m"] - frame[f"{UGV}.{axis}_m"] for axis in "xyz"]
        frame[f"{UGV}.decision_variable_m"] = np.linalg.norm(error, axis=0) + frame[f"{UGV}.noise_m"]

    edit_table(folder, edit)


@tampering
def whole_team_moved(folder: Path) -> None:
    def edit(frame: pd.DataFrame) -> None:
        for robot in ("ugv1", "ugv2", "uav"):
            frame[f"{robot}.x_m"] += 0.5

    edit_table(folder, edit)


@tampering
def crash_hidden(folder: Path) -> None:
    def edit(frame: pd.DataFrame) -> None:
        frame[f"{UGV}.x_m"] += 5.0

    edit_table(folder, edit, run="b")


@tampering
def command_changed(folder: Path) -> None:
    def edit(frame: pd.DataFrame) -> None:
        frame.loc[middle(frame), f"{UGV}.vy_m_s"] += 1e-3

    edit_table(folder, edit)


@tampering
def times_stretched(folder: Path) -> None:
    def edit(frame: pd.DataFrame) -> None:
        frame["t_s"] *= 1.0 + 1e-6

    edit_table(folder, edit)


@tampering
def one_time_changed(folder: Path) -> None:
    def edit(frame: pd.DataFrame) -> None:
        frame.loc[middle(frame), "t_s"] += 1e-4

    edit_table(folder, edit)


@tampering
def last_rows_dropped(folder: Path) -> None:
    edit_table(folder, lambda frame: frame.iloc[:-20])


@tampering
def first_rows_dropped(folder: Path) -> None:
    edit_table(folder, lambda frame: frame.iloc[5:])


@tampering
def middle_row_dropped(folder: Path) -> None:
    edit_table(folder, lambda frame: frame.drop(index=middle(frame)))


@tampering
def standing_row_dropped(folder: Path) -> None:
    edit_table(folder, lambda frame: frame.drop(index=len(frame) - 3))


@tampering
def row_duplicated(folder: Path) -> None:
    edit_table(folder, lambda frame: pd.concat([frame.iloc[:50], frame.iloc[49:]]))


@tampering
def rows_in_another_order(folder: Path) -> None:
    edit_table(folder, lambda frame: frame.iloc[[*range(50), 51, 50, *range(52, len(frame))]])


@tampering
def signals_empty(folder: Path) -> None:
    edit_table(folder, lambda frame: frame.iloc[:0])


@tampering
def position_is_nan(folder: Path) -> None:
    def edit(frame: pd.DataFrame) -> None:
        frame.loc[100, "uav.z_m"] = np.nan

    edit_table(folder, edit)


@tampering
def column_missing(folder: Path) -> None:
    edit_table(folder, lambda frame: frame.drop(columns="uav.vz_m_s"))


@tampering
def robots_exchanged(folder: Path) -> None:
    edit_table(folder, lambda frame: frame.rename(columns=lambda name: {"1": "ugv2", "2": "ugv1"}[name[3]] + name[4:]
                                                  if name.startswith("ugv") else name))  # fmt: skip


@tampering
def decision_variable_changed(folder: Path) -> None:
    def edit(frame: pd.DataFrame) -> None:
        frame[f"{UGV}.decision_variable_m"] -= 1e-4

    edit_table(folder, edit)


@tampering
def noise_and_decision_variable_changed(folder: Path) -> None:
    def edit(frame: pd.DataFrame) -> None:
        frame[f"{UGV}.decision_variable_m"] += 0.01
        frame[f"{UGV}.noise_m"] += 0.01

    edit_table(folder, edit)


@tampering
def preset_changed(folder: Path) -> None:
    def edit(frame: pd.DataFrame) -> None:
        frame[f"{UGV}.ref_x_m"] += 0.01

    edit_table(folder, edit)


@tampering
def mode_changed(folder: Path) -> None:
    def edit(frame: pd.DataFrame) -> None:
        frame.loc[middle(frame), f"{UGV}.mode"] = 0.0

    edit_table(folder, edit)


@tampering
def trigger_count_changed(folder: Path) -> None:
    def edit(frame: pd.DataFrame) -> None:
        frame.loc[len(frame) - 1, f"{UGV}.triggers"] += 1.0

    edit_table(folder, edit)


@tampering
def executed_without_acceptance(folder: Path) -> None:
    def edit(frame: pd.DataFrame) -> None:
        frame.loc[50, f"{UGV}.accepted"] = 1.0

    edit_table(folder, edit)


# ------------------------------------------------------------------------------------- decisions and problems


def set_decision(folder: Path, row: int, **values: Any) -> None:
    """Change columns of one decision."""
    edit_table(folder, lambda frame: [frame.__setitem__(name, [*frame[name][:row], value, *frame[name][row + 1 :]])
                                      for name, value in values.items()] and None, "decisions")  # fmt: skip


@tampering
def decision_flipped(folder: Path) -> None:
    set_decision(folder, 0, decision="accept")


@tampering
def decision_and_reason_flipped_with_its_event(folder: Path) -> None:
    set_decision(folder, 0, decision="accept", reason="cheaper")
    set_decision(folder, 1, decision="accept", reason="kept")

    def edit(entry: Any) -> None:
        next(event for event in entry["events"] if event["kind"] == "refuse")["kind"] = "accept"

    edit_both(folder, edit)
    edit_report(folder, lambda report: report["runs"][RUN]["metrics"]["event_counts"][UGV].update(accept=2, refuse=0))


@tampering
def decision_removed(folder: Path) -> None:
    for table in ("decisions", "problems"):
        edit_table(folder, lambda frame: frame.drop(index=10), table)
    edit_json(folder / "trace" / RUN / "timings.json", lambda timings: timings["decision_times_s"].pop(10) and None)


@tampering
def decisions_all_removed(folder: Path) -> None:
    for table in ("decisions", "problems"):
        edit_table(folder, lambda frame: frame.iloc[:0], table)


@tampering
def decisions_on_a_proposal_removed(folder: Path) -> None:
    first = pd.read_parquet(folder / "trace" / RUN / "decisions.parquet")["issued_s"]
    kept = np.flatnonzero(first != first.iloc[0])
    for table in ("decisions", "problems"):
        edit_table(folder, lambda frame: frame.iloc[kept], table)
    edit_json(
        folder / "trace" / RUN / "timings.json", lambda all_: all_["decision_times_s"].__delitem__(slice(0, -len(kept)))
    )
    without_event(folder, "refuse")


@tampering
def decision_on_no_proposal(folder: Path) -> None:
    meta = json.loads((folder / "trace" / RUN / "meta.json").read_text())
    when = next(event["t_s"] for event in meta["events"] if event["kind"] == "refuse")

    def edit(frame: pd.DataFrame) -> None:
        frame.loc[frame["issued_s"] == frame["issued_s"].iloc[0], "issued_s"] = when

    edit_table(folder, edit, "decisions")


@tampering
def messages_all_removed(folder: Path) -> None:
    decisions_all_removed(folder)
    edit_json(folder / "trace" / RUN / "timings.json", lambda timings: timings.update(decision_times_s=[]))
    talk = ("proposal", "accept", "refuse")
    edit_both(folder, lambda entry: entry.update(events=[e for e in entry["events"] if e["kind"] not in talk]))

    def edit(report: Any) -> None:
        for claim in ("GATE-OPT", "GATE-SUR", "GATE-FEAS", "GATE-TIME"):
            verdict(report, claim).update(margin=None)
        verdict(report, "COMM").update(margin=1.0)

    edit_report(folder, edit)


@tampering
def problems_with_labels(folder: Path) -> None:
    path = folder / "trace" / RUN / "problems.parquet"
    pd.read_parquet(path).iloc[::-1].to_parquet(path, index=True)
    seal(folder)


@tampering
def first_stage_is_no_choice(folder: Path) -> None:
    set_decision(folder, 0, first_stage="banana")


@tampering
def bend_is_nan(folder: Path) -> None:
    edit_table(folder, lambda frame: frame.assign(bend=np.nan), "decisions")


@tampering
def losing_choice_made_dear(folder: Path) -> None:
    def edit(frame: pd.DataFrame) -> None:
        lost = frame["first_stage"] == "refuse"
        frame.loc[lost, "objective_accept"] *= 3.0

    edit_table(folder, edit, "decisions")


@tampering
def decision_of_another_robot(folder: Path) -> None:
    set_decision(folder, 20, robot="ugv2")


@tampering
def decision_on_another_policy(folder: Path) -> None:
    set_decision(folder, 20, policy="towards")


@tampering
def decision_by_another_route(folder: Path) -> None:
    set_decision(folder, 20, route="nonlinear")


@tampering
def objective_lowered(folder: Path) -> None:
    edit_table(folder, lambda frame: frame.update(frame[["objective"]] * 0.99), "decisions")


@tampering
def objective_of_refusal_raised(folder: Path) -> None:
    edit_table(folder, lambda frame: frame.update(frame[["objective_refuse"]] * 1.5), "decisions")


@tampering
def lower_bound_raised(folder: Path) -> None:
    edit_table(folder, lambda frame: frame.update(frame[["objective"]].rename(columns={"objective": "lower_bound"})),
               "decisions")  # fmt: skip


@tampering
def gap_hidden(folder: Path) -> None:
    edit_table(folder, lambda frame: frame.update(frame[["gap"]] - 0.01), "decisions")


@tampering
def rounding_error_hidden(folder: Path) -> None:
    edit_table(folder, lambda frame: frame.update(frame[["rounding_deviation_s"]] * 0.9), "decisions")


@tampering
def clearance_raised(folder: Path) -> None:
    edit_table(folder, lambda frame: frame.update(frame[["predicted_clearance_m"]] + 0.01), "decisions")


def edit_arrays(folder: Path, name: str, edit: Callable[[Any], Any]) -> None:
    """Change an array of every problem."""
    edit_table(
        folder, lambda frame: frame.__setitem__(name, [edit(np.array(value)) for value in frame[name]]), "problems"
    )


@tampering
def plans_inverted(folder: Path) -> None:
    edit_arrays(folder, "plan", lambda plan: 1.0 - plan)


@tampering
def predicted_positions_moved(folder: Path) -> None:
    edit_arrays(folder, "positions_m", lambda positions: positions + 1e-3)


@tampering
def relaxed_plan_changed(folder: Path) -> None:
    edit_arrays(folder, "relaxed", lambda relaxed: np.clip(relaxed + 0.1, 0.0, 1.0))


@tampering
def rounded_plan_changed(folder: Path) -> None:
    edit_arrays(folder, "rounded", lambda rounded: np.roll(rounded, 1))


@tampering
def mode_velocities_changed(folder: Path) -> None:
    edit_arrays(folder, "accept_m_s", lambda velocity: 0.9 * velocity)


@tampering
def normals_lengthened(folder: Path) -> None:
    edit_arrays(folder, "normals", lambda normals: 1.01 * normals)


@tampering
def obstacle_of_a_problem_moved(folder: Path) -> None:
    edit_arrays(folder, "centres_m", lambda centres: centres + 0.01)


@tampering
def safe_distance_of_a_problem_lowered(folder: Path) -> None:
    edit_arrays(folder, "distances_m", lambda distances: 0.99 * distances)


@tampering
def slack_weight_of_a_problem_lowered(folder: Path) -> None:
    edit_table(folder, lambda frame: frame.update(frame[["slack_weight_1_m2_s"]] * 0.1), "problems")


@tampering
def problem_with_nan(folder: Path) -> None:
    edit_arrays(folder, "reference_m", lambda reference: reference * np.nan)


@tampering
def decision_times_lowered(folder: Path) -> None:
    def edit(timings: Any) -> None:
        timings["decision_times_s"] = [0.1 * value for value in timings["decision_times_s"]]

    edit_json(folder / "trace" / RUN / "timings.json", edit)


@tampering
def decision_time_removed(folder: Path) -> None:
    edit_json(folder / "trace" / RUN / "timings.json", lambda timings: timings["decision_times_s"].pop() and None)


# ------------------------------------------------------------------------------------- events and runs


@tampering
def traces_exchanged(folder: Path) -> None:
    place = folder / "trace"
    (place / "b").rename(place / "x")
    (place / RUN).rename(place / "b")
    (place / "x").rename(place / RUN)


@tampering
def traces_exchanged_and_renamed(folder: Path) -> None:
    traces_exchanged(folder)
    for name in ("b", RUN):
        edit_json(folder / "trace" / name / "meta.json", lambda meta, name=name: meta.update(run=name, method=name))


@tampering
def crash_replaced_by_a_safe_run(folder: Path) -> None:
    shutil.rmtree(folder / "trace" / "b")
    shutil.copytree(folder / "trace" / RUN, folder / "trace" / "b")
    edit_json(folder / "trace" / "b" / "meta.json", lambda meta: meta.update(run="b", method="b"))


def without_event(folder: Path, kind: str, run: str = RUN) -> None:
    """Remove the first event of a kind from meta.json, and from report.json with its count."""

    def edit(entry: Any) -> None:
        entry["events"].remove(next(event for event in entry["events"] if event["kind"] == kind))

    def count(report: Any) -> None:
        counts = report["runs"][run]["metrics"]["event_counts"][UGV]
        counts[kind] -= 1
        if not counts[kind]:
            del counts[kind]

    edit_both(folder, edit, run)
    edit_report(folder, count)


@tampering
def event_removed_from_the_report(folder: Path) -> None:
    edit_report(folder, lambda report: report["runs"][RUN]["events"].pop(0) and None)


@tampering
def trigger_removed(folder: Path) -> None:
    without_event(folder, "trigger")


@tampering
def proposal_removed(folder: Path) -> None:
    without_event(folder, "proposal")


@tampering
def collision_removed(folder: Path) -> None:
    without_event(folder, "collision", "b")


@tampering
def refusal_removed(folder: Path) -> None:
    without_event(folder, "refuse")


@tampering
def proposal_added(folder: Path) -> None:
    signals = pd.read_parquet(folder / "trace" / RUN / "signals.parquet")
    place = [float(np.interp(1.0, signals["t_s"], signals[f"ugv2.{axis}_m"])) for axis in "xyz"]
    event = {"t_s": 1.0, "robot": "ugv2", "kind": "proposal", "position_m": place, "policy": "detour"}
    edit_both(folder, lambda entry: entry["events"].insert(0, event))
    edit_report(folder, lambda report: report["runs"][RUN]["metrics"]["event_counts"]["ugv2"].update(proposal=1))


@tampering
def trigger_moved(folder: Path) -> None:
    def edit(entry: Any) -> None:
        next(event for event in entry["events"] if event["kind"] == "trigger")["t_s"] -= 1e-3

    edit_both(folder, edit)


@tampering
def trigger_late(folder: Path) -> None:
    when: list[float] = []

    def edit(frame: pd.DataFrame) -> Any:
        row = int(np.flatnonzero(np.diff(frame[f"{UGV}.mode"]) == 1.0)[0])
        when.append(float(frame["t_s"].iloc[row + 1]))
        return frame.drop(index=row)

    edit_table(folder, edit)

    def event(entry: Any) -> None:
        next(event for event in entry["events"] if event["kind"] == "trigger")["t_s"] = when[0]

    edit_both(folder, event)


@tampering
def trigger_of_the_uav(folder: Path) -> None:
    def edit(entry: Any) -> None:
        entry["events"] += [{**entry["events"][0], "kind": "trigger", "robot": "uav", "t_s": t} for t in (24.9, 24.8)]

    edit_both(folder, edit)


@tampering
def threshold_in_force_changed(folder: Path) -> None:
    edit_both(folder, lambda entry: entry.update(zeta_m=2.9))


@tampering
def seed_changed(folder: Path) -> None:
    edit_report(folder, lambda report: report["provenance"].update(seed=7))


# ------------------------------------------------------------------------------------- report.json


@tampering
def verdict_flipped(folder: Path) -> None:
    edit_report(folder, lambda report: verdict(report, "SAFE-TRACE", "b").update(status="holds"))


@tampering
def refutation_hidden_everywhere(folder: Path) -> None:
    def edit(report: Any) -> None:
        for claim in ("SAFE-TRACE", "SAFE-HYP"):
            verdict(report, claim, "b").update(status="holds", expected="holds", counterexample=None)
        report["overall"]["counts"]["holds"] += report["overall"]["counts"].pop("refuted")

    edit_scenario(folder, lambda scenario: scenario["runs"]["b"].update(expected={}))
    edit_report(folder, edit)


@tampering
def refuted_though_it_holds(folder: Path) -> None:
    edit_report(
        folder, lambda report: verdict(report, "SAFE-TRACE").update(status="refuted", counterexample={"t_s": 1.0})
    )


@tampering
def margin_changed(folder: Path) -> None:
    edit_report(folder, lambda report: verdict(report, "LIVE-GOAL").update(margin=0.09))


@tampering
def margin_removed(folder: Path) -> None:
    edit_report(folder, lambda report: verdict(report, "SAFE-TRACE").update(margin=None))


@tampering
def margin_of_the_broken_hypothesis_changed(folder: Path) -> None:
    edit_report(folder, lambda report: verdict(report, "SAFE-HYP", "b").update(margin=-8.0))


@tampering
def time_between_triggers_invented(folder: Path) -> None:
    edit_report(folder, lambda report: verdict(report, "ZENO-TRACE").update(margin=0.5, unit="s"))


@tampering
def margin_of_a_proof_changed(folder: Path) -> None:
    edit_report(folder, lambda report: verdict(report, "SAFE-INV", "").update(margin=2.0))


@tampering
def margin_of_the_gap_changed(folder: Path) -> None:
    edit_report(folder, lambda report: verdict(report, "GATE-OPT").update(margin=0.049))


@tampering
def distance_in_the_evidence_changed(folder: Path) -> None:
    def edit(report: Any) -> None:
        verdict(report, "SAFE-TRACE")["evidence"]["pairs"][3]["min_distance_m"] += 0.1

    edit_report(folder, edit)


@tampering
def time_of_a_minimum_moved(folder: Path) -> None:
    def edit(report: Any) -> None:
        verdict(report, "SAFE-TRACE")["evidence"]["pairs"][3]["t_s"] += 1.0

    edit_report(folder, edit)


@tampering
def counterexample_invented(folder: Path) -> None:
    edit_report(folder, lambda report: verdict(report, "THR-TRIG").update(counterexample={"t_s": 1.0}))


@tampering
def counterexample_removed(folder: Path) -> None:
    edit_report(folder, lambda report: verdict(report, "SAFE-HYP", "b").update(counterexample=None))


@tampering
def obligation_left_open(folder: Path) -> None:
    def edit(report: Any) -> None:
        verdict(report, "SAFE-INV", "")["evidence"]["obligations"][0]["status"] = "inconclusive"

    edit_report(folder, edit)


@tampering
def distance_in_the_metrics_changed(folder: Path) -> None:
    def edit(report: Any) -> None:
        report["runs"]["b"]["metrics"]["min_distance_m"][UGV]["sudden"]["value"] = 2.0

    edit_report(folder, edit)


@tampering
def method_unknown(folder: Path) -> None:
    edit_scenario(folder, lambda scenario: scenario["runs"][RUN].update(method="D"))
    edit_both(folder, lambda entry: entry.update(method="D"))
    gated = ("GATE-OPT", "GATE-SUR", "GATE-FEAS", "GATE-TIME")

    def edit(report: Any) -> None:
        report["claims"] = [c for c in report["claims"] if c["run"] != RUN or c["id"] not in gated]
        report["overall"]["counts"]["holds"] -= len(gated)

    edit_report(folder, edit)


@tampering
def claim_removed(folder: Path) -> None:
    edit_report(folder, lambda report: report["claims"].remove(verdict(report, "SAFE-HYP", "b")))


@tampering
def proof_removed(folder: Path) -> None:
    edit_report(folder, lambda report: report["claims"].remove(verdict(report, "SAFE-INV", "")))


@tampering
def claim_twice(folder: Path) -> None:
    edit_report(folder, lambda report: report["claims"].append(verdict(report, "COMM")))


@tampering
def claim_unknown(folder: Path) -> None:
    edit_report(folder, lambda report: report["claims"].append({**verdict(report, "COMM"), "id": "SAFE-ALL"}))


@tampering
def run_removed(folder: Path) -> None:
    def edit(report: Any) -> None:
        del report["runs"]["b"]
        report["claims"] = [claim for claim in report["claims"] if claim["run"] != "b"]

    edit_report(folder, edit)


@tampering
def run_removed_everywhere_but_in_the_scenario(folder: Path) -> None:
    run_removed(folder)
    shutil.rmtree(folder / "trace" / "b")


@tampering
def expectation_changed(folder: Path) -> None:
    edit_report(folder, lambda report: verdict(report, "SAFE-TRACE", "b").update(expected="holds"))


@tampering
def expectation_flag_changed(folder: Path) -> None:
    edit_report(folder, lambda report: verdict(report, "SAFE-TRACE", "b").update(as_expected=False))


@tampering
def overall_status_changed(folder: Path) -> None:
    edit_report(folder, lambda report: report["overall"].update(status="inconclusive"))


@tampering
def exit_code_changed(folder: Path) -> None:
    edit_report(folder, lambda report: report["overall"].update(exit_code=4))


@tampering
def counts_changed(folder: Path) -> None:
    edit_report(folder, lambda report: report["overall"]["counts"].update(holds=99))


@tampering
def safe_distance_changed_in_the_report(folder: Path) -> None:
    edit_report(folder, lambda report: report["scenario"]["resolved"]["safe_distance"].update(obstacle_m=1.0))


@tampering
def safe_distance_changed_everywhere(folder: Path) -> None:
    edit_scenario(folder, lambda scenario: scenario["safe_distance"].update(obstacle_m=1.5))


@tampering
def gain_changed_everywhere(folder: Path) -> None:
    edit_scenario(folder, lambda scenario: scenario["control"].update(avoidance_gain_1_s=5.0))


@tampering
def gain_changed_everywhere_and_in_the_inputs(folder: Path) -> None:
    gain_changed_everywhere(folder)

    def edit(report: Any) -> None:
        for claim in ("SAFE-INV", "SAFE-GATE", "SAFE-DIST"):
            verdict(report, claim, "")["inputs"]["avoidance_gain_1_s"] = 5.0

    edit_report(folder, edit)


@tampering
def drift_changed_everywhere_and_in_the_inputs(folder: Path) -> None:
    edit_scenario(folder, lambda scenario: scenario["decision"]["threshold"].update(drift_m_s=5.0))

    def edit(report: Any) -> None:
        for claim in ("THR-ROOT", "THR-OPT", "THR-DDM"):
            verdict(report, claim, "")["inputs"]["drift_m_s"] = 5.0

    edit_report(folder, edit)


@tampering
def obstacle_removed_everywhere(folder: Path) -> None:
    edit_scenario(folder, lambda scenario: scenario["obstacles"].pop("sudden") and None)


@tampering
def stall_declared_where_none_was(folder: Path) -> None:
    edit_scenario(folder, lambda scenario: scenario["runs"][RUN].update(stalls_m={UGV: [3.3, 13.0, 0.0]}))


# ------------------------------------------------------------------------------------- certificates


@tampering
def certificate_missing(folder: Path) -> None:
    (folder / "certificates" / "SAFE-INV" / "obligations.json").unlink()


@tampering
def certificate_added(folder: Path) -> None:
    (folder / "certificates" / "SAFE-INV" / "more.json").write_text("{}")


@tampering
def certificate_changed_digest_left(folder: Path) -> None:
    edit_certificate(folder, "SAFE-INV", lambda all_: all_.reverse(), digest=False)


@tampering
def coefficient_changed(folder: Path) -> None:
    def edit(obligations: Any) -> None:
        obligation(obligations, "pair_outside")["certificate"][2]["coefficient"] = "1"

    edit_certificate(folder, "SAFE-INV", edit)


@tampering
def coefficient_negative(folder: Path) -> None:
    def edit(obligations: Any) -> None:
        wrong = obligation(obligations, "outside")
        wrong["goal"] = "d - D - s*r"
        for term in wrong["certificate"]:
            term["coefficient"] = "-1"

    edit_certificate(folder, "SAFE-INV", edit)


@tampering
def coefficient_without_a_sign(folder: Path) -> None:
    def edit(obligations: Any) -> None:
        wrong = obligation(obligations, "outside")
        wrong["goal"] = "h*d"
        wrong.update(multiplier=[], certificate=[{"coefficient": "h*d", "factors": [], "square": "1"}])

    edit_certificate(folder, "SAFE-INV", edit)


@tampering
def multiplier_not_positive(folder: Path) -> None:
    def edit(obligations: Any) -> None:
        wrong = obligation(obligations, "outside")
        wrong.update(multiplier=[{"coefficient": "0", "factors": ["h"], "square": "1"}], certificate=[])

    edit_certificate(folder, "SAFE-INV", edit)


@tampering
def goal_weakened(folder: Path) -> None:
    def edit(obligations: Any) -> None:
        weak = obligation(obligations, "outside")
        weak["goal"] = "D + s*r - d + 1"
        weak["certificate"].append({"coefficient": "1", "factors": ["h"], "square": "1"})

    edit_certificate(folder, "SAFE-INV", edit)


@tampering
def hypothesis_added(folder: Path) -> None:
    def edit(obligations: Any) -> None:
        begged = obligation(obligations, "inside_bound")
        begged["hypotheses"]["begged"] = begged["goal"]
        begged["certificate"] = [{"coefficient": "1", "factors": ["begged"], "square": "1"}]

    edit_certificate(folder, "SAFE-DIST", edit)


@tampering
def equation_added(folder: Path) -> None:
    def edit(obligations: Any) -> None:
        begged = obligation(obligations, "zero_outside")
        begged.update(equations={"begged": "b"}, equation_multipliers={"begged": "-1"}, multiplier=[], certificate=[])

    edit_certificate(folder, "SAFE-GATE", edit)


@tampering
def number_in_a_certificate_changed(folder: Path) -> None:
    def edit(obligations: Any) -> Any:
        return json.loads(json.dumps(obligations).replace("1/20", "1/40"))

    edit_certificate(folder, "SAFE-INV", edit)


@tampering
def name_twice(folder: Path) -> None:
    def edit(obligations: Any) -> None:
        false = {**obligation(obligations, "outside"), "goal": "-1000", "hypotheses": {}, "strict": {}}
        obligations.insert(0, false | {"multiplier": [], "certificate": []})

    edit_certificate(folder, "SAFE-INV", edit)


@tampering
def hypotheses_made_strict(folder: Path) -> None:
    def edit(obligations: Any) -> None:
        for one in obligations:
            one["strict"], one["hypotheses"] = {**one["hypotheses"], **one["strict"]}, {}

    edit_certificate(folder, "SAFE-LEMMA", edit)


@tampering
def invariant_of_the_automaton_not_shown(folder: Path) -> None:
    def edit(obligations: Any) -> Any:
        return [one for one in obligations if one["name"].endswith("_claim")]

    edit_certificate(folder, "ZENO-PROOF", edit)


@tampering
def only_half_of_the_claim_shown(folder: Path) -> None:
    def edit(obligations: Any) -> Any:
        return [one for one in obligations if one["name"].endswith("_bound")]

    edit_certificate(folder, "SAFE-DIST", edit)


@tampering
def key_obligation_removed(folder: Path) -> None:
    edit_certificate(folder, "SAFE-INV", lambda all_: all_.remove(obligation(all_, "pair_inside")))


@tampering
def obligations_all_removed(folder: Path) -> None:
    edit_certificate(folder, "ZENO-PROOF", lambda all_: all_.clear())


@tampering
def code_in_a_certificate(folder: Path) -> None:
    def edit(obligations: Any) -> None:
        obligations[0]["goal"] = "__import__('os').getcwd()"

    edit_certificate(folder, "SAFE-LEMMA", edit)


@tampering
def dwell_of_the_proof_changed(folder: Path) -> None:
    def edit(obligations: Any) -> None:
        obligation(obligations, "dwell_is_the_bound")["equations"].update(dwell="dwell - 1/4", bound="bound - 1/4")

    edit_certificate(folder, "ZENO-PROOF", edit)


@tampering
def disagreement_of_the_running_code_recorded(folder: Path) -> None:
    edit_report(folder, lambda report: verdict(report, "SAFE-INV", "")["evidence"]["conformance"].update(agrees=False))


@tampering
def interventions_put_on_top(folder: Path) -> None:
    edit_report(
        folder, lambda report: verdict(report, "SAFE-GATE", "")["inputs"]["method_d"].update(intervention_on_top=True)
    )


@tampering
def enclosure_moved(folder: Path) -> None:
    def edit(statements: Any) -> None:
        ends = statements["enclosures"]["u"]
        statements["enclosures"]["u"] = [ends[1], str(Fraction(ends[1]) * (1 + Fraction(1, 10**13)))]

    edit_certificate(folder, "THR-ROOT", edit, "statements.json")


@tampering
def enclosure_widened(folder: Path) -> None:
    edit_certificate(folder, "THR-ROOT", lambda all_: all_["enclosures"].update(u=["1/10", "1"]), "statements.json")


@tampering
def printed_root_missing(folder: Path) -> None:
    edit_certificate(folder, "THR-OPT", lambda all_: all_["enclosures"].pop("printed_u") and None, "statements.json")


@tampering
def printed_root_moved(folder: Path) -> None:
    def edit(statements: Any) -> None:
        statements["enclosures"]["printed_u"] = statements["enclosures"]["u"]

    edit_certificate(folder, "THR-OPT", edit, "statements.json")


@tampering
def constants_of_the_root_changed(folder: Path) -> None:
    edit_certificate(folder, "THR-ROOT", lambda all_: all_["constants"].update(r="3"), "statements.json")


@tampering
def sign_turned(folder: Path) -> None:
    def edit(statements: Any) -> None:
        next(one for one in statements["statements"] if one["name"] == "printed_risk")["sign"] = "<"

    edit_certificate(folder, "THR-OPT", edit, "statements.json")


@tampering
def running_threshold_changed(folder: Path) -> None:
    edit_report(folder, lambda report: verdict(report, "THR-ROOT", "")["evidence"].update(running_threshold_m=2.9))


def edit_paths(folder: Path, edit: Callable[[Any], Any]) -> None:
    """Change the first row of THR-DDM's counts in evidence and certificate."""
    edit_report(folder, lambda report: edit(verdict(report, "THR-DDM", "")["evidence"]["comparisons"]))
    edit_certificate(folder, "THR-DDM", lambda paths: edit(paths["comparisons"]), "paths.json")


@tampering
def counts_of_paths_changed(folder: Path) -> None:
    edit_paths(folder, lambda rows: [row.update(wrong_decisions=row["wrong_decisions"] + 50) for row in rows] and None)


@tampering
def experiments_removed(folder: Path) -> None:
    edit_certificate(folder, "THR-DDM", lambda paths: paths.update(comparisons=paths["comparisons"][:1]), "paths.json")


@tampering
def interval_widened(folder: Path) -> None:
    edit_paths(folder, lambda rows: rows[0].update(interval=[0.0, 1.0]))


@tampering
def formula_fitted(folder: Path) -> None:
    edit_paths(folder, lambda rows: rows[1].update(formula=rows[1]["estimate"]))


@tampering
def number_for_ever(folder: Path) -> None:
    edit_certificate(folder, "SAFE-LEMMA", lambda all_: all_[0]["certificate"][0].update(coefficient="1e999999999"))


@tampering
def power_for_ever(folder: Path) -> None:
    power = "(" * 9 + "9" + "**12)" * 9
    edit_certificate(folder, "SAFE-LEMMA", lambda all_: all_[0].update(goal=power))


def edit_counts(folder: Path, edit: Callable[[pd.DataFrame], Any]) -> None:
    """Change the trigger counts of ZENO-REFINE, with their digest."""
    path = folder / "certificates" / "ZENO-REFINE" / "counts.csv"
    frame = pd.read_csv(path)
    changed = edit(frame)
    (frame if changed is None else changed).to_csv(path, index=False)
    right = hashlib.sha256(path.read_bytes()).hexdigest()
    edit_report(folder, lambda report: verdict(report, "ZENO-REFINE", "")["certificates"].update({"counts.csv": right}))


@tampering
def counts_of_triggers_lowered(folder: Path) -> None:
    edit_counts(folder, lambda frame: frame.update(frame[["automaton"]].clip(upper=1)))


@tampering
def counts_of_triggers_raised_with_another_dwell(folder: Path) -> None:
    edit_counts(folder, lambda frame: frame.update(frame[["automaton"]] * 1000))
    edit_report(folder, lambda report: verdict(report, "ZENO-REFINE", "")["inputs"].update(dwell_s=1e-6))


@tampering
def counts_of_a_path_missing(folder: Path) -> None:
    edit_counts(folder, lambda frame: frame[frame["path"] > 0])


@tampering
def interval_of_the_exponent_moved(folder: Path) -> None:
    def edit(report: Any) -> None:
        fit = verdict(report, "ZENO-REFINE", "")["evidence"]["fit"]["automaton"]
        fit["interval"] = [-0.001, 0.001]

    edit_report(folder, edit)


@tampering
def theory_of_the_bare_count_changed(folder: Path) -> None:
    def edit(report: Any) -> None:
        verdict(report, "ZENO-REFINE", "")["evidence"]["expected_bare"][-1] *= 1.1

    edit_report(folder, edit)


BEYOND = {
    name: TAMPERINGS.pop(name)
    for name in (
        "report_with_a_key_twice",
        "preset_changed",
        "trigger_count_changed",
        "refusal_removed",
        "clearance_raised",
        "collision_removed",
        "seed_changed",
        "distance_in_the_evidence_changed",
        "time_of_a_minimum_moved",
        "obligation_left_open",
        "distance_in_the_metrics_changed",
        "dwell_of_the_proof_changed",
        "disagreement_of_the_running_code_recorded",
        "interventions_put_on_top",
        "constants_of_the_root_changed",
        "sign_turned",
        "running_threshold_changed",
        "interval_widened",
        "formula_fitted",
        "counts_of_triggers_lowered",
        "interval_of_the_exponent_moved",
        "theory_of_the_bare_count_changed",
    )
}
"""Edits that change no verdict: of evidence, metrics, recorded comparisons. The checker, being short, ignores them."""


def attempt(report: Path, name: str) -> tuple[int, list[str]]:
    """Exit code and the lines that are no agreement, of a tampered copy of a report."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "report"
        shutil.copytree(report, folder)
        TAMPERINGS[name](folder)
        said = io.StringIO()
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            code = check.main([str(folder)])
    return code, [line for line in said.getvalue().splitlines() if " agrees: " not in line and " checks: " not in line]


def main() -> int:
    """Print what notices each tampering; 0 if all are noticed."""
    report, missed = Path(sys.argv[1]), 0
    for name in TAMPERINGS:
        code, lines = attempt(report, name)
        missed += not code
        print(f"{name:<52} {len(lines):>2}  {' '.join(lines[0])[:150] if lines else 'NOTHING'}")
    print(f"{len(TAMPERINGS)} tamperings, {missed} not noticed; not looked at: {', '.join(BEYOND)}")
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main())
