"""What a process of its own costs a policy: the same policy asked here and there, in turn.

    python benchmarks/policies.py --proposals 2000

For `detour` on the map of case A, and for `towards`, which has nothing to compute, the time of a proposal in the
process of the simulation and in one of its own; their difference is the price, their ratio what a run notices. The two
are asked in turn, so that both meet the same machine; the least and the median are printed. Besides: the time to start
the process, once in a run, and that of the first proposal afterwards.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np

from airground_drake.components import make_map, make_presets
from airground_drake.intervention.database import make_policy
from airground_drake.intervention.policy import Observation, Policy, Teammate, motions_of
from airground_drake.scenarios.load import load


def observation() -> Observation:
    """What the UAV sees of case A where its first UGV stalls."""
    scenario = load("case_a")[0]
    places = np.array([[3.37, 5.1, 0.0], [-2.6, 8.0, 0.0], [0.0, 6.5, 2.0]])
    targets = np.array([ugv.target_m for ugv in scenario.ugvs.values()])
    presets, (known, _) = make_presets(scenario), make_map(scenario)
    team = tuple(
        Teammate(name, places[i], targets[i], presets[i], 3.0, triggered=i == 0, standing=i == 0)
        for i, name in enumerate(scenario.ugvs)
    )
    return Observation(
        14.45, 14.5, team[0].name, places[0], targets[0], presets[0], known, known, places[1:], 2.0, 0, team, 2.0
    )


def elapsed(ask: Callable[[], object]) -> float:
    """Wall-clock time of a call, ms."""
    started = time.perf_counter()
    ask()
    return 1e3 * (time.perf_counter() - started)


def compare(here: Policy, name: str, parameters: dict[str, float], proposals: int) -> None:
    """Print what the policy takes here and there."""
    seen = observation()
    started = time.perf_counter()
    there = make_policy(name, parameters, 60.0)
    print(f"{name}\n  start {1e3 * (time.perf_counter() - started):.0f} ms", end="")
    print(f", first proposal {elapsed(lambda: there.propose(seen)):.2f} ms")
    calls = (
        lambda: motions_of(here.propose(seen.fresh()), seen),
        lambda: motions_of(there.propose(seen), seen),
    )
    taken = np.array([[elapsed(call) for call in calls] for _ in range(proposals)])
    for said, (inside, outside) in (("least", taken.min(axis=0)), ("median", np.median(taken, axis=0))):
        print(f"  {said}: here {inside:.3f} ms, there {outside:.3f} ms, ", end="")
        print(f"difference {outside - inside:.3f} ms, ratio {outside / inside:.2f}")


def main() -> None:
    """Compare a policy with some work and one with none."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--proposals", type=int, default=2000)
    proposals = parser.parse_args().proposals
    known = {"x_m": 3.3, "y_m": 13.0, "speed_m_s": 2.8}
    for name, place, parameters in (
        ("detour", "airground_drake.intervention.detour:Detour", {"speed_m_s": 2.8}),
        ("towards", "airground_drake.intervention.wrong:Towards", known),
    ):
        compare(make_policy(name, parameters), place, parameters, proposals)


if __name__ == "__main__":
    main()
