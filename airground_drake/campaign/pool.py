"""Many draws, on the processors of this machine (joblib, loky) or on a Dask cluster."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from airground_drake.campaign.rows import Row
from airground_drake.campaign.work import died
from airground_drake.errors import AirgroundError, one_line

DEATHS = 2
"""A draw in whose presence so many processes have died is given up."""
AHEAD = 4
"""Draws that are handed out beforehand for each process of a cluster."""

Work = Callable[[int], list[Row]]
"""What is done with the index of a draw; goes to other processes, and so is pickled."""


def locally(work: Work, indices: Iterable[int], jobs: int) -> Iterator[list[Row]]:
    """Rows of draws, as they are finished.

    Processes whose memory grows are replaced (loky sees to it): Drake never frees a diagram with Python systems. If
    one dies, those draws that it may have taken with it are done again, one at a time; one whose process dies
    again is `died`.

    Args:
        work: for one draw.
        indices: of the draws; may be without end.
        jobs: number of processes.
    """
    from joblib import Parallel, delayed  # a campaign's alone
    from joblib.externals.loky.process_executor import BrokenProcessPool

    waiting, deaths = iter(indices), Counter[int]()
    begun: dict[int, None] = {}

    def handed_out() -> Iterator[int]:
        for index in waiting:
            begun[index] = None
            yield index

    def finished(some: Iterable[int], at_once: int) -> Iterator[list[Row]]:
        parallel = Parallel(at_once, return_as="generator_unordered", batch_size=1, pre_dispatch="2*n_jobs")
        for rows in parallel(delayed(work)(index) for index in some):
            begun.pop(rows[0]["index"], None)
            yield rows

    while True:
        try:
            yield from finished(handed_out(), jobs)
            return
        except BrokenProcessPool:
            yield from _again(work, tuple(begun), deaths)
            begun.clear()


def _again(work: Work, indices: Iterable[int], deaths: Counter[int]) -> Iterator[list[Row]]:
    """Rows of draws that were under way when a process died, each in a process of its own."""
    from joblib.externals.loky import get_reusable_executor
    from joblib.externals.loky.process_executor import BrokenProcessPool

    for index in indices:
        deaths[index] += 1
        while True:
            try:
                yield get_reusable_executor(1, kill_workers=True).submit(work, index).result()
                break
            except BrokenProcessPool:
                deaths[index] += 1
                if deaths[index] > DEATHS:
                    yield died(index)
                    break


def on_cluster(work: Work, indices: Iterable[int], scheduler: str) -> Iterator[list[Row]]:
    """Rows of draws, as workers of a Dask cluster finish them; each worker must have this package installed.

    A worker that dies is Dask's to notice: its draws go to others; one that has killed several is `died`.

    Raises:
        AirgroundError: if the scheduler cannot be reached, or Dask is not installed.
    """
    try:
        import distributed
    except ImportError:
        raise AirgroundError(
            "--scheduler needs the package distributed: pip install 'airground_drake[cluster]'"
        ) from None
    dask: Any = distributed  # its types are incomplete
    try:
        client = dask.Client(scheduler, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise AirgroundError(one_line(f"no Dask scheduler at {scheduler}: {error}")) from None
    with client:
        waiting = iter(indices)

        def submit(count: int) -> list[Any]:
            return [
                client.submit(work, index, key=f"draw-{index}", pure=False)
                for index in itertools.islice(waiting, count)
            ]

        threads = sum(client.nthreads().values()) or 1
        under_way = dask.as_completed(submit(AHEAD * threads), loop=client.loop)
        for future in under_way:
            index = int(future.key.rpartition("-")[2])
            yield died(index) if future.status == "error" else future.result()
            for more in submit(1):
                under_way.add(more)
