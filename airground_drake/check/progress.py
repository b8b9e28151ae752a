"""LIVE-PROG: what was accepted went on as predicted or was given back; every answer of method (d) has its reason."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .decisions import silent_ugvs
from .feasibility import reasons_of
from .files import Json
from .foresight import asked_in, foreseen, on_which, rows_of
from .rules import SMALL, Array, Found, at_most, close, same
from .run import Run

LAG_M = 1e-6
"""Recorded and recomputed lags may differ by this."""
NO_DIFFERENCE = 1e-6
"""Relative gain from which on an outcome is better."""


@dataclass
class _Ugv:
    """Where a UGV stands between decisions: its tries, since when it is on its own or executes, and what it watches."""

    tries: int = 0
    since_s: float = 0.0
    executing: bool = False
    until_s: float = 0.0
    on_time_s: float = 0.0
    lags_m: Array | None = None


def live_prog(run: Run, _: Json) -> Found:
    """LIVE-PROG: the decisions of each UGV gone through by time."""
    if silent_ugvs(run):
        return Found("not_run")
    rows = rows_of(run)
    if not rows:
        return Found("holds", facts={"decisions": 0}).counted(0)
    longest, accepted, farthest = 0.0, 0, 0.0
    for ugv in run.ugvs:
        state, last = _Ugv(), None
        for row in [row for row in rows if row["robot"] == ugv]:
            _follow(run, row, last, state)
            if row["decision"] == "accept":
                longest = max(longest, row["t_s"] - state.on_time_s)
                farthest = max(farthest, row["lag_m"] - row["predicted_lag_m"])
                accepted += 1
            last = row
    facts = {
        "decisions": len(rows),
        "executing": accepted,
        "farthest_behind_prediction_m": farthest,
        "reasons": reasons_of(run),
        "most_tries": max(row["tries"] for row in rows),
        "leave_a_direction": _leaving_a_direction(run, rows),
    }
    return Found.with_margin("holds", run.scenario["gatekeeper"]["behind_s"] - longest, **facts).counted(accepted)


def _leaving_a_direction(run: Run, rows: list[dict[str, Any]]) -> int:
    """How many accepted proposals leave a direction of the plane to the own task."""
    accepted = {(row["robot"], row["issued_s"]) for row in rows if row["decision"] == "accept"}
    parts = [on_which(run, *proposal).projector[:2, :2] for proposal in accepted]
    return sum(not np.allclose(part, np.eye(2)) for part in parts)


def _follow(run: Run, row: dict[str, Any], last: dict[str, Any] | None, state: _Ugv) -> None:
    """One decision against the rules; `state` is brought up to date."""
    gate, t = run.scenario["gatekeeper"], row["t_s"]
    about: dict[str, Any] = {"about": f"decision of {row['robot']}", "t_s": t}
    standing = last["decision"] if last is not None and last["issued_s"] == row["issued_s"] else None
    if state.executing and standing != "accept" and last is not None:
        state.executing, state.since_s = False, last["t_s"] + gate["period_s"]
    rested_s = t - state.since_s - gate["rest_s"]
    if not state.executing and rested_s >= -SMALL:
        anew = row["tries"] <= float(standing is None and row["decision"] == "accept")
        state.tries = 0 if rested_s > SMALL or anew else state.tries
    lag = predicted = -1.0
    if standing == "accept":
        lag, predicted = _lags_m(run, row, state)
        state.on_time_s = t if lag <= predicted + gate["lag_m"] else state.on_time_s
        answer = ["accept", "kept"]
        if t - state.on_time_s > gate["behind_s"]:
            answer = ["refuse", "no_progress"]
        elif t >= state.until_s:
            answer = ["refuse", "over"]
        if answer[0] == "refuse":
            state.executing, state.since_s = False, t
    elif standing == "refuse":
        answer = ["refuse", "kept"]
    else:
        answer = _first(row, on_which(run, row["robot"], row["issued_s"]).cause, state, gate)
        if answer[0] == "accept":
            lag = predicted = _accept(run, row, state)
    same("answer and its reason", [row["decision"], row["reason"]], answer, **about)
    same("tries", row["tries"], float(state.tries), **about)
    at_most("tries", row["tries"], gate["tries"], **about)
    close("lag", row["lag_m"], lag, within=LAG_M, **about)
    close("predicted lag", row["predicted_lag_m"], predicted, within=LAG_M, **about)


def _first(row: dict[str, Any], cause: str, state: _Ugv, gate: Json) -> list[str]:
    """The first answer to a proposal sent for the trigger of `cause`, from the recorded outcomes."""
    if state.tries >= gate["tries"]:
        return ["refuse", "exhausted"]
    if row["accept_stalls"] < 0.0:
        return ["refuse", "no_plan"]
    better = row["accept_outcome_m2_s"] < (1.0 - NO_DIFFERENCE) * row["refuse_outcome_m2_s"]
    if row["accept_stalls"] != row["refuse_stalls"]:
        better = row["accept_stalls"] < row["refuse_stalls"]
    if better:
        return ["accept", "cheaper"]
    if row["accept_stalls"] == 1.0:
        return ["refuse", "stalls"]
    return ["refuse", "not_cheaper"] if cause == row["robot"] else ["accept", "makes_way"]


def _accept(run: Run, row: dict[str, Any], state: _Ugv) -> float:
    """A try begins; returns how far the UGV is from where it is to be, m."""
    gate, t = run.scenario["gatekeeper"], row["t_s"]
    asked = on_which(run, row["robot"], row["issued_s"])
    places = foreseen(run)[asked_in(row)][1].places_m
    instants = t + run.scenario["control"]["period_s"] * np.arange(float(len(places)))
    state.lags_m = np.linalg.norm((places - asked.place_m(instants)) @ asked.projector, axis=1)
    state.executing, state.tries, state.since_s, state.on_time_s = True, state.tries + 1, t, t
    state.until_s = min(float(asked.times_s[-1]), t + gate["longest_s"])
    return float(state.lags_m[0])


def _lags_m(run: Run, row: dict[str, Any], state: _Ugv) -> tuple[float, float]:
    """How far from where it is to be the UGV is, and was predicted to be."""
    asked = on_which(run, row["robot"], row["issued_s"])
    away = asked.projector @ (run.place_m(row["robot"], row["t_s"]) - asked.place_m(np.array([row["t_s"]]))[0])
    lags = state.lags_m if state.lags_m is not None else np.zeros(1)
    k = round((row["t_s"] - state.since_s) / run.scenario["control"]["period_s"])
    return float(np.linalg.norm(away)), float(lags[min(k, len(lags) - 1)])
