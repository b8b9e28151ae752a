"""Robots among people who give way to nobody: own doing, collisions, arrivals; beside them ORCA (`orca`).

    python benchmarks/persons.py -n 20
    python benchmarks/persons.py -n 20 --hunting --ways a d

People walk at random or, with `--hunting`, each at the robot that is nearest to it: every second it sets out for where
that robot was, in a run before, a second later. The first of the runs before has people who walk at random; each pass
aims again at what the robots then did. Starts, targets and ways are drawn; a way may lead through walls and robots.
Nothing promises that nobody is run into: SAFE-OWN must hold in every run.
"""

import argparse
import math
from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
import orca

from airground_drake.base.arrays import Array
from airground_drake.base.parallel import run_parallel
from airground_drake.model.bodies.motion import PeriodMotion
from airground_drake.scenario.courses import course
from airground_drake.scenario.load import load, validated
from airground_drake.scenario.schema import Moves, Obstacle, Scenario
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge

CLAIMS = ("SAFE-TRACE", "SAFE-OWN", "SAFE-HYP")
HALL_M = (8.0, 5.0)
"""Half of the length and of the width in which people walk."""
BODY_M, MOST_M_S = 0.25, 1.2
"""Radius of a person, m, and the speed that robots expect at most, m/s."""
AHEAD_S = 1.0
"""A person who walks at a robot chooses its way for this time."""
PASSES = 2
ENDS = ("run into", "nearer than required", "arrived")
WAYS = {"a": ("a", False), "d": ("d", False), "known": ("d", True), "orca": ("orca", False)}
"""How robots go about it: the method, and whether predictions know the ways of people."""


class Tracks(NamedTuple):
    """Where the UGVs of a run were: times (T,), s, and places (n, T, 3), m."""

    t: Array
    places: Array

    def at(self, t: float) -> Array:
        """Places at a time, (n, 2), m."""
        return np.array([[np.interp(t, self.t, way[:, axis]) for axis in (0, 1)] for way in self.places])


def drawn(seed: int, persons: int, *, known: bool, hunted: Tracks | None = None) -> Scenario:
    """The scenario `crowd` with other people, who walk at random or at the robots of other runs."""
    rng, scenario = np.random.default_rng(seed), load("crowd", ["duration_s=45"])
    scenario.obstacles = {"pillar": scenario.obstacles["pillar"]}
    for k in range(persons):
        corners = (rng.uniform(-1.0, 1.0, (int(rng.integers(2, 5)), 2)) * HALL_M).round(3)
        speed = float(rng.uniform(0.3, MOST_M_S))
        ways = corners.tolist()
        if hunted is not None:
            ways = chase(hunted, corners[0], speed, scenario.control.period_s, scenario.duration_s)
        moves = Moves([[*corner, 0.0] for corner in ways], speed, at_end="stop" if hunted else "reverse")
        scenario.obstacles[f"person{k}"] = Obstacle(
            radius_m=BODY_M, moves=moves, max_speed_m_s=MOST_M_S, known_motion=known
        )
    return validated(scenario)


def chase(hunted: Tracks, start: Array, speed: float, period_s: float, until_s: float) -> list[list[float]]:
    """Corners [x, y], m, of the way of somebody who walks at the nearest robot, as far as it gets in each `AHEAD_S`."""
    found, t = [start.round(3).tolist()], 0.0
    while t < until_s:
        place = np.array(found[-1])
        offset = hunted.at(t + AHEAD_S) - place
        towards = offset[np.linalg.norm(offset, axis=1).argmin()]
        length = float(np.linalg.norm(towards))
        step = towards * min(1.0, speed * AHEAD_S / length) if length > 0.05 else np.array([0.1, 0.0])
        found.append((place + step).round(3).tolist())
        t += period_s * max(1, math.ceil(math.dist(found[-2], found[-1]) / speed / period_s))
    return found


def outcome(seed: int, persons: int, way: str, *, hunting: bool) -> Counter[str]:
    """What one run came to."""
    method, known = WAYS[way]
    run = by_orca if method == "orca" else by_method
    scenario = drawn(seed, persons, known=known)
    tracks, found = run(scenario, method)
    for _ in range(PASSES if hunting else 0):
        scenario = drawn(seed, persons, known=known, hunted=tracks)
        tracks, found = run(scenario, method)
    count = found()
    targets = np.array([ugv.target_m for ugv in scenario.ugvs.values()])
    apart = np.linalg.norm(tracks.places - targets[:, None], axis=2)
    count["robots arrived"] = int((apart[:, -1] <= scenario.arrival_tolerance_m).sum())
    limits = scenario.safe_distance.collision_m, scenario.safe_distance.moving_m - 1e-9
    hit, near = (least_gaps(scenario, tracks) < limit for limit in limits)
    count["robots run into"], count["robots nearer than required"] = int(hit.sum()), int(near.sum())
    return count


Judged = tuple[Tracks, Callable[[], Counter[str]]]
"""Where the robots of a run were, and what judges it."""


def by_method(scenario: Scenario, method: str) -> Judged:
    """A run of the package."""
    trace = simulate(scenario, method)
    return Tracks(trace.t, np.stack([trace.position(ugv) for ugv in trace.ugvs])), partial(judged, trace)


def judged(trace: Trace) -> Counter[str]:
    """Which of the claims hold."""
    return Counter({verdict.claim.id: int(verdict.status == "holds") for verdict in judge(trace, CLAIMS)})


def by_orca(scenario: Scenario, _: str) -> Judged:
    """The same robots and people, by ORCA."""
    ugvs, half = list(scenario.ugvs.values()), 0.5 * scenario.safe_distance.moving_m
    corner, (low, high) = 0.5 * np.array(scenario.obstacles["pillar"].size_m) + half, np.array(scenario.arena_m)
    pillar, hall = orca.box(-corner, corner), orca.box(low + half, high - half)[::-1]
    steps = orca.STEP_S * np.arange(round(scenario.duration_s / orca.STEP_S) + 1)
    traffic = orca.Traffic(
        np.array([ugv.start_m[:2] for ugv in ugvs]), ugvs[0].radius_m + half, ugvs[0].max_speed_m_s,
        orca.presets_of(scenario), [pillar, hall], walks(scenario, steps)[..., :2], BODY_M + half, scenario.seed,
    )  # fmt: skip
    tracks = Tracks(*orca.driven(traffic, scenario.duration_s))
    return tracks, lambda: Counter({"SAFE-OWN": int(own_margin(scenario, tracks) >= -1e-9)})


def walks(scenario: Scenario, t: Array) -> Array:
    """Where the people are at times (T,), s: (k, T, 3), m."""
    period, until = scenario.control.period_s, scenario.duration_s
    moving = [each.moves for each in scenario.obstacles.values() if each.moves]
    return np.stack([course(moves, period, until).sample(t) for moves in moving])


def least_gaps(scenario: Scenario, tracks: Tracks) -> Array:
    """The least gap between each robot and anybody, over the run, (n,), m."""
    radii = np.array([ugv.radius_m for ugv in scenario.ugvs.values()]) + BODY_M
    apart = tracks.places[:, None] - walks(scenario, tracks.t)
    least = PeriodMotion(apart[..., :-1, :], apart[..., 1:, :]).least_distance()[0]
    return np.asarray(least.min(axis=(1, 2)) - radii)


def own_margin(scenario: Scenario, tracks: Tracks) -> float:
    """SAFE-OWN beside people: how much nearer than min(D, d + V h) a robot came to where somebody was, m."""
    safe = scenario.safe_distance.moving_m + BODY_M + next(iter(scenario.ugvs.values())).radius_m
    apart = tracks.places[:, None, :-1] - walks(scenario, tracks.t)[:, :-1]
    least = PeriodMotion(apart, apart + np.diff(tracks.places, axis=1)[:, None]).least_distance()[0]
    keeps = safe + MOST_M_S * orca.STEP_S
    return float((least - np.minimum(np.linalg.norm(apart, axis=3), keeps)).min())


def main() -> None:
    """Print a line per way."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=20, help="runs for each way (default: 20)")
    parser.add_argument("--persons", type=int, default=8, help="people in the hall (default: 8)")
    parser.add_argument("--seed", type=int, default=1, help="of the first run (default: 1)")
    parser.add_argument("--hunting", action="store_true", help="people walk at the nearest robot")
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=list(WAYS), help="default: all")
    parser.add_argument("--jobs", type=int, help="processes (default: one for each processor)")
    given = parser.parse_args()
    for way in given.ways:
        seeds = range(given.seed, given.seed + given.n)
        work = [partial(outcome, seed, given.persons, way, hunting=given.hunting) for seed in seeds]
        total = sum(run_parallel(work, names=[f"seed {seed}" for seed in seeds], jobs=given.jobs), Counter[str]())
        claims = CLAIMS if way != "orca" else ("SAFE-OWN",)
        told = ", ".join(f"{claim} in {total[claim]}" for claim in claims)
        ends = ", ".join(f"{total[f'robots {what}']} {what}" for what in ENDS)
        print(f"({way}) {given.n} runs, {3 * given.n} robots: {told}; {ends}", flush=True)


if __name__ == "__main__":
    main()
