"""Much of the same work, on the processors of this machine (joblib's loky) or on a Dask cluster."""

from __future__ import annotations

import gc
import itertools
import logging
import threading
import uuid
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from functools import partial
from typing import Any, Protocol, TypeVar

from airground_drake.base.errors import AirgroundError, one_line
from airground_drake.base.interruption import end_with_parent

DEATHS = 2
"""An item in whose presence so many processes have died is given up."""
AHEAD = 4
"""Items that are handed out beforehand for each process."""
IDLE_S = 300.0
"""A process that has had nothing to do for so long ends, s."""
ENDING_S = 5.0
"""A thread of the pool that has ended has so long to end, s."""
ENVIRONMENT = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "BLIS", "NUMEXPR")}
"""Of the processes: one thread each for numerical libraries."""
ENVIRONMENT["PYTHONSAFEPATH"] = "1"  # loky starts them with `-m`, which would import from the current folder

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
    from joblib.externals import loky  # takes a while, which other commands need not wait for

    others = set(threading.enumerate())
    try:
        yield partial(_locally, jobs)
    finally:
        loky.get_reusable_executor(reuse=True).shutdown(wait=True, kill_workers=True)
        gc.collect()  # its semaphores are in cycles; those that are left when the command ends would be warned of
        for thread in set(threading.enumerate()) - others:  # that which feeds a queue holds semaphores until it ends
            thread.join(ENDING_S)


def _locally(jobs: int, work: Callable[[int], T], items: Iterable[int]) -> Iterator[tuple[int, T | None]]:
    """See `Pool`.

    If a process dies, those that are there end with it, and the items that they may have been at are done again, each
    in a process of its own.
    """
    from joblib.externals import loky

    waiting, under_way = iter(items), dict[Any, int]()
    while True:
        for item in itertools.islice(waiting, AHEAD * jobs - len(under_way)):
            under_way[_submitted(partial(work, item), jobs)] = item
        if not under_way:
            return
        done = loky.wait(under_way, return_when=loky.FIRST_COMPLETED).done
        for future in tuple(under_way) if any(map(_lost, done)) else done:
            item = under_way.pop(future)
            yield item, _alone(partial(work, item)) if _lost(future) else future.result()


def _submitted(call: Callable[[], T], jobs: int) -> Any:
    """The future of a call in one of so many processes; failed already if one of them has just died."""
    from joblib.externals import loky

    try:
        processes = loky.get_reusable_executor(jobs, timeout=IDLE_S, env=ENVIRONMENT, initializer=end_with_parent)
        return processes.submit(call)
    except loky.BrokenProcessPool as error:
        future = loky.Future()
        future.set_exception(error)
        return future


def _lost(future: Any) -> bool:
    """Whether a process died before it had finished this."""
    from joblib.externals import loky

    return isinstance(future.exception(), loky.BrokenProcessPool)


def _alone(call: Callable[[], T]) -> T | None:
    """The result of a call in a process of its own, begun again if that dies; None if it always does."""
    for _ in range(DEATHS):
        future = _submitted(call, 1)
        if not _lost(future):
            result: T = future.result()
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
    """See `Pool`. A scheduler has one name for each item of all its clients; workers may come at any time.

    Raises:
        AirgroundError: if the scheduler is lost.
    """
    waiting, ours = iter(items), uuid.uuid4().hex

    def submit(under_way: int) -> list[Any]:
        threads = sum(client.nthreads().values()) or 1
        some = itertools.islice(waiting, max(0, AHEAD * threads - under_way))
        return [client.submit(work, item, key=f"{ours}-{item}", pure=False) for item in some]

    try:
        under_way = dask.as_completed(submit(0), loop=client.loop)
        for future in under_way:
            item = int(future.key.rpartition("-")[2])
            yield item, _result(dask, future)
            for more in submit(under_way.count()):
                under_way.add(more)
    except (CancelledError, OSError) as error:
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # or it shows how it fails to reconnect
        lost = f"the Dask scheduler was lost ({type(error).__name__}); --resume goes on with what is finished"
        raise AirgroundError(lost) from None


def _result(dask: Any, future: Any) -> Any:
    """Of an item that is finished; None if its workers have died.

    Raises:
        Exception: what the work has raised.
    """
    try:
        return future.result()
    except dask.scheduler.KilledWorker:
        return None
