"""Pieces of work in processes of their own."""

from __future__ import annotations

import os
from functools import partial

import pytest

from airground_drake.errors import AirgroundError, TraceError
from airground_drake.side_by_side import begun, processors, side_by_side


def test_what_is_returned_is_in_order_and_comes_from_other_processes() -> None:
    found = side_by_side([lambda k=k: (k, os.getpid()) for k in range(5)], jobs=2)
    assert [k for k, _ in found] == list(range(5))
    assert os.getpid() not in {pid for _, pid in found}


@pytest.mark.parametrize(("count", "jobs"), [(0, 2), (1, 2), (3, 1)])
def test_where_there_is_no_use_in_it_no_process_is_begun(count: int, jobs: int) -> None:
    assert side_by_side([os.getpid] * count, jobs=jobs) == [os.getpid()] * count


def test_a_piece_sees_what_there_was_and_leaves_nothing_behind() -> None:
    seen = [1]
    assert side_by_side([lambda: seen.append(2) or len(seen)] * 2, jobs=2) in ([2, 2], [2, 3])
    assert seen == [1]


def test_pieces_of_pieces_are_done_where_they_are_asked_for() -> None:
    def inner() -> set[int]:
        return {os.getpid(), *side_by_side([os.getpid] * 2, jobs=2)}

    assert [len(pids) for pids in side_by_side([inner] * 2, jobs=2)] == [1, 1]


def test_what_a_piece_raises_is_raised() -> None:
    def broken() -> int:
        raise TraceError("no such column")

    with pytest.raises(TraceError, match="no such column"):
        side_by_side([os.getpid, broken], jobs=2)
    assert len(side_by_side([os.getpid] * 2, jobs=2)) == 2


def test_a_process_that_dies_is_an_error() -> None:
    with pytest.raises(AirgroundError, match="died"):
        side_by_side([partial(os._exit, 0), os.getpid], jobs=2)


def test_what_was_begun_is_done_elsewhere_and_waited_for() -> None:
    returned = begun(os.getpid)
    assert (returned() == os.getpid()) is (processors() == 1)


def test_what_was_begun_and_dies_is_an_error_when_it_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("airground_drake.side_by_side.processors", lambda: 2)
    returned = begun(partial(os._exit, 3))
    with pytest.raises(AirgroundError, match=r"died \(exit code 3\)"):
        returned()


def test_on_one_processor_it_is_done_here(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("airground_drake.side_by_side.processors", lambda: 1)
    assert begun(os.getpid)() == os.getpid()
