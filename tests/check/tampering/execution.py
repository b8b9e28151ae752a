"""Tampering with what was executed, and with the predictions that decisions rest on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from check.tampering.base import (
    UGV,
    edited_claim,
    edited_json,
    edited_table,
    middle,
    read_table,
    tampering,
    trace,
    write_table,
)


def edit_proposals(folder: Path, name: str, edit: Callable[[Any], Any]) -> None:
    """Change an array of every proposal."""
    with edited_table(folder, "proposals") as frame:
        frame[name] = [edit(np.array(value)) for value in frame[name]]


def moved(frame: pd.DataFrame, robot: str, row: int, by_m: float) -> None:
    """Put a robot elsewhere at one row, with commands that lead there and back."""
    dt = np.diff(frame["t_s"])
    frame.loc[row, f"{robot}.x_m"] += by_m
    frame.loc[row, f"{robot}.vx_m_s"] += by_m / dt[row - 1]
    frame.loc[row + 1, f"{robot}.vx_m_s"] -= by_m / dt[row]


@tampering()
def uav_flies_otherwise(folder: Path) -> None:
    with edited_table(folder) as frame:
        moved(frame, "uav", 100, 1e-4)


@tampering()
def executed_motion_moved(folder: Path) -> None:
    edit_proposals(folder, "positions_m", lambda value: value + 1e-4)


@tampering()
def executed_motion_delayed(folder: Path) -> None:
    edit_proposals(folder, "times_s", lambda value: value + 1e-3)


@tampering()
def executed_directions_fewer(folder: Path) -> None:
    edit_proposals(folder, "selection", lambda value: value[:3])


@tampering()
def executed_motion_is_nan(folder: Path) -> None:
    edit_proposals(folder, "positions_m", lambda value: value * np.nan)


@tampering()
def executed_motion_cut(folder: Path) -> None:
    edit_proposals(folder, "positions_m", lambda value: value[:-1])


@tampering()
def executed_motion_backwards(folder: Path) -> None:
    edit_proposals(folder, "times_s", lambda value: value[::-1])


@tampering()
def proposal_to_nobody(folder: Path) -> None:
    with edited_table(folder, "proposals") as frame:
        frame["robot"] = "ugv9"


@tampering()
def proposal_for_nobody(folder: Path) -> None:
    with edited_table(folder, "proposals") as frame:
        frame["cause"] = "ugv9"


@tampering()
def proposal_for_another_ugv(folder: Path) -> None:
    with edited_table(folder, "proposals") as frame:
        frame["cause"] = [next(ugv for ugv in ("ugv1", "ugv2") if ugv != robot) for robot in frame["robot"]]


@tampering()
def proposals_table_emptied(folder: Path) -> None:
    write_table(folder, read_table(folder, "proposals").iloc[:0], "proposals")


@tampering()
def proposal_missing_from_the_table(folder: Path) -> None:
    write_table(folder, read_table(folder, "proposals").iloc[1:], "proposals")


@tampering()
def intervention_said_to_be_over_early(folder: Path) -> None:
    with edited_table(folder) as frame:
        frame.loc[middle(frame) :, f"{UGV}.accepted"] = 0.0


@tampering()
def execution_said_to_be_refuted(folder: Path) -> None:
    with edited_claim(folder, "EXEC") as claim:
        claim.update(status="refuted", as_expected=False, counterexample={"robot": UGV}, margin=-1.0)


@tampering()
def last_predicted_velocity_changed(folder: Path) -> None:
    with edited_table(folder, "problems", "c") as frame:
        frame["accept_m_s"] = [np.append(np.array(v)[:-3], np.array(v)[-3:] + 1e-5) for v in frame["accept_m_s"]]


@tampering()
def own_way_predicted_slower(folder: Path) -> None:
    with edited_table(folder, "problems", "c") as frame:
        frame["refuse_m_s"] = [0.99 * np.array(value) for value in frame["refuse_m_s"]]


@tampering()
def decisions_on_a_proposal_that_is_not_in_the_table(folder: Path) -> None:
    write_table(folder, read_table(folder, "proposals", "c").iloc[1:], "proposals", "c")


@tampering()
def proposals_missing(folder: Path) -> None:
    (trace(folder) / "proposals.parquet").unlink()


@tampering()
def digest_of_the_proposals_removed(folder: Path) -> None:
    with edited_json(trace(folder) / "meta.json") as meta:
        del meta["files"]["proposals.parquet"]
