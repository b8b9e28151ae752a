"""Pieces of work in processes of their own."""

from __future__ import annotations

import os
from functools import partial

import pytest

from airground_drake.base.errors import AirgroundError, TraceError
from airground_drake.base.parallel import processors, run_parallel, start_in_process


def test_what_is_returned_is_in_order_and_comes_from_other_processes() -> None:
    found = run_parallel([lambda k=k: (k, os.getpid()) for k in range(5)], jobs=2)
    assert [k for k, _ in found] == list(range(5))
    assert os.getpid() not in {pid for _, pid in found}


@pytest.mark.parametrize(("count", "jobs"), [(0, 2), (1, 2), (3, 1)])
def test_where_there_is_no_use_in_it_no_process_is_begun(count: int, jobs: int) -> None:
    assert run_parallel([os.getpid] * count, jobs=jobs) == [os.getpid()] * count


def test_a_piece_sees_what_there_was_and_leaves_nothing_behind() -> None:
    seen = [1]
    assert run_parallel([lambda: seen.append(2) or len(seen)] * 2, jobs=2) in ([2, 2], [2, 3])
    assert seen == [1]


def test_pieces_of_pieces_are_done_where_they_are_asked_for() -> None:
    def inner() -> set[int]:
        return {os.getpid(), *run_parallel([os.getpid] * 2, jobs=2)}

    assert [len(pids) for pids in run_parallel([inner] * 2, jobs=2)] == [1, 1]


def test_what_a_piece_raises_is_raised() -> None:
    def broken() -> int:
        raise TraceError("no such column")

    with pytest.raises(TraceError, match="no such column"):
        run_parallel([os.getpid, broken], jobs=2)
    assert len(run_parallel([os.getpid] * 2, jobs=2)) == 2


def test_a_process_that_dies_is_an_error() -> None:
    with pytest.raises(AirgroundError, match="died"):
        run_parallel([partial(os._exit, 0), os.getpid], jobs=2)


def test_what_was_begun_is_done_elsewhere_and_waited_for() -> None:
    returned = start_in_process(os.getpid)
    assert (returned() == os.getpid()) is (processors() == 1)


def test_what_was_begun_and_dies_is_an_error_when_it_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("airground_drake.base.parallel.processors", lambda: 2)
    returned = start_in_process(partial(os._exit, 3))
    with pytest.raises(AirgroundError, match=r"died .*\(exit code 3\)"):
        returned()


def test_on_one_processor_it_is_done_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("airground_drake.base.parallel.processors", lambda: 1)
    assert start_in_process(os.getpid)() == os.getpid()
