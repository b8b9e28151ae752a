"""What a process of its own costs a policy: the same policy asked here and there, in turn.

    python benchmarks/policies.py --proposals 2000

For `detour` on the map of case A, and for `towards`, which has nothing to compute, the time of a proposal in the
process of the simulation and in one of its own; their difference is the price, their ratio what a run notices. The two
are asked in turn, so that both meet the same machine; the least and the median are printed, by the clock and, on Linux,
in CPU time of both processes, which does not count the wait for a processor. Besides: the time to start the process,
once in a run, and that of the first proposal afterwards.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from airground_drake.intervention.database import make_policy
from airground_drake.intervention.guest.process import GuestPolicy
from airground_drake.intervention.policy import Observation, Policy, Teammate, motions_of
from airground_drake.scenarios.load import load
from airground_drake.systems.components import make_map, make_presets


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


def elapsed(ask: Callable[[], object], child: int | None = None) -> tuple[float, float]:
    """Time of a call by the clock, ms, and CPU time of this process and of a child, ms."""
    before, started, spent = cpu_s(child), time.perf_counter(), time.process_time()
    ask()
    taken, spent = time.perf_counter() - started, time.process_time() - spent
    return 1e3 * taken, 1e3 * (spent + cpu_s(child) - before)


def cpu_s(child: int | None) -> float:
    """CPU time that all threads of a child have had, s; 0 where the system does not say."""
    threads = Path(f"/proc/{child}/task").glob("*/schedstat")
    return sum(int(thread.read_text(encoding="utf-8").split()[0]) for thread in threads) / 1e9


def compare(here: Policy, name: str, parameters: dict[str, float], proposals: int) -> None:
    """Print what the policy takes here and there."""
    seen = observation()
    started = time.perf_counter()
    there = make_policy(name, parameters, 60.0)
    child = there._process.pid if isinstance(there, GuestPolicy) else None
    print(f"{name}\n  start {1e3 * (time.perf_counter() - started):.0f} ms", end="")
    print(f", first proposal {elapsed(lambda: there.propose(seen))[0]:.2f} ms")
    calls = (
        lambda: motions_of(here.propose(seen.fresh()), seen),
        lambda: motions_of(there.propose(seen), seen),
    )
    taken = np.array([[elapsed(call, child) for call in calls] for _ in range(proposals)])
    for k, time_of in enumerate(("by the clock", "CPU time")):
        both = taken[:, :, k]
        for said, (inside, outside) in (("least", both.min(axis=0)), ("median", np.median(both, axis=0))):
            print(f"  {time_of}, {said}: here {inside:.3f} ms, there {outside:.3f} ms, ", end="")
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
