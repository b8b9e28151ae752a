"""The oracle of decisions: silent on honest runs, and not on records that a faulty gatekeeper would leave."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from builders.decisions import ALL_PLANS, STAGES, GateData
from builders.edits import with_cells, with_decision
from hypothesis import given
from hypothesis import strategies as st
from verify.runs.cases import (
    B_C,
    BINARY,
    BLOCKS,
    LOCAL,
    RELAXED,
    SIXTH,
    SWAP,
    Edit,
    at,
    both,
    column,
    decision,
    problem,
    swapped,
)

from airground_drake.scenario.schema import Gatekeeper
from airground_drake.sim.trace import Trace
from airground_drake.uav.messages import ACCEPT, REFUSE, SILENT
from airground_drake.ugv.answer import Rules, settle
from airground_drake.ugv.solution import Solution
from airground_drake.verify.claims.gate_plan import Bounded, bound
from airground_drake.verify.runs.gate_record import POSITION_TOLERANCE_M, DecisionRecord, rows_of
from oracles.decisions import GAP_TOLERANCE, OVERSTATED, UNDERSTATED, rule, wrong_decisions

Base = Callable[[str], Trace]
COSTS = st.floats(0.1, 10.0)
LAST = -1


@pytest.mark.parametrize("name", [RELAXED, BINARY, LOCAL, BLOCKS])
def test_an_honest_run_has_no_faults(base: Base, name: str) -> None:
    assert wrong_decisions(base(name)) == []


def without_point(trace: Trace) -> Trace:
    row = rows_of(trace)[SIXTH]
    j = int(np.argmin(np.linalg.norm(row["initial_m"] - row["centres_m"][0], axis=1) - row["distances_m"]))
    m = len(row["distances_m"])
    return problem(
        centres_m=lambda v: np.delete(v.reshape(STAGES, m, 3), j, axis=1).ravel(),
        normals=lambda v: np.delete(v.reshape(STAGES, m, 3), j, axis=1).ravel(),
        distances_m=lambda v: np.delete(v, j),
    )(trace)


def budget_spent(row: dict[str, Any], given: dict[str, Any]) -> None:
    row["status"] = "budget_spent"
    given |= {"relaxed": [], "rounded": [], "normals": []}


def other_plan(choose: Callable[[GateData], Any], *, bounded: bool) -> Edit:
    def edit(trace: Trace) -> Trace:
        data = GateData.of(rows_of(trace)[SIXTH])
        plan = choose(data)
        new = {"objective": data.plan_cost(plan)}
        if bounded:
            new |= {"route_bound": data.plan_cost(plan, along=True), "gap": 0.0}
        return both(column(**new), problem(plan=lambda _: plan, positions_m=lambda _: data.positions(plan).ravel()))(
            trace
        )

    return edit


def worst(data: GateData) -> Any:
    return max(ALL_PLANS, key=data.plan_cost)


def beside_the_best(data: GateData) -> Any:
    best = min(ALL_PLANS, key=lambda plan: data.plan_cost(plan, along=True))
    return np.where(np.arange(STAGES) == STAGES // 2, 1.0 - best, best)


FAULTY: tuple[tuple[str, str, Edit, str], ...] = (
    ("obstacle forgotten", RELAXED, without_point, "left out"),
    ("moving robot stands", SWAP, problem(9, centres_m=lambda v: np.tile(v[: len(v) // 60], 60)), "UGV senses"),
    ("weight of slack", RELAXED, problem(slack_weight_1_m2_s=lambda v: 1.1 * v), "weight of slack"),
    ("terminal", RELAXED, problem(terminal_weight_s=lambda v: v + 0.1), "weight of the terminal cost"),
    ("contrary answer", RELAXED, column(decision=swapped), "answer or reason"),
    ("reason", RELAXED, column(reason="dwell"), "answer or reason"),
    ("rounded nevertheless", BINARY, column(rounding_deviation_s=0.0), "a relaxation that the route has not"),
    ("loser inflated", RELAXED, column(objective_accept=lambda v: 2.0 * v, objective_refuse=lambda v: 2.0 * v),
     "throughout"),
    ("worst plan", RELAXED, other_plan(worst, bounded=False), "objective above"),
    ("dearer than rounded", RELAXED, column(objective=lambda v: 1.001 * v), "above the rounded plan's"),
    ("worse plan proved", BINARY, other_plan(beside_the_best, bounded=True), "lower bound overstated"),
    ("bound too high", BINARY, column(route_bound=lambda v: 1.001 * v, gap=0.0), "lower bound"),
    ("optimal with a gap", BINARY, column(route_bound=lambda v: 0.9999 * v, gap=1e-4), "but with a gap"),
    ("budget spent", RELAXED, decision(budget_spent), ""),
    ("no normals", RELAXED, problem(normals=lambda _: []), "a bound without unit normals"),
)  # fmt: skip
"""What is edited, in which run, how, and a word of the fault; '': no fault."""


@pytest.mark.parametrize(("name", "edit", "shown"), [row[1:] for row in FAULTY], ids=[row[0] for row in FAULTY])
def test_an_edited_record_has_faults(base: Base, name: str, edit: Edit, shown: str) -> None:
    found = wrong_decisions(edit(base(name)))
    assert any(shown in fault.what for fault in found) if shown else found == []


def changed(name: str, index: Any, *, factor: bool = False) -> Callable[[Trace, float], Trace]:
    return lambda trace, by: problem(LAST, **{name: at(index, lambda v: v * (1.0 + by) if factor else v + by)})(trace)


def moved(name: str) -> Callable[[Trace, float], Trace]:
    return lambda trace, by: with_cells(trace, "decisions", len(trace.decisions) - 1, name, lambda value: value + by)


def with_bound(worked_out: Callable[[Bounded, float], float]) -> Edit:
    def edit(trace: Trace, by: float) -> Trace:
        row = rows_of(trace)[LAST]
        (bounded,) = bound([row], 0)
        lower, cost = worked_out(bounded, by * row.scale), float(row.cost(row["positions_m"], row.half_planes))
        return with_decision(trace, lambda given, _: given.update(route_bound=lower, gap=(cost - lower) / cost), LAST)

    return edit


TOLERANCES: tuple[tuple[str, float, Callable[[Trace, float], Trace], str], ...] = (
    (B_C, POSITION_TOLERANCE_M, changed("initial_m", 0), "initial position"),
    (B_C, POSITION_TOLERANCE_M, changed("reference_m", -2), "reference"),
    (B_C, POSITION_TOLERANCE_M, changed("centres_m", 0), "point"),
    (B_C, POSITION_TOLERANCE_M, changed("distances_m", 0), "point"),
    (RELAXED, POSITION_TOLERANCE_M, changed("normals", slice(3), factor=True), "normals"),
    (RELAXED, GAP_TOLERANCE, moved("gap"), "gap"),
    (RELAXED, OVERSTATED, with_bound(lambda of, by: of.optimum.upper + by), "overstated"),
    (RELAXED, UNDERSTATED, with_bound(lambda of, by: of.optimum.lower - by), "understated"),
)


@pytest.mark.parametrize(("name", "tolerance", "edit", "shown"), TOLERANCES)
def test_twice_the_tolerance_is_a_fault_and_half_of_it_is_none(
    base: Base, name: str, tolerance: float, edit: Callable[[Trace, float], Trace], shown: str
) -> None:
    assert tolerance <= 1e-3
    assert wrong_decisions(edit(base(name), 0.5 * tolerance)) == []
    assert any(shown in fault.what for fault in wrong_decisions(edit(base(name), 2.0 * tolerance)))


@given(
    st.tuples(COSTS, COSTS), st.tuples(COSTS, COSTS), st.sampled_from([SILENT, ACCEPT, REFUSE]),
    st.sampled_from([0.0, 0.1, 0.2, 0.3]), st.sampled_from([0.0, 0.05, 0.2]), st.booleans(), st.booleans(),
    st.booleans(), st.sampled_from([None, 0.0, 1.0]),
)  # fmt: skip
def test_the_rules_are_those_of_the_running_gatekeeper(
    costs: tuple[float, float], throughout: tuple[float, float], standing: float, stood: float, margin: float,
    equal: bool, planned: bool, literal: bool, rounded: float | None,
) -> None:  # fmt: skip
    accept, refuse = (costs[0], costs[0]) if equal else costs
    plan = np.array([float(accept <= refuse)]) if planned else None
    first = None if rounded is None else np.array([rounded])
    status: Any = "optimal" if planned else "refused_not_finite"
    found = Solution(accept <= refuse, status, objective=min(costs), plan=plan, rounded=first)
    given = {"objective": min(costs), "accept_throughout": throughout[0], "refuse_throughout": throughout[1]}
    row = DecisionRecord(given, 1.0, 1.0, 1.0, 0.0, {"plan": plan, "rounded": first})
    gate = Gatekeeper(switching_margin=margin, min_dwell_s=0.2, rule="first_stage" if literal else "hysteresis")
    stands = {SILENT: None, ACCEPT: "accept", REFUSE: "refuse"}[standing]
    rules = Rules(switching_margin=margin, min_dwell=0.2, first_stage=literal)
    ours = rule(row, stands, stood, gate)
    assert ours == settle(found, throughout, standing, stood, rules)
