"""For each claim about a run: a record changed by twice its tolerance is refuted, and by half of it holds."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import persons
import pytest
from builders.edits import bumped, moved, with_cells, with_decision, with_events, with_scenario
from builders.layout import rebuilt
from builders.runs import beside_a_rock
from builders.scenarios import STILL, lone
from builders.simulation import simulate
from verify.judging import CLAIMS
from verify.runs.cases import A_D, B_C, B_D, at, first, problem

from airground_drake.sim.trace import Trace
from airground_drake.verify.claim import MOTION_TOLERANCE_M, TIME_TOLERANCE_S
from airground_drake.verify.claims import live_hyp, safe_hyp
from airground_drake.verify.claims.gate_plan import LONGER, SPEED_TOLERANCE, TIE
from airground_drake.verify.claims.live_goal import AT_REST_M
from airground_drake.verify.claims.thr_trig import EVENT_TOLERANCE_S, VARIABLE_TOLERANCE_M
from airground_drake.verify.runs.gate_record import POSITION_TOLERANCE_M, cost_tolerance, rows_of
from airground_drake.verify.runs.pairs import DISTANCE_TOLERANCE_M
from airground_drake.verify.runs.triggers import NOISE_TOLERANCE_M

Edit = Callable[[Trace, float], Trace]
"""Changes a record by so much."""
A, RELAXED = "case_a a", "soft_gate c"
LAST = -1
"""The decision of a run that is edited: no other one follows from it."""


def from_the_end(key: str, robot: str = "ugv1") -> Edit:
    def edit(trace: Trace, by: float) -> Trace:
        end = (trace.position(robot)[-1] + [by, 0.0, 0.0]).tolist()
        return with_scenario(trace, **{key: {robot: end} if key.endswith("stalls_m") else end})

    return edit


def nearer_than_allowed(trace: Trace, by: float) -> Trace:
    least = trace.scenario.safe_distance.obstacle_m + CLAIMS["SAFE-TRACE"].judge(trace).margin
    return with_scenario(trace, safe_distance__obstacle_m=least + by)


def longer_dwell(trace: Trace, by: float) -> Trace:
    first, second = (e["t_s"] for e in trace.events if e["kind"] == "trigger")
    return with_scenario(trace, decision__min_inter_event_s=second - first + by)


def driven_at(_: Trace, over: float) -> Trace:
    scenario = lone([5.0, 0.0, 0.0], [5.0, 0.0, 0.0], STILL, 1.0)
    trace = simulate(scenario, drive=lambda t: [[2.0 + over, 0.0, 0.0], [0.0] * 3])
    return rebuilt(with_scenario(trace, ugvs__ugv1__max_speed_m_s=2.0))


def stepped_towards_a_person(_: Trace, by: float) -> Trace:
    trace = persons.run("on the goal")
    return moved(trace, "ugv1", len(trace.t) - 1, [by, 0.0, 0.0])


def at_the_trigger(trace: Trace) -> int:
    return int(np.argmin(np.abs(trace.t - next(e["t_s"] for e in trace.events if e["kind"] == "trigger"))))


def triggered_later(trace: Trace, by: float) -> Trace:
    shifted = with_events(
        trace, lambda every: [{**e, "t_s": e["t_s"] + by} if e["kind"] == "trigger" else e for e in every]
    )
    name = "ugv1.triggered_at_s"
    return with_cells(shifted, "states", shifted.states[name] >= 0.0, name, lambda value: value + by)


def column(name: str, unit: Callable[[Trace], float] = lambda trace: 1.0) -> Edit:
    return lambda trace, by: with_cells(
        trace, "decisions", len(trace.decisions) - 1, name, lambda value: value + by * unit(trace)
    )


def array(name: str, index: Any, *, relative: bool = False) -> Edit:
    return lambda trace, by: problem(LAST, **{name: at(index, lambda v: v * (1.0 + by) if relative else v + by)})(trace)


def of_throughout(mode: int) -> Callable[[Trace], float]:
    """What the cost of a constant plan of the last decision may differ by; the last plan of case B accepts."""
    return lambda trace: cost_tolerance(float((row := rows_of(trace)[LAST]).cost(row.constant[mode])))


def faster_than_allowed(trace: Trace, by: float) -> Trace:
    """The last step of the constant plan that refuses, by the speed limit and so much more."""
    row = rows_of(trace)[LAST]
    limit = trace.scenario.ugvs[row.given["robot"]].max_speed_m_s

    def change(given: dict[str, Any], of: dict[str, Any]) -> None:
        velocity = of["refuse_m_s"].reshape(-1, 3)
        velocity[-1] = [0.0, limit * (1.0 + by), 0.0]
        given["refuse_throughout"] = float(row.cost(row["initial_m"] + row.dt * np.cumsum(velocity, axis=0)))
        given["objective_refuse"] = max(given["objective_refuse"], given["objective"])

    return with_decision(trace, change, LAST)


def rounded_up_too_early(trace: Trace, by: float) -> Trace:
    """The first stage lacks less than half of it, and is rounded up all the same."""

    def change(given: dict[str, Any], of: dict[str, Any]) -> None:
        of["relaxed"][:], of["rounded"][:] = 0.0, 0.0
        of["relaxed"][0], of["rounded"][0] = 0.5 - by, 1.0
        given |= {"relaxed_first_stage": 0.5 - by, "rounding_deviation_s": of["dt_s"] * (0.5 + by)}

    return with_decision(trace, change, LAST)


def stops_farther(trace: Trace, by: float) -> Trace:
    """Both choices of the first decision stop short of the goal, the one taken farther from it by so much."""
    given = trace.decisions.iloc[0]
    left, speed = given["refuse_left_m"], trace.scenario.ugvs[given["robot"]].preset.speed_m_s
    changes = {}
    for choice in ("accept", "refuse"):
        here = left * (1.0 + by) if given["decision"] == choice else left
        changes |= {f"{choice}_stalls": 1.0, f"{choice}_left_m": here, f"{choice}_outcome_m2_s": here**3 / 3.0 / speed}
    return first(lambda table: table["t_s"] == given["t_s"], **changes)(trace)


def dearer_stop(trace: Trace, by: float) -> Trace:
    """A choice that stops short of the goal costs more than the way left, by so many tolerances."""
    given = trace.decisions.iloc[0]
    ahead = given["refuse_left_m"] ** 3 / 3.0 / trace.scenario.ugvs[given["robot"]].preset.speed_m_s
    values = [1.0, ahead + by * cost_tolerance(ahead)]
    return with_cells(trace, "decisions", 0, ["refuse_stalls", "refuse_outcome_m2_s"], values)


def signal(name: str, row: int | Callable[[Trace], int]) -> Edit:
    return lambda trace, by: bumped(name, by, row(trace) if callable(row) else row)(trace)


CASES: tuple[tuple[str, str, str, float, Edit, str], ...] = (
    ("SAFE-TRACE", "least distance", A, DISTANCE_TOLERANCE_M, nearer_than_allowed, "margin_m"),
    ("SAFE-TRACE", "place after a step", A, MOTION_TOLERANCE_M,
     lambda t, by: bumped("uav.x_m", by, len(t.t) - 1)(t), "error"),
    ("SAFE-OWN", "step towards a person", A, DISTANCE_TOLERANCE_M, stepped_towards_a_person, "person"),
    ("SAFE-HYP", "inequality", "at a rock", DISTANCE_TOLERANCE_M * 0.075, lambda _, by: beside_a_rock(by), "avoidance"),
    ("SAFE-HYP", "start", "at a rock", DISTANCE_TOLERANCE_M, lambda _, by: beside_a_rock(0.0, by - 2.0), "safe start"),
    ("SAFE-HYP", "way", "synthetic a", DISTANCE_TOLERANCE_M,
     lambda t, by: bumped("ugv2.x_m", by, at_the_trigger(t))(t), "error"),
    ("SAFE-HYP", "speed", A, safe_hyp.VELOCITY_TOLERANCE_M_S, driven_at, "speed limit"),
    ("ZENO-TRACE", "gap of two triggers", "refractory", TIME_TOLERANCE_S, longer_dwell, "gap_s"),
    ("THR-TRIG", "time of a trigger", A_D, EVENT_TOLERANCE_S, triggered_later, "trigger"),
    ("THR-TRIG", "variable", A_D, VARIABLE_TOLERANCE_M, signal("ugv1.decision_variable_m", 100), "variable"),
    ("THR-TRIG", "noise at the start", A_D, NOISE_TOLERANCE_M, signal("ugv1.noise_m", 0), "noise"),
    ("THR-TRIG", "noise within a period", A_D, NOISE_TOLERANCE_M, signal("ugv1.noise_m", at_the_trigger), "noise"),
    ("THR-QUALITY", "error at a trigger", "synthetic a", 1.5, lambda t, by: triggered_later(t, -by), "early"),
    ("THR-QUALITY", "error before a trigger", "synthetic a", 1.5, triggered_later, "served"),
    ("LIVE-GOAL", "distance from the target", A_D, 0.1, from_the_end("ugvs__ugv1__target_m"), "target"),
    ("LIVE-GOAL", "distance from the stall", A, 0.1, from_the_end("runs__a__stalls_m"), "stall"),
    ("LIVE-GOAL", "motion at the end", A, AT_REST_M,
     lambda t, by: moved(t, "ugv1", len(t.t) - 5, [by, 0.0, 0.0]), "stands"),
    ("GATE-PLAN", "initial position", B_C, POSITION_TOLERANCE_M, array("initial_m", 0), "initial position"),
    ("GATE-PLAN", "predicted position", B_C, POSITION_TOLERANCE_M, array("positions_m", 3), "positions"),
    ("GATE-PLAN", "clearance", B_C, POSITION_TOLERANCE_M, column("predicted_clearance_m"), "clearance"),
    ("GATE-PLAN", "cost of refusing", B_C, 1.0, column("refuse_throughout", of_throughout(0)), "refuse throughout"),
    ("GATE-PLAN", "cost of the plan", B_C, 1.0, column("objective_accept", of_throughout(1)), "objective"),
    ("GATE-PLAN", "speed", B_C, SPEED_TOLERANCE, faster_than_allowed, "faster"),
    ("GATE-PLAN", "rounding against the rule", RELAXED, TIE, rounded_up_too_early, "rounded against the rule"),
    ("GATE-PLAN", "rounding error", RELAXED, TIE, column("rounding_deviation_s"), "rounding error"),
    ("GATE-PLAN", "first stage", RELAXED, TIE, column("relaxed_first_stage"), "first stage"),
    ("GATE-PLAN", "longer way from a stop", B_D, LONGER, stops_farther, "farther"),
    ("GATE-PLAN", "cost of the way left", B_D, 1.0, dearer_stop, "way left"),
)  # fmt: skip
"""Claim, the number that it compares, run, by how much that may differ, edit, what a larger difference shows."""


@pytest.mark.parametrize(
    ("claim", "name", "tolerance", "edit", "shown"), [(c, n, b, e, s) for c, _, n, b, e, s in CASES],
    ids=[f"{claim}: {what}" for claim, what, *_ in CASES],
)  # fmt: skip
def test_twice_the_tolerance_is_refuted_and_half_of_it_holds(
    base: Callable[[str], Trace], claim: str, name: str, tolerance: float, edit: Edit, shown: str
) -> None:
    for share in (0.0, 0.5):
        assert CLAIMS[claim].judge(edit(base(name), share * tolerance)).status == "holds", share
    found = CLAIMS[claim].judge(edit(base(name), 2.0 * tolerance))
    assert found.status == ("error" if shown == "error" else "refuted")
    assert shown in str(found.counterexample or found.evidence)


def test_a_rest_and_the_time_after_it_may_be_off_by_rounding() -> None:
    tries = [SimpleNamespace(t_s=t, end_s=end) for t, end in ((0.25, 0.5), (0.75, 1.0), (1.5, 2.0))]
    for lacking, begins in ((-1.0, [0.0, 1.5]), (0.5, [0.0, 1.5]), (2.0, [0.0])):
        assert live_hyp._after_rests(cast("Any", tries), 0.5 + lacking * TIME_TOLERANCE_S) == begins
    given = {"t_s": 0.25 * np.arange(8), "ugv1.executing": np.array([-1.0, 0, -1, 1, -1, -1, 2, 2])}
    trace = SimpleNamespace(sampled=given.get, scenario=SimpleNamespace(control=SimpleNamespace(period_s=0.25)))
    for late in (0.0, 0.5):
        assert live_hyp._executed_s(cast("Any", trace), "ugv1", [0.0, 1.5 + late * TIME_TOLERANCE_S]) == [0.5, 0.5]


def test_every_claim_is_in_the_table_and_no_tolerance_is_wide() -> None:
    """LIVE-HYP compares counts, and times that are a period apart."""
    assert {claim for claim, *_ in CASES} == set(CLAIMS) - {"LIVE-HYP"}
    assert {f"{claim}: {what}": tolerance for claim, what, _, tolerance, *_ in CASES if tolerance > 1e-5} == {
        "THR-QUALITY: error at a trigger": 1.5, "THR-QUALITY: error before a trigger": 1.5,
        "LIVE-GOAL: distance from the target": 0.1, "LIVE-GOAL: distance from the stall": 0.1,
        "LIVE-GOAL: motion at the end": 1e-3,
        "GATE-PLAN: cost of refusing": 1.0, "GATE-PLAN: cost of the plan": 1.0, "GATE-PLAN: speed": 1e-4,
        "GATE-PLAN: cost of the way left": 1.0,
    }  # fmt: skip
    assert cost_tolerance(1.0) < 1e-8
