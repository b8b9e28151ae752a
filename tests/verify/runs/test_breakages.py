"""Each claim about a run holds on honest records, and does not on records that were edited."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from builders.decisions import STAGES
from builders.edits import bumped, first_of, moved, rows, with_decision, with_events, with_meta, with_signals
from verify.judging import CLAIMS
from verify.runs.cases import (
    B_C,
    B_D,
    BINARY,
    BLOCKS,
    DOORWAY,
    LOCAL,
    RELAXED,
    SIXTH,
    A,
    D,
    Edit,
    at,
    both,
    column,
    decision,
    decisions,
    events,
    first,
    meta,
    one_more,
    problem,
    proposals,
    proposed,
    scenario,
    signals,
    swapped,
)  # fmt: skip

from airground_drake.run.trace import Trace
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


def intervened(trace: Trace) -> Trace:
    """ugv2 is intervened on in the second half of the run."""
    half = trace.t[-1] / 2.0
    return with_signals(trace, lambda table: table.assign(**{"ugv2.mode": 1.0 * (table["t_s"] > half)}))


def without_decisions(trace: Trace) -> Trace:
    return replace(trace, decisions=trace.decisions.iloc[:0], problems=trace.problems.iloc[:0])


def told(
    row: int, points: slice = slice(None), radii: slice = slice(None), by: float = 0.0, wider: float = 0.0
) -> Edit:
    """The map of the last proposal, or a part of it, in another proposal."""

    def edit(table: pd.DataFrame) -> pd.DataFrame:
        columns = {name: table[name].tolist() for name in ("mapped_m", "mapped_radius_m")}
        places, sizes = (np.array(columns[name][-1]) for name in columns)
        columns["mapped_m"][row] = (places.reshape(-1, 3)[points] + [by, 0.0, 0.0]).ravel()
        columns["mapped_radius_m"][row] = sizes[radii] + wider
        return table.assign(**columns)

    return proposals(edit)


def sent_again(trace: Trace) -> Trace:
    """The last proposal once more, 0.2 s later."""
    later = trace.proposals.iloc[[-1]].assign(issued_s=lambda table: table["issued_s"] + 0.2, number=90)
    event = {**[e for e in trace.events if e["kind"] == "proposal"][-1], "t_s": float(later["issued_s"].iloc[0])}
    more = with_meta(trace, events=[*trace.events, event])
    return replace(more, proposals=pd.concat([trace.proposals, later], ignore_index=True))


def part_lost(trace: Trace) -> Trace:
    """A part of a joint plan was not sent."""
    gone = trace.proposals.iloc[int(np.argmax([len(party) for party in trace.proposals["party"]]))]
    assert len(gone["party"]) > 1
    of = ("proposal", gone["robot"], float(gone["issued_s"]))
    left = with_events(trace, lambda every: [e for e in every if (e["kind"], e["robot"], float(e["t_s"])) != of])
    tables = {name: getattr(trace, name) for name in ("proposals", "decisions")}
    return replace(left, **{k: v[v["number"] != gone["number"]].reset_index(drop=True) for k, v in tables.items()})


def refusal_later(by: float) -> Edit:
    def edit(table: pd.DataFrame) -> pd.DataFrame:
        refused = table[table["decision"] == "refuse"].iloc[[0]]
        return pd.concat([table, refused.assign(t_s=refused["t_s"] + by)], ignore_index=True)

    return decisions(edit)


def accepted_once(ugv: str, *, between: bool) -> Edit:
    """The signal says so at a control sample, or at a row between two, and no message does."""

    def edit(trace: Trace) -> Trace:
        off = np.abs(trace.t / 0.05 - np.round(trace.t / 0.05))
        return bumped(f"{ugv}.accepted", 1.0, int(np.flatnonzero(off > 0.1)[0]) if between else 100)(trace)

    return edit


def each_value(**changes: Callable[[Any], Any]) -> Edit:
    """Every value of a column of the proposals."""
    return proposals(
        lambda table: table.assign(**{k: [f(np.asarray(v)) for v in table[k]] for k, f in changes.items()})
    )


def other_map(trace: Trace) -> Trace:
    """Predictions rest on the map in the message."""
    walls = np.ravel([[3.3, 9.5, 0.0], [5.0, 9.0, 0.0], [6.5, 7.5, 0.0]])
    return each_value(mapped_m=lambda _: walls, mapped_radius_m=lambda _: np.zeros(3))(trace)


def cut_short(trace: Trace) -> Trace:
    """The decisions on an accepted proposal stop while it is in force."""
    last = int(np.flatnonzero(executing(trace.decisions))[-1])
    return replace(trace, decisions=trace.decisions.iloc[: last - 3])


def accepted(table: pd.DataFrame) -> Any:
    return table["reason"] == "cheaper"


def refused(table: pd.DataFrame) -> Any:
    return table["reason"] == "stalls"


def executing(table: pd.DataFrame) -> Any:
    return (table["reason"] == "kept") & (table["decision"] == "accept")


def stall(y: float) -> dict[str, list[float]]:
    return {"ugv1": [3.35, y, 0.0]}


def late(row: int, robot: str, *offset: float) -> Edit:
    """A robot is elsewhere at a row, counted from the end."""
    return lambda trace: moved(trace, robot, len(trace.t) - row, list(offset))


def without_triggers(every: list[dict[str, Any]]) -> None:
    every[:] = [event for event in every if event["kind"] not in ("trigger", "release")]


def false_alarm(every: list[dict[str, Any]]) -> None:
    """A trigger near the beginning that is released before the error is at the threshold."""
    first = first_of(every, "trigger")
    every[:0] = [{**first, "t_s": 0.2}, {**first, "t_s": 0.3, "kind": "release"}]


def released_too_soon(every: list[dict[str, Any]]) -> None:
    """A release while the error is large, and no trigger afterwards."""
    first_of(every, "release")["t_s"] = 1.6
    del every[every.index(first_of(every, "release")) + 1 :]


# ---------------------------------------------------------------------------------------------------- the table

R, E, N, H, I = "refuted", "error", "not_run", "holds", "inconclusive"  # noqa: E741
REST = [0.0] * 3
BREAKAGES: dict[str, tuple[tuple[str, str, Edit, str, str], ...]] = {
    "SAFE-TRACE": (("ends at an obstacle", A, late(1, "ugv2", 4.8, -8.75, 0.0), R, "ugv2"),),
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
    "EXEC": (
        ("accepted at a sample", B_D, accepted_once("ugv2", between=False), R, "'accepted_by_the_signals': True"),
        ("accepted between samples", B_D, accepted_once("ugv1", between=True), R, "'accepted_by_the_messages': False"),
        ("acceptance hidden", B_D, signals(**{"ugv1.accepted": 0.0}), R, "'accepted_by_the_messages': True"),
        ("other times", B_D, each_value(times_s=lambda v: v + 1e-3), R, "ugv1"),
        ("other places", B_D, each_value(positions_m=lambda v: v + 1e-4), R, "ugv1"),
        ("other directions", B_D, each_value(selection=lambda v: v[:3]), R, "ugv1"),
        ("no proposals", B_D, proposals(lambda table: table.iloc[:0]), E, ""),
        ("to a stranger", B_D, proposals(lambda table: table.assign(robot="ugv9")), E, ""),
        ("cause unknown", B_D, proposals(lambda table: table.assign(cause="ugv9")), E, ""),
        ("cause not triggered", B_D, proposals(lambda table: table.assign(cause="ugv2")), E, ""),
        ("motion cut", B_D, each_value(positions_m=lambda v: v[:-1]), E, ""),
        ("motion backwards", B_D, each_value(times_s=lambda v: v[::-1]), E, ""),
        ("motion NaN", B_D, each_value(positions_m=lambda v: np.nan * v), E, ""),
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
        ("first stage", RELAXED, column(first_stage=swapped), R, "first stage"),
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
    "GATE-MODEL": (
        ("another law", B_C, scenario(control__intervention_gain_1_s=1.6), R, "velocity of mode"),
        ("never sent", B_C, decision(lambda row, _: row.update(issued_s=row["issued_s"] + 0.01)), E, ""),
        ("stalls", B_D, first(refused, refuse_stalls=0.0), R, "stalls"),
        ("way left", B_D, first(refused, accept_left_m=lambda v: 0.5 * v), R, "outcome"),
        ("another map", B_D, other_map, R, ""),
    ),
    "LIVE-PROG": (
        ("reason", B_D, first(refused, reason="not_cheaper"), R, "answer or reason"),
        ("accepted", B_D, first(refused, decision="accept"), R, "answer or reason"),
        ("outcome", B_D, first(refused, accept_stalls=0.0), R, "answer or reason"),
        ("makes way", B_D, first(refused, decision="accept", reason="makes_way", accept_stalls=0.0), R, "answer"),
        ("makes way for nobody", B_D, first(accepted, reason="makes_way"), R, "answer or reason"),
        ("kept at first", B_D, first(accepted, reason="kept"), R, "answer or reason"),
        ("no try", B_D, first(accepted, tries=0.0), R, "tries"),
        ("over too early", B_D, first(executing, decision="refuse", reason="over"), R, "answer or reason"),
        ("another try", B_D, first(executing, tries=2.0), R, "tries"),
        ("just ends", B_D, cut_short, R, "end of an accepted intervention"),
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
    "COMM": (
        ("decision before the trigger", D, one_more(t_s=8.1), R, "decision"),
        ("decision for the other UGV", D, one_more(robot="ugv2"), E, ""),
        ("decision for a stranger", D, one_more(robot="ugv9"), E, ""),
        ("decision at no time", D, one_more(t_s=np.nan), E, ""),
        ("decision on no proposal", D, one_more(issued_s=9.0), E, ""),
        ("proposal while supervising", D, proposed(5.0), R, "proposal"),
        ("proposal to the other UGV", D, proposed(9.0, robot="ugv2"), R, "ugv2"),
        ("no more than always-on", D, proposed(*np.linspace(8.2, 10.7, 721)), R, "always_on"),
        ("no proposals", D, events(lambda e: e.remove(first_of(e, "proposal"))), E, ""),
        ("no decisions", D, without_decisions, N, ""),
        ("no help for ugv2", D, intervened, H, ""),
        ("ugv1 out of turn", D, both(intervened, proposed(5.0)), R, "proposal"),
        ("map before the answer", B_D, told(0), R, "map of a proposal"),
        ("map forgotten", B_D, told(-1, slice(-1), slice(-1)), R, "map of a proposal"),
        ("map displaced", B_D, told(-1, by=1e-3), R, "map of a proposal"),
        ("map inflated", B_D, told(-1, wider=1e-3), R, "map of a proposal"),
        ("refusal repeated", B_D, refusal_later(0.0), H, ""),
        ("refusal of what was withdrawn", B_D, refusal_later(1.0), R, "decision on what was withdrawn"),
        ("sent again", B_D, sent_again, R, ""),
        ("part of a joint plan", DOORWAY, part_lost, R, "part of a joint plan not sent"),
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
HONEST |= {(claim, name) for claim in ("GATE-MODEL", "GATE-PLAN") for name in (RELAXED, BINARY, BLOCKS, B_C)}
HONEST |= {("GATE-PLAN", LOCAL), ("THR-TRIG", "chattering")}


@pytest.mark.parametrize(("claim", "name"), sorted(HONEST))
def test_the_record_as_it_is_holds(base: Callable[[str], Trace], claim: str, name: str) -> None:
    found = CLAIMS[claim].judge(base(name))
    assert found.status == "holds", found
    assert found.margin is None or found.margin >= 0.0
