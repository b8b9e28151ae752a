"""The reproduction table over many seeds: `python benchmarks/seeds.py case_a case_b -n 50`.

For each row of a scenario's reproduction table: the paper's value, the median and the 5 % and 95 % quantiles over the
seeds, and the number of seeds within the tolerance. For each run: the least margin to a safe distance over continuous
time, and the counts of the verdicts of SAFE-TRACE, SAFE-HYP, LIVE-GOAL and GATE-OPT. Methods (b) and (c) guarantee no
verdict: a scenario expects the verdict that all seeds agree on, and otherwise admits either ("or refuted").
"""

from __future__ import annotations

import argparse
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from typing import Any

import numpy as np

from airground_drake.report.reproduction import rows
from airground_drake.run.simulation import Recorder
from airground_drake.scenarios.load import load
from airground_drake.verify import verify

CLAIMS = ("SAFE-TRACE", "SAFE-HYP", "LIVE-GOAL", "GATE-OPT")


def of_run(name: str, run: str, seeds: int) -> list[tuple[list[dict[str, Any]], float, dict[str, str]]]:
    """Per seed: the rows about a run, the margin of SAFE-TRACE, m, and the verdicts by claim."""
    scenario = load(name)[0]
    recorder, found = Recorder(scenario, run), []
    for seed in range(1, seeds + 1):
        trace = recorder.simulate(seed)
        findings = {verdict.claim.id: verdict.finding for verdict in verify(trace, CLAIMS)}
        mine = [row for row in rows(scenario, {run: trace}) if row["run"] == run]
        statuses = {claim: finding.status for claim, finding in findings.items()}
        found.append((mine, float(findings["SAFE-TRACE"].margin or 0.0), statuses))
    return found


def summary(values: list[list[float]]) -> str:
    """Median and quantiles of each component."""
    quantiles = np.quantile(np.array(values), [0.5, 0.05, 0.95], axis=0).T
    return "; ".join(f"{median:.3f} ({low:.3f} to {high:.3f})" for median, low, high in quantiles)


def main() -> None:
    """Simulate and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenarios", nargs="+")
    parser.add_argument("-n", "--seeds", type=int, default=50, help="seeds 1 to N (default: %(default)s)")
    parser.add_argument("-r", "--runs", nargs="+", help="only these runs (default: all)")
    options = parser.parse_args()
    for name in options.scenarios:
        runs = options.runs or list(load(name)[0].runs)
        with ProcessPoolExecutor() as pool:
            found = dict(zip(runs, pool.map(partial(of_run, name, seeds=options.seeds), runs), strict=True))
        print(f"\n{name}, {options.seeds} seeds: paper, median (5 % to 95 %), seeds within the tolerance")
        for run, of_seeds in found.items():
            for k, row in enumerate(of_seeds[0][0]):
                each = [mine[k] for mine, _, _ in of_seeds]
                values = [np.atleast_1d(one["ours"]).tolist() for one in each if one["ours"] is not None]
                within = sum(one["difference"] is not None and one["difference"] <= one["tolerance"] for one in each)
                print(f"  {row['id']}, run {run}: {row['paper']}, {summary(values)} {row['unit']}, {within}")
            margins = [margin for _, margin, _ in of_seeds]
            print(f"  run {run}: least margin {min(margins):.4f} m")
            for claim in of_seeds[0][2]:
                often = Counter(statuses[claim] for _, _, statuses in of_seeds)
                print(f"  {claim}, run {run}: {', '.join(f'{what} for {n}' for what, n in often.most_common())}")


if __name__ == "__main__":
    main()
