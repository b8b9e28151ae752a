"""Runs of a campaign per second, and memory over many: `python benchmarks/throughput.py -n 40 --memory 2000`.

The same draws in this process, in processes forked from it, and on a Dask cluster of this machine. For each: runs per
second by the clock, CPU seconds per run where it is worked (simulating, judging), and two efficiencies: of the clock,
that is the rate over that of one process times the number of processes, which says little if other programs want the
processors or there are fewer of them; and of the work, CPU seconds per run in one process over those in many. With
`--memory`, so many short runs in this process, and what it has grown by since the tenth.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from airground_drake.campaign import pool
from airground_drake.campaign.pool import Pool
from airground_drake.campaign.spec import Spec, load_spec
from airground_drake.campaign.work import rows_of
from airground_drake.scenarios.estimate import DEFAULT_LIMITS

SPEC = Path(__file__).parent / "campaigns" / "case_a.yaml"


def worked(spec: Spec, index: int) -> tuple[int, float]:
    """Number of runs of a draw, and what it took of this process's CPU time, s."""
    started = time.process_time()
    runs = {row["run"] for row in rows_of(spec, index, DEFAULT_LIMITS)}
    return len(runs), time.process_time() - started


@contextmanager
def serial() -> Iterator[Pool]:
    """This process."""
    yield lambda work, items: ((item, work(item)) for item in items)


@contextmanager
def dask(workers: int) -> Iterator[Pool]:
    """A cluster of this machine, each of whose workers is a process."""
    from distributed import LocalCluster

    options = {"n_workers": workers, "threads_per_worker": 1, "dashboard_address": ":0"}
    with LocalCluster(**options) as here, pool.cluster(here.scheduler_address) as processes:
        yield processes


POOLS: dict[str, Any] = {"local": pool.local, "dask": dask}


def rates(spec: Spec, number: int, jobs: list[int], pools: list[str]) -> list[dict[str, Any]]:
    """A row for each way of working."""
    ways: list[tuple[str, int, Any]] = [("serial", 1, serial)]
    ways += [(name, count, partial(POOLS[name], count)) for name in pools for count in jobs]
    found: list[dict[str, Any]] = []
    for name, count, way in ways:
        with way() as processes:
            for _ in processes(partial(worked, spec), range(number, number + 2 * count)):  # imports and compiled code
                pass
            started = time.perf_counter()
            done = [result for _, result in processes(partial(worked, spec), range(number))]
            wall = time.perf_counter() - started
        runs, cpu = sum(runs for runs, _ in done), sum(taken for _, taken in done)
        row = {"pool": name, "processes": count, "runs": runs, "runs_1_s": runs / wall, "cpu_s_per_run": cpu / runs}
        first = found[0] if found else row
        row["efficiency_of_the_clock"] = row["runs_1_s"] / (count * first["runs_1_s"])
        row["efficiency_of_the_work"] = first["cpu_s_per_run"] / row["cpu_s_per_run"]
        found.append(row)
        print(pd.DataFrame([row]).to_string(index=False, float_format="%.3g"), flush=True)
    return found


def grown(spec: Spec, number: int, duration_s: float) -> list[dict[str, float]]:
    """Resident memory of this process, MB, after so many short runs, and what it has grown by since the tenth."""
    short, marks = replace(spec, fixed={**spec.fixed, "duration_s": duration_s}), []
    runs, next_mark = 0, 10
    for index in range(number):
        runs += worked(short, index)[0]
        if runs >= min(next_mark, number):
            mb = int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
            marks.append({"runs": runs, "rss_mb": mb, "grown_mb": mb - (marks[0]["rss_mb"] if marks else mb)})
            print(f"after {runs} runs: {mb:.1f} MB, grown by {marks[-1]['grown_mb']:.1f} MB", flush=True)
            next_mark *= 2
        if runs >= number:
            break
    return marks


def main() -> None:
    """Measure, print, and write JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("spec", type=Path, nargs="?", default=SPEC)
    parser.add_argument("-n", "--number", type=int, default=40, help="draws (default: %(default)s; 0: no rates)")
    parser.add_argument("--jobs", type=int, nargs="*", default=[1, 2], help="processes (default: 1 2)")
    parser.add_argument("--pools", nargs="*", choices=POOLS, default=list(POOLS), help="besides this process")
    parser.add_argument("--memory", type=int, default=0, metavar="RUNS", help="short runs in this process")
    parser.add_argument("--short", type=float, default=2.0, metavar="S", help="their duration (default: %(default)s)")
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    spec = load_spec(options.spec)
    found = {
        "rates": rates(spec, options.number, options.jobs, options.pools) if options.number else [],
        "memory": grown(spec, options.memory, options.short),
    }
    if found["rates"]:
        print("\n" + pd.DataFrame(found["rates"]).to_string(index=False, float_format="%.3g"))
    if options.json:
        from airground_drake.base.files import write_json

        write_json(options.json, found)


if __name__ == "__main__":
    main()
