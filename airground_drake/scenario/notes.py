"""Warnings about values of a scenario that are allowed but probably unintended."""

from collections.abc import Iterator
from math import dist

import numpy as np

from airground_drake.scenario.budget import budget
from airground_drake.scenario.hints import fast
from airground_drake.scenario.schema import SafeDistance, Scenario

# Robots with a smaller radius, and worlds with shorter sides, are small for the paper's distances, m.
SMALL_M, NARROW_M = 0.5, 6.0


def notes(scenario: Scenario) -> Iterator[str]:
    for name, robot in scenario.robots.items():
        if hint := fast(robot.max_speed_m_s):
            yield f"{name} has max_speed_m_s = {robot.max_speed_m_s:g}{hint}"
    radius = max(ugv.radius_m for ugv in scenario.ugvs.values())
    places = [place[:2] for ugv in scenario.ugvs.values() for place in (ugv.start_m, ugv.target_m)]
    side = float(np.ptp(places, axis=0).max())
    defaults = [
        ("safe_distance.obstacle_m", scenario.safe_distance.obstacle_m, SafeDistance().obstacle_m, scenario.barriers),
        ("safe_distance.ugv_m", scenario.safe_distance.ugv_m, SafeDistance().ugv_m, len(scenario.ugvs) > 1),
    ]
    kept = [f"{key} = {value:g} m" for key, value, default, matters in defaults if matters and value == default]
    if kept and (0.0 < radius < SMALL_M or side < NARROW_M):
        small = f"UGVs with a radius of {radius:g} m" if 0.0 < radius < SMALL_M else f"a field of {side:.2g} m"
        yield f"{', '.join(kept)}: the paper's values, which are large for {small}; set your own"
    if scenario.asynchronous:
        yield from _of_old_positions(scenario)


def _of_old_positions(scenario: Scenario) -> Iterator[str]:
    """The worst pair of UGVs that may block each other when they meet, and the worst that starts too close to meet."""
    pairs = [pair for pair in budget(scenario) if pair.unsure_m]
    starts = {name: ugv.start_m for name, ugv in scenario.ugvs.items()}
    room_m = [pair.law_m - pair.unsure_m for pair in pairs]
    spare_m = [dist(starts[pair.first], starts[pair.second]) - pair.law_m - pair.unsure_m for pair in pairs]
    for margins_m, text in (
        (room_m, "if they meet, they can block each other for ever"),
        (spare_m, "they start closer than that, so they may only separate"),
    ):
        if min(margins_m, default=1.0) <= 0.0:
            pair = pairs[int(np.argmin(margins_m))]
            count = sum(margin_m <= 0.0 for margin_m in margins_m)
            others = f" (the first of {count} pairs)" if count > 1 else ""
            room = f"{pair.law_m:.3g} m in the law plus {pair.unsure_m:.3g} m for the age of positions"
            yield f"{pair.first} and {pair.second}{others} keep {room}: {text}"
