"""Pieces of work in processes of their own."""

import os
from functools import partial

import pytest

from airground_drake.base.errors import AirgroundError, TraceError
from airground_drake.base.parallel import processes, run_parallel


def test_results_are_in_order_and_come_from_other_processes_where_these_are_of_use() -> None:
    seen = [0]

    def piece(k: int) -> tuple[int, int, set[int]]:
        seen.append(k)  # the process sees what there was, and leaves nothing behind
        return k, len(seen) > 1, {os.getpid(), *run_parallel([os.getpid] * 2, jobs=2)}

    found = run_parallel([partial(piece, k) for k in range(5)], jobs=2)
    assert [k for k, _, _ in found] == list(range(5))
    assert seen == [0]
    assert all(len(pids) == 1 and os.getpid() not in pids for _, _, pids in found)  # pieces of pieces are done there
    for count, jobs in ((0, 2), (1, 2), (3, 1)):
        assert run_parallel([os.getpid] * count, jobs=jobs) == [os.getpid()] * count


def test_an_exception_of_a_piece_is_raised_and_so_is_a_death() -> None:
    def broken() -> int:
        raise TraceError("no such column")

    with pytest.raises(TraceError, match="no such column"):
        run_parallel([os.getpid, broken], jobs=2)
    with pytest.raises(AirgroundError, match="died"):
        run_parallel([partial(os._exit, 0), os.getpid], jobs=2)
    with pytest.raises(AirgroundError, match="died"), processes(1) as pool:
        pool.submit(os._exit, 0).result()
    assert len(run_parallel([os.getpid] * 2, jobs=2)) == 2
