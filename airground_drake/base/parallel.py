"""Independent pieces of work in processes forked from this one, as many at a time as there are processors.

A piece sees the data that existed before the first piece began; only its result is returned. A process does several
pieces one after the other, which share imports and loaded data.
"""

import gc
import multiprocessing
import os
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import TypeVar

from airground_drake.base.errors import AirgroundError
from airground_drake.base.interruption import end_with_parent
from airground_drake.base.progress import SILENT, Progress

T = TypeVar("T")

# The current work. Forked processes inherit it, so that it is not pickled.
_pieces: Sequence[Callable[[], object]] = ()


def forks() -> bool:
    """Whether forking is allowed here."""
    return "fork" in multiprocessing.get_all_start_methods() and sys.platform != "darwin"


def one_thread_each() -> None:
    """Limit libraries that are loaded later to one thread, because there is a process for each processor."""
    for name in ("OMP", "OPENBLAS", "MKL", "BLIS", "NUMEXPR"):
        os.environ.setdefault(f"{name}_NUM_THREADS", "1")


def processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def shared() -> Iterator[None]:
    """In this block, garbage collection, also in forked processes, leaves alone what existed before."""
    # It would write to each of these objects, so that every process would copy the memory that it shares.
    already = gc.get_freeze_count() > 0
    gc.freeze()
    try:
        yield
    finally:
        if not already:
            gc.unfreeze()


@contextmanager
def processes(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """A pool of `jobs` processes, killed at the end of the block."""
    # AirgroundError if a process has died and the block has not raised.
    # The first call forks them, with all data that exist then. If forking is not safe, they start without data.
    # Calls and results are pickled.
    before = set(multiprocessing.active_children())
    context = multiprocessing.get_context("fork" if forks() else "spawn")
    pool = ProcessPoolExecutor(jobs, context, initializer=_begin)
    try:
        with shared(), warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # idle threads of numerical libraries survive a fork
            yield pool
    except BrokenProcessPool as error:
        raise AirgroundError("a worker process died") from error
    finally:
        for process in set(multiprocessing.active_children()) - before:
            process.kill()
        pool.shutdown()


def run_parallel(
    pieces: Sequence[Callable[[], T]],
    jobs: int | None = None,
    *,
    names: Sequence[str] = (),
    progress: Progress = SILENT,
) -> list[T]:
    """Do all pieces, and return their results in the same order."""
    # pieces: their results are pickled. The longest should come first.
    # jobs: processes at a time; default: one for each processor. With one job, one piece or no fork, the pieces are
    # done in this process.
    global _pieces
    called = names or [""] * len(pieces)
    most = min(len(pieces), processors() if jobs is None else jobs)
    if most <= 1 or not forks() or _pieces:
        return [_done(_timed(piece), name, progress) for piece, name in zip(pieces, called, strict=True)]
    _pieces = pieces
    try:
        with processes(most) as pool:
            futures = {pool.submit(_piece, index): index for index in range(len(pieces))}
            for future in as_completed(futures):
                _done(future.result(), called[futures[future]], progress)
            return [future.result()[0] for future in futures]  # type: ignore[misc]
    finally:
        _pieces = ()


def _begin() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent's to heed
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    end_with_parent()


def _piece(index: int) -> tuple[object, float]:
    return _timed(_pieces[index])


def _timed(piece: Callable[[], T]) -> tuple[T, float]:
    started = time.perf_counter()
    return piece(), time.perf_counter() - started


def _done(outcome: tuple[T, float], name: str, progress: Progress) -> T:
    progress.elapsed_s(name, outcome[1])
    progress.advance(1.0, name)
    return outcome[0]
