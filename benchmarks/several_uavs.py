"""Who arrives with one UAV, with two, and when one of them is lost.

    python benchmarks/several_uavs.py
    python benchmarks/several_uavs.py crossing warehouse --seeds 3

Method (d). Of two UAVs each is in charge of one half of the UGVs, in their order, and the second flies higher. A UAV is
lost 0.1 s before the first proposal of the run in which none is lost, or 0.1 s after it: then some of its UGVs have
been asked, and others have not.
"""

import argparse
from collections.abc import Iterator
from typing import Any

from airground_drake.scenario.load import from_data, load, resolved
from airground_drake.scenario.schema import Scenario
from airground_drake.sim.simulation import simulate
from airground_drake.sim.trace import Trace
from airground_drake.verify import judge

DEFAULT = ("swap", "doorway", "intersection", "crossing", "warehouse", "lab", "pillars")
APART_M = 0.5
CLAIMS = ("SAFE-TRACE", "SAFE-HYP", "LIVE-HYP", "GATE-PLAN")


def with_uavs(name: str, count: int, seed: int, lost_s: float = 0.0) -> Scenario:
    """A shipped scenario with one or two UAVs, the last of which is lost at a time, s; 0: never."""
    data: dict[str, Any] = resolved(load(name)) | {"seed": seed, "choices": [], "reproduction": []}
    data["runs"] = {"d": data["runs"]["d"] | {"expected": {}}}
    uav, ugvs = data.pop("uav") | {"target_m": []}, [*data["ugvs"]]
    half = (len(ugvs) + 1) // 2
    teams = [ugvs] if count == 1 else [ugvs[:half], ugvs[half:]]
    data["uavs"] = {}
    for k, team in enumerate(teams):
        higher = k * (APART_M + 2.0 * uav["radius_m"] + 0.2)
        x, y, z = uav["start_m"]
        placed = {"start_m": [x, y, z + higher], "altitude_m": uav["altitude_m"] + higher}
        data["uavs"][f"uav{k + 1}"] = uav | placed | {"name": f"uav{k + 1}", "ugvs": team}
    data["uavs"][f"uav{count}"]["lost_at_s"] = lost_s
    data["safe_distance"]["uav_m"] = APART_M
    return from_data(data, name)


def told(trace: Trace) -> str:
    """How many UGVs arrived, when the last one did, and which claims do not hold."""
    arrived = [event["t_s"] for event in trace.events if event["kind"] == "arrival" and event["robot"] in trace.ugvs]
    bad = [verdict.claim.id for verdict in judge(trace) if verdict.claim.id in CLAIMS and verdict.status == "refuted"]
    last = f", {max(arrived):.1f} s" if arrived else ""
    return f"{len(arrived)} of {len(trace.ugvs)}{last}{' ' if bad else ''}{', '.join(bad)}"


def cells(name: str, seed: int) -> Iterator[str]:
    """The cells of a row."""
    for count in (1, 2):
        trace = simulate(with_uavs(name, count, seed), "d")
        yield told(trace)
        for later_s in (-0.1, 0.1):
            if trace.proposals.empty:
                yield "-"
                continue
            first_s = float(trace.proposals["issued_s"].min())
            yield told(simulate(with_uavs(name, count, seed, first_s + later_s), "d"))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenarios", nargs="*", default=DEFAULT, metavar="SCENARIO")
    parser.add_argument("--seeds", type=int, default=1)
    options = parser.parse_args()
    heads = [f"{uavs}{lost}" for uavs in ("one UAV", "two") for lost in ("", ", lost before", ", lost after")]
    print(f"| scenario | {' | '.join(heads)} |\n|{' --- |' * (len(heads) + 1)}")
    for name in options.scenarios:
        for seed in range(1, options.seeds + 1):
            print(f"| {name} | {' | '.join(cells(name, seed))} |", flush=True)


if __name__ == "__main__":
    main()
