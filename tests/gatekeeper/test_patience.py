"""The automaton of tries and rests."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.gatekeeper.patience import Commitment, Patience

PATIENCE = Patience(most=2, rest=5.0, longest=10.0)


def test_tries_are_used_up_and_come_back_with_a_rest() -> None:
    turn = Commitment()
    for t in (0.0, 20.0):
        turn = PATIENCE.accept(turn, t, t + 3.0)
        assert turn.until == t + 3.0
        turn = PATIENCE.stop(turn, t + 3.0)
    assert PATIENCE.exhausted(turn)
    assert PATIENCE.exhausted(PATIENCE.rested(turn, 27.9))
    assert PATIENCE.rested(turn, 28.0).tries == 0


def test_a_try_lasts_no_longer_than_it_may() -> None:
    turn = PATIENCE.accept(Commitment(), 1.0, 1e9)
    assert turn.until == 11.0
    assert not PATIENCE.over(turn, 10.9)
    assert PATIENCE.over(turn, 11.0)
    assert PATIENCE.rested(turn, 100.0).tries == 1  # nobody rests while executing


@pytest.mark.parametrize("broken", [{"most": 0}, {"rest": 0.0}, {"longest": 0.0}, {"longest": float("nan")}])
def test_impossible_parameters_are_refused(broken: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="patience needs"):
        replace(PATIENCE, **broken)


@examples(50)
@given(st.lists(st.tuples(st.booleans(), st.booleans(), st.integers(1, 400)), max_size=300))
def test_between_two_rests_no_more_than_all_tries_to_the_end(events: list[tuple[bool, bool, int]]) -> None:
    """A UAV that proposes and withdraws at will, at samples 0.1 s apart."""
    turn, stolen, period = Commitment(), 0.0, 0.1
    for k, (proposes, withdraws, length) in enumerate(events):
        t = period * k
        if turn.executing:
            stolen += period
            if withdraws or PATIENCE.over(turn, t):
                turn = PATIENCE.stop(turn, t)
        rested = PATIENCE.rested(turn, t)
        if rested.tries == 0 and not turn.executing:
            stolen = 0.0
        turn = rested
        if not turn.executing and proposes and not PATIENCE.exhausted(turn):
            turn = PATIENCE.accept(turn, t, t + 0.1 * length)
        assert stolen <= PATIENCE.most * (PATIENCE.longest + period) + 1e-9
