"""Robots among people who walk at random and give way to nobody: own doing, collisions, arrivals.

    python benchmarks/persons.py -n 20
    python benchmarks/persons.py -n 100 --persons 8 --known

Starts, targets and ways are drawn; a way may lead through walls and robots. Nothing promises that nobody is run into:
SAFE-OWN must hold in every run.
"""

from __future__ import annotations

import argparse
from collections import Counter
from functools import partial

import numpy as np

from airground_drake.base.parallel import run_parallel
from airground_drake.run.simulation import simulate
from airground_drake.scenarios.load import load, validated
from airground_drake.scenarios.schema import Moves, Obstacle, Scenario
from airground_drake.verify import judge

CLAIMS = ("SAFE-TRACE", "SAFE-OWN", "SAFE-HYP")
HALL_M = (8.0, 5.0)
"""Half of the length and of the width in which people walk."""


def drawn(seed: int, persons: int, *, known: bool) -> Scenario:
    """The scenario `crowd` with other people."""
    rng, scenario = np.random.default_rng(seed), load("crowd")
    scenario.obstacles = {"pillar": scenario.obstacles["pillar"]}
    for k in range(persons):
        corners = rng.uniform(-1.0, 1.0, (int(rng.integers(2, 5)), 2)) * HALL_M
        speed = float(rng.uniform(0.3, 1.2))
        moves = Moves([[*corner, 0.0] for corner in corners.round(3).tolist()], speed, at_end="reverse")
        scenario.obstacles[f"person{k}"] = Obstacle(radius_m=0.25, moves=moves, max_speed_m_s=1.2, known_motion=known)
    return validated(scenario)


def outcome(seed: int, persons: int, method: str, *, known: bool) -> Counter[str]:
    """What one run came to."""
    trace = simulate(drawn(seed, persons, known=known), method)
    found = Counter({verdict.claim.id: verdict.status == "holds" for verdict in judge(trace, CLAIMS)})
    hit = {event["robot"] for event in trace.events if event["kind"] == "collision"}
    found["robots run into"] = len(hit)
    arrived = {event["robot"] for event in trace.events if event["kind"] == "arrival"}
    found["robots arrived"] = len(arrived & set(trace.ugvs))
    return found


def main() -> None:
    """Print a line per method."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=20, help="runs per method (default: 20)")
    parser.add_argument("--persons", type=int, default=8, help="people in the hall (default: 8)")
    parser.add_argument("--seed", type=int, default=1, help="of the first run (default: 1)")
    parser.add_argument("--known", action="store_true", help="predictions know the ways of people")
    given = parser.parse_args()
    for method in "ad":
        seeds = range(given.seed, given.seed + given.n)
        work = [partial(outcome, seed, given.persons, method, known=given.known) for seed in seeds]
        total = sum(run_parallel(work, names=[f"seed {seed}" for seed in seeds]), Counter[str]())
        told = ", ".join(f"{claim} in {total[claim]}" for claim in CLAIMS)
        ends = f"{total['robots run into']} robots were run into, {total['robots arrived']} of {3 * given.n} arrived"
        print(f"({method}) {given.n} runs: {told}; {ends}")


if __name__ == "__main__":
    main()
