"""Tampering with decisions of the gatekeeper and their problems."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from check.tampering import base
from check.tampering.base import UGV, edited_report, tampering
from check.tampering.events import first
from check.tampering.events import without_event as without_event_of

RUN = "c"
"""The run whose decisions are by problem (26)."""
claim_of = partial(base.claim_of, run=RUN)
edited_entries = partial(base.edited_entries, run=RUN)
edited_table = partial(base.edited_table, run=RUN)
edited_timings = partial(base.edited_timings, run=RUN)
read_table = partial(base.read_table, run=RUN)
write_table = partial(base.write_table, run=RUN)
without_event = partial(without_event_of, run=RUN)


def keep_decisions(folder: Path, kept: list[int]) -> None:
    """Keep some decisions, with their problems and times."""
    for table in ("decisions", "problems"):
        write_table(folder, read_table(folder, table).iloc[kept], table)
    with edited_timings(folder) as timings:
        timings["decision_times_s"] = [timings["decision_times_s"][row] for row in kept]


@tampering()
def decisions_in_another_order(folder: Path) -> None:
    rows = len(read_table(folder, "decisions"))
    keep_decisions(folder, [1, 0, *range(2, rows)])


@tampering()
def decision_and_reason_flipped_with_its_event(folder: Path) -> None:
    with edited_table(folder, "decisions") as frame:
        frame.loc[0, ["decision", "reason"]] = "accept", "cheaper"
        frame.loc[1, ["decision", "reason"]] = "accept", "kept"
    with edited_entries(folder) as entries:
        for entry in entries:
            first(entry, "refuse")["kind"] = "accept"
        counts = entries[0]["metrics"]["event_counts"][UGV]
        counts.update(accept=2, refuse=0)


@tampering()
def decisions_all_removed(folder: Path) -> None:
    for table in ("decisions", "problems"):
        write_table(folder, read_table(folder, table).iloc[:0], table)


@tampering()
def decisions_on_a_proposal_removed(folder: Path) -> None:
    issued = read_table(folder, "decisions")["issued_s"]
    keep_decisions(folder, np.flatnonzero(issued != issued.iloc[0]).tolist())
    without_event(folder, "refuse")


@tampering()
def messages_all_removed(folder: Path) -> None:
    keep_decisions(folder, [])
    with edited_entries(folder) as entries:
        for entry in entries:
            entry["events"] = [e for e in entry["events"] if e["kind"] not in ("proposal", "accept", "refuse")]
    with edited_report(folder) as report:
        for claim in ("GATE-OPT", "GATE-FEAS"):
            claim_of(report, claim)["margin"] = None
        claim_of(report, "COMM")["margin"] = 1.0


@tampering()
def lower_bound_lowered_with_its_gap(folder: Path) -> None:
    """A bound that is far from the best one, with the gap that follows from it."""
    with edited_table(folder, "decisions") as frame:
        frame["route_bound"] *= 0.98
        frame["gap"] = 1.0 - frame["route_bound"] / frame["objective"]


@tampering()
def relaxation_invented(folder: Path) -> None:
    with edited_table(folder, "problems") as frame:
        for name in ("relaxed", "rounded"):
            frame[name] = [np.ones(60)] * len(frame)


@tampering()
def mode_velocities_of_another_vehicle(folder: Path) -> None:
    """Refusing is predicted at twice the speed limit, in every plan that never refuses."""
    with edited_table(folder, "problems") as frame:
        never = [bool((np.array(plan) == 1.0).all()) for plan in frame["plan"]]
        assert any(never)
        frame["refuse_m_s"] = [
            np.full_like(velocity, 12.0) if alone else velocity
            for velocity, alone in zip(frame["refuse_m_s"], never, strict=True)
        ]
    with edited_table(folder, "decisions") as frame:
        for row in np.flatnonzero(never):
            problem = read_table(folder, "problems").iloc[row]
            path = problem["initial_m"] + problem["dt_s"] * np.cumsum(np.full((60, 3), 12.0), axis=0)
            frame.loc[row, "refuse_throughout"] = cost(problem, path)


def cost(problem: Any, path: Any) -> float:
    """(25) of positions (N, 3), m."""
    error = ((path - np.reshape(problem["reference_m"], (-1, 3))) ** 2).sum()
    centres = np.reshape(problem["centres_m"], (len(path), -1, 3))
    reach = np.linalg.norm(path[:, None] - centres, axis=2) - problem["distances_m"]
    slack = np.minimum(0.0, reach.min(axis=1, initial=0.0))
    weights = problem["error_weight_1_m2_s"], problem["slack_weight_1_m2_s"]
    return float(problem["dt_s"] * (weights[0] * error + weights[1] * (slack**2).sum()))


@tampering()
def obstacles_left_out_of_a_problem(folder: Path) -> None:
    with edited_table(folder, "problems") as frame:
        for name in ("centres_m", "normals", "distances_m"):
            frame[name] = [np.empty(0)] * len(frame)


@tampering()
def decision_times_lowered(folder: Path) -> None:
    with edited_timings(folder) as timings:
        timings["decision_times_s"] = [0.1 * value for value in timings["decision_times_s"]]


@tampering()
def decisions_on_a_proposal_that_is_not_in_the_table(folder: Path) -> None:
    write_table(folder, read_table(folder, "proposals").iloc[1:], "proposals")


@tampering()
def executed_directions_fewer(folder: Path) -> None:
    with base.edited_table(folder, "proposals") as frame:
        frame["selection"] = [value[:3] for value in frame["selection"]]
