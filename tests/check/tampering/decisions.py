"""Tampering with decisions of the gatekeeper and their problems."""

from __future__ import annotations

from collections.abc import Callable
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


def set_decision(folder: Path, row: int, **values: Any) -> None:
    """Change columns of one decision."""
    with edited_table(folder, "decisions") as frame:
        for name, value in values.items():
            frame.loc[row, name] = value


def scale_decisions(folder: Path, column: str, factor: float) -> None:
    """Multiply a column of all decisions."""
    with edited_table(folder, "decisions") as frame:
        frame[column] *= factor


def edit_arrays(folder: Path, name: str, edit: Callable[[Any], Any]) -> None:
    """Change an array of every problem."""
    with edited_table(folder, "problems") as frame:
        frame[name] = [edit(np.array(value)) for value in frame[name]]


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
def decision_flipped(folder: Path) -> None:
    set_decision(folder, 0, decision="accept")


@tampering()
def decision_and_reason_flipped_with_its_event(folder: Path) -> None:
    set_decision(folder, 0, decision="accept", reason="cheaper")
    set_decision(folder, 1, decision="accept", reason="kept")
    with edited_entries(folder) as entries:
        for entry in entries:
            first(entry, "refuse")["kind"] = "accept"
        counts = entries[0]["metrics"]["event_counts"][UGV]
        counts.update(accept=2, refuse=0)


@tampering()
def decision_removed(folder: Path) -> None:
    keep_decisions(folder, [row for row in range(len(read_table(folder, "decisions"))) if row != 10])


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
def decision_on_no_proposal(folder: Path) -> None:
    with edited_table(folder, "decisions") as frame:
        issued = frame["issued_s"].iloc[0]
        frame.loc[frame["issued_s"] == issued, "issued_s"] = issued + 0.05


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
def first_stage_is_no_choice(folder: Path) -> None:
    set_decision(folder, 0, first_stage="banana")


@tampering()
def gap_is_nan(folder: Path) -> None:
    with edited_table(folder, "decisions") as frame:
        frame["gap"] = np.nan


@tampering()
def losing_choice_made_dear(folder: Path) -> None:
    with edited_table(folder, "decisions") as frame:
        frame.loc[frame["first_stage"] == "refuse", "objective_accept"] *= 3.0


@tampering()
def decision_of_another_robot(folder: Path) -> None:
    set_decision(folder, 20, robot="ugv2")


@tampering()
def decision_on_another_policy(folder: Path) -> None:
    set_decision(folder, 20, policy="towards")


@tampering()
def decision_by_another_route(folder: Path) -> None:
    set_decision(folder, 20, route="nonlinear")


@tampering()
def objective_lowered(folder: Path) -> None:
    scale_decisions(folder, "objective", 0.99)


@tampering()
def objective_of_refusal_raised(folder: Path) -> None:
    scale_decisions(folder, "objective_refuse", 1.5)


@tampering()
def cost_of_accepting_throughout_raised(folder: Path) -> None:
    scale_decisions(folder, "accept_throughout", 1.01)


@tampering()
def lower_bound_raised(folder: Path) -> None:
    with edited_table(folder, "decisions") as frame:
        frame["route_bound"] *= 1.001


@tampering()
def lower_bound_lowered_with_its_gap(folder: Path) -> None:
    """A bound that is far from the best one, with the gap that follows from it."""
    with edited_table(folder, "decisions") as frame:
        frame["route_bound"] *= 0.98
        frame["gap"] = 1.0 - frame["route_bound"] / frame["objective"]


@tampering()
def gap_hidden(folder: Path) -> None:
    with edited_table(folder, "decisions") as frame:
        frame["gap"] -= 0.01


@tampering()
def gap_exaggerated(folder: Path) -> None:
    with edited_table(folder, "decisions") as frame:
        frame["gap"] += 0.01


@tampering()
def rounding_error_hidden(folder: Path) -> None:
    scale_decisions(folder, "rounding_deviation_s", 0.9)


@tampering()
def relaxed_first_stage_changed(folder: Path) -> None:
    with edited_table(folder, "decisions") as frame:
        frame["relaxed_first_stage"] = 1.0 - frame["relaxed_first_stage"]


@tampering()
def clearance_raised(folder: Path) -> None:
    with edited_table(folder, "decisions") as frame:
        frame["predicted_clearance_m"] += 0.01


@tampering()
def plans_inverted(folder: Path) -> None:
    edit_arrays(folder, "plan", lambda plan: 1.0 - plan)


@tampering()
def predicted_positions_moved(folder: Path) -> None:
    edit_arrays(folder, "positions_m", lambda positions: positions + 1e-3)


@tampering()
def relaxation_invented(folder: Path) -> None:
    for name in ("relaxed", "rounded"):
        edit_arrays(folder, name, lambda omega: np.ones(60))


@tampering()
def mode_velocities_changed(folder: Path) -> None:
    edit_arrays(folder, "accept_m_s", lambda velocity: 0.9 * velocity)


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
def normals_lengthened(folder: Path) -> None:
    edit_arrays(folder, "normals", lambda normals: 1.01 * normals)


@tampering()
def obstacle_of_a_problem_moved(folder: Path) -> None:
    edit_arrays(folder, "centres_m", lambda centres: centres + 0.01)


@tampering()
def safe_distance_of_a_problem_lowered(folder: Path) -> None:
    edit_arrays(folder, "distances_m", lambda distances: 0.99 * distances)


@tampering()
def obstacles_left_out_of_a_problem(folder: Path) -> None:
    for name in ("centres_m", "normals", "distances_m"):
        edit_arrays(folder, name, lambda values: values[:0])


@tampering()
def slack_weight_of_a_problem_lowered(folder: Path) -> None:
    with edited_table(folder, "problems") as frame:
        frame["slack_weight_1_m2_s"] *= 0.1


@tampering()
def terminal_cost_added_to_a_problem(folder: Path) -> None:
    with edited_table(folder, "problems") as frame:
        frame["terminal_weight_s"] += 0.25


@tampering()
def stages_shortened(folder: Path) -> None:
    with edited_table(folder, "problems") as frame:
        frame["dt_s"] *= 0.9


@tampering()
def reference_of_a_problem_moved(folder: Path) -> None:
    edit_arrays(folder, "reference_m", lambda reference: reference + 0.01)


@tampering()
def problem_with_nan(folder: Path) -> None:
    edit_arrays(folder, "reference_m", lambda reference: reference * np.nan)


@tampering()
def positions_of_a_plan_missing(folder: Path) -> None:
    edit_arrays(folder, "positions_m", lambda positions: positions[:30])


@tampering()
def decision_times_lowered(folder: Path) -> None:
    with edited_timings(folder) as timings:
        timings["decision_times_s"] = [0.1 * value for value in timings["decision_times_s"]]


@tampering()
def decision_time_removed(folder: Path) -> None:
    with edited_timings(folder) as timings:
        del timings["decision_times_s"][-1]


@tampering()
def decision_before_it_began(folder: Path) -> None:
    with edited_timings(folder) as timings:
        timings["decision_times_s"][0] = -1.0
