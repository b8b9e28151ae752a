"""The automaton of tries and rests."""

from hypothesis import given
from hypothesis import strategies as st
from properties import examples

from airground_drake.ugv.patience import Commitment, Patience

PATIENCE = Patience(most=2, rest=5.0, longest=10.0)


def test_tries_are_used_up_and_come_back_with_a_rest() -> None:
    turn = Commitment()
    for t, end, until in ((0.0, 3.0, 3.0), (20.0, 1e9, 30.0)):
        turn = PATIENCE.accept(turn, t, end)
        assert turn.until == until
        assert not PATIENCE.over(turn, until - 0.1)
        assert PATIENCE.over(turn, until)
        assert PATIENCE.rested(turn, 100.0).tries > 0  # nobody rests while executing
        turn = PATIENCE.stop(turn, until)
    assert PATIENCE.exhausted(turn)
    assert PATIENCE.exhausted(PATIENCE.rested(turn, 34.9))
    assert PATIENCE.rested(turn, 35.0).tries == 0


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
        turn = PATIENCE.rested(turn, t)
        if turn.tries == 0 and not turn.executing:
            stolen = 0.0
        if not turn.executing and proposes and not PATIENCE.exhausted(turn):
            turn = PATIENCE.accept(turn, t, t + 0.1 * length)
        assert stolen <= PATIENCE.most * (PATIENCE.longest + period) + 1e-9
