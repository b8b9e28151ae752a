"""Positions between UGVs that come late or are lost: a period of delay is free, and who lacks a message stands."""

from dataclasses import replace
from functools import cache
from itertools import permutations
from typing import Any

import maps
import numpy as np
import pytest
from builders.edits import with_cells
from oracles import ORACLES, faults_of
from sim.blocks.both_programs import broken_rules, checked, found

from airground_drake.base.arrays import Array
from airground_drake.base.errors import PluginError
from airground_drake.check import safety
from airground_drake.model.plants.budget import Bounds, law_distance, part_of_gain
from airground_drake.scenario.load import from_data, load, resolved
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.blocks.positions import WaryUgvController
from airground_drake.sim.diagram import make_monitor
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.uav.channel import lost
from airground_drake.verify import judge

PERIOD_S, APART_M = 0.05, 0.6
ABOUT_D = ("SAFE-TRACE", "SAFE-HYP", "LIVE-HYP", "GATE-PLAN", "THR-TRIG")


def team(seed: int, links: dict[str, float] | None, plant: Any = None, **more: Any) -> Scenario:
    draw = np.random.default_rng(seed)
    angles = 0.5 * np.pi * np.arange(4) + draw.uniform(-0.5, 0.5, 4)
    starts = np.round(4.0 * np.column_stack([np.cos(angles), np.sin(angles)]), 3)
    ends = np.round(-starts + draw.uniform(-0.6, 0.6, (4, 2)), 3)
    speeds = draw.uniform(0.8, 2.0, 4).round(2)
    ugvs = {
        f"ugv{k}": maps.straight(*way, 0.7 * speed, max_speed_m_s=speed, **({"plant": plant} if plant else {}))
        for k, (*way, speed) in enumerate(zip(starts, ends, speeds.tolist(), strict=True), start=1)
    }
    rock = [*np.round(draw.uniform(-0.5, 0.5, 2), 3).tolist(), 0.0]
    data = {
        "name": "circle", "duration_s": 8.0, "ugvs": ugvs, "uav": {"start_m": [0.0, 0.0, 3.0], "altitude_m": 3.0},
        "obstacles": {"rock": {"position_m": rock, "radius_m": 0.2}},
        "safe_distance": {"obstacle_m": 0.4, "ugv_m": APART_M},
        "control": {"period_s": PERIOD_S, "avoidance_gain_1_s": 8.0},
        "decision": {"threshold": {"zeta_m": 1.2}, "release_m": 0.8, "noise_period_s": 0.05},
        "intervention": {"policies": [{"name": "coordinate"}]},
        "runs": {"a": {"method": "a"}, "d": {"method": "d"}},
        **({"channel": {"ugvs": links}} if links else {}), **more,
    }  # fmt: skip
    return from_data(data, "test")


@cache
def run(seed: int, loss: float, delay_s: float = 0.0, method: str = "a") -> Trace:
    return simulate(team(seed, {"loss": loss, "delay_s": delay_s}), method)


def least_m(trace: Trace) -> float:
    least = np.inf
    for k, first in enumerate(trace.ugvs):
        for second in trace.ugvs[k + 1 :]:
            offset = trace.position(first) - trace.position(second)
            start, way = offset[:-1], np.diff(offset, axis=0)
            squared = np.maximum((way**2).sum(axis=1), 1e-30)
            part = np.clip(-(start * way).sum(axis=1) / squared, 0.0, 1.0)
            least = min(least, float(np.linalg.norm(start + part[:, None] * way, axis=1).min()))
    return least


@pytest.mark.parametrize(("seed", "loss"), [(0, 0.5), (1, 0.5), (2, 0.1), (3, 0.1)])
def test_no_distance_breaks_and_the_theorem_covers_the_run(seed: int, loss: float) -> None:
    trace = run(seed, loss, PERIOD_S if seed % 2 else 0.0)
    assert least_m(trace) >= APART_M - 1e-9
    verdicts = {verdict.claim.id: verdict for verdict in judge(trace, ["SAFE-TRACE", "SAFE-HYP"])}
    assert {verdict.status for verdict in verdicts.values()} == {"holds"}
    assert verdicts["SAFE-HYP"].exercised
    assert verdicts["SAFE-HYP"].margin == pytest.approx(0.0, abs=1e-9)
    assert safety.safe_hyp(checked(trace)).status == "holds"
    assert not faults_of(trace)
    stood = [np.linalg.norm(trace.chosen(ugv), axis=1) == 0.0 for ugv in trace.ugvs]
    assert np.mean(stood) > 0.2 * loss  # and not because messages were never missed


class Heedless(WaryUgvController):
    def _commanded(self, context: Any, t: float, positions: Array, *about: Any) -> Array:
        velocity, n = np.zeros((len(about[0]), 3)), len(about[0])
        last = self._last_places.Eval(context).reshape(n, n, 3)
        for i in range(n):
            known = positions.copy()
            known[:n] = last[i]
            velocity[i] = self.velocity(t, known, *about)[i]
        return velocity


def test_without_standing_distances_break_and_both_programs_say_which_rule(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("airground_drake.sim.blocks.positions.WaryUgvController", Heedless)
    for seed in (0, 1):
        trace = simulate(team(seed, {"loss": 0.5}), "a")
        assert least_m(trace) < APART_M - 1e-3
        assert broken_rules(trace) == 2 * ["standing without a message"]


def test_a_delay_of_up_to_a_period_is_free() -> None:
    """The runs differ by rounding alone; that of half a period is that of a whole one."""
    exact, late = simulate(team(0, None), "d"), run(0, 0.0, PERIOD_S, "d")
    for robot in exact.robots:
        assert np.allclose(exact.position(robot), late.position(robot), rtol=0.0, atol=1e-9)
        assert np.allclose(late.as_seen(robot, robot), late.position(robot)[late.sample_rows], rtol=0.0, atol=1e-12)
    assert late.samples.equals(run(0, 0.0, 0.5 * PERIOD_S, "d").samples)
    assert set(found(late, *ABOUT_D).values()) == {"holds"}
    assert not faults_of(late)


PLANTS: dict[str, Any] = {
    "unicycle": {"kind": "unicycle", "hand_point_m": 0.15},
    "lag": {"kind": "lag", "time_constant_s": 0.1},
    "delay": {"kind": "delay", "delay_s": 0.1},
}


@pytest.mark.parametrize("plant", PLANTS)
def test_points_that_the_law_steers_are_where_they_are_announced(plant: str) -> None:
    trace = simulate(team(1, {"loss": 0.3, "delay_s": PERIOD_S}, PLANTS[plant]), "a")
    assert found(trace, "SAFE-TRACE", "SAFE-HYP") == {"SAFE-TRACE": "holds", "SAFE-HYP": "holds"}
    assert safety.safe_hyp(checked(trace)).status == "holds"


def test_measured_positions_are_announced_too() -> None:
    sensing = {"position_error_m": 0.03, "errors": "adversarial"}
    trace = simulate(team(2, {"loss": 0.3, "delay_s": PERIOD_S}, sensing=sensing), "d")
    off = np.linalg.norm(trace.as_seen("ugv1", "ugv2") - trace.position("ugv2")[trace.sample_rows], axis=1)
    assert 0.9 * 0.03 < off.max() <= 0.03
    assert least_m(trace) >= APART_M
    assert set(found(trace, *ABOUT_D).values()) == {"holds"}
    assert safety.safe_hyp(checked(trace)).status == "holds"
    assert not faults_of(trace)


def test_positions_elsewhere_than_announced_are_found() -> None:
    trace = run(0, 0.0, PERIOD_S, "d")
    moved = with_cells(trace, "samples", 40, "ugv1.seen_x_m", lambda seen: seen + 1e-6)
    assert broken_rules(moved) == 2 * ["announced position"]


def test_a_ugv_that_drives_without_a_message_of_a_near_one_is_found() -> None:
    trace = run(0, 0.5)
    k, first, second = next(
        (k, first, second)
        for first, second in permutations(trace.ugvs, 2)
        for k in np.flatnonzero(np.linalg.norm(trace.chosen(first), axis=1) > 0.1).tolist()
        if np.linalg.norm((trace.position(first) - trace.position(second))[trace.sample_rows[k]]) < APART_M + 0.1
    )
    unheard = with_cells(trace, "samples", k, f"{first}.heard_{second}_s", trace.sampled("t_s")[k - 1])
    assert broken_rules(unheard) == 2 * ["standing without a message"]
    assert ORACLES["records"](unheard)


def test_what_is_lost_depends_on_seed_and_sample_alone_and_starts_are_known() -> None:
    few, many = (np.mean([lost(3, loss, 4, k) for k in range(1, 400)], axis=0) for loss in (0.1, 0.5))
    others = ~np.eye(4, dtype=np.bool_)
    assert np.abs(few[others] - 0.1).max() < 0.06
    assert np.abs(many[others] - 0.5).max() < 0.1
    assert not many[~others].any()
    assert not lost(3, 0.5, 4, 0).any()
    assert all((lost(3, 0.5, 4, k) | ~lost(3, 0.1, 4, k)).all() for k in range(1, 100))  # more loss loses more
    heard = run(0, 0.5).sampled("ugv2.heard_ugv3_s") < run(0, 0.5).sampled("t_s") - 1e-9
    assert heard.tolist() == [bool(lost(1, 0.5, 4, k)[1, 2]) for k in range(len(heard))]


def test_a_position_that_is_heard_at_no_time_so_far_is_not_heard() -> None:
    trace = run(0, 0.5)
    samples = trace.samples.assign(**{"ugv1.heard_ugv2_s": 1e9})
    assert broken_rules(replace(trace, samples=samples)) == 2 * ["standing without a message"]


def test_one_of_a_pair_that_may_stand_costs_half_the_gain() -> None:
    drifts, stands = Bounds(drift_m_s=0.1), Bounds(may_stand=True)
    assert law_distance(1.0, drifts, Bounds(speed_m_s=1.0), gain=5.0) == pytest.approx(1.02)
    assert law_distance(1.0, drifts, stands, gain=5.0) == pytest.approx(1.04)
    assert part_of_gain(stands) == 1.0  # beside what is at rest


def test_without_the_key_nothing_is_written_of_it_and_the_loop_leaves_it_to_drake() -> None:
    assert simulate(team(0, {"loss": 0.5}), "a", engine="batch").samples.equals(run(0, 0.5).samples)
    assert "ugvs" not in resolved(load("noisy_link"))["channel"]
    with pytest.raises(PluginError, match="says what UGVs know, and a monitor sees true positions"):
        make_monitor(team(0, {"loss": 0.5}))
