"""Much of the same work, on the processors of this machine (joblib, loky) or on a Dask cluster."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, Protocol, TypeVar

from airground_drake.errors import AirgroundError, one_line

DEATHS = 2
"""An item in whose presence so many processes have died is given up."""
AHEAD = 4
"""Items that are handed out beforehand for each process of a cluster."""

T = TypeVar("T")


class Pool(Protocol):
    """Does the same work for many items."""

    def __call__(self, work: Callable[[int], T], items: Iterable[int]) -> Iterator[tuple[int, T | None]]:
        """What comes of each item, as it is finished; None where its process has died again and again.

        Args:
            work: for one item; goes to other processes, and so is pickled.
            items: numbers, none twice.
        """


@contextmanager
def local(jobs: int) -> Iterator[Pool]:
    """So many processes of this machine, which end in the end."""
    from joblib.externals.loky import get_reusable_executor  # takes a while, which other commands need not wait for

    try:
        yield partial(_locally, jobs)
    finally:
        get_reusable_executor().shutdown(wait=True, kill_workers=True)


def _locally(jobs: int, work: Callable[[int], T], items: Iterable[int]) -> Iterator[tuple[int, T | None]]:
    """See `Pool`.

    A process whose memory grows, by code of others, is replaced (loky sees to it). If one dies, those items that it may
    have taken with it are done again, each in a process of its own.
    """
    from joblib import Parallel, delayed
    from joblib.externals.loky.process_executor import BrokenProcessPool

    waiting, begun, numbered = iter(items), dict[int, None](), partial(_numbered, work)

    def handed_out() -> Iterator[Any]:
        for item in waiting:
            begun[item] = None
            yield delayed(numbered)(item)

    while True:
        pool = Parallel(jobs, return_as="generator_unordered", batch_size=1, pre_dispatch="2*n_jobs")
        try:
            for item, result in pool(handed_out()):
                del begun[item]
                yield item, result
            return
        except BrokenProcessPool:
            for item in tuple(begun):
                del begun[item]
                yield item, _alone(work, item)


def _numbered(work: Callable[[int], T], item: int) -> tuple[int, T]:
    return item, work(item)


def _alone(work: Callable[[int], T], item: int) -> T | None:
    """One item in a process of its own, again if that dies."""
    from joblib.externals.loky import get_reusable_executor
    from joblib.externals.loky.process_executor import BrokenProcessPool

    for _ in range(DEATHS):
        try:
            result: T = get_reusable_executor(1, kill_workers=True).submit(work, item).result()
        except BrokenProcessPool:
            continue
        return result
    return None


@contextmanager
def cluster(scheduler: str, timeout_s: float = 10.0) -> Iterator[Pool]:
    """The workers of a Dask cluster, each of which must have this package installed.

    A worker that dies is Dask's to notice: its items go to others; one that has killed several is given up.

    Raises:
        AirgroundError: if the scheduler cannot be reached, or Dask is not installed.
    """
    try:
        import distributed
    except ImportError:
        missing = "--scheduler needs the package distributed: pip install 'airground_drake[cluster]'"
        raise AirgroundError(missing) from None
    dask: Any = distributed  # its types are incomplete
    try:
        client = dask.Client(scheduler, timeout=timeout_s, set_as_default=False)
    except (OSError, ValueError) as error:
        raise AirgroundError(one_line(f"no Dask scheduler at {scheduler}: {error}")) from None
    with client:
        yield partial(_on_cluster, dask, client)


def _on_cluster(
    dask: Any, client: Any, work: Callable[[int], T], items: Iterable[int]
) -> Iterator[tuple[int, T | None]]:
    """See `Pool`."""
    waiting = iter(items)

    def submit(count: int) -> list[Any]:
        some = itertools.islice(waiting, count)
        return [client.submit(work, item, key=f"item-{item}", pure=False) for item in some]

    threads = sum(client.nthreads().values()) or 1
    under_way = dask.as_completed(submit(AHEAD * threads), loop=client.loop)
    for future in under_way:
        item = int(future.key.rpartition("-")[2])
        yield item, _result(dask, future)
        for more in submit(1):
            under_way.add(more)


def _result(dask: Any, future: Any) -> Any:
    """Of an item that is finished; None if its workers have died.

    Raises:
        Exception: what the work has raised.
    """
    try:
        return future.result()
    except dask.scheduler.KilledWorker:
        return None
