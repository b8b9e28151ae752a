"""Runs that put a claim to an unusual test, and hold; what a claim says of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from builders.edits import with_meta, with_scenario
from builders.runs import at_rest, chattering, refractory, run_of
from builders.scenarios import STILL, changed, lone
from builders.simulation import simulate as simulate_synthetic
from verify.judging import decided
from verify.runs.test_running_code import PATIENCE

from airground_drake.gatekeeper import outcome_gatekeeper
from airground_drake.run.simulation import simulate
from airground_drake.run.trace import Trace
from airground_drake.scenarios.load import from_data, load, resolved
from airground_drake.scenarios.schema import Decision, Obstacle, Policy, Preset, Threshold
from airground_drake.verify.runs import beginnings
from airground_drake.verify.runs.proposals import proposals_of

Run = Callable[..., Trace]


def held(claim: str, trace: Trace) -> dict[str, Any]:
    """The evidence of a claim that must hold."""
    finding = decided(claim, trace)
    assert finding.status == "holds", finding
    return dict(finding.evidence)


@pytest.mark.parametrize(
    ("scenario", "run_name"),
    [("case_a", "a"), ("case_a", "b"), ("case_a", "d"), ("case_a", "a_recursion_nearest"),
     ("case_a", "a_recursion_listed"), ("case_b", "b"), ("case_b", "c"), ("case_b", "d"), ("soft_gate", "c")],
)  # fmt: skip
def test_commands_are_the_laws_also_where_inequalities_bind(run: Run, scenario: str, run_name: str) -> None:
    assert held("EXEC", run(scenario, run_name))["robots"]["ugv1"]["binding"] > 100
    assert decided("EXEC", run(scenario, run_name)).margin == pytest.approx(1e-6, rel=1e-4)


def test_the_uavs_avoidance_and_contradicting_inequalities_are_judged(case_a: Any) -> None:
    """A pole in the UAV's way; a proposal that leads UGV1 between two obstacles, inside both safe distances."""
    case_a.obstacles["pole"] = Obstacle([0.8, 3.6, 2.3])
    case_a.intervention.policies = [Policy("towards", {"x_m": 2.85, "y_m": 5.5, "speed_m_s": 2.0})]
    case_a.decision.threshold.zeta_m, case_a.decision.release_m = 1.0, 0.9
    trace = simulate(case_a, "b")
    assert held("EXEC", trace)["robots"]["uav"]["binding"] > 5
    inside = [np.linalg.norm(trace.position("ugv1") - o, axis=1) < 1.95 for o in ([1.7, 4, 0], [4.0, 7.0, 0.0])]
    assert (inside[0] & inside[1]).any()


def test_a_uav_with_another_task_is_not_judged(case_a: Any) -> None:
    case_a.duration_s, case_a.uav.task = 1.0, "airground_drake.nsbc.tasks:FormationTask"
    assert held("EXEC", simulate(case_a, "a"))["not_judged"] == [f"uav: task {case_a.uav.task}"]


def test_stages_of_several_control_periods_hold() -> None:
    trace = simulate(load("case_a", ["gatekeeper.stages=20", "duration_s=16.0", "reproduction=[]"]), "c")
    assert held("GATE-MODEL", trace)["decisions"] > 5
    assert held("GATE-MODEL", trace)["farthest_from_predicted"]["away_m"] > 0.0


@pytest.mark.slow
def test_a_queue_along_an_axis_is_squeezed_and_holds() -> None:
    """Seven UGVs behind each other but for 1e-9 m, before a gap between two obstacles that is as wide as a point.

    Each is in contact with two others: predicted to be pushed by both, it may leap for kilometres.
    """
    data = resolved(load("minimal"))
    ends = [([-6.0 - 3.0 * i, 1e-9 * (-1) ** i, 0.0], [14.0 - 3.0 * i, 0.0, 0.0]) for i in range(7)]
    data["ugvs"] = {
        f"u{i}": {
            "start_m": start, "target_m": end, "max_speed_m_s": 3.0, "preset": {"waypoints_m": [start, end]},
        }
        for i, (start, end) in enumerate(ends)
    }  # fmt: skip
    data["obstacles"] = {f"o{i}": {"position_m": [0.0, y, 0.0]} for i, y in enumerate((2.0, -2.0))}
    data["uav"] = {"start_m": [-15.0, 0.0, 2.0], "target_m": [5.0, 0.0, 2.0]}
    data["control"] |= {"period_s": 0.05, "sensing_range_m": 6.0}
    data["gatekeeper"] |= {"period_s": 0.1, "stages": 30}
    data["intervention"]["period_s"] = 0.1
    data["decision"] |= {"noise_period_s": 0.05, "threshold": {"zeta_m": 2.0}}
    trace = simulate(from_data(data | {"duration_s": 9.5}, "queue"), "d")
    assert trace.decisions["refuse_left_m"].max() > 1e3
    assert held("EXEC", trace)
    assert held("GATE-MODEL", trace)


def test_the_nearest_obstacles_of_an_endless_map_count() -> None:
    assert outcome_gatekeeper.MOST_CLAIMED == beginnings.MOST_CLAIMED == 64
    scenario = load("case_a", ["duration_s=15.5", "reproduction=[]", "choices=[]"])
    scenario.intervention.policies = [Policy("towards", {"x_m": 6.0, "y_m": 5.0, "speed_m_s": 2.0})]
    scenario.uav.phantoms_m = [[float(x), float(y), 0.0] for x in range(10, 20) for y in range(0, 20, 2)]
    trace = simulate(scenario, "d")
    assert held("GATE-MODEL", trace)["outcomes"]
    sent = proposals_of(trace)[0]
    known = len(beginnings.known_discs(trace, "ugv1", sent.issued_s, sent)[0])
    assert 64 <= known <= 64 + len(scenario.obstacles)


def test_a_ugv_goes_along_as_often_and_as_long_as_it_may() -> None:
    trace = simulate(load("case_b", PATIENCE), "d")
    assert {"over", "exhausted"} <= set(trace.decisions["reason"])
    for claim in ("GATE-MODEL", "GATE-PLAN", "EXEC", "COMM", "SAFE-TRACE"):
        held(claim, trace)
    assert held("LIVE-PROG", trace)["accepted_interventions_ended"]["over"] >= 1


@pytest.mark.parametrize(("hidden", "answer"), [((6.5, 9.0), "refuse"), ((4.5, 10.0), "accept")])
def test_an_accepted_intervention_is_reconsidered_when_an_obstacle_is_new(
    case_a: Any, hidden: tuple[float, float], answer: str
) -> None:
    """The obstacle is not on the UAV's map; it comes into sight after the acceptance."""
    case_a.obstacles["hidden"] = Obstacle(position_m=[*hidden, 0.0], known_to_uav=False)
    trace = simulate(case_a, "d")
    mine = trace.decisions[trace.decisions["number"] == trace.decisions["number"].iloc[0]]
    first, again = (row for _, row in mine[mine["accept_stalls"] >= 0.0].iterrows())
    assert (first["decision"], again["decision"], first["tries"], again["tries"]) == ("accept", answer, 1.0, 1.0)
    for claim in ("LIVE-PROG", "GATE-MODEL", "GATE-PLAN"):
        held(claim, trace)
    trace.decisions.loc[again.name, ["decision", "reason"]] = ["accept", "kept"]
    assert decided("LIVE-PROG", replace(trace)).status == "refuted"


def test_messages_are_counted() -> None:
    decided = len(run_of("d").decisions)
    found = held("COMM", run_of("d"))
    assert found["spent"] == {"proposal": 1, "decision": decided}
    assert found["always_on"] == {"proposal": 720, "decision": 720}
    assert decided("COMM", run_of("d")).margin == pytest.approx(1.0 - decided / 720)


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_a_crossing_inside_the_dwell_triggers_at_its_end(noise: float) -> None:
    trace = refractory(noise)
    times = [event["t_s"] for event in trace.events if event["kind"] == "trigger"]
    assert np.diff(times) == pytest.approx([4.0], abs=1e-9)
    assert held("THR-TRIG", trace)
    assert set(trace.column("ugv1.mode")) == {0.0, 1.0, 2.0}
    assert decided("ZENO-TRACE", trace).margin == pytest.approx(0.0, abs=1e-12)


def test_a_bare_trigger_chatters() -> None:
    found = decided("ZENO-TRACE", chattering())
    assert found.evidence["triggers"]["ugv1"]["count"] > found.evidence["most_triggers_possible"]
    assert 0.0 < found.evidence["smallest_gap"]["gap_s"] < 0.5


def test_above_the_threshold_at_the_start_triggers_at_once() -> None:
    trace = simulate_synthetic(lone([4.0, 0.0, 0.0], [4.0, 0.0, 0.0], STILL, 1.0), drive=at_rest)
    assert [event["t_s"] for event in trace.events if event["kind"] != "proposal"] == [0.0]
    assert held("THR-TRIG", trace)
    assert decided("THR-TRIG", with_meta(trace, events=[])).status == "refuted"


def test_a_corner_of_the_preset_inside_a_row_interval() -> None:
    """The variable peaks at the corner, between two rows, above the threshold: seen only if it is cut there."""
    out_and_home = Preset([[0.0, 0.0, 0.0], [3.0125, 0.0, 0.0], [0.0, 0.0, 0.0]], 1.0)
    decision = Decision(threshold=Threshold(zeta_m=3.005), release_m=3.0045)
    trace = simulate_synthetic(lone([0.0] * 3, [0.0] * 3, out_and_home, 7.0, decision=decision), drive=at_rest)
    samples = trace.column("ugv1.decision_variable_m")[np.abs(trace.t - np.round(trace.t / 0.025) * 0.025) < 1e-9]
    assert samples.max() < 3.005
    assert [event["kind"] for event in trace.events if event["kind"] != "proposal"] == ["trigger", "release"]
    assert held("THR-TRIG", trace)
    never = simulate_synthetic(changed(trace.meta["scenario"], {"decision.threshold.zeta_m": 99.0}), drive=at_rest)
    unseen = with_meta(with_scenario(never, decision__threshold__zeta_m=3.005), zeta_m=3.005)
    found = decided("THR-TRIG", unseen).counterexample or {}
    assert (found["what"], found["t_s"]) == ("missing trigger", pytest.approx(3.005, abs=1e-9))


@pytest.mark.parametrize("trigger", ["automaton", "bare"])
@pytest.mark.parametrize("seed", range(3))
def test_random_motions_and_noise(trigger: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    velocities = np.repeat(rng.normal(0.0, 2.0, (40, 3)), 4, axis=0) * [1.0, 1.0, 0.0]
    decision = Decision(trigger=trigger, release_m=0.6, min_inter_event_s=0.4, noise_m_sqrt_s=0.2)
    decision.threshold.zeta_m = 1.0
    preset = Preset([[0.0, 0.0, 0.0], [0.7, 0.3, 0.0], [0.7, -0.2, 0.0]], 0.61)
    trace = simulate_synthetic(
        lone([0.5, 0.0, 0.0], [0.0] * 3, preset, 4.0, decision=decision), seed=seed,
        drive=lambda t: [velocities[round(t / 0.025)].tolist(), [0.0] * 3],
    )  # fmt: skip
    assert held("THR-TRIG", trace)
    assert trace.events


@pytest.mark.parametrize(("run", "safe_m", "duration_s"), [("d", 1e-6, 1.2), ("c", 1e-3, 1.6)])
def test_a_prediction_that_depends_on_rounding_is_not_compared(run: str, safe_m: float, duration_s: float) -> None:
    """Four UGVs head for one point: where they get round each other depends on the last digits."""
    corners = {"e": (1.0, 0.0), "n": (0.0, 1.0), "w": (-1.0, 0.0), "s": (0.0, -1.0)}
    data = {
        "name": "meeting", "duration_s": duration_s, "decision": {"threshold": {"zeta_m": 0.2}, "release_m": 0.1},
        "ugvs": {
            name: {"start_m": [x, y, 0.0], "target_m": [-x, -y, 0.0], "max_speed_m_s": 6.0}
            | {"preset": {"waypoints_m": [[x, y, 0.0], [-x, -y, 0.0]], "speed_m_s": 1.0}}
            for name, (x, y) in ((name, (0.7071068518972258 * x, 0.7071068518972258 * y))
                                 for name, (x, y) in corners.items())
        },
        "uav": {"start_m": [0.0, 0.0, 2.0], "target_m": [0.0, 0.0, 2.0], "altitude_m": 2.0, "max_speed_m_s": 10.0},
        "safe_distance": dict.fromkeys(("obstacle_m", "ugv_m", "air_ground_m"), safe_m) | {"collision_m": safe_m / 50},
        "control": {"sensing_range_m": 2.0}, "runs": {run: {"method": run}},
        "intervention": {"policies": [{"name": "towards", "parameters": {"x_m": 0.0, "y_m": 0.0, "speed_m_s": 1e5}}]},
    }  # fmt: skip
    assert held("GATE-MODEL", simulate(from_data(data, "meeting"), run))["unstable"] > 0
