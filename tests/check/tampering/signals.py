"""Tampering with the signals of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from check.tampering.base import UGV, edited_entries, edited_table, middle, read_table, tampering, write_table


def moved(frame: pd.DataFrame, robot: str, row: int, by_m: float) -> None:
    """Put a robot elsewhere at one row, with commands that lead there and back."""
    dt = np.diff(frame["t_s"])
    frame.loc[row, f"{robot}.x_m"] += by_m
    frame.loc[row, f"{robot}.vx_m_s"] += by_m / dt[row - 1]
    frame.loc[row + 1, f"{robot}.vx_m_s"] -= by_m / dt[row]


@tampering()
def position_changed(folder: Path) -> None:
    with edited_table(folder) as frame:
        frame.loc[middle(frame), f"{UGV}.x_m"] += 1e-6


@tampering()
def position_commands_and_decision_variable_changed(folder: Path) -> None:
    with edited_table(folder) as frame:
        moved(frame, UGV, middle(frame), 1e-3)
        error = [frame[f"{UGV}.ref_{axis}_m"] - frame[f"{UGV}.{axis}_m"] for axis in "xyz"]
        frame[f"{UGV}.decision_variable_m"] = np.linalg.norm(error, axis=0) + frame[f"{UGV}.noise_m"]


@tampering()
def crash_hidden(folder: Path) -> None:
    with edited_table(folder, run="b") as frame:
        frame[f"{UGV}.x_m"] += 5.0


@tampering()
def faster_than_the_limit(folder: Path) -> None:
    """The UAV jumps by 1 m and back, by commands that lead there."""
    with edited_table(folder) as frame:
        moved(frame, "uav", middle(frame), 1.0)


@tampering()
def last_rows_dropped(folder: Path) -> None:
    write_table(folder, read_table(folder).iloc[:-20])


@tampering()
def first_rows_dropped(folder: Path) -> None:
    write_table(folder, read_table(folder).iloc[5:])


@tampering()
def position_is_nan(folder: Path) -> None:
    with edited_table(folder) as frame:
        frame.loc[100, "uav.z_m"] = np.nan


@tampering()
def robots_exchanged(folder: Path) -> None:
    other = {"ugv1": "ugv2", "ugv2": "ugv1"}
    frame = read_table(folder)
    names = {name: f"{other.get(name[:4], name[:4])}{name[4:]}" for name in frame if name.startswith("ugv")}
    write_table(folder, frame.rename(columns=names))


@tampering()
def decision_variable_changed(folder: Path) -> None:
    with edited_table(folder) as frame:
        frame[f"{UGV}.decision_variable_m"] -= 1e-4


@tampering()
def noise_from_elsewhere(folder: Path) -> None:
    with edited_table(folder) as frame:
        for column in ("decision_variable_m", "noise_m"):
            frame[f"{UGV}.{column}"] += 1e-7


@tampering()
def trigger_late(folder: Path) -> None:
    """The row of the trigger is left out, and the event put to the next one."""
    frame = read_table(folder)
    row = int(np.flatnonzero(np.diff(frame[f"{UGV}.mode"]) == 1.0)[0])
    late = float(frame["t_s"].iloc[row + 1])
    triggered = f"{UGV}.triggered_at_s"
    frame.loc[frame[triggered] >= 0.0, triggered] = late
    write_table(folder, frame.drop(index=row))
    with edited_entries(folder) as entries:
        for entry in entries:
            trigger = next(event for event in entry["events"] if event["kind"] == "trigger")
            trigger["t_s"] = late


@tampering()
def uav_flies_otherwise(folder: Path) -> None:
    with edited_table(folder) as frame:
        moved(frame, "uav", 100, 1e-4)


@tampering()
def intervention_said_to_be_over_early(folder: Path) -> None:
    with edited_table(folder) as frame:
        frame.loc[middle(frame) :, f"{UGV}.accepted"] = 0.0
