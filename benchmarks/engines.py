"""How much faster the compiled loop makes a run than Drake's Simulator, with its trace, and whether both are the same.

    python benchmarks/engines.py
    python benchmarks/engines.py lab:d crossing:d --seeds 10

Both are set up once and take turns, seed by seed, in one process with one thread; times are of the CPU, medians. The
first seed, in which compiled functions are loaded, is not timed. Of a run that the loop leaves to Drake it says why.
"""

import argparse
import os
import time
from collections.abc import Callable

os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

import numpy as np

from airground_drake.report.difference import first_difference
from airground_drake.scenario.load import load
from airground_drake.sim.batch.run import Batch, LeftToDrakeError
from airground_drake.sim.simulation import Recorder
from airground_drake.sim.trace import Trace

DEFAULT = ("case_a:a", "case_a:b", "case_a:c", "case_a:d", "lab:d", "crossing:d")


def timed(simulate: Callable[[int], Trace], seed: int) -> tuple[Trace, float]:
    """A trace, and the CPU time that it took, s."""
    began = time.process_time()
    return simulate(seed), time.process_time() - began


def row(scenario: str, run: str, seeds: int) -> str:
    """A row of the table."""
    given = load(scenario)
    try:
        loop = Batch(given, run)
    except LeftToDrakeError as error:
        return f"| {scenario} {run} | left to Drake: {error} | | | |"
    drake, times, same = Recorder(given, run), [], 0
    for seed in range(seeds + 1):
        (ours, loop_s), (theirs, drake_s) = timed(loop.simulate, seed), timed(drake.simulate, seed)
        same += first_difference(theirs, ours) is None
        times.append((1e3 * drake_s, 1e3 * loop_s))
    drake_ms, loop_ms = np.median(times[1:], axis=0)
    return f"| {scenario} {run} | {drake_ms:.0f} | {loop_ms:.1f} | {drake_ms / loop_ms:.1f} | {same} of {seeds + 1} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="*", default=DEFAULT, metavar="SCENARIO:RUN")
    parser.add_argument("--seeds", type=int, default=20)
    options = parser.parse_args()
    print("| run | Drake, ms | loop, ms | ratio | the same, bit by bit |\n| --- | --- | --- | --- | --- |")
    for name in options.runs:
        print(row(*name.split(":"), options.seeds), flush=True)


if __name__ == "__main__":
    main()
