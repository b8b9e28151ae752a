"""The reproduction table over many seeds: `python benchmarks/seeds.py case_a case_b -n 50`.

For each row of a scenario's reproduction table: the paper's value, the median and the 5 % and 95 % quantiles over the
seeds, and the number of seeds within the tolerance. `airground report NAME --seeds N` counts the seeds that keep all
distances and bring all home.

`--policies` prints which policy of the behaviour database helped how often instead, in the runs with a gatekeeper.
"""

import argparse
from collections import Counter, defaultdict
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Any

import numpy as np

from airground_drake.base.registry import METHODS
from airground_drake.report.reproduction import rows
from airground_drake.scenario.load import load
from airground_drake.sim.simulation import Recorder

ANSWERS = ("proposal", "accept", "refuse")


def of_run(name: str, run: str, seeds: int) -> list[list[dict[str, Any]]]:
    """The rows about a run, for each seed."""
    scenario = load(name)
    recorder = Recorder(scenario, run)
    of_seeds = (rows(scenario, {run: recorder.simulate(seed)}) for seed in range(1, seeds + 1))
    return [[row for row in each if row["run"] == run] for each in of_seeds]


def of_policies(name: str, run: str, seeds: int, changes: Sequence[str]) -> dict[str, Counter[str]]:
    """Per policy of the behaviour database: proposals, answers, and arrivals of UGVs that followed it last."""
    recorder = Recorder(load(name, changes), run)
    found: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for seed in range(1, seeds + 1):
        followed: dict[str, str] = {}
        for event in recorder.simulate(seed).events:
            if event["kind"] in ANSWERS:
                found[event["policy"]][event["kind"]] += 1
            if event["kind"] == "accept":
                followed[event["robot"]] = event["policy"]
            if event["kind"] == "arrival" and event["robot"] in followed:
                found[followed[event["robot"]]]["arrival"] += 1
    return dict(found)


def print_policies(name: str, seeds: int, changes: Sequence[str]) -> None:
    """A table with a row per run with a gatekeeper and policy."""
    runs = [run for run, spec in load(name).runs.items() if METHODS[spec.method].gated]
    with ProcessPoolExecutor() as pool:
        found = list(pool.map(partial(of_policies, name, seeds=seeds, changes=changes), runs))
    print("| scenario | run | policy | proposed | accepted | refused | arrived |\n|" + " --- |" * 7)
    for run, policies in zip(runs, found, strict=True):
        for policy, counts in policies.items():
            told = " | ".join(str(counts[kind]) for kind in (*ANSWERS, "arrival"))
            print(f"| {name} | {run} | {policy} | {told} |")


def summary(values: list[list[float]]) -> str:
    """Median and quantiles of each component."""
    quantiles = np.quantile(np.array(values), [0.5, 0.05, 0.95], axis=0).T
    return "; ".join(f"{median:.3f} ({low:.3f} to {high:.3f})" for median, low, high in quantiles)


def main() -> None:
    """Simulate and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenarios", nargs="+")
    parser.add_argument("-n", "--seeds", type=int, default=50, help="seeds 1 to N (default: %(default)s)")
    parser.add_argument("--policies", action="store_true", help="count proposals, answers and arrivals per policy")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="for --policies")
    options = parser.parse_args()
    if options.policies:
        for name in options.scenarios:
            print_policies(name, options.seeds, options.set)
        return
    for name in options.scenarios:
        runs = list(dict.fromkeys(row.run for row in load(name).reproduction))
        with ProcessPoolExecutor() as pool:
            found = dict(zip(runs, pool.map(partial(of_run, name, seeds=options.seeds), runs), strict=True))
        print(f"\n{name}, {options.seeds} seeds: paper, median (5 % to 95 %), seeds within the tolerance")
        for run, of_seeds in found.items():
            for row, *others in zip(*of_seeds, strict=True):
                each = [row, *others]
                values = [np.atleast_1d(one["ours"]).tolist() for one in each if one["ours"] is not None]
                within = sum(one["difference"] is not None and one["difference"] <= one["tolerance"] for one in each)
                print(f"  {row['id']}, run {run}: {row['paper']}, {summary(values)} {row['unit']}, {within}")


if __name__ == "__main__":
    main()
