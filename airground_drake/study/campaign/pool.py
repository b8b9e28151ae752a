"""The same work for many items, on the processors of this machine or on a Dask cluster."""

import itertools
import logging
import time
import uuid
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from typing import Any, Protocol, TypeVar

from airground_drake.base.errors import AirgroundError
from airground_drake.base.parallel import processes

DEATHS = 2  # an item is given up after this many of its processes have died
AHEAD = 4  # number of items (on a cluster: tasks) handed out to each process in advance
TASK_S = 1.0  # intended duration of a task on a cluster, s: each task costs Dask milliseconds

T = TypeVar("T")


class Pool(Protocol):
    """Does the same work for many items."""

    def __call__(self, work: Callable[[int], T], items: Iterable[int]) -> Iterator[tuple[int, T | None]]:
        """Yield each item with its result when it is finished; None if its process died each time."""
        # work: does one item; it is pickled.


@contextmanager
def local(jobs: int) -> Iterator[Pool]:
    """A pool of `jobs` processes on this machine, which are kept between calls."""
    # When a process dies, its pool ends the others, too. Items that were handed out are then done again, each in its
    # own process, and new items go to a new pool.
    with ExitStack() as alive:
        pool = alive.enter_context(processes(jobs))

        def submit(call: Callable[[], T]) -> Future[T]:
            nonlocal pool
            with suppress(BrokenProcessPool):
                return pool.submit(call)
            alive.close()
            pool = alive.enter_context(processes(jobs))
            return pool.submit(call)

        def finished(work: Callable[[int], T], items: Iterable[int]) -> Iterator[tuple[int, T | None]]:
            waiting, under_way = iter(items), dict[Future[T], int]()
            while True:
                for item in itertools.islice(waiting, AHEAD * jobs - len(under_way)):
                    under_way[submit(partial(work, item))] = item
                if not under_way:
                    return
                for future in wait(under_way, return_when=FIRST_COMPLETED).done:
                    item = under_way.pop(future)
                    yield item, _result_of(future, partial(work, item))

        yield finished


def _result_of(future: Future[T], call: Callable[[], T]) -> T | None:
    """The result of a call. If its process has died, it is tried DEATHS times alone; None if it always dies."""
    with suppress(BrokenProcessPool):
        return future.result()
    for _ in range(DEATHS):
        with processes(1) as executor, suppress(BrokenProcessPool):
            return executor.submit(call).result()
    return None


@contextmanager
def cluster(scheduler: str, timeout_s: float = 10.0) -> Iterator[Pool]:
    """A pool of the workers of a Dask cluster. Each worker needs this package."""
    # Dask replaces workers that die, and gives up an item after several deaths.
    try:
        import distributed
    except ImportError:
        missing = "--scheduler needs the package distributed: pip install 'airground_drake[cluster]'"
        raise AirgroundError(missing) from None
    dask: Any = distributed  # its types are incomplete
    try:
        client = dask.Client(scheduler, timeout=timeout_s, set_as_default=False)
    except (OSError, ValueError) as error:
        raise AirgroundError(f"no Dask scheduler at {scheduler}: {error}") from None
    with client:
        yield partial(_on_cluster, dask, client)


def _on_cluster(
    dask: Any, client: Any, work: Callable[[int], T], items: Iterable[int]
) -> Iterator[tuple[int, T | None]]:
    """The work of `Pool` on a cluster, in blocks of items; workers may join at any time."""
    # A block is as many items as have taken about TASK_S so far. Its name is unique to this client.
    waiting, ours, blocks = iter(items), uuid.uuid4().hex, dict[str, Sequence[int]]()
    began, done = time.monotonic(), 0

    def handed_out(block: Sequence[int]) -> Any:
        blocks[key := f"{ours}-{block[0]}-{len(block)}"] = block
        return client.submit(_every, work, block, key=key, pure=False)

    def submit(under_way: int) -> list[Any]:
        threads = sum(client.nthreads().values()) or 1
        size = 1 + int(TASK_S * done / (threads * (time.monotonic() - began))) if done else 1
        some = [tuple(itertools.islice(waiting, size)) for _ in range(under_way, AHEAD * threads)]
        return [handed_out(block) for block in some if block]

    try:
        under_way = dask.as_completed(submit(0), loop=client.loop)
        for future in under_way:
            block, results = blocks.pop(future.key), _result(dask, future)
            if results is None and len(block) > 1:
                under_way.update([handed_out((item,)) for item in block])
                continue
            done += len(block)
            yield from zip(block, results or [None], strict=True)
            under_way.update(submit(under_way.count()))
    except (CancelledError, OSError) as error:
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # or it shows how it fails to reconnect
        lost = f"the Dask scheduler was lost ({type(error).__name__}); --resume goes on with what is finished"
        raise AirgroundError(lost) from None


def _every(work: Callable[[int], T], items: Sequence[int]) -> list[T]:
    return [work(item) for item in items]


def _result(dask: Any, future: Any) -> Any:
    """The results of a finished block, or the exception of its work; None if its workers have died."""
    try:
        return future.result()
    except dask.scheduler.KilledWorker:
        return None
