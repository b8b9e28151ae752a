"""For each claim about a run: a record changed by twice its tolerance is refuted, and by half of it holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from builders.edits import bumped, moved, with_decision, with_events, with_scenario, with_signals
from builders.runs import refractory

from airground_drake.registry import RUN_CLAIMS
from airground_drake.run.trace import Trace
from airground_drake.verify.claim import MOTION_TOLERANCE_M, TIME_TOLERANCE_S
from airground_drake.verify.registry import run_claims
from airground_drake.verify.runs import gate_model, gate_opt
from airground_drake.verify.runs.exec import COMMAND_TOLERANCE_M_S
from airground_drake.verify.runs.gate_feas import SPEED_TOLERANCE
from airground_drake.verify.runs.gate_record import POSITION_TOLERANCE_M, Row, cost_tolerance, rows_of
from airground_drake.verify.runs.live_goal import AT_REST_M
from airground_drake.verify.runs.outcome_rolls import foreseen
from airground_drake.verify.runs.pairs import DISTANCE_TOLERANCE_M
from airground_drake.verify.runs.proposals import answers_to, proposals_of
from airground_drake.verify.runs.standing import SENSED_M
from airground_drake.verify.runs.sum_up_rounding import TIE
from airground_drake.verify.runs.thr_trig import EVENT_TOLERANCE_S, VARIABLE_TOLERANCE_M
from airground_drake.verify.runs.triggers import NOISE_TOLERANCE_M

Edit = Callable[[Trace, float], Trace]
"""Changes a record by so much."""

WITHOUT = {
    "SAFE-HYP": "its tolerances have tests of their own",
    "LIVE-PROG": "it compares answers, reasons and counts, which are equal or not",
}
"""Claims that are not in the table, and why."""


def of(trace: Trace, claim: str) -> Any:
    """The finding of a claim."""
    return run_claims([claim])[0].judge(trace)


def at_the_end(robot: str) -> Edit:
    """The last command is faster, and leads as much farther: nothing follows from it."""

    def edit(trace: Trace, by: float) -> Trace:
        dt = float(np.diff(trace.t)[-1])
        return moved(trace, robot, len(trace.t) - 1, [by * dt, 0.0, 0.0])

    return edit


def nearer_than_allowed(trace: Trace, by: float) -> Trace:
    """What was the least distance to an obstacle is too little."""
    distance = trace.scenario.safe_distance.obstacle_m + of(trace, "SAFE-TRACE").margin + by
    return with_scenario(trace, safe_distance__obstacle_m=distance)


def not_where_its_command_leads(trace: Trace, by: float) -> Trace:
    return bumped("uav.x_m", by, len(trace.t) - 1)(trace)


def triggered_later(trace: Trace, by: float) -> Trace:
    """The event and the column that agrees with it."""

    def events(all_of_them: list[dict[str, Any]]) -> list[dict[str, Any]]:
        return [{**e, "t_s": e["t_s"] + by} if e["kind"] == "trigger" else e for e in all_of_them]

    def column(signals: pd.DataFrame) -> None:
        times = signals["ugv1.triggered_at_s"]
        signals["ugv1.triggered_at_s"] = times.where(times < 0.0, times + by)

    return with_signals(with_events(trace, events), column)


def signal(name: str, row: int) -> Edit:
    return lambda trace, by: bumped(name, by, row)(trace)


def noise_within_a_period(trace: Trace, by: float) -> Trace:
    """At the row of the trigger, which is between two samples of the noise."""
    when = next(e["t_s"] for e in trace.events if e["kind"] == "trigger")
    return bumped("ugv1.noise_m", by, int(np.argmin(np.abs(trace.t - when))))(trace)


def longer_dwell(trace: Trace, by: float) -> Trace:
    gap = of(trace, "ZENO-TRACE").evidence["smallest_gap"]["gap_s"]
    return with_scenario(trace, decision__min_inter_event_s=gap + by)


def beside_its_target(trace: Trace, by: float) -> Trace:
    end = trace.position("ugv1")[-1] + [by, 0.0, 0.0]
    return with_scenario(trace, ugvs__ugv1__target_m=end.tolist())


def beside_its_stall(trace: Trace, by: float) -> Trace:
    end = trace.position("ugv1")[-1] + [by, 0.0, 0.0]
    return with_scenario(trace, runs__a__stalls_m={"ugv1": end.tolist()})


def moves_at_the_end(trace: Trace, by: float) -> Trace:
    return moved(trace, "ugv1", len(trace.t) - 5, [by, 0.0, 0.0])


def barely_in_sight(trace: Trace, by: float) -> Trace:
    """The sensing range does not reach what a refusal has taught the UAV."""
    known = {tuple(o.position_m) for o in trace.scenario.obstacles.values() if o.known_to_uav}
    (hidden,) = {tuple(o.position_m) for o in trace.scenario.obstacles.values()} - known
    said = [answer for sent in proposals_of(trace) if sent.ugv == "ugv1" for answer in answers_to(trace, sent)]
    refused = [answer.t_s for answer in said if not answer.accepted]
    places = [trace.position("ugv1")[np.argmin(np.abs(trace.t - when))] for when in refused]
    farthest = max(float(np.linalg.norm(place - hidden)) for place in places)
    return with_scenario(trace, control__sensing_range_m=farthest - by)


def decided_later(trace: Trace, by: float) -> Trace:
    decisions = trace.decisions.copy()
    decisions.loc[len(decisions) - 1, "t_s"] += by
    return replace(trace, decisions=decisions)


def column(name: str, row: int, of_what: Callable[[Row], float] = lambda row: 1.0) -> Edit:
    """A number of a decision, changed by so much of something."""

    def edit(trace: Trace, by: float) -> Trace:
        decisions = trace.decisions.copy()
        k = range(len(decisions))[row]
        scale = of_what(rows_of(trace)[k]) if len(trace.problems) else 1.0
        decisions.loc[k, name] += by * scale
        return replace(trace, decisions=decisions)

    return edit


def array(name: str, index: int) -> Edit:
    """A number of an array of a decision's problem."""

    def edit(trace: Trace, by: float) -> Trace:
        def change(row: dict[str, Any], problem: dict[str, Any]) -> None:
            problem[name][index] += by

        return with_decision(trace, change, LATE)

    return edit


def longer_normal(trace: Trace, by: float) -> Trace:
    def change(row: dict[str, Any], problem: dict[str, Any]) -> None:
        problem["normals"][:3] *= 1.0 + by

    return with_decision(trace, change, LATE)


def with_bound(worked_out: Callable[[gate_opt.Bounded, float], float]) -> Edit:
    """Another lower bound, and the gap that goes with it."""

    def edit(trace: Trace, by: float) -> Trace:
        row = rows_of(trace)[LATE]
        (bounded,) = gate_opt.bound([row], 0)
        lower = worked_out(bounded, by * row.scale)
        cost = float(row.cost(row["positions_m"], row.half_planes))

        def change(given: dict[str, Any], problem: dict[str, Any]) -> None:
            given |= {"route_bound": lower, "gap": (cost - lower) / cost}

        return with_decision(trace, change, LATE)

    return edit


def faster_than_allowed(trace: Trace, by: float) -> Trace:
    """The last step of the constant plan that refuses, by the speed limit and so much more."""
    row = rows_of(trace)[LATE]
    limit = trace.scenario.ugvs[row.given["robot"]].max_speed_m_s

    def change(given: dict[str, Any], problem: dict[str, Any]) -> None:
        velocity = problem["refuse_m_s"].reshape(-1, 3)
        velocity[-1] = [0.0, limit * (1.0 + by), 0.0]
        positions = row["initial_m"] + row.dt * np.cumsum(velocity, axis=0)
        given["refuse_throughout"] = float(row.cost(positions))
        given["objective_refuse"] = max(given["objective_refuse"], given["objective"])

    return with_decision(trace, change, LATE)


def rounded_up_too_early(trace: Trace, by: float) -> Trace:
    """The first stage lacks less than half of it, and is rounded up all the same."""

    def change(given: dict[str, Any], problem: dict[str, Any]) -> None:
        problem["relaxed"][:], problem["rounded"][:] = 0.0, 0.0
        problem["relaxed"][0], problem["rounded"][0] = 0.5 - by, 1.0
        given["relaxed_first_stage"] = 0.5 - by
        given["rounding_deviation_s"] = problem["dt_s"] * (0.5 + by)

    return with_decision(trace, change, LATE)


def longer_way_left(trace: Trace, by: float) -> Trace:
    """Farther from the goal than is possible, with the cost of that."""
    decisions = trace.decisions.copy()
    k = int(np.argmax(decisions["accept_left_m"].to_numpy()))
    given = decisions.iloc[k].to_dict()
    most = foreseen(trace, given, proposals_of(trace))[1].most_left_m
    speed = trace.scenario.ugvs[given["robot"]].preset.speed_m_s
    decisions.loc[k, "accept_left_m"] = most + by
    decisions.loc[k, "accept_outcome_m2_s"] += ((most + by) ** 3 - given["accept_left_m"] ** 3) / (3.0 * speed)
    return replace(trace, decisions=decisions)


def outcome(trace: Trace, by: float) -> Trace:
    """Relative, as outcomes are compared."""
    decisions = trace.decisions.copy()
    k = int(np.argmax(decisions["accept_outcome_m2_s"].to_numpy()))
    decisions.loc[k, "accept_outcome_m2_s"] *= 1.0 + by
    return replace(trace, decisions=decisions)


def of_refusing(row: Row) -> float:
    """What the cost of refusing throughout may differ by."""
    return cost_tolerance(float(row.cost(row.constant[0])))


def of_accepting(row: Row) -> float:
    """The same of accepting throughout, which the last plan of the run does."""
    return cost_tolerance(float(row.cost(row.constant[1])))


LATE = -1
"""The decision of a run that is edited: the last one, which no other one follows from."""


@dataclass(frozen=True)
class Case:
    """A number that a claim compares.

    Attributes:
        claim: which.
        what: the number.
        of: scenario and run; none: a small synthetic run.
        tolerance: by which it may differ.
        edit: changes it.
        wrong: what a larger difference makes of the claim.
    """

    claim: str
    what: str
    of: tuple[str, str] | None
    tolerance: float
    edit: Edit
    wrong: str = "refuted"


A, A_D, B_C, B_D, RELAXED = ("case_a", "a"), ("case_a", "d"), ("case_b", "c"), ("case_b", "d"), ("soft_gate", "c")

CASES = (
    Case("SAFE-TRACE", "least distance", A, DISTANCE_TOLERANCE_M, nearer_than_allowed),
    Case("SAFE-TRACE", "place after a step", A, MOTION_TOLERANCE_M, not_where_its_command_leads, "error"),
    Case("EXEC", "command of a UGV", A_D, COMMAND_TOLERANCE_M_S, at_the_end("ugv2")),
    Case("EXEC", "command of the UAV", A_D, COMMAND_TOLERANCE_M_S, at_the_end("uav")),
    Case("ZENO-TRACE", "gap of two triggers", None, TIME_TOLERANCE_S, longer_dwell),
    Case("THR-TRIG", "time of a trigger", A_D, EVENT_TOLERANCE_S, triggered_later),
    Case("THR-TRIG", "variable", A_D, VARIABLE_TOLERANCE_M, signal("ugv1.decision_variable_m", 100)),
    Case("THR-TRIG", "noise at the start", A_D, NOISE_TOLERANCE_M, signal("ugv1.noise_m", 0)),
    Case("THR-TRIG", "noise within a period", A_D, NOISE_TOLERANCE_M, noise_within_a_period),
    Case("LIVE-GOAL", "distance from the target", A_D, 0.1, beside_its_target),
    Case("LIVE-GOAL", "distance from the stall", A, 0.1, beside_its_stall),
    Case("LIVE-GOAL", "motion at the end", A, AT_REST_M, moves_at_the_end),
    Case("COMM", "sight of an obstacle", B_D, SENSED_M, barely_in_sight),
    Case("GATE-FEAS", "time of a decision", B_D, TIME_TOLERANCE_S, decided_later),
    Case("GATE-FEAS", "initial position", B_C, POSITION_TOLERANCE_M, array("initial_m", 0)),
    Case("GATE-FEAS", "reference", B_C, POSITION_TOLERANCE_M, array("reference_m", -2)),
    Case("GATE-FEAS", "place of a point", B_C, POSITION_TOLERANCE_M, array("centres_m", 0)),
    Case("GATE-FEAS", "safe distance", B_C, POSITION_TOLERANCE_M, array("distances_m", 0)),
    Case("GATE-FEAS", "predicted position", B_C, POSITION_TOLERANCE_M, array("positions_m", 3)),
    Case("GATE-FEAS", "clearance", B_C, POSITION_TOLERANCE_M, column("predicted_clearance_m", LATE)),
    Case("GATE-FEAS", "cost of refusing", B_C, 1.0, column("refuse_throughout", LATE, of_refusing)),
    Case("GATE-FEAS", "cost of the plan", B_C, 1.0, column("objective_accept", LATE, of_accepting)),
    Case("GATE-FEAS", "speed", B_C, SPEED_TOLERANCE, faster_than_allowed),
    Case("GATE-FEAS", "rounding against the rule", RELAXED, TIE, rounded_up_too_early),
    Case("GATE-FEAS", "rounding error", RELAXED, TIE, column("rounding_deviation_s", LATE)),
    Case("GATE-FEAS", "first stage", RELAXED, TIE, column("relaxed_first_stage", LATE)),
    Case("GATE-OPT", "gap", RELAXED, gate_opt.GAP_TOLERANCE, column("gap", LATE)),
    Case("GATE-OPT", "length of a normal", RELAXED, POSITION_TOLERANCE_M, longer_normal),
    Case("GATE-OPT", "bound too high", RELAXED, gate_opt.OVERSTATED, with_bound(lambda of, by: of.optimum.upper + by)),
    Case("GATE-OPT", "bound too low", RELAXED, gate_opt.UNDERSTATED, with_bound(lambda of, by: of.optimum.lower - by)),
    Case("GATE-MODEL", "velocity", B_C, gate_model.VELOCITY_TOLERANCE_M_S, array("accept_m_s", 0)),
    Case("GATE-MODEL", "outcome", B_D, gate_model.OUTCOME_TOLERANCE, outcome),
    Case("GATE-MODEL", "way left", B_D, gate_model.LEFT_TOLERANCE_M, longer_way_left),
)


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.claim}: {case.what}")
def test_twice_the_tolerance_is_refuted_and_half_of_it_holds(run: Callable[[str, str], Trace], case: Case) -> None:
    trace = refractory() if case.of is None else run(*case.of)
    for share, due in ((0.0, "holds"), (0.5, "holds"), (2.0, case.wrong)):
        found = of(case.edit(trace, share * case.tolerance), case.claim)
        assert found.status == due, (share, found.counterexample)


def test_every_claim_about_runs_is_in_the_table_or_has_no_tolerance() -> None:
    assert sorted({case.claim for case in CASES} | set(WITHOUT)) == sorted(RUN_CLAIMS)
    assert not {case.claim for case in CASES} & set(WITHOUT)


def test_what_may_differ_by_more_than_rounding_is_known() -> None:
    """Lengths in m, velocities in m/s, times in s, and costs relative to what costs may differ by."""
    assert {f"{case.claim}: {case.what}": case.tolerance for case in CASES if case.tolerance > 1e-5} == {
        "LIVE-GOAL: distance from the target": 0.1, "LIVE-GOAL: distance from the stall": 0.1,
        "LIVE-GOAL: motion at the end": 1e-3, "GATE-FEAS: cost of refusing": 1.0, "GATE-FEAS: cost of the plan": 1.0,
        "GATE-FEAS: speed": 1e-4, "GATE-OPT: bound too low": 1e-3, "GATE-MODEL: way left": 1e-3,
    }  # fmt: skip
    assert cost_tolerance(1.0) < 1e-8
