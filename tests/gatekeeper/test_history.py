"""Histories that share their items are like tuples that do not."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from airground_drake.gatekeeper.history import History


@given(st.lists(st.tuples(st.integers(0, 20), st.lists(st.integers(), max_size=3)), max_size=20))
def test_they_branch_like_tuples(growth: list[tuple[int, list[int]]]) -> None:
    histories: list[History[int]] = [History()]
    tuples: list[tuple[int, ...]] = [()]
    for parent, more in growth:
        k = parent % len(histories)
        histories.append(histories[k].extended(more))
        tuples.append((*tuples[k], *more))
    for history, wanted in zip(histories, tuples, strict=True):
        assert tuple(history) == wanted
        assert [history[k] for k in range(-len(wanted), len(wanted))] == [*wanted, *wanted]
        assert history[1:3] == wanted[1:3]
