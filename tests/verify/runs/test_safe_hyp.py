"""SAFE-HYP."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from builders.edits import moved, rows, with_scenario
from builders.runs import at_rest, passing_by, run_of
from builders.scenarios import STILL, case_a, lone
from builders.simulation import simulate
from verify.judging import counterexample, judge

from airground_drake.nsbc.avoidance import Avoidance, Surroundings
from airground_drake.scenarios.schema import Obstacle
from airground_drake.trace import Trace


def crowd(seed: int) -> Trace:
    """Robots near and inside each other's and an obstacle's safe distance, moving at random."""
    rng = np.random.default_rng(seed)
    start = rng.uniform([-0.5, 2.0, 0.0], [3.0, 6.0, 0.0], (3, 3))
    start[2, 2] = 1.5
    starts = {f"{name}.start_m": s.tolist() for name, s in zip(("ugvs.ugv1", "ugvs.ugv2", "uav"), start, strict=True)}
    velocity = rng.normal(0.0, 1.5, (20, 3, 3)) * [[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 1.0]]
    scenario = case_a(starts | {"duration_s": 0.5})
    return simulate(scenario, drive=lambda t: velocity[round(t / 0.025)].tolist())


@pytest.mark.parametrize("seed", range(8))
def test_safe_hyp_margins_are_those_of_the_controllers_inequalities(seed: int) -> None:
    """The inequalities, written twice, in nsbc and for this claim, agree for every robot at every sample."""
    trace = crowd(seed)
    found = [w for w in judge("SAFE-HYP", trace).evidence["worst"] if w["hypothesis"] == "avoidance"]
    avoidance = Avoidance(gain=3.0, period=0.025, sensing_range=4.0)
    ticks = np.flatnonzero(np.abs(trace.t / 0.025 - np.round(trace.t / 0.025)) < 1e-6)[:-1]
    for robot in trace.robots:
        others = [r for r in trace.robots if r != robot]
        obstacles = [np.broadcast_to(o["position_m"], (len(ticks), 3)) for o in trace.scenario["obstacles"].values()]
        centre = np.stack([*obstacles, *(trace.position(r)[ticks] for r in others)], axis=1)
        apart = [1.0 if "uav" in (robot, r) else 2.0 for r in others]
        distance = np.tile([2.0] * 3 + apart, (len(ticks), 1))
        share = np.tile([1.0] * 3 + [0.5] * len(others), (len(ticks), 1))
        mobility = np.tile([1.0, 1.0, float(robot == "uav")], (len(ticks), 1))
        spaces = avoidance.half_spaces(trace.position(robot)[ticks], mobility, Surroundings(centre, distance, share))
        least = spaces.slack(trace.command(robot)[ticks + 1]).min(axis=1)
        (entry,) = [w for w in found if w["robot"] == robot]
        assert entry["margin"] == pytest.approx(least.min(), abs=1e-11)
        assert entry["t_s"] == trace.t[ticks][least.argmin()]


def crossing_the_hold(trace: Trace) -> Trace:
    """The event row gets a command of its own: the robot takes a detour inside one control period."""
    event = int(np.flatnonzero(trace.t == trace.events[0]["t_s"])[0])
    return moved(trace, "ugv2", event, [1e-7, 0.0, 0.0])


HYPOTHESES: dict[str, tuple[str, Callable[[Trace], Trace]]] = {
    "avoidance": ("avoidance", lambda trace: moved(trace, "ugv1", 100, [1e-6, 0.0, 0.0])),
    "zero-order hold": ("zero-order hold", crossing_the_hold),
    "gain": ("gain: A h <= 1", lambda trace: with_scenario(trace, control__avoidance_gain_1_s=40.1)),
    "sensing range": ("sensing range", lambda trace: with_scenario(trace, control__sensing_range_m=2.29)),
    "speed limit": ("speed limit", lambda trace: with_scenario(trace, ugvs__ugv1__max_speed_m_s=2.0)),
    "safe start": ("safe start", lambda trace: with_scenario(trace, safe_distance__ugv_m=2.001)),
    "planar": ("planar motion", lambda trace: moved(trace, "ugv2", 200, [0.0, 0.0, 1e-9])),
    "sampling": ("sampling", lambda trace: with_scenario(trace, control__period_s=0.0125)),
}


@pytest.mark.parametrize("name", HYPOTHESES)
def test_safe_hyp_names_the_broken_hypothesis(name: str) -> None:
    hypothesis, mutate = HYPOTHESES[name]
    base = run_of("a") if name != "avoidance" else stopped_at_the_limit()
    assert judge("SAFE-HYP", base).status == "holds"
    assert counterexample("SAFE-HYP", mutate(base))["hypothesis"] == hypothesis


def stopped_at_the_limit() -> Trace:
    """A UGV that stands at the safe distance of an obstacle, so that any step towards it is one too many."""
    scenario = lone([-2.0, 0.0, 0.0], [-2.0, 0.0, 0.0], STILL, 3.0, obstacles={"o": Obstacle([0.0] * 3)})
    return simulate(scenario, drive=at_rest)


def test_safe_hyp_refuted_although_the_distance_was_kept() -> None:
    assert counterexample("SAFE-HYP", passing_by(1e-6))["other"] == "o"
    assert judge("SAFE-TRACE", passing_by(1e-6)).status == "holds"


def test_safe_hyp_a_missing_sample_is_seen_even_if_the_motion_is_straight() -> None:
    mutant = rows(lambda signals: signals.drop(index=50))(stopped_at_the_limit())
    assert counterexample("SAFE-HYP", mutant)["hypothesis"] == "sampling"
    assert "no row" in judge("SAFE-TRACE", mutant).evidence["error"]
