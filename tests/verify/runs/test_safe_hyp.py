"""SAFE-HYP."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
import pytest
from builders.edits import moved, rows, with_scenario
from builders.layout import rebuilt
from builders.runs import at_rest, passing_by, run_of
from builders.scenarios import STILL, case_a, lone
from builders.simulation import simulate
from verify.judging import counterexample, judge

from airground_drake.base.arrays import Array
from airground_drake.nsbc.avoidance import Avoidance, Surroundings
from airground_drake.run.trace import Trace
from airground_drake.scenarios.schema import Obstacle


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
def test_what_is_missed_is_what_the_controllers_inequalities_lack(seed: int) -> None:
    """The inequalities, written in nsbc and in the exact check, agree for every pair."""
    trace, h = crowd(seed), 0.025
    found = {(entry["first"], entry["second"]): entry for entry in judge("SAFE-HYP", trace).evidence["pairs"]}
    avoidance = Avoidance(gain=3.0, period=h, sensing_range=100.0)
    ticks = np.flatnonzero(np.abs(trace.t / h - np.round(trace.t / h)) < 1e-6)
    place = {name: trace.position(name)[ticks] for name in trace.robots}
    place |= {
        name: np.broadcast_to(each.position_m, (len(ticks), 3)) for name, each in trace.scenario.obstacles.items()
    }
    step = {name: np.diff(each, axis=0) for name, each in place.items()}

    def lack(robot: str, other: str, safe: float, share: float) -> Array:
        around = Surroundings(
            place[other][:-1, None], np.full((len(ticks) - 1, 1), safe), np.full((len(ticks) - 1, 1), share)
        )
        mobility = np.tile([1.0, 1.0, float(robot == "uav")], (len(ticks) - 1, 1))
        spaces = avoidance.half_spaces(place[robot][:-1], mobility, around)
        return np.maximum(-h * spaces.slack(step[robot] / h)[:, 0], 0.0)

    compared = 0
    for first, second in product(trace.robots, place):
        if first == second or (second in trace.robots[: trace.robots.index(first)]):
            continue
        obstacle = second not in trace.robots
        safe = 2.0 if obstacle or "uav" not in (first, second) else 1.0
        missed = lack(first, second, safe, 1.0) if obstacle else lack(first, second, safe, 0.5)
        missed += 0.0 if obstacle else lack(second, first, safe, 0.5)
        apart = np.linalg.norm((place[first] - place[second])[:-1], axis=1)
        missed[apart >= safe + sum(np.linalg.norm(step[name], axis=1) for name in (first, second))] = 0.0
        entry = found.get((first, second), {"e_m": 0.0, "guarantee_m": safe})
        assert entry["e_m"] == pytest.approx(missed.max(), abs=1e-12)
        starts = max(missed.max() / (3.0 * h), safe - apart[0], 0.0)
        assert entry["guarantee_m"] == pytest.approx(safe - starts, abs=1e-10)
        compared += missed.max() > 0.0
    assert compared > 0


HYPOTHESES: dict[str, Callable[[Trace], Trace]] = {  # those with a tolerance: below
    "controller parameters": lambda trace: with_scenario(trace, control__sensing_range_m=4.001),
    "gain: A h <= 1": lambda trace: with_scenario(trace, control__avoidance_gain_1_s=40.1),
    "sensing range": lambda trace: with_scenario(trace, control__sensing_range_m=2.29),
    "safe start": lambda trace: with_scenario(trace, safe_distance__ugv_m=2.001),
    "planar motion": lambda trace: moved(trace, "ugv2", 200, [0.0, 0.0, 1e-9]),
    "sampling": lambda trace: with_scenario(trace, control__period_s=0.0125),
}


@pytest.mark.parametrize("hypothesis", HYPOTHESES)
def test_safe_hyp_names_the_broken_hypothesis(hypothesis: str) -> None:
    assert judge("SAFE-HYP", run_of("a")).status == "holds"
    assert counterexample("SAFE-HYP", HYPOTHESES[hypothesis](run_of("a")))["hypothesis"] == hypothesis


def stopped_at_the_limit() -> Trace:
    """A UGV that stands at the safe distance of an obstacle, so that any step towards it is one too many."""
    scenario = lone([-2.0, 0.0, 0.0], [-2.0, 0.0, 0.0], STILL, 3.0, obstacles={"o": Obstacle([0.0] * 3)})
    return simulate(scenario, drive=at_rest)


def test_safe_hyp_refuted_although_the_distance_was_kept() -> None:
    assert counterexample("SAFE-HYP", passing_by(1e-6))["second"] == "o"
    assert judge("SAFE-TRACE", passing_by(1e-6)).status == "holds"


def test_safe_hyp_a_missing_sample_is_seen_even_if_the_motion_is_straight() -> None:
    mutant = rows(lambda signals: signals.drop(index=50))(stopped_at_the_limit())
    assert counterexample("SAFE-HYP", mutant)["hypothesis"] == "sampling"
    assert "no row" in judge("SAFE-TRACE", mutant).evidence.error


def towards_the_rock(step: float, start: float = -2.0) -> Trace:
    """A UGV that stands at the safe distance of an obstacle and takes one step into it, m."""
    scenario = lone([start, 0.0, 0.0], [start, 0.0, 0.0], STILL, 3.0, obstacles={"o": Obstacle([0.0] * 3)})
    return simulate(scenario, drive=lambda t: [[step / 0.025 * (round(t / 0.025) == 7), 0.0, 0.0], [0.0] * 3])


def test_safe_hyp_promises_what_follows_from_the_shortfall() -> None:
    finding = judge("SAFE-HYP", towards_the_rock(0.015))  # A h = 0.075
    assert finding.status == "refuted"
    assert finding.evidence["e_m"] == pytest.approx(0.015, abs=1e-15)
    assert finding.evidence["guarantee_m"] == pytest.approx(1.8, abs=1e-12)
    assert finding.margin == pytest.approx(-0.2, abs=1e-12)
    (pair,) = finding.evidence["pairs"]
    assert (pair["first"], pair["second"], pair["safe_distance_m"]) == ("ugv1", "o", 2.0)
    assert pair["t_s"] == pytest.approx(0.175)
    kept = judge("SAFE-HYP", towards_the_rock(0.0))
    assert (kept.status, kept.margin, kept.evidence["e_m"], kept.evidence["guarantee_m"]) == ("holds", 0.0, 0.0, 2.0)


def test_safe_hyp_without_a_gain_promises_what_all_samples_leave() -> None:
    trace = with_scenario(towards_the_rock(2.0**-10), control__avoidance_gain_1_s=0.0)
    (pair,) = judge("SAFE-HYP", trace).evidence["pairs"]
    samples = round(trace.scenario.duration_s / 0.025)
    assert pair["guarantee_m"] == pytest.approx(2.0 - samples * 2.0**-10, abs=1e-12)


TOLERANCES: dict[str, tuple[float, Callable[[float], Trace]]] = {
    "avoidance": (1e-9 * 0.075, towards_the_rock),
    "safe start": (1e-9, lambda short: towards_the_rock(0.0, start=-2.0 + short)),
    "straight motion": (1e-9, lambda off: moved_at_an_event(off)),
    "speed limit": (1e-9, lambda over: rebuilt(with_scenario(driven_at(2.0 + over), ugvs__ugv1__max_speed_m_s=2.0))),
}


def moved_at_an_event(off: float) -> Trace:
    """A UGV that is beside its way at an event between two control samples."""
    trace = run_of("a")
    event = int(np.flatnonzero(trace.t == trace.events[0]["t_s"])[0])
    return moved(trace, "ugv2", event, [off, 0.0, 0.0])


def driven_at(speed: float) -> Trace:
    scenario = lone([5.0, 0.0, 0.0], [5.0, 0.0, 0.0], STILL, 1.0)
    return simulate(scenario, drive=lambda t: [[speed, 0.0, 0.0], [0.0] * 3])


@pytest.mark.parametrize("name", TOLERANCES)
def test_safe_hyp_refutes_twice_its_tolerance_and_takes_half_of_it(name: str) -> None:
    tolerance, made = TOLERANCES[name]
    assert judge("SAFE-HYP", made(0.5 * tolerance)).status == "holds"
    assert counterexample("SAFE-HYP", made(2.0 * tolerance))["hypothesis"] == name
