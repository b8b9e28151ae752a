"""Bodies that lag or get their commands late, beside what appears or stops; each hypothesis of SAFE-HYP by itself."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import maps
import numpy as np
import pytest
from builders.edits import with_cells
from promises import judged

from airground_drake.model.plants.budget import AT_REST, Bounds, kept_distance, law_distance
from airground_drake.scenario.load import from_data, load
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge
from airground_drake.verify.claims.safe_hyp import SafeHyp
from airground_drake.verify.runs.pairs import least_gap, pair_of

LATE = {"kind": "delay", "delay_s": 1.0}
ROCK = {"position_m": [2.0, 0.0, 0.0], "radius_m": 0.2, "appears_s": 1.5}
PERSON = {"radius_m": 0.05, "moves": {"waypoints_m": [[1.2, -3.0], [1.2, 0.0]], "speed_m_s": 1.5, "start_s": 0.8}}


def beside(obstacle: dict[str, Any], plant: Any, *, speed: float = 2.0, radius: float = 0.1, **safe: float) -> Trace:
    limit = speed if speed < 1.0 else 2.5
    ugv = maps.straight((0.0, 0.0), (8.0, 0.0), speed, max_speed_m_s=limit, radius_m=radius, plant=plant)
    data = {
        "name": "late", "duration_s": 6.0, "ugvs": {"u1": ugv}, "obstacles": {"rock": obstacle},
        "uav": {"start_m": [0.0, 20.0, 4.0], "target_m": [8.0, 20.0, 4.0], "altitude_m": 4.0},
        "safe_distance": {"obstacle_m": 0.3, "ugv_m": 0.3, "air_ground_m": 0.5, **safe},
        "control": {"period_s": 0.05, "sensing_range_m": 8.0}, "runs": {"d": {"method": "d"}},
    }  # fmt: skip
    return simulate(from_data(data, "late"), "d")


def found(trace: Trace) -> dict[str, Any]:
    return {verdict.claim.id: verdict for verdict in judge(trace, ("SAFE-TRACE", "SAFE-HYP", "SAFE-OWN"))}


def broken(trace: Trace) -> set[str]:
    evidence = SafeHyp().check(trace).evidence
    names = {row["hypothesis"] for row in evidence["worst"] if row["margin"] < -1e-8}
    return names | ({"avoidance"} if evidence["e_m"] > 1e-9 else set())


def test_a_body_whose_way_under_given_commands_is_not_clear_has_no_proof() -> None:
    """The steered point is past the rock when it appears, the body 0.7 m before it."""
    trace = beside(ROCK, LATE)
    verdicts = found(trace)
    assert broken(trace) == {"safe start of the bodies"}
    assert verdicts["SAFE-HYP"].status == "refuted"
    assert verdicts["SAFE-HYP"].evidence["guarantee_m"] is None
    (row,) = (row for row in verdicts["SAFE-HYP"].evidence["pairs"] if row["second"] == "rock")
    assert (row["guarantee_m"], row["why"]) == (None, "safe start of the bodies missed by 0.6 m")


def test_what_never_moves_ran_into_nobody() -> None:
    """The rock might move, and does not: by commands under way the robot drives over it."""
    trace = beside({**ROCK, "max_speed_m_s": 0.1}, LATE)
    verdicts = found(trace)
    (met,) = verdicts["SAFE-TRACE"].evidence["encounters"]
    assert (met["doing"], met["appeared"]) == ("under way", False)
    assert verdicts["SAFE-OWN"].status == "refuted"
    assert verdicts["SAFE-TRACE"].counterexample["why"].startswith("u1 drove 0.")


def test_who_drives_on_where_a_person_stops_at_the_distance_did_it() -> None:
    """The person stands from 2.8 s on at exactly the distance required; the body comes 0.24 m nearer."""
    safe = {"obstacle_m": 0.2, "collision_m": 0.02}
    verdicts = found(beside(PERSON, LATE, speed=0.5, radius=0.05, **safe))
    (met,) = verdicts["SAFE-TRACE"].evidence["encounters"]
    assert (met["doing"], met["under_way_m"]) == ("under way", pytest.approx(0.24, abs=0.01))
    assert verdicts["SAFE-OWN"].status == "refuted"


def test_who_drives_on_towards_a_person_who_comes_did_it_together_with_them() -> None:
    walks_on = {**PERSON, "moves": {**PERSON["moves"], "waypoints_m": [[1.2, -3.0], [1.2, 0.1]]}}
    verdicts = found(beside(walks_on, LATE, speed=0.5, radius=0.05, obstacle_m=0.2, collision_m=0.02))
    (met,) = verdicts["SAFE-TRACE"].evidence["encounters"]
    assert met["doing"] == "both"
    assert verdicts["SAFE-TRACE"].counterexample["why"].endswith(" m from rock, which moved, too")


def test_what_is_lost_comes_off_what_the_points_keep() -> None:
    """Where a rock appears nearer to a lagging robot than required, no guarantee is above the true gap."""
    rock = {"position_m": [3.35, 0.0, 0.0], "radius_m": 0.05, "appears_s": 2.2}
    trace = beside(rock, {"kind": "lag", "time_constant_s": 0.5}, obstacle_m=0.2, collision_m=0.01)
    verdicts = found(trace)
    assert verdicts["SAFE-HYP"].evidence["guarantee_m"] is None
    assert least_gap(trace, pair_of(trace, "u1", "rock")).gap_m == pytest.approx(-0.088, abs=1e-3)


LAGGING = Bounds(lag_s=0.5, speed_m_s=2.0)


@pytest.mark.parametrize(
    ("other", "passive"),
    [
        (AT_REST, False),
        (AT_REST, True),
        (Bounds(cover_m=0.1, drift_m_s=0.15, lag_s=0.2, delay_s=0.3, speed_m_s=2.0), False),
        (Bounds(speed_m_s=1.0), False),
    ],
)
def test_bodies_keep_what_points_keep_less_lag_and_cover(other: Bounds, passive: bool) -> None:
    """The inverse of the law's distance; the legs of a triangle by hand."""
    lagging = Bounds(cover_m=0.05, drift_m_s=0.03, lag_s=0.5, delay_s=0.1, speed_m_s=2.0)
    drawn = Bounds(cover_m=0.3, dip_m=0.01, speed_m_s=1.0, drawn=True)
    for one in (lagging, drawn, Bounds(speed_m_s=1.0)):
        for safe in (0.0, 0.2, 3.0):
            law = float(law_distance(safe, one, other, gain=3.0, passive=passive))
            assert kept_distance(law, one, other, gain=3.0, passive=passive) == pytest.approx(safe, abs=1e-12)
    assert kept_distance(1.25, LAGGING, gain=3.0) == pytest.approx(0.75)
    assert kept_distance(0.9, LAGGING, gain=3.0) == -np.inf


WHEELS = "{kind: unicycle, hand_point_m: 0.3, max_turn_rad_s: 2.0, wheel_base_m: 0.4, max_wheel_speed_m_s: 1.5}"
LIMITS = {
    "turning limit": (WHEELS.replace(", wheel_base_m: 0.4, max_wheel_speed_m_s: 1.5", ""), 2.1),
    "wheel speeds": (WHEELS.replace(" max_turn_rad_s: 2.0,", ""), 3.2),
    "dip of the hand point": ("{kind: unicycle, hand_point_m: 0.3}", 9.0),
    "least turning radius": ("{kind: ackermann, hand_point_m: 0.3, wheelbase_m: 0.3, max_steering_rad: 0.3}", 1.5),
}


def plain(plant: str, *more: str) -> Trace:
    given = [*more, f"ugvs.ugv1.plant={plant}", "ugvs.ugv1.max_speed_m_s=1.4", "obstacles={}", "uav.altitude_m=3"]
    return simulate(load("minimal", [*given, "duration_s=4.0"]), "a")


@pytest.mark.parametrize("name", LIMITS)
def test_one_turn_above_a_limit_breaks_that_hypothesis_alone(name: str) -> None:
    plant, rate_rad_s = LIMITS[name]
    trace = plain(plant)
    assert not broken(trace)
    later, turn = trace.t >= trace.t[trace.sample_rows[51]], rate_rad_s * trace.scenario.control.period_s
    assert broken(with_cells(trace, "states", later, "ugv1.heading_rad", lambda value: value + turn)) == {name}


EDITS: dict[str, tuple[str, Callable[[Any, Any], None]]] = {
    "never backwards": (
        WHEELS.replace("}", ", backwards: false}"),
        lambda states, _: states.__setitem__("ugv1.heading_rad", states["ugv1.heading_rad"] + np.pi),
    ),
    "speed of the body": (
        "{kind: lag, time_constant_s: 0.2}", lambda states, _: states.__setitem__("ugv1.body_vx_m_s", 1.5)
    ),
    "speed limit": ("{kind: first_order}", lambda _, samples: samples.__setitem__("ugv1.vx_m_s", 1.5)),
}  # fmt: skip


@pytest.mark.parametrize("name", EDITS)
def test_one_recorded_signal_breaks_its_hypothesis_alone(name: str) -> None:
    plant, edit = EDITS[name]
    trace = plain(plant)
    states, samples = trace.states.copy(), trace.samples.copy()
    edit(states, samples)
    assert not broken(trace)
    assert broken(replace(trace, states=states, samples=samples)) == {name}


def test_a_steered_point_off_its_line_breaks_straight_motion_alone() -> None:
    trace = plain("{kind: first_order}", "decision.noise_m_sqrt_s=0.001", "decision.noise_period_s=0.0125")
    row = int(np.setdiff1d(np.arange(len(trace.t)), trace.sample_rows)[20])
    assert broken(with_cells(trace, "states", row, "ugv1.y_m", lambda y_m: y_m + 1e-6)) == {"straight motion"}


@pytest.mark.slow
def test_no_promise_is_above_the_truth() -> None:
    """Drawn robots of every plant beside what appears, stops and turns back; 1,000 draws: docs/results.md."""
    results = [result for result in map(judged, range(100)) if result]
    tested = sum((result.tested for result in results), start=type(results[0].tested)())
    assert [words for result in results for words in result.broken] == []
    for promise in ("guarantee", "proved", "kept period", "cleared", "SAFE-OWN", "budget"):
        assert tested[promise] >= 10, tested


def test_whoever_commands_a_late_body_into_a_rock_did_it() -> None:
    """Under (b) the steered point itself is led into the rock."""
    changes = {
        "ugvs.ugv1.plant": {"kind": "delay", "delay_s": 0.1},
        "intervention.policies": [{"name": "towards", "parameters": {"speed_m_s": 1.5, "x_m": 10.0, "y_m": 0.0}}],
        "runs": {"b": {"method": "b"}},
    }
    (met,) = judge(simulate(load("minimal", changes), "b"), ("SAFE-TRACE",))[0].evidence["encounters"]
    assert met["doing"] == "robot"
