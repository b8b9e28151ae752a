"""Edits of one recorded decision, given as its columns and its problem."""

from __future__ import annotations

from typing import Any

import numpy as np
from builders.decisions import ALL_PLANS, STAGE_S, STAGES, TERMINAL_S
from builders.edits import DecisionEdit

from airground_drake.base.arrays import Array


def task_error(problem: dict[str, Any], positions: Array, terminal_s: float = TERMINAL_S) -> float:
    """The task error's part of (25) through positions (N, 3), m, and the terminal cost."""
    error = (positions.ravel() - problem["reference_m"]) ** 2
    return float(STAGE_S * error.sum() + terminal_s * error[-3:].sum())


def fractional_plan(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["plan"][3] = 0.5


def inflate_loser(row: dict[str, Any], problem: dict[str, Any]) -> None:
    other = {"accept": "refuse", "refuse": "accept"}[row["first_stage"]]
    row[f"objective_{other}"] *= 10.0


def wrong_first_stage(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["first_stage"] = {"accept": "refuse", "refuse": "accept"}[row["first_stage"]]


def without_point(index: int) -> DecisionEdit:
    def edit(row: dict[str, Any], problem: dict[str, Any]) -> None:
        keep = 1 - index
        problem["centres_m"] = problem["centres_m"].reshape(STAGES, 2, 3)[:, keep : keep + 1].ravel()
        problem["normals"] = problem["normals"].reshape(STAGES, 2, 3)[:, keep : keep + 1].ravel()
        problem["distances_m"] = problem["distances_m"][keep : keep + 1]

    return edit


def standing_robot(row: dict[str, Any], problem: dict[str, Any]) -> None:
    centres = problem["centres_m"].reshape(STAGES, 2, 3)
    centres[:, 1] = centres[0, 1]


def lighter_slack(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["slack_weight_1_m2_s"] = 1.0


def other_terminal_cost(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["terminal_weight_s"] = 0.0


def without_terminal_cost(row: dict[str, Any], problem: dict[str, Any]) -> None:
    """What the running code would record if it forgot the terminal cost."""
    row["objective"] -= task_error(problem, problem["positions_m"]) - task_error(problem, problem["positions_m"], 0.0)
    row[f"objective_{row['first_stage']}"] = row["objective"]


def contrary_answer(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["decision"] = {"accept": "refuse", "refuse": "accept"}[row["decision"]]


def wrong_reason(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["reason"] = "dwell"


def round_otherwise(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["rounded"][4] = 1.0 - problem["rounded"][4]


def fractional_rounding(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["rounded"] = problem["relaxed"].copy()
    row["rounding_deviation_s"] = 0.0


def relaxed_outside(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["relaxed"][0] = 1.0 + 1e-6


def understate_rounding(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row["rounding_deviation_s"] *= 0.5


def long_normals(row: dict[str, Any], problem: dict[str, Any]) -> None:
    problem["normals"] *= 1.01


def worst_plan(row: dict[str, Any], problem: dict[str, Any]) -> None:
    """A consistent record of a plan that is worse than both constant ones."""
    accept, refuse = (problem[name].reshape(STAGES, 3) for name in ("accept_m_s", "refuse_m_s"))
    shape = (STAGES, len(problem["distances_m"]), 3)

    def cost(plan: Array) -> float:
        positions = problem["initial_m"] + STAGE_S * np.cumsum(np.where(plan[:, None] == 1.0, accept, refuse), axis=0)
        gap = problem["distances_m"] - np.linalg.norm(positions[:, None] - problem["centres_m"].reshape(shape), axis=2)
        return task_error(problem, positions) + float(STAGE_S * 10.0 * np.sum(np.maximum(0.0, gap.max(axis=1)) ** 2))

    plan = max(ALL_PLANS, key=cost)
    problem["plan"] = plan
    problem["positions_m"] = (
        problem["initial_m"] + STAGE_S * np.cumsum(np.where(plan[:, None] == 1.0, accept, refuse), axis=0)
    ).ravel()
    row["objective"] = cost(plan)


def refused_for_want_of_a_plan(row: dict[str, Any], problem: dict[str, Any]) -> None:
    row |= {"status": "refused_not_finite", "decision": "refuse", "reason": "no_plan"}
    for name in ("plan", "positions_m", "relaxed", "rounded", "normals"):
        problem[name] = []
