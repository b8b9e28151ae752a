"""Each claim about a run holds on honest records, and does not on records that were edited."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.decisions import STAGES
from builders.edits import bumped, first_of, moved, rows, with_cells, with_decision, with_scenario
from verify.judging import CLAIMS
from verify.runs.cases import (
    B_C,
    B_D,
    BINARY,
    BLOCKS,
    LOCAL,
    RELAXED,
    SIXTH,
    A,
    D,
    Edit,
    accepted,
    at,
    column,
    decisions,
    events,
    executing,
    first,
    meta,
    problem,
    refused,
    scenario,
    swapped,
)  # fmt: skip

from airground_drake.sim.trace import Trace
from airground_drake.verify.runs.gate_record import rows_of

# ---------------------------------------------------------------------------------------------------- single edits


def without_a_plan(row: dict[str, Any], given: dict[str, Any]) -> None:
    row |= {"status": "refused_not_finite", "decision": "refuse", "reason": "no_plan"}
    given |= {name: [] for name in ("plan", "positions_m", "relaxed", "rounded", "normals")}


def last_without_a_plan(answer: str) -> Edit:
    def edit(row: dict[str, Any], given: dict[str, Any]) -> None:
        without_a_plan(row, given)
        row["decision"] = answer

    return lambda trace: with_decision(trace, edit, len(trace.decisions) - 1)


def no_plan_at_all(trace: Trace) -> Trace:
    for row in range(len(trace.decisions)):
        trace = with_decision(trace, without_a_plan, row)
    return trace


def idle_normals_turned(trace: Trace) -> Trace:
    """Half-planes where no plan can come near ask for nothing; turned round, they would ask for metres."""
    row = rows_of(trace)[SIXTH]
    idle = ~row.half_planes.any(axis=2)
    assert idle.any()
    return problem(normals=lambda _: np.where(idle[..., None], -row["normals"], row["normals"]).ravel())(trace)


def without_decisions(trace: Trace) -> Trace:
    return replace(trace, decisions=trace.decisions.iloc[:0], problems=trace.problems.iloc[:0])


def alternating(trace: Trace) -> Trace:
    """Every other answer on an accepted proposal is a refusal."""
    answers = np.flatnonzero(executing(trace.decisions))[::2]
    return with_cells(with_scenario(trace, gatekeeper__tries=2), "decisions", answers, "decision", "refuse")


def stall(y: float) -> dict[str, list[float]]:
    return {"ugv1": [3.35, y, 0.0]}


def late(row: int, robot: str, *offset: float) -> Edit:
    return lambda trace: moved(trace, robot, len(trace.t) - row, list(offset))


def without_triggers(every: list[dict[str, Any]]) -> None:
    every[:] = [event for event in every if event["kind"] not in ("trigger", "release")]


def false_alarm(every: list[dict[str, Any]]) -> None:
    first = first_of(every, "trigger")
    every[:0] = [{**first, "t_s": 0.2}, {**first, "t_s": 0.3, "kind": "release"}]


def released_too_soon(every: list[dict[str, Any]]) -> None:
    first_of(every, "release")["t_s"] = 1.6
    del every[every.index(first_of(every, "release")) + 1 :]


# ---------------------------------------------------------------------------------------------------- the table

R, E, N, H, I = "refuted", "error", "not_run", "holds", "inconclusive"  # noqa: E741
REST = [0.0] * 3
BREAKAGES: dict[str, tuple[tuple[str, str, Edit, str, str], ...]] = {
    "SAFE-TRACE": (("ends at an obstacle", A, late(1, "ugv2", 4.8, -8.75, 0.0), R, "ugv2"),),
    "SAFE-OWN": (("ends at an obstacle", A, late(1, "ugv2", 4.8, -8.75, 0.0), R, "ugv2"),),
    "SAFE-HYP": (
        ("sensing range of another scenario", A, scenario(control__sensing_range_m=4.001), R, "controller parameters"),
        ("gain", A, scenario(control__avoidance_gain_1_s=40.1), R, "gain: A h <= 1"),
        ("sensing range", A, scenario(control__sensing_range_m=2.29), R, "sensing range"),
        ("start", A, scenario(safe_distance__ugv_m=2.001), R, "safe start"),
        ("off the ground", A, lambda t: moved(t, "ugv2", 200, [0.0, 0.0, 1e-9]), R, "planar motion"),
        ("period", A, scenario(control__period_s=0.0125), R, "sampling"),
        ("a row lost", "at a rock", rows(lambda table: table.drop(index=50)), R, "sampling"),
        ("no parameters", A, lambda t: replace(t, meta={k: v for k, v in t.meta.items() if k != "controllers"}), E, ""),
    ),
    "ZENO-TRACE": (
        ("chattering", "chattering", lambda t: t, R, "gap_s"),
        ("an event only", "refractory", events(lambda e: first_of(e, "trigger").update(t_s=1.501)), E, ""),
        ("no bound", D, scenario(decision__min_inter_event_s=0.0), N, ""),
    ),
    "THR-TRIG": (
        ("trigger lost", "refractory", events(lambda e: e.remove(first_of(e, "trigger"))), R, "missing trigger"),
        ("release lost", "refractory", events(lambda e: e.remove(first_of(e, "release"))), R, "missing release"),
        ("early release", "refractory", events(lambda e: first_of(e, "release").update(t_s=3.249)), R, "spurious"),
        ("last trigger", "refractory", events(lambda e: e.append({**e[0], "t_s": 9.9})), R, "spurious trigger"),
        ("of the UAV", "refractory", events(lambda e: e.append({**e[0], "robot": "uav"})), R, "not a UGV"),
        ("mode", D, bumped("ugv1.mode", 1.0), R, "mode"),
        ("count", D, bumped("ugv1.triggers", 1.0), R, "column"),
        ("time in the column", D, bumped("ugv1.triggered_at_s", 1e-3), R, "column"),
        ("time of the release", D, bumped("ugv1.released_at_s", 1e-3), R, "column"),
        ("release level", D, scenario(decision__release_m=1.4), R, "release"),
        ("preset", D, scenario(ugvs__ugv1__preset__speed_m_s=1.001), R, "(15)"),
        ("bare", D, scenario(decision__trigger="bare"), R, ""),
        ("leak", "leaking", scenario(decision__leak_1_s=0.49), R, "noise"),
        ("no leak", "leaking", scenario(decision__leak_1_s=0.0), R, "noise"),
        ("period of the noise", "leaking", scenario(decision__noise_period_s=0.05), R, "noise"),
        ("intensity", "leaking", scenario(decision__noise_m_sqrt_s=0.1), R, "noise"),
        ("threshold", D, meta(zeta_m=2.9), E, ""),
        ("not the root", D, scenario(decision__threshold__rule="bayes"), E, ""),
        ("the root", D, scenario(decision__threshold__rule="bayes", decision__threshold__drift_m_s=6.066688755667553),
         H, ""),
    ),
    "THR-QUALITY": (
        ("trigger lost", "refractory", events(without_triggers), R, "missed"),
        ("too late", A, events(lambda e: first_of(e, "trigger").update(t_s=10.0)), R, "served"),
        ("too early", A, events(lambda e: first_of(e, "trigger").update(t_s=6.0)), R, "early"),
        ("false alarm", "refractory", events(false_alarm), R, "false"),
        ("released by noise", "refractory", events(released_too_soon), R, "missed"),
        ("in the dwell", "refractory", scenario(decision__min_inter_event_s=1.8), R, "served"),
        ("at the end of the dwell", "refractory", lambda t: t, H, ""),
        ("preset", D, scenario(ugvs__ugv1__preset__speed_m_s=0.5), R, ""),
        ("threshold", D, meta(zeta_m=2.9), E, ""),
    ),
    "GATE-PLAN": (
        ("fractional", RELAXED, problem(plan=at(3, 0.5)), R, "omega is not binary"),
        ("first stage", RELAXED, column(plan_first_stage=swapped), R, "first stage"),
        ("rounded first stage", RELAXED, column(rounded_first_stage=swapped), R, "rounded first stage"),
        ("rounded otherwise", RELAXED, problem(rounded=at(4, lambda v: 1.0 - v)), R, "rounded against the rule"),
        ("not rounded", RELAXED, problem(rounded=at(4, 0.5)), R, "rounded omega is not binary"),
        ("relaxed outside", RELAXED, problem(relaxed=at(0, 1.0 + 1e-6)), R, "outside [0, 1]"),
        ("weight of slack", RELAXED, problem(slack_weight_1_m2_s=lambda v: 1.1 * v), R, "objective"),
        ("problems exchanged", RELAXED, lambda t: replace(t, problems=t.problems.iloc[[*range(9), 10, 9]]), R, ""),
        ("NaN", RELAXED, problem(accept_m_s=at(0, np.nan)), E, ""),
        ("cost NaN", RELAXED, column(objective=np.nan), E, ""),
        ("cut", RELAXED, problem(positions_m=lambda v: v[:-1]), E, ""),
        ("optimal without a plan", RELAXED, problem(plan=lambda _: []), E, ""),
        ("not relaxed, but rounded", RELAXED, problem(relaxed=lambda _: []), E, ""),
        ("no relaxation", RELAXED, problem(relaxed=lambda _: [], rounded=lambda _: []), E, "complete"),
        ("relaxed nevertheless", BINARY, problem(relaxed=lambda _: np.ones(STAGES), rounded=lambda _: np.ones(STAGES)),
         R, "recorded rounding error"),
        ("another route", RELAXED, column(route="nonlinear"), E, ""),
        ("a problem lost", RELAXED, lambda t: replace(t, problems=t.problems.iloc[1:]), E, ""),
        ("idle normals", RELAXED, idle_normals_turned, H, ""),
        ("a refusal without a plan", RELAXED, last_without_a_plan("refuse"), H, ""),
        ("no plan at all", RELAXED, no_plan_at_all, H, ""),
        ("no problems", RELAXED, lambda t: replace(t, problems=t.problems.iloc[:0]), N, ""),
        ("no decisions", RELAXED, without_decisions, N, ""),
        ("stops short", B_D, first(accepted, accept_stalls=1.0, refuse_stalls=0.0), R, "accept stops short"),
        ("stops shorter", B_D, first(refused, decision="accept", refuse_stalls=1.0, refuse_left_m=0.1), R, "farther"),
        ("refuses to get there", B_D, first(refused, refuse_stalls=1.0, accept_stalls=0.0), R, "refuse stops short"),
        ("a stop at no cost", B_D, first(refused, accept_outcome_m2_s=0.0), R, "cost of the way left, accept"),
        ("for less", B_D, first(refused, refuse_stalls=0.0, accept_stalls=0.0, refuse_left_m=99.0), R, "left"),
    ),
    "LIVE-HYP": (
        ("over too late", B_D, scenario(gatekeeper__longest_s=0.5, gatekeeper__tries=50), R, "over too late"),
        ("too long", B_D, scenario(gatekeeper__longest_s=0.5, gatekeeper__tries=1), R, "longer from its own task"),
        ("reversed", B_D, first(executing, decision="refuse", reason="over"), R, "reversed without news"),
        ("too often", B_D, alternating, R, "more acceptances between two rests than allowed"),
        ("never sent", B_D, decisions(lambda table: table.assign(number=90)), E, ""),
    ),
    "LIVE-GOAL": (
        ("UGV off target", D, scenario(ugvs__ugv2__target_m=[-1.3, 13.2, 0.0]), R, "at its target"),
        ("UAV off target", D, scenario(uav__target_m=[1.0, 13.0, 2.2]), R, "at its target"),
        ("late jump", D, late(1, "ugv1", 0.0, 0.11, 0.0), R, "at its target"),
        ("no stall", D, scenario(runs__d__stalls_m=stall(5.1)), R, "at its stall point"),
        ("arrives instead", D, scenario(runs__d__stalls_m=stall(12.95)), R, "short of its target"),
        ("stalls elsewhere", A, scenario(runs__a__stalls_m=stall(5.3)), R, "at its stall point"),
        ("stalls undeclared", A, scenario(runs__a__stalls_m={}), R, "at its target"),
        ("still moving", A, late(20, "ugv1", 0.0, -2e-3, 0.0), R, "stands"),
        ("UAV aside", A, late(1, "uav", 0.2, 0.0, 0.0), R, "centroid"),
        ("unknown stall", A, scenario(runs__a__stalls_m={"ugv9": REST}), E, ""),
    ),
}  # fmt: skip
"""By claim: what is edited, in which run, how, and what the claim then says: its status, what a refutation shows."""


def test_every_claim_has_breakages() -> None:
    assert list(BREAKAGES) == sorted(BREAKAGES, key=list(CLAIMS).index)
    assert set(BREAKAGES) == set(CLAIMS)


@pytest.mark.parametrize(("claim", "row"), [(c, row) for c, table in BREAKAGES.items() for row in table],
                         ids=lambda value: value if isinstance(value, str) else value[0])  # fmt: skip
def test_an_edited_record_is_found_out(base: Callable[[str], Trace], claim: str, row: Any) -> None:
    _, name, edit, status, shown = row
    found = CLAIMS[claim].judge(edit(base(name)))
    assert found.status == status, found
    if status == "refuted":
        assert shown in str(found.counterexample)
        assert found.margin is None or found.margin < 0.0


HONEST = {(claim, name) for claim, table in BREAKAGES.items() for _, name, *_ in table} - {("ZENO-TRACE", "chattering")}
HONEST |= {("GATE-PLAN", name) for name in (RELAXED, BINARY, BLOCKS, B_C, LOCAL)} | {("THR-TRIG", "chattering")}


@pytest.mark.parametrize(("claim", "name"), sorted(HONEST))
def test_the_record_as_it_is_holds(base: Callable[[str], Trace], claim: str, name: str) -> None:
    found = CLAIMS[claim].judge(base(name))
    assert found.status == "holds", found
    assert found.margin is None or found.margin >= 0.0
