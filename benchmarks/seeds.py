"""The reproduction table over many seeds: `python benchmarks/seeds.py case_a case_b -n 50`.

For each row of a scenario's reproduction table: the paper's value, the median and the 5 % and 95 % quantiles over the
seeds, and the number of seeds within the tolerance. `airground report NAME --seeds N` counts the seeds that keep all
distances and bring all home.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Any

import numpy as np

from airground_drake.report.reproduction import rows
from airground_drake.run.simulation import Recorder
from airground_drake.scenarios.load import load


def of_run(name: str, run: str, seeds: int) -> list[list[dict[str, Any]]]:
    """The rows about a run, for each seed."""
    scenario = load(name)[0]
    recorder = Recorder(scenario, run)
    of_seeds = (rows(scenario, {run: recorder.simulate(seed)}) for seed in range(1, seeds + 1))
    return [[row for row in each if row["run"] == run] for each in of_seeds]


def summary(values: list[list[float]]) -> str:
    """Median and quantiles of each component."""
    quantiles = np.quantile(np.array(values), [0.5, 0.05, 0.95], axis=0).T
    return "; ".join(f"{median:.3f} ({low:.3f} to {high:.3f})" for median, low, high in quantiles)


def main() -> None:
    """Simulate and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenarios", nargs="+")
    parser.add_argument("-n", "--seeds", type=int, default=50, help="seeds 1 to N (default: %(default)s)")
    options = parser.parse_args()
    for name in options.scenarios:
        runs = list(dict.fromkeys(row.run for row in load(name)[0].reproduction))
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
