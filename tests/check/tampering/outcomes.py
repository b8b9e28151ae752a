"""Tampering with what method (d) foresaw, with what it watched, and with the map in a message."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from check.tampering import base
from check.tampering.base import edited_entries, edited_table, tampering


def change(folder: Path, where: Callable[[pd.DataFrame], Any], **values: Any) -> None:
    """Change columns of the first decision for which something holds."""
    with edited_table(folder, "decisions") as frame:
        row = frame.index[np.flatnonzero(where(frame))[0]]
        for name, value in values.items():
            frame.loc[row, name] = value(frame.loc[row, name]) if callable(value) else value


def first_accepted(frame: pd.DataFrame) -> Any:
    return frame["reason"] == "cheaper"


def first_refused(frame: pd.DataFrame) -> Any:
    return frame["reason"] == "stalls"


@tampering()
def map_in_a_message_exchanged(folder: Path) -> None:
    with edited_table(folder, "proposals") as frame:
        walls = [3.3, 9.5, 0.0, 5.0, 9.0, 0.0, 6.5, 7.5, 0.0]
        frame["mapped_m"] = [np.array(walls) for _ in range(len(frame))]
        frame["mapped_radius_m"] = [np.zeros(3) for _ in range(len(frame))]


@tampering()
def large_obstacle_added_to_a_message(folder: Path) -> None:
    """Where a point would be out of the way."""
    with edited_table(folder, "proposals") as frame:
        frame["mapped_m"] = [np.append(points, [9.5, 9.0, 0.0]) for points in frame["mapped_m"]]
        frame["mapped_radius_m"] = [np.append(radii, 5.0) for radii in frame["mapped_radius_m"]]


@tampering()
def favour_to_itself(folder: Path) -> None:
    """Accepted although of no use, to make way for the very UGV that is asked."""
    change(folder, first_refused, decision="accept", reason="makes_way", accept_stalls=0.0)


@tampering()
def obstacle_known_before_it_was_told(folder: Path) -> None:
    with edited_table(folder, "proposals") as frame:
        for name in ("mapped_m", "mapped_radius_m"):
            frame[name] = [frame[name].iloc[-1]] * len(frame)


@tampering()
def obstacle_forgotten(folder: Path) -> None:
    with edited_table(folder, "proposals") as frame:
        for name in ("mapped_m", "mapped_radius_m"):
            frame[name] = [frame[name].iloc[0]] * len(frame)


@tampering()
def decision_on_what_was_taken_back(folder: Path) -> None:
    change(folder, first_refused, t_s=lambda value: value + 1.0)
    base.write_table(folder, base.read_table(folder, "decisions").sort_values("t_s", kind="stable"), "decisions")


@tampering()
def proposal_replaced_while_in_force(folder: Path) -> None:
    with edited_table(folder, "proposals") as proposals, edited_table(folder, "decisions") as decisions:
        issued_s, replaced_s = decisions.loc[first_accepted(decisions), ["issued_s", "t_s"]].iloc[0]
        decisions.loc[(decisions["issued_s"] == issued_s) & (decisions["t_s"] > replaced_s), "issued_s"] = replaced_s
        again = proposals[proposals["issued_s"] == issued_s].assign(issued_s=replaced_s)
        both = pd.concat([proposals, again]).sort_values("issued_s", ignore_index=True)
    base.write_table(folder, both, "proposals")
    with edited_entries(folder) as entries:
        for entry in entries:
            sent = next(e for e in entry["events"] if e["kind"] == "proposal" and e["t_s"] == issued_s)
            entry["events"] = sorted([*entry["events"], {**sent, "t_s": replaced_s}], key=lambda event: event["t_s"])


@tampering()
def outcome_invented_where_none_was_weighed(folder: Path) -> None:
    change(folder, lambda frame: frame["reason"] == "kept", accept_outcome_m2_s=5.0)


@tampering()
def solver_invented_for_outcomes(folder: Path) -> None:
    change(folder, lambda frame: frame["reason"] == "kept", status="optimal", route="mixed_integer")
