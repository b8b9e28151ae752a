"""How much faster the compiled loop makes a run than Drake's Simulator, with its trace, and whether both are the same.

    python benchmarks/engines.py
    python benchmarks/engines.py lab:d crossing:d --seeds 10
    python benchmarks/engines.py --judged
    python benchmarks/engines.py --campaign 400

Both are set up once and take turns, seed by seed, in one process with one thread; times are of the CPU, medians. The
first seed, in which compiled functions are loaded, is not timed. Of a run that the loop leaves to Drake it says why.

With `--judged`, Drake's runs are judged by their traces and those of the loop by array judges, without traces: four
claims on both sides. `--campaign` does so many draws of `campaigns/screened.yaml` as a campaign does, each run alone,
with all that belongs to it: drawing, checking and setting up a scenario, and Drake's share.
"""

import argparse
import os
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

import numpy as np

from airground_drake.report.difference import first_difference
from airground_drake.scenario.estimate import DEFAULT_LIMITS
from airground_drake.scenario.load import load
from airground_drake.sim.batch.run import Batch, LeftToDrakeError
from airground_drake.sim.simulation import Recorder
from airground_drake.study.campaign.spec import load_spec
from airground_drake.study.campaign.work import happened, rows_of, screened
from airground_drake.verify import Verdict, judge
from airground_drake.verify.array_judges import SCREENED

T = TypeVar("T")
DEFAULT = ("case_a:a", "case_a:b", "case_a:c", "case_a:d", "lab:d", "crossing:d")


def timed(make: Callable[[int], T], seed: int) -> tuple[T, float]:
    """What is made of a seed, and the CPU time that it took, s."""
    began = time.process_time()
    return make(seed), time.process_time() - began


def campaign(run: str, draws: int) -> str:
    """How many runs a second of CPU time makes in a campaign; times of Drake's first run are not counted."""
    spec = replace(load_spec(Path(__file__).parent / "campaigns" / "screened.yaml"), runs=(run,))
    loaded, engines = load("case_a", ["reproduction=[]"]), Counter[str]()
    Recorder(loaded, run).simulate()
    rows_of(spec, draws, DEFAULT_LIMITS)

    def draw(count: int) -> None:
        for index in range(count):
            engines.update({rows_of(spec, index, DEFAULT_LIMITS)[0]["engine"]})

    _, took_s = timed(draw, draws)
    return f"run {run}: {draws / took_s:.0f} runs/s; {dict(engines)}"


def row(scenario: str, run: str, seeds: int, *, judged: bool) -> str:
    """A row of the table."""
    given = load(scenario)
    try:
        loop = Batch(given, run)
    except LeftToDrakeError as error:
        return f"| {scenario} {run} | left to Drake: {error} | | | |"
    drake, times, same = Recorder(given, run), [], 0

    def screens(seed: int) -> list[Verdict]:
        made = loop.made(seed)
        happened(loop, made)
        return screened(loop, made, SCREENED)

    for seed in range(seeds + 1):
        if judged:
            ours, loop_s = timed(screens, seed)
            theirs, drake_s = timed(lambda seed: judge(drake.simulate(seed), SCREENED), seed)
            same += [verdict.status for verdict in ours] == [verdict.status for verdict in theirs]
        else:
            made, loop_s = timed(loop.simulate, seed)
            by_drake, drake_s = timed(drake.simulate, seed)
            same += first_difference(by_drake, made) is None
        times.append((1e3 * drake_s, 1e3 * loop_s))
    drake_ms, loop_ms = np.median(times[1:], axis=0)
    return f"| {scenario} {run} | {drake_ms:.0f} | {loop_ms:.1f} | {drake_ms / loop_ms:.1f} | {same} of {seeds + 1} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="*", default=DEFAULT, metavar="SCENARIO:RUN")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--judged", action="store_true")
    parser.add_argument("--campaign", type=int, metavar="DRAWS")
    options = parser.parse_args()
    if options.campaign:
        for run in ("a", "d"):
            print(campaign(run, options.campaign), flush=True)
        return
    print("| run | Drake, ms | loop, ms | ratio | the same |\n| --- | --- | --- | --- | --- |")
    for name in options.runs:
        print(row(*name.split(":"), options.seeds, judged=options.judged), flush=True)


if __name__ == "__main__":
    main()
