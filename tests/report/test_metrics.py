"""Metrics of a run."""

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
import persons
import pytest
from builders.edits import with_scenario
from builders.scenarios import lone
from builders.simulation import simulate as drive
from report.cases import GOING_ROUND, event, make_scenario, make_trace

from airground_drake.base.progress import SILENT
from airground_drake.report import after_runs, metrics
from airground_drake.scenario.load import load
from airground_drake.scenario.schema import Preset
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace


def test_metrics_of_robot_pairs_and_events(traces: dict[str, Trace]) -> None:
    found = metrics.of_run(traces["c"])
    assert found["event_counts"]["ugv1"] == {"accept": 1, "proposal": 1, "release": 1, "trigger": 1}
    ((_, nearest),) = found["min_robot_distance_m"]["uav"].items()
    assert nearest["safe_distance_m"] == 1.0
    assert found["gatekeeper"]["decisions"] == {"accept": 2}
    assert metrics.of_run(traces["a"])["gatekeeper"] is None


def test_least_pair_margin_is_the_exact_one_not_that_at_the_rows() -> None:
    trace = make_trace(make_scenario(), "a", [(0, 1.5, 0.5), (30, -8.0, 3.0)], step_s=30.0)
    fine = {robot: np.linspace(*trace.position(robot), 30_001) for robot in trace.robots}
    to_ugv2, to_uav = (np.linalg.norm(fine["ugv1"] - fine[other], axis=1) for other in ("ugv2", "uav"))
    assert min(to_uav[0], to_uav[-1]) - 1.0 < min(to_ugv2[0], to_ugv2[-1]) - 2.0  # at the rows, the UAV is nearer
    (nearest,) = metrics.of_run(trace)["min_robot_distance_m"]["ugv1"].items()
    assert (nearest[0], nearest[1]["value"]) == ("ugv2", pytest.approx(to_ugv2.min(), abs=1e-6))


def test_decisions_are_counted_by_their_gap_and_those_that_met_their_budget(
    run: Callable[[str, str], Trace],
) -> None:
    trace = run("case_b", "c")
    table = trace.decisions.iloc[:6].assign(gap=[0.0, -1e-12, -1.0, 0.01, 0.02, 1.0])
    table = table.assign(decision="refuse", number=[1, 1, 2, 2, 2, 3], robot="ugv1", reason=["waits", "kept"] * 3)
    table["status"] = ["optimal", "optimal", "optimal", "budget_spent", "budget_spent", "solver_failed"]
    table["accept_throughout"], table["refuse_throughout"] = (
        [-1.0, 4.0, 1.0, 3.0, 2.0, 9.0],
        [1.0, 1.0, 3.0, 2.0, 6.0, 1.0],
    )
    period_s = trace.scenario.gatekeeper.period_s
    timings = {"decision_times_s": [0.0, 0.5 * period_s, period_s, 2.0 * period_s]}
    found = metrics.gatekeeper(replace(trace, decisions=table, timings=timings))
    assert found is not None
    assert (found["late"], found["closest_call"]["relative_cost_margin"]) == (2, 0.5)
    assert found["gaps"] == {"zero": 2, "up_to_1_percent": 1, "more": 2}
    assert (found["budget_spent"], found["solver_failures"], found["max_gap"]) == (2, 1, 1.0)
    assert found["refusals"] == {"ugv1": {"waits": 2, "kept": 1}}  # first answers only


def test_a_run_is_home_if_every_robot_arrives() -> None:
    arrivals = [event(t, "arrival", robot) for t, robot in ((23.0, "ugv1"), (23.5, "ugv2"), (24.0, "uav"))]
    for count in (2, 3):
        trace = make_trace(make_scenario(), "c", GOING_ROUND, arrivals[:count])
        assert metrics.outcome(trace)["home"] is (count == 3)


@pytest.mark.slow
@pytest.mark.parametrize("own", [0, 2])
def test_seeds_are_those_from_1_on_and_the_reports_own_runs_serve_for_theirs(own: int) -> None:
    runs, noise = "runs={a: {method: a}, b: {method: b}}", "decision.noise_m_sqrt_s=1"
    scenario = load(
        "case_b", [f"seed={own}", "duration_s=12", "arrival_tolerance_m=99", noise, "reproduction=[]", runs]
    )
    traces = {name: simulate(scenario, name) for name in scenario.runs}
    marked = {name: replace(trace, meta=trace.meta | {"events": []}) for name, trace in traces.items()}
    found = after_runs.with_seeds(scenario, marked, 2, SILENT)
    assert [(row["run"], row["seed"]) for row in found] == [("a", 1), ("a", 2), ("b", 1), ("b", 2)]
    for row in found:
        again = metrics.outcome(simulate(scenario, row["run"], seed=row["seed"]))
        assert row == again | ({"home": False} if row["seed"] == own else {})
    crash = {row["seed"]: row["t_s"] for row in found if row["run"] == "b"}
    assert crash[1] != crash[2]  # the noise decides when the wrong intervention begins


@pytest.mark.parametrize(
    ("speed", "stands", "left_m", "left_s"),
    [(1.0, False, 30.0, 30.0), (0.0, True, 32.0, None), (-1.0, False, 34.0, None), (0.05, False, 31.9, None)],
)
def test_how_far_a_ugv_has_come_and_how_long_it_would_need(
    speed: float, stands: bool, left_m: float, left_s: float | None
) -> None:
    """Along its preset, which passes near its start again: the part that is not due yet does not count."""
    corners = [(0.0, 0.0), (10.0, 0.0), (10.0, 5.0), (-1.0, 5.0), (-1.0, 0.0), (-1.0, -1.0)]
    preset = Preset([[*corner, 0.0] for corner in corners], 1.0)
    scenario = lone([0.0] * 3, [-1.0, -1.0, 0.0], preset, 2.0)
    trace = drive(scenario, drive=lambda t: [[speed, 0.0, 0.0], [0.0] * 3])
    found = metrics.on_the_way(trace)["ugv1"]
    assert (found["stands"], found["left_m"]) == (stands, pytest.approx(left_m))
    assert found["left_s"] == (None if left_s is None else pytest.approx(left_s))
    assert found["creeps"] == (0.0 < speed < 0.1)


@pytest.mark.parametrize(("target_m", "on"), [(2.0, True), (1.5, False), (1.2, None)])
def test_who_is_kept_away_from_its_target_by_a_person_and_since_when(target_m: float, on: bool | None) -> None:
    """The person stands at 2 m; the radii are 0.45 m, and 0.3 m are kept between them."""
    trace = with_scenario(persons.run("on the goal"), ugvs__ugv1__target_m=[target_m, 0.0, 0.0])
    kept, place = metrics.on_the_way(trace)["ugv1"].get("kept_away"), trace.position("ugv1")
    assert (kept and (kept["by"], kept["on"])) == (on if on is None else ("person", on))
    if kept:
        assert kept["off_m"] == pytest.approx(np.linalg.norm(place[-1] - [target_m, 0.0, 0.0]))
        off_m = np.linalg.norm(place - place[-1], axis=1)
        assert trace.t[off_m > metrics.AT_REST_M][-1] < kept["since_s"] == trace.t[off_m <= metrics.AT_REST_M][0]


def test_stalls_name_the_bodies_that_hold_and_no_others(run: Callable[[str, str], Trace]) -> None:
    """In case A ugv1 stands between two discs until the UAV helps, or to the end; a third disc is placed alongside."""
    (alone,), (helped,) = (metrics.of_run(run("case_a", name))["stalls"] for name in ("a", "d"))
    for stall in (alone, helped):
        assert (stall["robot"], {*stall["held_by"]}) == ("ugv1", {"obstacle_1", "obstacle_2"})
        assert stall["position_m"][:2] == pytest.approx([3.37, 5.10], abs=0.01)
    assert (alone["until_s"], helped["until_s"]) == (30.0, pytest.approx(14.5, abs=0.15))
    assert alone["from_s"] == helped["from_s"] == pytest.approx(9.3, abs=0.5)


def test_who_waits_as_its_proposal_asks_is_held_by_nobody(run: Callable[[str, str], Trace]) -> None:
    trace = run("case_a", "a")
    sent = run("case_a", "d").proposals.iloc[:1].copy()
    sent["positions_m"] = [np.tile(trace.position("ugv1")[-1], 2)]
    sent["times_s"] = [np.array([14.5, 30.0])]
    events = [*trace.events, {"t_s": 14.5, "robot": "ugv1", "kind": "proposal", "policy": "detour"}]
    waits = replace(
        trace, proposals=sent, meta=trace.meta | {"events": events},
        samples=trace.samples.assign(**{"ugv1.executing": np.where(trace.samples["t_s"] > 14.5, 0, -1)}),
    )  # fmt: skip
    (stall,) = metrics.of_run(waits)["stalls"]
    assert stall["held_by"] == []


@pytest.mark.parametrize("turns", [(9.0, 7.0), (3.0, 0.5), (12.0, -4.0)])
def test_the_nearest_approach_is_that_of_all_pairs_after_they_had_been_farther_apart(turns: tuple[float, ...]) -> None:
    corners = [(0.0, 0.0, 0.5), (10.0, turns[0], 0.5), (20.0, turns[1], 7.0), (30.0, 9.0, 13.0)]
    trace = make_trace(make_scenario(), "a", corners)
    least = (np.inf, 0.0)
    for first, second in combinations([*trace.robots, *trace.scenario.obstacles], 2):
        if first in trace.robots:
            gap = metrics.gap_m(trace, first, second)
            nearer = [k for k in range(len(gap)) if gap[k] < gap[: k + 1].max() - 1e-3]
            required = 1.0 if "uav" in (first, second) and second in trace.robots else 2.0
            least = min([least, *((gap[k] - required, trace.t[k]) for k in nearer)])
    found = metrics.came_near(trace)[0]
    assert found["value"] - found["safe_distance_m"] == pytest.approx(least[0], abs=0.02)
    assert found["t_s"] == pytest.approx(least[1], abs=0.2)


def test_a_decision_variable_that_begins_above_the_threshold() -> None:
    assert metrics.of_run(make_trace(make_scenario(), "a"))["above_at_start"] == []
    above = make_trace(make_scenario(), "a", [(0, 9.3, 0.5), (30, 3.3, 13.0)])
    assert metrics.of_run(above)["above_at_start"] == ["ugv1"]
