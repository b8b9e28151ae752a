"""Runs that many tests share."""

from functools import cache

import planner

from airground_drake.scenario.schema import Decision, Obstacle, Threshold
from airground_drake.sim import simulation
from airground_drake.sim.trace import Trace
from builders.scenarios import STILL, case_a, lone
from builders.simulation import simulate


@cache
def run_of(method: str) -> Trace:
    return simulate(case_a(), method)


@cache
def chattering() -> Trace:
    """A bare trigger whose decision variable hovers at the threshold: many triggers."""
    decision = Decision(trigger="bare", noise_m_sqrt_s=0.3, min_inter_event_s=0.5)
    return simulate(lone([3.01, 0.0, 0.0], [3.0, 0.0, 0.0], STILL, 3.0, decision=decision), drive=at_rest, seed=28)


def at_rest(t: float) -> list[list[float]]:
    return [[0.0] * 3, [0.0] * 3]


def there_and_back(t: float) -> list[list[float]]:
    """Out beyond the threshold, back below the release level, out again and home."""
    speed = 2.0 if t < 2.0 or 3.5 <= t < 6.0 else -2.0 if t < 8.9 else 0.0
    return [[speed, 0.0, 0.0], [0.0] * 3]


def refractory(noise: float = 0.0) -> Trace:
    """Triggers at 1.5 s; released at 3.25 s; above again before the dwell of 4 s is over: triggers at 5.5 s."""
    decision = Decision(min_inter_event_s=4.0, noise_m_sqrt_s=noise)
    return simulate(lone([0.0] * 3, [0.2, 0.0, 0.0], STILL, 10.0, decision=decision), drive=there_and_back)


def passing_by(offset: float) -> Trace:
    """A UGV passes an obstacle at 2 m + offset, closest in the middle between two rows."""
    scenario = lone(
        [-0.5125, 2.0 + offset, 0.0], [0.4875, 2.0 + offset, 0.0], STILL, 1.0, obstacles={"o": Obstacle([0.0] * 3)}
    )
    return simulate(scenario, drive=lambda t: [[1.0, 0.0, 0.0], [0.0] * 3])


def leaking() -> Trace:
    """Noise that triggers within its periods, so that these have rows within."""
    threshold = Threshold(zeta_m=0.5)
    decision = Decision(threshold, release_m=0.4, min_inter_event_s=0.1, noise_m_sqrt_s=1.0, leak_1_s=0.5)
    return simulate(lone([0.0] * 3, [0.2, 0.0, 0.0], STILL, 10.0, decision=decision), drive=at_rest)


def beside_a_rock(step: float = 0.0, start: float = -2.0) -> Trace:
    """A UGV stands at the safe distance of an obstacle and takes one step into it, m."""
    scenario = lone([start, 0.0, 0.0], [start, 0.0, 0.0], STILL, 3.0, obstacles={"o": Obstacle([0.0] * 3)})
    return simulate(scenario, drive=lambda t: [[step / 0.025 * (round(t / 0.025) == 7), 0.0, 0.0], [0.0] * 3])


@cache
def dead_end() -> Trace:
    """Under (d), ugv1 would accept its part of a joint plan, but others refuse theirs."""
    return simulation.simulate(planner.scenario_of("deadend4", planner.dead_end(4), 3.0), "d")
