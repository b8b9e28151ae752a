"""A sequence that only grows keeps what it was, however it is continued."""

from collections.abc import Sequence
from copy import deepcopy

from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.base.history import History

STEPS = st.lists(st.tuples(st.integers(0, 99), st.lists(st.integers(), max_size=3)), max_size=12)


@given(steps=STEPS)
@examples(200)
def test_a_history_is_as_a_tuple_whichever_of_them_is_continued(steps: Sequence[tuple[int, list[int]]]) -> None:
    made, expected = [History[int]()], [()]
    for which, more in steps:
        k = which % len(made)
        made.append(made[k].plus(more))
        expected.append((*expected[k], *more))
    for history, entries in zip(made, expected, strict=True):
        assert (history, len(history), [*history]) == (entries, len(entries), [*entries])
        assert (history[1:], history[-2:]) == (entries[1:], entries[-2:])
        assert all(history[k] == entries[k] == history[k - len(entries)] for k in range(len(entries)))


def test_a_continuation_shares_what_was_before_and_a_copy_is_the_history_itself() -> None:
    first = History[int]().plus([1])
    assert first.plus([2])._entries is first._entries
    assert first.plus([3])._entries is not first._entries
    assert first.plus([]) is first
    assert deepcopy(first) is first
